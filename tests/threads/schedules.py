#!/usr/bin/env python3
"""Random schedules of the daemon's threads: jobs, cancels, deletions, sweeps, SIGHUP, a full cache, ends and new starts.

    tests/threads/schedules.py --build build [--schedules 10000] [--seed 1] [--free] [--faults]

A preloaded library (schedule.c) runs one thread at a time, by priorities that a seed decides. Under each seed three clients
act at once on the same few scenes. Every 20th schedule the daemon ends in the middle of that, by SIGTERM or SIGKILL, and starts
again with its data. --free: the threads run as they will, for the thread sanitizer. --faults: an allocation or a file call
of each schedule fails (tests/faults/interpose.c). The suite runs a few schedules (tests/contract/test_schedules.py)."""
import argparse
import collections
import contextlib
import ctypes
import mmap
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor

HERE = os.path.dirname(os.path.abspath(__file__))
for beside in ("support", "faults", "threads"):
    sys.path.insert(0, os.path.join(HERE, "..", beside))
import control  # noqa: E402
import program  # noqa: E402
from actor import Actor, Ended, References  # noqa: E402
from database import job_counts  # noqa: E402

CLIENTS = 3
PER_LIFE = 20  # schedules of one life of the daemon; it ends in the last of them
PER_FOLDER = 10  # lives with the same data
TIMEOUT = 120  # [s] until a daemon that does not end has hung
TLS = "--tls-cert {} --tls-key {}"
OPTIONS = ("--workers", "2", "--rate", "0", "--journal", "off")
CACHES = ("8192", "65536")  # [B], both soon full
FAULTS = [(control.ALLOCATIONS, 0), *control.KINDS.values()]


class Fields(ctypes.Structure):
    _fields_ = [(name, ctypes.c_uint64) for name in ("seed", "switches", "digest")]


class Scheduler:
    """The control file of schedule.c, and the environment that a daemon is to be started with."""

    def __init__(self, seed):
        self.file = tempfile.NamedTemporaryFile(prefix="impactd-schedule-")
        self.file.truncate(mmap.PAGESIZE)
        self.fields = Fields.from_buffer(mmap.mmap(self.file.fileno(), mmap.PAGESIZE))
        self.fields.seed = seed
        library = os.path.join(program.build, "tests", "libschedule.so")
        self.environment = {"LD_PRELOAD": library, "IMPACTD_SCHEDULE": self.file.name}


class Campaign:
    def __init__(self, seed=1, is_free=False, has_faults=False, mix="all"):
        self.mix, self.seed, self.is_free, self.has_faults = mix, seed, is_free, has_faults
        self.outcomes, self.answers = collections.Counter(), collections.Counter()
        self.wrong, self.orders, self.switches = [], set(), 0
        self.references = References(OPTIONS)

    def fault(self, kind, text):
        self.outcomes[kind] += 1
        self.wrong.append(text)
        print(f"  {kind}: {text}"[:5000], flush=True)

    def run(self, schedules):
        """Runs schedules until there were as many, or ten are wrong."""
        done = 0
        while done < schedules and len(self.wrong) < 10:
            with tempfile.TemporaryDirectory(prefix="impactd-") as folder:
                with contextlib.suppress(Ended):
                    done = self.folder(folder, done, schedules)
            if done % 1000 == 0:
                print(f"{done} schedules, {len(self.wrong)} faults", flush=True)
        self.outcomes["schedules"] = done

    def folder(self, folder, done, schedules):
        """Some lives of daemons with the same data; afterwards what was acknowledged is in the database, once."""
        self.jobs, self.revisions, self.purged = {}, [], []
        # Every second folder is served with TLS, so that SIGHUP has something to read.
        tls = TLS.format(*program.certificate(folder)).split() if (done // PER_LIFE // PER_FOLDER) % 2 == 1 or schedules < PER_LIFE * PER_FOLDER else ()
        data = os.path.join(folder, "data")
        for _ in range(PER_FOLDER):
            if done >= schedules or len(self.wrong) >= 10:
                break
            done = self.life(data, tls, done, min(done + PER_LIFE, schedules))
        with program.Daemon(program.build, *OPTIONS, data=data) as daemon:
            for job in self.jobs.values():
                self.settle(Actor(self, daemon, 0), job)
        ids = job_counts(data)
        for job in self.jobs:
            if ids[job] != 1:
                self.fault("duplicated" if ids[job] else "lost", f"{job} is {ids[job]} times in the database")
        if any(ids[job] for job in self.purged):
            self.fault("wrong", "a job that was removed is there again")
        if len(set(self.revisions)) != len(self.revisions):
            self.fault("duplicated", f"revisions {self.revisions}")
        self.outcomes["jobs"] += len(self.jobs)
        return done

    def life(self, data, tls, done, last):
        scheduler, faults = Scheduler(self.seed + done), control.Control(data)
        environment = faults.environment if self.has_faults else {} if self.is_free else scheduler.environment
        daemon = program.Daemon(program.build, *OPTIONS, *tls, "--cache-bytes", CACHES[done // PER_LIFE % 2], data=data, environment=environment)
        try:
            daemon.start(60)
            self.actors = [Actor(self, daemon, index) for index in range(CLIENTS)]
            # Jobs of the life before: they are there, and go on.
            for job in [job for job in self.jobs.values() if not job.is_settled]:
                self.settle(self.actors[0], job)
            for number in range(done, last):
                self.schedule(daemon, scheduler, faults, number, number == last - 1)
        finally:
            daemon.kill()
        return last

    def schedule(self, daemon, scheduler, faults, number, is_last):
        seed = self.seed + number
        chance = random.Random(seed)
        scheduler.fields.digest = scheduler.fields.switches = 0
        scheduler.fields.seed = seed
        if self.has_faults:
            calls, error = chance.choice(FAULTS)
            faults.arm(chance.randrange(1, 2000 if calls == control.ALLOCATIONS else 100), calls, error)
        end = None
        if is_last:
            end = threading.Thread(target=self.end, args=(daemon, chance.random() * 0.1, chance.random() < 0.75))
            end.start()
        scenes = self.references.draw(chance) if self.mix == "all" else 3 * [self.references.scenes[-1]]
        with ThreadPoolExecutor(CLIENTS) as pool:
            ran = [pool.submit(actor.act, seed, scenes) for actor in self.actors]
        if self.has_faults:
            self.outcomes["faults"] += faults.disarm()[1] > 0
        if end is not None:
            end.join()
        for one in ran:
            if (reason := one.exception()) is not None and not (is_last and isinstance(reason, Ended)):
                self.fault("hung" if isinstance(reason, TimeoutError) else "wrong", f"schedule {seed}: {reason!r}")
        if not is_last and not daemon.is_alive():
            self.fault("crashed", f"schedule {seed}: ended with {daemon.process.poll()}: {daemon.stderr()[-2000:]}")
            raise Ended
        if not is_last:
            self.check(seed)
        self.orders.add(scheduler.fields.digest)
        self.switches += scheduler.fields.switches

    def check(self, seed):
        for job in [job for job in self.jobs.values() if not job.is_settled]:
            self.settle(self.actors[0], job)
        try:
            self.actors[0].verify()
        except Exception as reason:  # noqa: BLE001 - whatever it was, it is counted
            self.fault("hung" if isinstance(reason, TimeoutError) else "wrong", f"after schedule {seed}: {reason!r}")

    def end(self, daemon, after, is_soft):
        """The daemon ends amid requests, with 0 if it was asked to."""
        time.sleep(after)
        for actor in self.actors:
            actor.is_ending = True
        daemon.process.send_signal(signal.SIGTERM if is_soft else signal.SIGKILL)
        try:
            code = daemon.process.wait(TIMEOUT)
        except subprocess.TimeoutExpired:
            self.fault("hung", f"does not end: {daemon.stderr()[-1000:]}")
            return
        errors = daemon.stderr()
        if code != (0 if is_soft else -signal.SIGKILL) or program.sanitizer_report(errors):
            self.fault("crashed", f"ended with {code}: {(program.sanitizer_report(errors) or errors)[:5000]}")
        self.outcomes["ended" if is_soft else "killed"] += 1

    def settle(self, actor, job):
        """The end of a job is the one that was acknowledged."""
        try:
            actor.settle(job)
        except Exception as reason:  # noqa: BLE001 - whatever it was, it is counted
            kind = "lost" if isinstance(reason, LookupError) else "hung" if isinstance(reason, TimeoutError) else "wrong"
            self.fault(kind, f"{job}: {reason!r}")
        job.is_settled = True

    def is_good(self):
        """Nothing is wrong, and what schedules differ by did happen: orders of threads, or faults."""
        happened = self.outcomes["faults"] if self.has_faults else len(self.orders)
        return not self.wrong and (self.is_free or happened * 2 > self.outcomes["schedules"] > 0)

    def summary(self, took):
        count = self.outcomes
        how = f"{self.switches} changes of threads in {len(self.orders)} orders, " if not self.is_free and not self.has_faults else ""
        faults = f"{count['faults']} faults, " if self.has_faults else ""
        return (f"{count['schedules']} schedules in {took:.0f} s: {how}{faults}{sum(self.answers.values())} actions, {count['jobs']} jobs, "
                f"{count['ended']} SIGTERM, {count['killed']} SIGKILL; "
                + ", ".join(f"{count[what]} {what}" for what in ("lost", "duplicated", "wrong", "crashed", "hung")))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", default=program.build)
    parser.add_argument("--schedules", type=int, default=10000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--free", action="store_true")
    parser.add_argument("--faults", action="store_true")
    parser.add_argument("--mix", choices=["all", "tables"], default="all", help="of actions")
    arguments = parser.parse_args()
    program.build = os.path.abspath(arguments.build)
    begin = time.monotonic()
    campaign = Campaign(arguments.seed, arguments.free, arguments.faults, arguments.mix)
    campaign.run(arguments.schedules)
    for (what, code), count in sorted(campaign.answers.items()):
        print(f"{what:10} {code}  {count}")
    print(campaign.summary(time.monotonic() - begin))
    return 0 if campaign.is_good() else 1


if __name__ == "__main__":
    sys.exit(main())
