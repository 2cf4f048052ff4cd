#!/usr/bin/env python3
"""kill -9 amid requests, again and again on one database, also while a daemon starts: what was acknowledged is there, once.

    tests/storm/kills.py --build build [--cycles 1000] [--clients 5] [--seed 1]

Clients submit jobs, with and without waiting, cancel some, and now and then store a record or a material. The next daemon serves
what was acknowledged before the kill. At the end every job has ended as it was reported, none is there twice, and the database is
whole. Every fourth kill is during a start, before the daemon listens or soon after."""
import argparse
import collections
import concurrent.futures
import http.client
import itertools
import os
import random
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from database import job_counts  # noqa: E402

ENDED = ("successful", "failed", "dismissed")
MAX_LIFE = 0.5  # [s] of a daemon amid requests
MAX_START = 0.1  # [s] of a daemon that is killed as it starts


def scene(number, duration):
    made = program.scene("paper_free_sponge")
    made.update(duration=duration, output={"channels": [], "psd": None})
    made["dampers"][0]["clearance"] = 0.012 + 1e-9 * number
    return made


def material(number):
    return {"slug": f"felt{number}", "name": "Felt", "restitution": 0.3, "source": "here", "comment": "x"}


def ask(daemon, number):
    """One request of some kind: (path, status of the job or None) of what was acknowledged."""
    # A database takes 20,000 records; a life of half a second has some 200 requests.
    if number % 100 == 0:
        reply = daemon.request("POST", "/v1/records", json={"name": f"shake{number}", "interval": 0.02, "samples": [0, number, -2]})
    elif number % 100 == 50:
        reply = daemon.request("POST", "/v1/materials", json=material(number))
    else:
        kind = ("short", "short waited for", "long", "long cancelled")[number % 4]
        is_long = kind.startswith("long")
        wanted = "wait=5" if kind == "short waited for" else "respond-async"
        reply = daemon.submit(scene(number, 3000 if is_long else 1), headers={"Prefer": wanted})
    assert reply.status in (200, 201, 202), reply
    if reply.status == 201:
        return reply.headers["location"], None
    path = f"/v1/jobs/{reply.json()['id']}"
    if kind == "long cancelled":
        reply = daemon.request("DELETE", path)
        assert reply.status in (200, 409), reply  # or it has ended
    return path, reply.json()["status"] if reply.status != 409 else None


def storm(daemon, numbers, acknowledged, stopped):
    for number in numbers:
        try:
            acknowledged.append(ask(daemon, number))
        except (OSError, http.client.HTTPException, ValueError):
            assert stopped.is_set(), "the daemon was gone before it was killed"
            return


def check(daemon, acknowledged, counts, is_end=False):
    """What was acknowledged is served; at the end each job has ended."""
    for path, status in acknowledged:
        reply = daemon.get(path)
        now = reply.json() if reply.status == 200 else {}
        if is_end and path.startswith("/v1/jobs/") and now.get("status") not in ENDED:
            now = daemon.finished(path.rsplit("/", 1)[1], 120)
        counts["checked"] += 1
        if reply.status != 200 or (status in ENDED and now["status"] != status) or now.get("status") == "failed":
            counts["lost"] += 1
            print(f"  lost: {path} was acknowledged ({status}) and is now {reply} {now.get('status')}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", default=program.build)
    parser.add_argument("--cycles", type=int, default=1000)
    parser.add_argument("--clients", type=int, default=5)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    program.build = os.path.abspath(arguments.build)
    dice, counts, everything, last = random.Random(arguments.seed), collections.Counter(), [], []
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="impactd-") as folder:
        numbers = itertools.count()  # for all clients
        for cycle in range(arguments.cycles):
            daemon = program.Daemon(program.build, "--workers", "2", data=folder)
            if cycle % 4 == 3:
                with subprocess.Popen([program.impactd(), "serve", "--listen", "127.0.0.1:0", "--data", folder],
                                      stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
                    time.sleep(dice.uniform(0, MAX_START))
                    process.kill()
                    counts["starts"] += b"listens on" not in process.stdout.read()
                continue
            daemon.start(60)
            check(daemon, last, counts)
            last, stopped = [], threading.Event()
            with concurrent.futures.ThreadPoolExecutor(arguments.clients) as pool:
                storms = [pool.submit(storm, daemon, numbers, last, stopped) for _ in range(arguments.clients)]
                time.sleep(dice.uniform(0, MAX_LIFE))
                stopped.set()
                daemon.kill()
                for one in storms:
                    one.result()
            everything += last
            if cycle % 100 == 0:
                print(f"{cycle} kills, {len(everything)} acknowledged, after {time.monotonic() - began:.0f} s", flush=True)
        with program.daemon("--workers", "2", data=folder) as daemon:
            check(daemon, everything, counts, is_end=True)
        counts["duplicated"] = sum(count > 1 for count in job_counts(folder).values())
    kinds = collections.Counter(path.split("/")[2] for path, _ in everything)
    print(f"{arguments.cycles} kills in {time.monotonic() - began:.0f} s, {counts['starts']} before it listened: {kinds['jobs']} jobs, {kinds['records']} records and "
          f"{kinds['materials']} materials acknowledged, {counts['checked']} checked, {counts['lost']} lost, {counts['duplicated']} duplicated")
    has_tried = len(everything) >= arguments.cycles and all(kinds[kind] for kind in ("jobs", "records", "materials")) and counts["starts"]
    return 0 if has_tried and not counts["lost"] and not counts["duplicated"] else 1


if __name__ == "__main__":
    sys.exit(main())
