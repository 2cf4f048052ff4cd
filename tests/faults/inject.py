#!/usr/bin/env python3
"""Every allocation or file call of the canonical requests fails in turn, once and from then on: the daemon refuses, and goes on.

    tests/faults/inject.py --build build allocations|EIO|ENOSPC|short [--stride 1] [--processes 8] [REQUEST...]

Much of the time is waiting: what could not be stored is tried again after a second. So the numbers are dealt to processes, each with
a daemon of its own. The suite runs a few of them (tests/contract/test_faults.py)."""
import argparse
import collections
import concurrent.futures
import gzip
import http.client
import os
import shutil
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import program  # noqa: E402
from canonical import REQUESTS, Setup  # noqa: E402
from control import ALLOCATIONS, KINDS, Control  # noqa: E402

# What a failed call may be answered with: no memory or no room now, or a disk that cannot be read or written.
REFUSALS = {"allocations": {503, 507}, "EIO": {500, 503, 507}, "ENOSPC": {500, 503, 507}, "short": {500, 503, 507}}
TIMEOUT = 25  # [s]
PERMANENT = 0.3  # a permanent fault ends after an answer, or so long without one [s]
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
    return job["status"] == "failed" and job["problem"]["status"] in (500, 503, 507)


def content(reply):
    """The body, and where the next page is. Without memory to pack it an answer is sent as it is."""
    is_packed = reply.headers.get("content-encoding") == "gzip"
    return gzip.decompress(reply.body) if is_packed else reply.body, reply.headers.get("link")


def has_failed(request, reply):
    return request[1] == "/v1/jobs" and reply.status == 200 and is_temporary(reply.json())


class Campaign:
    """Every `stride`-th number, from `first` on."""

    def __init__(self, kind, stride=1, first=1):
        self.kind, self.stride, self.first = kind, stride, first
        self.calls, self.error = (ALLOCATIONS, 0) if kind == "allocations" else KINDS[kind]
        self.tried, self.outcomes = 0, collections.Counter()
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
            number = 2
            for permanent in (False, True):
                for n in range(self.first, count + 1, self.stride):
                    where = f"{name}, {'from call' if permanent else 'call'} {n} of {count}"
                    request = make(setup, number)
                    number += 1
                    self.tried += 1
                    control.arm(n, self.calls, self.error, permanent)
                    end = threading.Timer(PERMANENT, control.disarm)
                    end.start()
                    try:
                        reply = send(daemon, request)
                    except TimeoutError:
                        self.outcomes["hung"] += 1
                        self.fault(f"{where}: no answer")
                        reply = None
                    end.cancel()
                    end.join()
                    control.disarm()
                    if not daemon.is_alive():
                        self.outcomes["crashed"] += 1
                        self.fault(f"{where}: ended with {daemon.process.wait()}: {daemon.stderr()[-3000:]}")
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
            self.fault(f"{where}: headers are missing: {sorted(reply.headers)}")
        elif reply.status in right:
            self.outcomes["right"] += 1
        elif reply.status == 202 and request[1] == "/v1/jobs":
            self.outcomes["accepted"] += 1
        elif reply.status in REFUSALS[self.kind] and reply.json().get("detail"):
            self.outcomes["refused"] += 1
        elif reply.status == 409 and request[0] == "DELETE" and is_temporary(daemon.get(request[1]).json()):
            self.outcomes["refused"] += 1  # the job that is to be cancelled has failed of the fault
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
        elif is_done and request[0] == "GET" and again.status == reply.status and content(again) != content(reply) and not VARYING.intersection(request[1].split("/")):
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


def part(kind, stride, first, name):
    """What a process does: the numbers of a request that are dealt to it."""
    campaign = Campaign(kind, stride, first)
    campaign.run([name])
    return campaign.outcomes, campaign.wrong, campaign.tried


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", default=program.build)
    parser.add_argument("--stride", type=int, default=1, help="each so many N")
    parser.add_argument("--processes", type=int, default=8, help="daemons at the same time")
    parser.add_argument("kind", choices=["allocations", *KINDS])
    parser.add_argument("names", nargs="*", help="all; of allocations all but the upload, which has one for each of its 60,000 samples")
    arguments = parser.parse_args()
    if not arguments.names:
        arguments.names = [name for name in REQUESTS if arguments.kind != "allocations" or name != "upload"]
    program.build = os.path.abspath(arguments.build)
    outcomes, wrong = collections.Counter(), []
    stride = arguments.stride * arguments.processes
    began = time.monotonic()
    with concurrent.futures.ProcessPoolExecutor(arguments.processes) as pool:
        firsts = range(1, stride + 1, arguments.stride)
        parts = {name: [pool.submit(part, arguments.kind, stride, first, name) for first in firsts] for name in arguments.names}
        for name, done in parts.items():
            tried = 0
            for one in done:
                outcomes += one.result()[0]
                wrong += one.result()[1]
                tried += one.result()[2]
            print(f"{name}: {tried} tried, after {time.monotonic() - began:.0f} s", flush=True)
    print(f"{arguments.kind}: " + ", ".join(f"{count} {what}" for what, count in sorted(outcomes.items())))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
