#!/usr/bin/env python3
"""Every allocation or file call of the canonical requests fails in turn, once and from then on: the daemon refuses, and goes on.

    tests/faults/inject.py --build build allocations|EIO|ENOSPC|short [--stride 1] [REQUEST...]

The suite runs a few of them (tests/contract/test_faults.py)."""
import argparse
import collections
import gzip
import http.client
import os
import sys
import tempfile
import shutil

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import program  # noqa: E402
from canonical import REQUESTS, Setup  # noqa: E402
from control import ALLOCATIONS, KINDS, Control  # noqa: E402

# What a failed call may be answered with: no memory or no room now, or a disk that cannot be read or written.
REFUSALS = {"allocations": {503, 507}, "EIO": {500, 503, 507}, "ENOSPC": {500, 503, 507}, "short": {500, 503, 507}}
TIMEOUT = 25  # [s]
VARYING = {"metrics", "events"}  # paths whose answers are never the same
OPTIONS = ("--workers", "1", "--cache-bytes", "0", "--rate", "0", "--journal", "off")


class Failures(Exception):
    """What went wrong, each with its request and number."""


def send(daemon, request):
    """The reply, None if the connection was closed without one."""
    method, path, body, headers = request
    try:
        return daemon.request(method, path, body=body, headers=headers, timeout=TIMEOUT)
    except (ConnectionError, http.client.HTTPException):
        return None


def is_temporary(job):
    """Whether a job failed of what may be better the next time."""
    problem = job.get("problem")
    return job["status"] == "failed" and (problem is None or problem["status"] in (500, 503, 507))


def decoded(reply):
    """Without memory to pack it an answer is sent as it is."""
    return gzip.decompress(reply.body) if reply.headers.get("content-encoding") == "gzip" else reply.body


def has_failed(request, reply):
    return request[1] == "/v1/jobs" and reply.status == 200 and is_temporary(reply.json())


class Campaign:
    def __init__(self, kind, stride=1):
        self.kind, self.stride = kind, stride
        self.calls, self.error = (ALLOCATIONS, 0) if kind == "allocations" else KINDS[kind]
        self.outcomes = collections.Counter()
        self.wrong = []

    def fault(self, text):
        self.outcomes["wrong"] += 1
        self.wrong.append(text)
        print("  " + text[:400], flush=True)

    def run(self, names):
        for name in names:
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
            number, before = 2, self.outcomes.total()
            for permanent in (False, True):
                for n in range(1, count + 1, self.stride):
                    where = f"{name}, {'from call' if permanent else 'call'} {n} of {count}"
                    request = make(setup, number)
                    number += 1
                    control.arm(n, self.calls, self.error, permanent)
                    try:
                        reply = send(daemon, request)
                    except TimeoutError:
                        self.outcomes["hung"] += 1
                        self.fault(f"{where}: no answer")
                        reply = None
                    control.disarm()
                    if not daemon.is_alive():
                        self.outcomes["crashed"] += 1
                        self.fault(f"{where}: ended with {daemon.process.wait()}: {daemon.stderr()[-3000:]}")
                        daemon.kill()
                        daemon.start()
                        continue
                    self.judge(daemon, where, request, right, reply)
            print(f"{name}: {count} calls, {self.outcomes.total() - before} tried", flush=True)
            self.end(daemon, name)
        finally:
            daemon.kill()

    def judge(self, daemon, where, request, right, reply):
        """The answer, and that of the same request without a fault."""
        if reply is None:
            self.outcomes["closed"] += 1
        elif "content-security-policy" not in reply.headers and "x-content-type-options" not in reply.headers:
            self.fault(f"{where}: headers are missing: {sorted(reply.headers)}")
        elif reply.status in right:
            self.outcomes["right"] += 1
        elif reply.status == 202 and request[1] == "/v1/jobs":
            self.outcomes["accepted"] += 1
        elif reply.status in REFUSALS[self.kind]:
            self.outcomes["refused"] += 1
        else:
            self.fault(f"{where}: {reply}")
        is_done = reply is not None and reply.status < 300
        try:
            if is_done and request[1] == "/v1/jobs":
                job = daemon.finished(reply.json()["id"], TIMEOUT)
                self.acknowledged[f"/v1/jobs/{job['id']}"] = job["status"]
                if job["status"] == "failed" and is_temporary(job):
                    self.outcomes["jobs refused"] += 1
                elif job["status"] != "successful":
                    self.fault(f"{where}: {job}")
            elif is_done and "location" in reply.headers:
                self.acknowledged[reply.headers["location"]] = None
            # A run that is failing of the fault, and whose end is not stored yet, may fail this one too.
            again = send(daemon, request)
            for _ in range(3):
                if again is None or again.status in (503, 507) or has_failed(request, again):
                    again = send(daemon, request)
        except (TimeoutError, OSError, KeyError) as reason:
            self.outcomes["hung"] += 1
            self.fault(f"{where}: then {reason!r}")
            return
        # What was done, or may have been done, is there and cannot be done again.
        allowed = set(right)
        if reply is None or is_done:
            allowed |= {200, 404, 409, 412} if request[0] in ("POST", "DELETE") else set()
        # A cancel that could not be stored holds until the end, and is tried again; a record that is there is found.
        allowed |= {409} if request[0] == "DELETE" else {200} if request[1] == "/v1/records" else set()
        if again is None or again.status not in allowed:
            self.fault(f"{where}: answered {reply}, then {again}")
        elif is_done and request[0] == "GET" and again.status == reply.status and decoded(again) != decoded(reply) and not VARYING.intersection(request[1].split("/")):
            self.fault(f"{where}: another answer than the next one")
        elif request[1] == "/v1/jobs" and again.status == 200 and again.json()["status"] != "successful":
            self.fault(f"{where}: the job again: {again}")

    def end(self, daemon, name):
        """What was acknowledged is there after a new start, as it was."""
        code, _ = daemon.stop(60)
        if code != 0 or "ERROR: " in daemon.stderr():
            self.fault(f"{name}: ended with {code}: {daemon.stderr()[-3000:]}")
        daemon.start()
        for path, status in self.acknowledged.items():
            reply = daemon.get(path)
            if reply.status != 200 or (status and reply.json()["status"] != status):
                self.outcomes["lost"] += 1
                self.fault(f"{name}: {path} was acknowledged ({status}) and is now {reply}")
        daemon.stop(60)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", default=program.build)
    parser.add_argument("--stride", type=int, default=1, help="each so many N")
    parser.add_argument("kind", choices=["allocations", *KINDS])
    parser.add_argument("names", nargs="*", default=list(REQUESTS))
    arguments = parser.parse_args()
    program.build = os.path.abspath(arguments.build)
    campaign = Campaign(arguments.kind, arguments.stride)
    campaign.run(arguments.names)
    print(f"{arguments.kind}: " + ", ".join(f"{count} {what}" for what, count in sorted(campaign.outcomes.items())))
    return 1 if campaign.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
