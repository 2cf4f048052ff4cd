#!/usr/bin/env python3
"""How long reads take while two clients send expensive bodies: of a result, a part of its series, a job and the list of jobs.

    tests/storm/reads.py [SECONDS] [--seed 1] [--build build]

For SECONDS (60) two clients send bodies of costly.py one after the other to a daemon with default limits and as many
workers as there are processors: each first asks for predictions, to make the body as long as is allowed, and submits it
without waiting for its end. A third client reads. Printed are the median, the 99th percentile and the most of its answers
[ms], before and meanwhile. The end is 1 if no body was accepted."""

import argparse
import multiprocessing
import os
import random
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import costly  # noqa: E402
import program  # noqa: E402
from daemon import Connection  # noqa: E402

LIMIT = {"run": 60, "study": 3600}  # [s] of CPU, the daemon's
CALM = 10  # [s] before the clients begin


def send(port, seed, end, sent):
    """Expensive bodies until then; counts those that were accepted."""
    client, number = Connection(port, timeout=120), 0

    def predict(body):
        reply = client.request("POST", "/v1/jobs?dry_run=1", json=body)
        return (reply.json()["cost"] if reply.status == 200 else None), reply

    while time.monotonic() < end:
        number += 1
        body = costly.drawn(seed, number)[1]
        best, _ = costly.fitted(body, predict, 0.97 * LIMIT["study" if "study" in body else "run"])
        if best is not None:
            reply = client.request("POST", "/v1/jobs", json=best[0], headers={"Prefer": "respond-async"})
            assert reply.status in (200, 202, 503), (reply.status, reply.body)
            with sent.get_lock():
                sent.value += reply.status == 202


def read(port, paths, end, dice):
    """Seconds of each answer until then, by path."""
    client, took = Connection(port, timeout=120), {path: [] for path in paths}
    while time.monotonic() < end:
        path = dice.choice(paths)
        began = time.perf_counter()
        reply = client.request("GET", path)
        took[path].append(time.perf_counter() - began)
        assert reply.status == 200, (path, reply.status, reply.body)
        time.sleep(0.002)
    return took


def tell(when, took):
    """A line for each path, and one for all."""
    for path, seconds in [*took.items(), ("all", sum(took.values(), []))]:
        name = "/".join("..." if len(part) > 30 else part for part in path.split("?")[0].split("/"))
        ranked = sorted(1e3 * one for one in seconds)
        print(f"{when:10} {name:28} {len(ranked):6} reads, median {ranked[len(ranked) // 2]:7.2f} ms, "
              f"99 % {ranked[int(0.99 * len(ranked))]:7.2f} ms, most {ranked[-1]:7.2f} ms", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("seconds", nargs="?", type=float, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--build", default=program.build)
    arguments = parser.parse_args()
    program.build = os.path.abspath(arguments.build)
    dice = random.Random(arguments.seed)
    with program.daemon() as daemon:
        costly.upload(daemon)
        job = daemon.request("POST", "/v1/jobs", json=program.scene("paper_free_sponge"), headers={"Prefer": "wait=60"}).json()
        result = job["links"]["result"]
        paths = [result, f"{result}/series.json?points=1000", f"/v1/jobs/{job['id']}", "/v1/jobs?limit=20"]
        tell("alone", read(daemon.port, paths, time.monotonic() + min(CALM, arguments.seconds), dice))
        end = time.monotonic() + arguments.seconds
        sent = multiprocessing.Value("i", 0)
        clients = [multiprocessing.Process(target=send, args=(daemon.port, f"{arguments.seed}-{i}", end, sent), daemon=True)
                   for i in range(2)]
        for client in clients:
            client.start()
        tell("meanwhile", read(daemon.port, paths, end, dice))
        for client in clients:
            client.join(120)
            assert client.exitcode == 0, client.exitcode
        print(f"{sent.value} expensive jobs accepted in {arguments.seconds:g} s")
    return 0 if sent.value > 0 else 1


if __name__ == "__main__":
    sys.exit(main())
