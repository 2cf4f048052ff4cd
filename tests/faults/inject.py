#!/usr/bin/env python3
"""Every allocation or file call of the canonical requests fails in turn, once and from then on: the daemon refuses, and goes on.

    tests/faults/inject.py --build build allocations|EIO|ENOSPC|short [--stride 1] [--processes 8] [REQUEST...]

Much of the time is waiting: what could not be stored is tried again after a second. So the numbers are dealt to processes, each with
a daemon of its own. The suite runs a few of them (tests/contract/test_faults.py)."""
import gzip
import http.client
import os
import shutil
import sys
import tempfile
import threading

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import campaign  # noqa: E402
import program  # noqa: E402
from canonical import REQUESTS, Setup  # noqa: E402
from control import KINDS, Control  # noqa: E402

# What a failed call may be answered with: no memory or no room now, or a disk that cannot be read or written.
REFUSALS = {"allocations": {503, 507}, "EIO": {500, 503, 507}, "ENOSPC": {500, 503, 507}, "short": {500, 503, 507}}
TIMEOUT = 25  # [s]
PERMANENT = 0.3  # a permanent fault ends after an answer, or so long without one [s]
VARYING = {"metrics", "events"}  # paths whose answers are never the same
OPTIONS = ("--workers", "1", "--cache-bytes", "0", "--rate", "0", "--journal", "off")


def send(daemon, request):
    """The reply, None if the connection was closed without one."""
    method, path, body, headers = request
    try:
        return daemon.request(method, path, body=body, headers=headers, timeout=TIMEOUT)
    except (ConnectionError, http.client.HTTPException):
        return None


def is_temporary(job):
    """Whether a job failed of what may be better the next time."""
    return job["status"] == "failed" and job["problem"]["status"] in (500, 503, 507)


def content(reply):
    """The body, and where the next page is. Without memory to pack it an answer is sent as it is."""
    is_packed = reply.headers.get("content-encoding") == "gzip"
    return gzip.decompress(reply.body) if is_packed else reply.body, reply.headers.get("link")


def has_failed(request, reply):
    return request[1] == "/v1/jobs" and reply.status == 200 and is_temporary(reply.json())


class Campaign(campaign.Campaign):
    """Calls of one request."""

    def run(self, name):
        folder = tempfile.mkdtemp(prefix="impactd-")
        try:
            self.request(name, folder)
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def request(self, name, folder):
        """All N of one request, by a daemon of its own, which is started again if it ends."""
        make, right = REQUESTS[name]
        control = Control(folder)
        daemon = program.Daemon(program.build, *OPTIONS, data=folder, environment=control.environment)
        daemon.start()
        self.acknowledged = {}
        try:
            setup = Setup(daemon)
            for number in (0, 1):
                request = make(setup, number)
                control.arm(0, self.calls)
                reply = send(daemon, request)
                count, _ = control.disarm()
                assert reply is not None and reply.status in right, (name, reply)
            body = reply.body
            number = 2
            for permanent in (False, True):
                for n in range(1, count + 1)[self.chosen]:
                    where = f"{name}, {'from call' if permanent else 'call'} {n} of {count}"
                    request = make(setup, number)
                    number += 1
                    control.arm(n, self.calls, self.error, permanent)
                    end = threading.Timer(PERMANENT, control.disarm)
                    end.start()
                    try:
                        reply = send(daemon, request)
                    except TimeoutError:
                        self.fault("hung", f"{where}: no answer")
                        reply = None
                    end.cancel()
                    end.join()
                    self.disarm(control)
                    if not daemon.is_alive():
                        self.fault("crashed", f"{where}: ended with {daemon.process.wait()}: {daemon.stderr()[-3000:]}")
                        daemon.kill()
                        daemon.start()
                        continue
                    self.judge(daemon, where, request, right, reply)
            self.end(daemon, name)
        finally:
            daemon.kill()

    def judge(self, daemon, where, request, right, reply):
        """The answer, and that of the same request without a fault."""
        if reply is None:
            self.outcomes["closed"] += 1
        elif "content-security-policy" not in reply.headers and "x-content-type-options" not in reply.headers:
            self.fault("wrong", f"{where}: headers are missing: {sorted(reply.headers)}")
        elif reply.status in right:
            self.outcomes["right"] += 1
        elif reply.status == 202 and request[1] == "/v1/jobs":
            self.outcomes["accepted"] += 1
        elif reply.status in REFUSALS[self.kind] and reply.json().get("detail"):
            self.outcomes["refused"] += 1
        elif reply.status == 409 and request[0] == "DELETE" and is_temporary(daemon.get(request[1]).json()):
            self.outcomes["refused"] += 1  # the job that is to be cancelled has failed of the fault
        else:
            self.fault("wrong", f"{where}: {reply}")
        is_done = reply is not None and reply.status < 300
        try:
            if is_done and request[1] == "/v1/jobs":
                job = daemon.finished(reply.json()["id"], TIMEOUT)
                self.acknowledged[f"/v1/jobs/{job['id']}"] = job["status"]
                if job["status"] == "failed" and is_temporary(job):
                    self.outcomes["jobs refused"] += 1
                elif job["status"] != "successful":
                    self.fault("wrong", f"{where}: {job}")
            elif is_done and "location" in reply.headers:
                self.acknowledged[reply.headers["location"]] = None
            # A run that is failing of the fault, and whose end is not stored yet, may fail this one too.
            again = send(daemon, request)
            for _ in range(3):
                if again is None or again.status in (503, 507) or has_failed(request, again):
                    again = send(daemon, request)
        except (TimeoutError, OSError, KeyError) as reason:
            self.fault("hung", f"{where}: then {reason!r}")
            return
        # What was done, or may have been done, is there and cannot be done again.
        allowed = set(right)
        if reply is None or is_done:
            allowed |= {200, 404, 409, 412} if request[0] in ("POST", "DELETE") else set()
        # A cancel that could not be stored holds until the end, and is tried again; a record that is there is found.
        allowed |= {409} if request[0] == "DELETE" else {200} if request[1] == "/v1/records" else set()
        if again is None or again.status not in allowed:
            self.fault("wrong", f"{where}: answered {reply}, then {again}")
        elif is_done and request[0] == "GET" and again.status == reply.status and content(again) != content(reply) and not VARYING.intersection(request[1].split("/")):
            self.fault("wrong", f"{where}: another answer than the next one")
        elif request[1] == "/v1/jobs" and again.status == 200 and again.json()["status"] != "successful":
            self.fault("wrong", f"{where}: the job again: {again}")

    def end(self, daemon, name):
        """What was acknowledged is there after a new start, as it was."""
        code, _ = daemon.stop(60)
        if code != 0 or program.sanitizer_report(daemon.stderr()):
            self.fault("wrong", f"{name}: ended with {code}: {daemon.stderr()[-3000:]}")
        daemon.start()
        for path, status in self.acknowledged.items():
            reply = daemon.get(path)
            if reply.status != 200 or (status and reply.json()["status"] != status):
                self.fault("lost", f"{name}: {path} was acknowledged ({status}) and is now {reply}")
        daemon.stop(60)


def names(kind):
    """An upload has an allocation for each of its 60,000 samples: they fail where it is named."""
    return [name for name in REQUESTS if kind != "allocations" or name != "upload"]


if __name__ == "__main__":
    sys.exit(campaign.main(Campaign, __doc__, ["allocations", *KINDS], names, processes=8))
