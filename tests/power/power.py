#!/usr/bin/env python3
"""Power failures: whatever a daemon acknowledged is there, with the same bytes, at every state that its disk can be in.

    tests/power/power.py --build build [--states 1000] [--scenes 60] [--daemons 100] [--seed 1]

Records what a daemon writes and syncs while clients submit jobs, sweeps, materials, records and tokens (recording.py),
builds the disk's state at chosen moments, without what was not synced or with parts of it (disk_states.py), and checks
each: `impactd check-db`, SQLite's integrity check, the rows of all that was acknowledged, no job but those submitted. On a
part of them a daemon is started: it serves what was acknowledged, and every job ends, once. During a restore the database
is the previous or the restored one. contract/test_power.py is the short version.
"""
import argparse
import collections
import os
import random
import shutil
import sqlite3
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import disk_states  # noqa: E402
import recording  # noqa: E402
from recording import program  # noqa: E402

NEAR = 6  # records around a change of the database's file itself, where half of the failures are


def choose(records, ends, restoring, count, chance):
    """Moments, each the number of records before it: a tenth in the restore, half of the others anywhere, half around checkpoints,
    truncations and changes of names."""
    rare, is_log = [], {}
    for number, (_, kind, inode, _, data) in enumerate(records):
        if kind == disk_states.MADE:
            is_log[inode] = data.endswith(b"-wal")
        if kind not in (disk_states.WROTE, disk_states.SYNCED) or not is_log[inode]:
            rare.append(number)
    begin, end = restoring
    inside = [number + 1 for number, place in enumerate(ends) if begin <= place < end]
    chosen = [chance.choice(inside) for _ in range(count // 10)]
    chosen += [chance.randint(0, len(records)) for _ in range((count - len(chosen)) // 2)]
    while len(chosen) < count:
        chosen.append(min(len(records), max(0, chance.choice(rare) + chance.randint(-NEAR, NEAR))))
    return sorted(chosen)


def check_rows(folder, acknowledged, place):
    """Compares the database with what was acknowledged before the place; the ids of its jobs."""
    connection = sqlite3.connect(os.path.join(folder, "impactd.db"))
    try:
        assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        for one in acknowledged:
            if one.what != "GET" and one.holds(place):
                found = recording.rows(connection, one.what, one.key)
                assert found == one.value, f"lost: {one.key}: {one.what}: {str(found)[:200]} in place of {str(one.value)[:200]}"
        return [row[0] for row in connection.execute("SELECT id FROM jobs")]
    finally:
        connection.close()


def check_daemon(folder, recorded, place, jobs):
    """A daemon on the state serves what was acknowledged; its jobs all end."""
    headers = {"Authorization": f"Bearer {recorded.token}"}
    with program.daemon(*recording.OPTIONS, data=folder) as daemon:
        served = 0
        for one in recorded.acknowledged:
            if one.what == "GET" and one.holds(place):
                reply = daemon.get(one.key, headers=headers)
                assert (reply.status, reply.headers.get("etag"), reply.body) == one.value, (one.key, reply, one.value)
                served += 1
        for job in jobs:
            ended = daemon.get(f"/v1/jobs/{job}?wait=60", headers=headers, timeout=90).json()
            assert ended["status"] == "successful", f"hangs or failed: {ended}"
    connection = sqlite3.connect(os.path.join(folder, "impactd.db"))
    after = [row[0] for row in connection.execute("SELECT id FROM jobs")]
    connection.close()
    assert sorted(after) == sorted(jobs), "a job was lost or doubled at the start"
    return served


def check_state(folder, recorded, place, with_daemon, counts):
    expected = [one for one in recorded.acknowledged if one.holds(place)]
    done = subprocess.run([program.impactd(), "check-db", "--data", folder], capture_output=True, text=True, timeout=60, check=False)
    if done.returncode == 4 and not expected:  # nothing was made yet
        counts["empty"] += 1
        with program.daemon(data=folder):
            return
    assert done.returncode == 0, (done.returncode, done.stdout[-500:], done.stderr)
    jobs = check_rows(folder, expected, place)
    # A request on its way may have made a job, each one; after all answers were given there are only those answered.
    assert len(jobs) <= recorded.posted and len(set(jobs)) == len(jobs), jobs
    begin, end, present, restored = recorded.restoring
    if begin <= place < end:  # neither is acknowledged: one of the two is there, whole
        counts["restoring"] += 1
        assert sorted(jobs) in (present, restored), "a part of a restored database"
    counts["rows"] += len(expected)
    if with_daemon:
        counts["daemons"] += 1
        counts["served"] += check_daemon(folder, recorded, place, jobs)


def fail_and_check(recorded, count, daemons, seed, quietly):
    """`count` states; what was found wrong, as texts, and counts of what was compared."""
    chance = random.Random(seed)
    records = disk_states.read(recorded.log)
    ends = [record[0] for record in records[1:]] + [os.path.getsize(recorded.log)]
    disk, played, faults, counts = disk_states.Disk(), 0, [], collections.Counter()
    counts["records"] = len(records)
    every = max(1, count // max(1, daemons))
    for number, moment in enumerate(choose(records, ends, recorded.restoring[:2], count, chance)):
        while played < moment:
            disk.play(records[played])
            played += 1
        mode = chance.choice(disk_states.MODES)
        folder = tempfile.mkdtemp(prefix="impactd-")
        try:
            disk.fail(folder, mode, chance)
            place = ends[moment - 1] if moment > 0 else 0
            check_state(folder, recorded, place, number % every == every - 1, counts)
        except (AssertionError, RuntimeError, sqlite3.Error, subprocess.TimeoutExpired) as fault:
            faults.append(f"state {number} after record {moment}, {mode}: {fault}")
            if not quietly:
                print(faults[-1], flush=True)
        finally:
            shutil.rmtree(folder, ignore_errors=True)
        counts[mode] += 1
    return faults, counts


def run(states, scenes, daemons, seed, quietly=False):
    """Records, then fails: (faults, counts)."""
    work = tempfile.mkdtemp(prefix="impactd-")
    try:
        folder = os.path.join(os.path.realpath(work), "data")
        os.mkdir(folder, 0o700)
        recorded = recording.record(folder, os.path.join(work, "log"), scenes, seed)
        faults, counts = fail_and_check(recorded, states, daemons, seed, quietly)
        counts["acknowledged"] = len(recorded.acknowledged)
        return faults, counts
    finally:
        shutil.rmtree(work, ignore_errors=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--build", required=True)
    parser.add_argument("--states", type=int, default=1000)
    parser.add_argument("--scenes", type=int, default=60, help="of each of three daemons")
    parser.add_argument("--daemons", type=int, default=100, help="states on which a daemon is started")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    program.build = os.path.abspath(arguments.build)
    faults, counts = run(arguments.states, arguments.scenes, arguments.daemons, arguments.seed)
    modes = ", ".join(f"{counts[mode]} {mode}" for mode in disk_states.MODES)
    print(f"{counts['records']} records, {counts['acknowledged']} acknowledgements; states: {modes}; {counts['empty']} without a database, "
          f"{counts['restoring']} during a restore")
    print(f"{arguments.states} power failures: {counts['rows']} acknowledgements compared in the database, {counts['served']} over HTTP with "
          f"{counts['daemons']} daemons; {len(faults)} states wrong")
    sys.exit(0 if not faults and counts["rows"] and counts["served"] and counts["restoring"] else 1)


if __name__ == "__main__":
    main()
