#!/usr/bin/env python3
"""kill -9 amid requests, again and again on one database, also while a daemon starts: what was acknowledged is there, once.

    tests/storm/kills.py --build build [--cycles 1000] [--clients 4] [--seed 1]

Clients submit jobs, with and without waiting, cancel some, and store records and materials. The next daemon serves what was
acknowledged before the kill. At the end every job has ended as it was reported, none is there twice, and the database is whole."""
import argparse
import collections
import concurrent.futures
import contextlib
import http.client
import os
import random
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

ENDED = ("successful", "failed", "dismissed")
LONGEST = 0.5  # [s] of a life


def scene(number, duration):
    made = program.scene("paper_free_sponge")
    made.update(duration=duration, output={"channels": [], "psd": None})
    made["dampers"][0]["clearance"] = 0.012 + 1e-9 * number
    return made


def material(number):
    return {"slug": f"felt{number}", "name": "Felt", "restitution": 0.3, "source": "here", "comment": "x"}


def ask(daemon, number):
    """One request of some kind: (path, status of the job or None) of what was acknowledged."""
    kind = number % 6
    if kind == 0:
        reply = daemon.request("POST", "/v1/records", json={"name": f"shake{number}", "interval": 0.02, "samples": [0, number, -2]})
    elif kind == 1:
        reply = daemon.request("POST", "/v1/materials", json=material(number))
    else:
        long = kind in (4, 5)
        reply = daemon.submit(scene(number, 3000 if long else 1), headers={"Prefer": "respond-async" if long or kind == 2 else "wait=5"})
    assert reply.status in (200, 201, 202), reply
    if kind <= 1:
        return reply.headers["location"], None
    path = f"/v1/jobs/{reply.json()['id']}"
    if kind == 5:
        reply = daemon.request("DELETE", path)
        assert reply.status in (200, 409), reply  # or it has ended
    return path, reply.json()["status"] if reply.status != 409 else None


def storm(daemon, numbers, acknowledged, stopped):
    with contextlib.suppress(StopIteration):
        while True:
            try:
                acknowledged.append(ask(daemon, next(numbers)))
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


def numbered(first, clients):
    """Numbers of a client's requests: its own, in an order that mixes the kinds."""
    while True:
        yield first
        first += clients


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", default=program.build)
    parser.add_argument("--cycles", type=int, default=1000)
    parser.add_argument("--clients", type=int, default=5, help="no multiple of 2 or 3, so that each sends all kinds")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    program.build = os.path.abspath(arguments.build)
    dice, counts, everything, last = random.Random(arguments.seed), collections.Counter(), [], []
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="impactd-") as folder:
        numbers = [numbered(i, arguments.clients) for i in range(arguments.clients)]
        for cycle in range(arguments.cycles):
            daemon = program.Daemon(program.build, "--workers", "2", data=folder)
            if cycle % 4 == 3:  # while it starts
                with subprocess.Popen([program.impactd(), "serve", "--listen", "127.0.0.1:0", "--data", folder],
                                      stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
                    time.sleep(dice.uniform(0, 0.1))
                    process.kill()
                continue
            daemon.start(60)
            check(daemon, last, counts)
            last, stopped = [], threading.Event()
            with concurrent.futures.ThreadPoolExecutor(arguments.clients) as pool:
                storms = [pool.submit(storm, daemon, one, last, stopped) for one in numbers]
                time.sleep(dice.uniform(0, LONGEST))
                stopped.set()
                daemon.kill()
                for one in storms:
                    one.result()
            everything += last
            if cycle % 100 == 0:
                print(f"{cycle} kills, {len(everything)} acknowledged, after {time.monotonic() - began:.0f} s", flush=True)
        with program.daemon("--workers", "2", data=folder) as daemon:
            check(daemon, everything, counts, is_end=True)
        with contextlib.closing(sqlite3.connect(os.path.join(folder, "impactd.db"))) as connection:
            jobs = collections.Counter(row[0] for row in connection.execute("SELECT id FROM jobs"))
            counts["duplicated"] = sum(count > 1 for count in jobs.values())
            assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
    kinds = collections.Counter(path.split("/")[2] for path, _ in everything)
    print(f"{arguments.cycles} kills in {time.monotonic() - began:.0f} s: {kinds['jobs']} jobs, {kinds['records']} records and "
          f"{kinds['materials']} materials acknowledged, {counts['checked']} checked, {counts['lost']} lost, {counts['duplicated']} duplicated")
    return 1 if counts["lost"] or counts["duplicated"] or len(everything) < arguments.cycles else 0


if __name__ == "__main__":
    sys.exit(main())
