"""Starts and stops an impactd of its own for a test: port 0, a folder of its own, ended in any case.

    with Daemon("build") as daemon:
        reply = daemon.request("POST", "/v1/jobs", json={...})

With IMPACTD_RECORD=FILE in the environment every request and its answer is one line of JSON in that file.
Standard library only. Not a client for users.
"""
import base64
import contextlib
import http.client
import json as json_module
import os
import re
import shutil
import signal
import subprocess
import tempfile
import time


class Reply:
    def __init__(self, status, headers, body):
        self.status = status
        self.headers = headers  # names in lower case
        self.body = body

    def json(self):
        return json_module.loads(self.body)

    def __repr__(self):
        return f"<{self.status} {self.headers.get('content-type')} {self.body[:300]!r}>"


def record(method, path, headers, body, reply):
    """One line for contract/test_traffic.py; answers that are no JSON or long are told by their size."""
    target = os.environ.get("IMPACTD_RECORD")
    if not target:
        return
    kind = reply.headers.get("content-type", "")
    is_text = "json" in kind and len(reply.body) < 1 << 20 and "content-encoding" not in reply.headers
    sent = {k.lower(): v.decode("latin-1") if isinstance(v, bytes) else v for k, v in headers.items()}
    line = {"method": method, "path": path, "headers": sent,
            "body": base64.b64encode(body).decode() if body is not None and len(body) < 1 << 20 else None,
            "status": reply.status, "answer_headers": reply.headers, "size": len(reply.body),
            "answer": base64.b64encode(reply.body).decode() if is_text else None}
    # One append each: tests run beside others.
    with open(target, "ab", buffering=0) as file:
        file.write(json_module.dumps(line).encode() + b"\n")


class Connection:
    """A connection that is kept open, as long as the daemon keeps it."""

    def __init__(self, port, timeout=60):
        self.connection = http.client.HTTPConnection("127.0.0.1", port, timeout=timeout)

    def request(self, method, path, body=None, json=None, headers=None):
        headers = dict(headers or {})
        if json is not None:
            body = json_module.dumps(json)
            headers.setdefault("Content-Type", "application/json")
        if isinstance(body, str):
            body = body.encode()
        self.connection.request(method, path, body=body, headers=headers)
        reply = self.connection.getresponse()
        answer = Reply(reply.status, {k.lower(): v for k, v in reply.getheaders()}, reply.read())
        record(method, path, headers, body, answer)
        return answer

    def close(self):
        self.connection.close()


class Daemon:
    def __init__(self, build, *arguments, data=None, environment=None, errors=None):
        """`errors` is a descriptor that takes its standard error; without, stderr() reads it."""
        self.program = os.path.join(os.path.abspath(build), "impactd")
        self.arguments = list(arguments)
        self.owns_data = data is None
        self.data = data or tempfile.mkdtemp(prefix="impactd-")
        self.environment = {**os.environ, **(environment or {})}
        self.errors_to = errors
        self.process = None
        self.port = None

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.stop()
        if self.owns_data:
            shutil.rmtree(self.data, ignore_errors=True)

    def start(self, seconds=20):
        """Starts it on any free port and returns when it answers."""
        self.errors = tempfile.TemporaryFile(mode="w+")
        self.process = subprocess.Popen(
            [self.program, "serve", "--listen", "127.0.0.1:0", "--data", self.data, *self.arguments],
            stdout=subprocess.PIPE, stderr=self.errors if self.errors_to is None else self.errors_to, text=True, env=self.environment)
        end = time.monotonic() + seconds
        self.greeting = ""
        while time.monotonic() < end:
            line = self.process.stdout.readline()
            self.greeting += line
            found = re.search(r"listens on (https?://(.+):(\d+))", line)
            if found:
                self.url, self.host, self.port = found[1], found[2], int(found[3])
                return self
            if line == "":
                break
        self.kill()
        raise RuntimeError(f"impactd does not start: {self.greeting}{self.stderr()}")

    def stderr(self):
        self.errors.seek(0)
        return self.errors.read()

    def stop(self, seconds=10):
        """SIGTERM; returns (exit code, seconds it took). Kills it if it does not end."""
        if self.process is None:
            return None
        begin = time.monotonic()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            self.kill()
            raise
        finally:
            if self.process is not None:
                self.process.stdout.close()
        code, self.process = self.process.returncode, None
        return code, time.monotonic() - begin

    def kill(self):
        """SIGKILL, as a power failure would."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()
            self.process.stdout.close()
            self.process = None

    def is_alive(self):
        return self.process is not None and self.process.poll() is None

    def request(self, method, path, body=None, json=None, headers=None, timeout=60):
        """One request on a connection of its own."""
        with contextlib.closing(Connection(self.port, timeout)) as connection:
            return connection.request(method, path, body, json, headers)

    def get(self, path, **options):
        return self.request("GET", path, **options)

    def submit(self, scene, wait=None, **options):
        """POST /v1/jobs; waits until the job is finished unless told otherwise by headers."""
        headers = dict(options.pop("headers", None) or {})
        if wait is not None:
            headers["Prefer"] = f"wait={wait}"
        return self.request("POST", "/v1/jobs", json=scene, headers=headers, **options)

    def finished(self, job_id, seconds=60):
        """The job when it is finished."""
        end = time.monotonic() + seconds
        while True:
            job = self.get(f"/v1/jobs/{job_id}?wait=20").json()
            if job["status"] not in ("accepted", "running"):
                return job
            if time.monotonic() > end:
                raise TimeoutError(f"job {job_id} is still {job['status']}")
