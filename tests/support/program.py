"""What the Python tests share: where the program is, how to run it, what a test file does as a whole.

Not a test framework: a test is a function whose name begins with test_ and whose first line of
documentation is the sentence it proves."""

import argparse
import contextlib
import fcntl
import glob
import json
import os
import pty
import re
import struct
import subprocess
import sys
import tempfile
import termios
import time
import traceback

from daemon import Daemon

SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
EXAMPLES = os.path.join(SOURCE, "schema", "examples")
build = os.path.join(SOURCE, "build")


class Skipped(Exception):
    """Raised by a test that cannot be made here; the reason is printed and counted."""


def impactd():
    return os.path.join(build, "impactd")


def sanitizer():
    """What the build is instrumented with: "address,undefined", "thread" or nothing."""
    with open(os.path.join(build, "CMakeCache.txt"), encoding="utf-8") as cache:
        found = re.search(r"^IMPACTD_SANITIZE:\w+=(\S*)", cache.read(), re.M)
    return found[1] if found else ""


def is_sanitized():
    """Whether the build is an instrumented one: several times slower, so that timing says nothing."""
    return sanitizer() != ""


def sanitizer_report(errors):
    """From the first line that a sanitizer wrote to standard error on; "" without one."""
    found = re.search(r"^.*(?:ERROR: |runtime error:|WARNING: ThreadSanitizer)", errors, re.M)
    return errors[found.start():] if found else ""


def certificate(folder, name="cert"):
    """The paths of a certificate of localhost and of its key, which are made."""
    cert, key = (os.path.join(folder, f"{name}{end}.pem") for end in ("", "_key"))
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost", "-addext",
                    "subjectAltName=DNS:localhost,IP:127.0.0.1", "-keyout", key, "-out", cert], check=True, capture_output=True)
    return cert, key


def cpu_of(process):
    """What a process has used so far [s of a processor]."""
    with open(f"/proc/{process}/stat", encoding="utf-8") as file:
        fields = file.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def cpu_of_threads(process):
    """What the threads that a process has now have used, to the nanosecond [s of a processor]."""
    total = 0
    for path in glob.glob(f"/proc/{process}/task/*/schedstat"):
        with contextlib.suppress(OSError), open(path, encoding="ascii") as file:
            total += int(file.read().split()[0])
    return total / 1e9


def run(*arguments, text="", timeout=120, environment=None):
    """Runs impactd to its end; returns code, standard output and standard error."""
    done = subprocess.run([impactd(), *arguments], input=text, capture_output=True, text=True,
                          timeout=timeout, env=environment or dict(os.environ), check=False)
    return done.returncode, done.stdout, done.stderr


def on_terminal(*arguments, scene=None, columns=80, **environment):
    """Runs impactd on a scene (a dict or a path) on a terminal; returns code and what is left there at its end."""
    settings = {**os.environ, "TERM": "xterm-256color", "LC_ALL": "C.UTF-8", "NO_COLOR": "1", "COLUMNS": "", **environment}
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        if isinstance(scene, dict):
            json.dump(scene, file)
            file.flush()
        operands = [] if scene is None else [file.name if isinstance(scene, dict) else scene]
        end, terminal = pty.openpty()
        fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 40, columns, 0, 0))
        with subprocess.Popen([impactd(), *arguments, *operands], stdin=subprocess.DEVNULL, stdout=terminal,
                              stderr=terminal, env=settings) as process:
            os.close(terminal)
            written = b""
            with contextlib.suppress(OSError):  # the end of a terminal is an error
                while piece := os.read(end, 65536):
                    written += piece
            os.close(end)
    text = written.decode().replace("\r\n", "\n")
    return process.returncode, re.sub(r"^.*\r", "", text, flags=re.M)


def scene(name):
    """One of schema/examples as a dict."""
    with open(os.path.join(EXAMPLES, name + ".json"), encoding="utf-8") as file:
        return json.load(file)


def examples():
    return sorted(f[:-5] for f in os.listdir(EXAMPLES) if f.endswith(".json"))


@contextlib.contextmanager
def full_pipe():
    """The ends of a pipe that takes no byte more: (to read, to write)."""
    taken, full = os.pipe()
    try:
        os.set_blocking(full, False)
        with contextlib.suppress(BlockingIOError):
            while True:
                os.write(full, b"0" * 4096)
        os.set_blocking(full, True)
        yield taken, full
    finally:
        os.close(taken)
        os.close(full)


@contextlib.contextmanager
def daemon(*arguments, **options):
    """A running daemon; afterwards it must end well, within its time, and no sanitizer may have spoken."""
    with Daemon(build, *arguments, **options) as running:
        yield running
        assert running.is_alive(), f"the daemon ended by itself: {running.stderr()}"
        code, seconds = running.stop(60)
        assert code == 0, f"the daemon ended with {code}: {running.stderr()}"
        # 5 s are promised; a machine with much else to do may take some more.
        assert seconds < 15 or is_sanitized(), f"SIGTERM took {seconds:.1f} s"
        spoken = sanitizer_report(running.stderr())
        assert not spoken, spoken


def until(condition, seconds=60):
    """What the condition says as soon as it is true, or after so long."""
    end = time.monotonic() + seconds
    while not (said := condition()) and time.monotonic() < end:
        time.sleep(0.02)
    return said


def finished(running, scene):
    """Submits and waits; the job's document, which must be of a successful one."""
    reply = running.submit(scene, wait=30)
    assert reply.status in (200, 202), reply
    job = reply.json()
    if job["status"] in ("accepted", "running"):
        job = running.finished(job["id"], 300)
    assert job["status"] == "successful", job
    return job


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
