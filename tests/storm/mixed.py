#!/usr/bin/env python3
"""Very many requests of all sorts, clients that are killed and restarts of the daemon: memory and descriptors stay flat, nothing
that was acknowledged is lost, and nothing is answered 5xx but back-pressure.

    tests/storm/mixed.py --build build [--requests 1000000] [--clients 8] [--restarts 10]

The suite runs 30,000 of them on the build with address and undefined-behaviour sanitizers (tests/contract/test_storm.py).
"""
import argparse
import collections
import json
import multiprocessing
import os
import queue
import random
import re
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import asker  # noqa: E402
import program  # noqa: E402
from database import job_counts  # noqa: E402

CACHE = 16 << 20  # [B] of the daemon, so that it is full soon
GROWTH = 8 << 20  # [B] that chance may make of it within a life
DIFFERENCE = 16 << 20  # [B] by which chance may make lives differ
OPENED = 8  # descriptors: connections to the database are opened when they are needed
VICTIM = 1000  # requests that a client has who is killed within a second
ROUNDS = 8  # of each life of the daemon; memory is measured after each
# Where the address sanitizer keeps its notes on all other addresses, an eighth of them.
SHADOW = range(0x7FFF8000, 0x10007FFF8000)


def resident(pid):
    """Anonymous memory: pages of the database are the kernel's to take back.

    So is not the sanitizer's shadow of such a page, which some kernels allocate when it is read: it grows with the database."""
    total, is_counted = 0, True
    with open(f"/proc/{pid}/smaps") as file:
        for line in file:
            word, rest = line.split(maxsplit=1)
            if not word.endswith(":"):
                is_counted = int(word.split("-")[0], 16) not in SHADOW
            elif word == "Anonymous:" and is_counted:
                total += int(rest.split()[0]) * 1024
    return total


def descriptors(pid):
    return len(os.listdir(f"/proc/{pid}/fd"))


def connected(daemon):
    """How many clients the daemon says are there, with the one who asks."""
    text = daemon.get("/metrics").body.decode()
    return int(float(re.search(r"^impactd_http_connections (\S+)$", text, re.M)[1]))


class Storm:
    """What is measured and counted over all lives of a daemon."""

    def __init__(self, daemon, requests, clients, restarts=0, seed=1, report=lambda text: None):
        self.daemon, self.clients, self.report = daemon, clients, report
        self.seed, self.dice = seed, random.Random(seed)
        self.lives, self.number, self.took = restarts + 1, 1000, 1.0
        self.each = max(requests // self.lives // ROUNDS // clients, 1)
        self.memory, self.files = [[]], [[]]  # by life, after each of its rounds
        self.codes, self.acknowledged, self.checked, self.victims = collections.Counter(), [], 0, 0
        self.place = asker.Place(daemon.port)
        line = asker.Line(self.place)
        self.known = []
        for number in range(asker.KEPT):
            code, _, body = line.ask("POST", "/v1/jobs", asker.scene(number), "Prefer: wait=30\r\n")
            assert code == 200, (code, body)
            job = json.loads(body)
            self.known.append((job["result"], job["id"]))
        line.close()

    def client(self, requests, first):
        """A client that runs; what it finds is put into the queue. Numbers of scenes are its own, from the first on."""
        self.seed += 1
        made = multiprocessing.Process(target=asker.client, daemon=True, args=(
            self.place, self.seed, requests, self.known, first, self.found))
        made.start()
        return made

    def restart(self):
        """A new life amid the requests: after SIGTERM or, every second time, after SIGKILL."""
        self.place.ends()
        if len(self.memory) % 2 == 1:
            code, _ = self.daemon.stop(120)
            assert code == 0, f"the daemon ended with {code}: {self.daemon.stderr()[-1500:]}"
        else:
            self.daemon.kill()
        spoken = program.sanitizer_report(self.daemon.stderr())
        assert not spoken, spoken
        self.daemon.start(120)
        self.place.begins(self.daemon.port)
        self.memory.append([])
        self.files.append([])

    def round(self, restarts):
        """As many requests as a round has, with one more client that is killed again and again, and perhaps a restart."""
        self.found = multiprocessing.Queue()
        begin = time.monotonic()
        workers = [self.client(self.each, self.number + i * self.each) for i in range(self.clients)]
        self.number += self.clients * self.each
        unheard = self.clients
        restart_at = begin + self.dice.uniform(0.1, 0.6) * self.took if restarts else None
        while unheard > 0:
            victim = self.client(VICTIM, 10**8 + self.victims * VICTIM)
            try:
                word = self.found.get(timeout=self.dice.uniform(0.1, 1))
            except queue.Empty:
                word = None
                assert any(worker.is_alive() for worker in workers), "a client ended without a word"
            victim.kill()
            victim.join()
            victim.close()
            self.victims += 1
            if restart_at is not None and time.monotonic() >= restart_at:
                self.restart()
                restart_at = None
            if word is not None:
                assert word[0] == "done", (word, f"the daemon: {self.daemon.process.poll()}, {self.daemon.stderr()[-1500:]}")
                self.codes += word[1]
                self.acknowledged += word[2]
                self.checked += word[3]
                unheard -= 1
            assert self.daemon.is_alive(), self.daemon.stderr()[-1500:]
        for worker in workers:
            worker.join()
        self.took = time.monotonic() - begin
        if restart_at is not None:
            self.restart()

    def measure(self):
        end = time.monotonic() + 10
        while connected(self.daemon) > 1 and time.monotonic() < end:
            time.sleep(0.05)
        self.memory[-1].append(resident(self.daemon.process.pid))
        self.files[-1].append(descriptors(self.daemon.process.pid))

    def run(self):
        for life in range(self.lives):
            for turn in range(ROUNDS):
                self.round(restarts=life > 0 and turn == 0)
                self.measure()
            self.report(f"life {life + 1}, {sum(self.codes.values())} requests: {self.memory[-1][-1] / 2**20:.1f} MiB, "
                        f"{self.files[-1][-1]} descriptors, {max(self.growth(life)[0], 0) / 2**20:.1f} MiB more than after warming up")

    def growth(self, life):
        """Bytes and descriptors in the last three rounds beyond the most in the first four, while caches fill."""
        memory, files = self.memory[life], self.files[life]
        return sorted(memory[-3:])[1] - max(memory[:4]), max(files[-3:]) - max(files[:4])

    def typical_growth(self):
        """The medians over the lives."""
        return [sorted(of)[(self.lives - 1) // 2] for of in zip(*(self.growth(life) for life in range(self.lives)))]

    def growth_over_lives(self):
        """The same from the first third of the lives to the last one."""
        memory, files = ([sorted(life[-3:])[1] for life in what] for what in (self.memory, self.files))
        first = (self.lives + 2) // 3
        return memory[-1] - max(memory[:first]), files[-1] - max(files[:first])

    def is_flat(self):
        """What leaks grows in every life. One may take some more for its caches and for connections to the database, but the
        last life no more than the first ones."""
        memory, files = self.typical_growth()
        more, opened = self.growth_over_lives()
        return memory < GROWTH and more < DIFFERENCE and max(opened, files) <= OPENED

    def unmet(self):
        """What no client asked, and each of them if none was checked after a restart."""
        asked = {what for what, _ in self.codes} if self.checked or self.lives == 1 else set()
        return {ask.__name__ for _, ask, _ in asker.MIX} - asked

    def lost(self):
        """How many acknowledged jobs the database does not have, or twice; to be called when the daemon has ended."""
        jobs = job_counts(self.daemon.data)
        return sum(jobs[job] != 1 for job in self.acknowledged), sum(count > 1 for count in jobs.values())


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", default=program.build)
    parser.add_argument("--requests", type=int, default=1000000)
    parser.add_argument("--clients", type=int, default=8)
    parser.add_argument("--restarts", type=int, default=10)
    arguments = parser.parse_args()
    program.build = os.path.abspath(arguments.build)
    with tempfile.TemporaryDirectory(prefix="impactd-") as folder:
        with program.daemon("--cache-bytes", str(CACHE), data=folder) as daemon:
            begin = time.monotonic()
            storm = Storm(daemon, arguments.requests, arguments.clients, arguments.restarts,
                          report=lambda text: print(text, flush=True))
            storm.run()
            took = time.monotonic() - begin
        lost, doubled = storm.lost()
    within, later = storm.typical_growth(), storm.growth_over_lives()
    for (what, code), count in sorted(storm.codes.items(), key=str):
        print(f"{what:10} {code}  {count}")
    print(f"{sum(storm.codes.values())} requests in {took:.0f} s, {storm.victims} clients killed, {arguments.restarts} restarts; "
          f"{len(storm.acknowledged)} jobs acknowledged, {storm.checked} checked after restarts: {lost} lost, {doubled} duplicated; "
          f"{within[0] / 2**20:.1f} MiB and {within[1]} descriptors more within a life (median), {later[0] / 2**20:.1f} MiB and {later[1]} from life to life")
    return 0 if storm.is_flat() and not lost and not doubled and not storm.unmet() else 1


if __name__ == "__main__":
    sys.exit(main())
