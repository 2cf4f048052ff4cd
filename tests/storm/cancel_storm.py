#!/usr/bin/env python3
"""Cancels jobs at random times and proves that each has one end: dismissed, or finished, never both.

    tests/storm/cancel_storm.py [N] [--build build-tsan]

N jobs (10,000) long enough to be hit are submitted by 8 clients, which cancel each at a random time of its life, some
of them twice at once. Every answer must fit the one final state, which the job has then, in the list, and after a
restart. At least half of the cancels must land in a running job."""

import argparse
import collections
import concurrent.futures
import json
import os
import random
import shutil
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from daemon import Connection  # noqa: E402

CLIENTS = 8
RUN = 0.2  # [s] of CPU a job: several times what a request takes while all processors are busy


def scene(number, duration):
    made = program.scene("paper_sine_aluminium")
    made.update(duration=duration, sample_rate=100, output={"channels": [], "psd": None},
                accuracy={"solver": "rk4", "step": 1e-5})
    made["dampers"][0]["clearance"] = 0.012 + 1e-8 * number
    return made


def fitting_duration():
    """How long a scene takes RUN seconds in this build."""
    took = min(json.loads(program.run("run", "-", text=json.dumps(scene(0, 1)))[1])["timing"]["run"]
               for _ in range(3))
    return max(RUN / took, 0.05)


def ask(connection, method, path, **what):
    reply = connection.request(method, path, **what)
    return reply.status, reply.json()


class Storm:
    def __init__(self, daemon, count, seed):
        self.daemon, self.seed = daemon, seed
        self.numbers = iter(range(1, count + 1))
        self.lock = threading.Lock()
        self.ends, self.running_hits, self.cancels = {}, 0, 0
        self.duration = fitting_duration()

    def next(self):
        with self.lock:
            return next(self.numbers, None)

    def one(self, client, other, chance, number):
        """Submits, waits a random part of the job's life from its start, cancels, and judges the answers."""
        status, job = ask(client, "POST", "/v1/jobs", json=scene(number, self.duration), headers={"Prefer": "respond-async"})
        assert status in (200, 202), (status, job)
        path = f"/v1/jobs/{job['id']}"
        waits_for_start = chance.random() < 0.8
        end = time.monotonic() + 60
        while waits_for_start and job["status"] == "accepted" and time.monotonic() < end:
            time.sleep(0.002)
            _, job = ask(client, "GET", path)
        time.sleep(chance.random() * RUN * 0.7)
        before = ask(client, "GET", path)[1]["status"]
        twice = chance.random() < 0.2
        second = []
        if twice:
            thread = threading.Thread(target=lambda: second.append(ask(other, "DELETE", path)))
            thread.start()
        answers = [ask(client, "DELETE", path)]
        if twice:
            thread.join()
            answers += second
        codes = sorted(code for code, _ in answers)
        final = ask(client, "GET", path)[1]
        assert codes in ([200], [409], [200, 409], [409, 409]), (path, answers)
        if 200 in codes:
            assert final["status"] == "dismissed" and final["result"] is None, (answers, final)
            told = next(document for code, document in answers if code == 200)
            assert told["status"] == "dismissed", told
        else:
            # The end it was refused for may be on its way to the disk still.
            while final["status"] in ("accepted", "running") and time.monotonic() < end:
                time.sleep(0.005)
                final = ask(client, "GET", path)[1]
            assert final["status"] in ("successful", "failed"), (answers, final)
        with self.lock:
            self.ends[job["id"]] = final["status"]
            self.cancels += 1
            self.running_hits += before == "running" and 200 in codes

    def work(self, index):
        chance = random.Random(self.seed * 1000 + index)
        client, other = (Connection(self.daemon.port, timeout=120) for _ in range(2))
        while (number := self.next()) is not None:
            self.one(client, other, chance, number)


def all_states(daemon):
    found, target = {}, "/v1/jobs?limit=100"
    while target:
        reply = daemon.get(target)
        for job in reply.json()["jobs"]:
            assert job["id"] not in found, "listed twice"
            found[job["id"]] = job["status"]
        link = reply.headers.get("link", "")
        target = link[1:link.index(">")] if link else None
    return found


def storm(count, seed=1):
    """Returns how many cancels there were, how many hit a running job, and the ends by kind."""
    folder = tempfile.mkdtemp(prefix="impactd-storm-")
    try:
        with program.daemon("--workers", "4", data=folder) as daemon:
            one = Storm(daemon, count, seed)
            with concurrent.futures.ThreadPoolExecutor(CLIENTS) as pool:
                for done in [pool.submit(one.work, index) for index in range(CLIENTS)]:
                    done.result()
            assert len(one.ends) == count
            assert all_states(daemon) == one.ends, "the list says otherwise"
        with program.daemon("--workers", "1", data=folder) as daemon:
            assert all_states(daemon) == one.ends, "an end did not outlast the daemon"
        return one.cancels, one.running_hits, collections.Counter(one.ends.values())
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("count", nargs="?", type=int, default=10000)
    parser.add_argument("--build", default=program.build)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    program.build = os.path.abspath(arguments.build)
    begin = time.monotonic()
    cancels, hits, ends = storm(arguments.count, arguments.seed)
    print(f"{cancels} cancels, {hits} of them in a running job; ends: {dict(ends)}; "
          f"{time.monotonic() - begin:.0f} s")
    return 0 if hits * 2 >= cancels > 0 else 1


if __name__ == "__main__":
    sys.exit(main())
