"""What the Python tests share: where the program is, how to start the daemon, how to ask it, how to count.

Not a test framework: a test is a function whose name begins with test_ and whose first line of
documentation is the sentence it proves. Used by every tests/**/test_*.py."""

import argparse
import http.client
import json
import os
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import traceback

SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
EXAMPLES = os.path.join(SOURCE, "schema", "examples")
build = os.path.join(SOURCE, "build")


class Skipped(Exception):
    """Raised by a test that cannot be made here; the reason is printed and counted."""


def impactd():
    return os.path.join(build, "impactd")


def is_sanitized():
    """Whether the build is an instrumented one: several times slower, so that timing says nothing."""
    with open(os.path.join(build, "CMakeCache.txt"), encoding="utf-8") as cache:
        return re.search(r"^IMPACTD_SANITIZE:\w+=\S", cache.read(), re.M) is not None


def run(*arguments, text="", timeout=120, environment=None):
    """Runs impactd to its end; returns code, standard output and standard error."""
    done = subprocess.run([impactd(), *arguments], input=text, capture_output=True, text=True,
                          timeout=timeout, env=environment or dict(os.environ), check=False)
    return done.returncode, done.stdout, done.stderr


def scene(name):
    """One of schema/examples as a dict."""
    with open(os.path.join(EXAMPLES, name + ".json"), encoding="utf-8") as file:
        return json.load(file)


def examples():
    return sorted(f[:-5] for f in os.listdir(EXAMPLES) if f.endswith(".json"))


class Answer:
    def __init__(self, response, body):
        self.status, self.headers, self.body = response.status, response.headers, body

    def json(self):
        return json.loads(self.body)


class Daemon:
    """impactd serve on a free port with a data folder of its own, which goes with it."""

    def __init__(self, *arguments, directory=None):
        self.arguments = arguments
        self.is_own_directory = directory is None
        self.directory = directory or tempfile.mkdtemp(prefix="impactd-test-")
        self.process = None

    def start(self):
        # Port 0: the system picks a free one and the daemon prints it.
        self.errors = open(os.path.join(self.directory, "stderr"), "ab")
        self.process = subprocess.Popen(
            [impactd(), "serve", "--listen", "127.0.0.1:0", "--data",
             os.path.join(self.directory, "data"), *self.arguments],
            stdout=subprocess.PIPE, stderr=self.errors)
        text, limit = b"", time.monotonic() + 30
        while time.monotonic() < limit:
            if select.select([self.process.stdout], [], [], 0.2)[0]:
                piece = os.read(self.process.stdout.fileno(), 4096)
                if not piece:
                    break
                text += piece
            found = re.search(rb"http://127\.0\.0\.1:(\d+)", text)
            if found:
                self.port = int(found.group(1))
                self.wait_ready(limit)
                return self
        self.kill()
        with open(self.errors.name, encoding="utf-8", errors="replace") as errors:
            raise AssertionError(f"the daemon did not start: {text!r} {errors.read()!r}")

    def wait_ready(self, limit):
        while time.monotonic() < limit:
            try:
                if self.get("/health/ready").status == 200:
                    return
            except OSError:
                pass
            time.sleep(0.02)
        raise AssertionError("the daemon did not become ready")

    def ask(self, method, target, body=None, timeout=120, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=timeout)
        try:
            connection.request(method, target, body,
                               {name.replace("_", "-"): value for name, value in headers.items()})
            response = connection.getresponse()
            return Answer(response, response.read())
        finally:
            connection.close()

    def get(self, target, **headers):
        return self.ask("GET", target, **headers)

    def post(self, scene_or_text, target="/v1/jobs", **headers):
        body = scene_or_text if isinstance(scene_or_text, (str, bytes)) else json.dumps(scene_or_text)
        return self.ask("POST", target, body, Content_Type="application/json", **headers)

    def finish(self, job, limit=300):
        """Waits for a job (its document); returns the finished document."""
        end = time.monotonic() + limit
        while job["status"] in ("accepted", "running"):
            assert time.monotonic() < end, f"{job['id']} is still {job['status']} after {limit} s"
            job = self.get(job["links"]["self"] + "?wait=10").json()
        return job

    def run(self, scene_or_text):
        """Submits and waits; returns the job, which must be successful."""
        answer = self.post(scene_or_text, Prefer="wait=30")
        assert answer.status in (200, 202), (answer.status, answer.body[:2000])
        job = self.finish(answer.json())
        assert job["status"] == "successful", job["problem"]
        return job

    def kill(self):
        """Ends it as a power cut would."""
        self.process.kill()
        self.process.wait()
        self.close()

    def stop(self):
        """Ends it as a service manager would; returns the exit code. It has 5 s by contract."""
        self.process.send_signal(signal.SIGTERM)
        try:
            code = self.process.wait(timeout=30 if is_sanitized() else 6)
        except subprocess.TimeoutExpired:
            self.kill()
            raise AssertionError("SIGTERM did not end the daemon within 5 s") from None
        self.close()
        return code

    def close(self):
        self.process.stdout.close()
        self.errors.close()
        self.process = None

    def complaints(self):
        """What it wrote to stderr that a sanitizer or a crash would write."""
        with open(os.path.join(self.directory, "stderr"), encoding="utf-8", errors="replace") as file:
            return re.findall(r".*(?:ERROR: |runtime error:|WARNING: ThreadSanitizer).*", file.read())

    def __enter__(self):
        return self.start()

    def __exit__(self, kind, value, trace):
        try:
            if self.process is not None and self.process.poll() is not None:
                code = self.process.returncode
                self.close()
                if kind is None:
                    raise AssertionError(f"the daemon ended by itself with {code}: {self.complaints()}")
            elif self.process is not None:
                code = self.stop()
                if kind is None:
                    assert code == 0, f"the daemon ended with {code}: {self.complaints()}"
            if kind is None:
                assert not self.complaints(), self.complaints()
        finally:
            if self.is_own_directory:
                shutil.rmtree(self.directory, ignore_errors=True)


def main(namespace):
    """Runs every test_* function of a test file; the last line printed counts them."""
    global build
    parser = argparse.ArgumentParser(description=namespace["__doc__"])
    parser.add_argument("--build", default=build, help="folder of the build to test")
    parser.add_argument("names", nargs="*", help="only the tests whose name contains one of these")
    arguments = parser.parse_args()
    build = os.path.abspath(arguments.build)
    passed = failed = skipped = 0
    for name, test in list(namespace.items()):
        if not name.startswith("test_") or not callable(test):
            continue
        if arguments.names and not any(part in name for part in arguments.names):
            continue
        sentence = (test.__doc__ or name).strip().splitlines()[0]
        began = time.monotonic()
        try:
            test()
        except Skipped as reason:
            skipped += 1
            print(f"skip  {sentence} ({reason})", flush=True)
        except Exception:  # noqa: BLE001 - whatever it was, the test failed
            failed += 1
            print(f"FAIL  {sentence}", flush=True)
            traceback.print_exc(file=sys.stdout)
        else:
            passed += 1
            print(f"ok    {sentence} [{time.monotonic() - began:.2f} s]", flush=True)
    print(f"{os.path.relpath(sys.argv[0], SOURCE)}: {passed} passed, {failed} failed"
          + (f", {skipped} skipped" if skipped else ""), flush=True)
    sys.exit(1 if failed or not passed + skipped else 0)
