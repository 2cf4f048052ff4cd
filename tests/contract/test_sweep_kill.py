#!/usr/bin/env python3
"""kill -9 in the middle of a sweep, and a disk that is full for a while: no row lost, none twice, the same bytes."""

import os
import random
import shutil
import sqlite3
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

POINTS, KILLS = 6000, 6
DURATION = 12  # of a scene [s]: the sweep is some seconds of CPU, in a dozen chunks or more


def scene(duration):
    return {**program.scene("paper_random_sponge"), "duration": duration, "sample_rate": 500,
            "study": {"kind": "sweep", "axes": [
                {"pointer": "/dampers/0/buffer", "values": ["sponge", "hard_rubber", "aluminium"]},
                {"pointer": "/dampers/0/clearance", "from": 0.005, "to": 0.03, "count": POINTS // 3}]}}


def stored(folder):
    """(chunks written down, chunks there, chunks twice) as the killed daemon left them."""
    with tempfile.TemporaryDirectory() as copy:
        for name in os.listdir(folder):
            if name.startswith("impactd.db"):
                shutil.copy(os.path.join(folder, name), copy)
        connection = sqlite3.connect(os.path.join(copy, "impactd.db"))
        try:
            wanted = connection.execute("SELECT chunks FROM sweeps").fetchall()
            there = connection.execute("SELECT count(*), count(DISTINCT chunk) FROM sweep_chunks").fetchone()
            return (wanted[0][0] if wanted else None), there[0], there[0] - there[1]
        finally:
            connection.close()


def tables(daemon, job):
    """What the finished sweep is, in bytes."""
    assert job["status"] == "successful", job
    return [daemon.get(f"/v1/results/{job['result']}/table.{kind}").body for kind in ("json", "csv")]


def test_a_sweep_survives_being_killed_again_and_again():
    """Killed at random times, when some rows had come: the table is to the byte that of a run that nobody disturbed."""
    asked = scene(DURATION)
    with program.daemon("--workers", "2") as daemon:
        whole = daemon.finished(daemon.submit(asked, headers={"Prefer": "respond-async"}).json()["id"], 300)
        undisturbed = tables(daemon, whole)
        assert daemon.get(f"/v1/results/{whole['result']}/table.json").json()["done"] == POINTS
    folder, kept = tempfile.mkdtemp(prefix="impactd-"), []
    chance = random.Random(7)
    try:
        job = None
        for _ in range(KILLS):
            with program.Daemon(program.build, "--workers", "2", data=folder) as daemon:
                if job is None:
                    job = daemon.submit(asked, headers={"Prefer": "respond-async"}).json()["id"]
                before, end = (done if kept else 0), time.monotonic() + 60
                while time.monotonic() < end:
                    done = daemon.get(f"/v1/jobs/{job}/table.json").json()["done"]
                    if done > before or done == POINTS:
                        break
                    time.sleep(0.01)
                time.sleep(chance.uniform(0, 0.6))
                daemon.kill()
            wanted, there, twice = stored(folder)
            assert twice == 0 and (not kept or there >= kept[-1]), (kept, there, twice)
            kept.append(there)
        with program.daemon("--workers", "2", data=folder) as daemon:
            assert tables(daemon, daemon.finished(job, 300)) == undisturbed
        wanted, there, twice = stored(folder)
        assert there == wanted and twice == 0
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    print(f"      of {wanted} chunks there were at each kill: {kept}")
    assert kept[0] < wanted and len(set(kept)) > 2, "the kills did not fall into the sweep"


def test_a_full_disk_pauses_a_sweep_until_there_is_room():
    """Rows that cannot be written wait; when there is room again the sweep goes on, without a restart, to the same end."""
    asked = scene(DURATION / 3)
    with program.daemon("--workers", "2") as daemon:
        whole = daemon.finished(daemon.submit(asked, headers={"Prefer": "respond-async"}).json()["id"], 300)
        undisturbed = tables(daemon, whole)
    folder = tempfile.mkdtemp(prefix="impactd-")
    mounted = os.system(f"mount -t tmpfs -o size=16m tmpfs {folder} 2>/dev/null") == 0
    try:
        if not mounted:
            raise program.Skipped("no tmpfs can be mounted here")
        with program.Daemon(program.build, "--workers", "2", data=folder) as daemon:
            job = daemon.submit(asked, headers={"Prefer": "respond-async"}).json()["id"]
            while daemon.get(f"/v1/jobs/{job}").json().get("points") is None:
                time.sleep(0.02)
            ballast = os.path.join(folder, "ballast")
            try:
                with open(ballast, "wb", buffering=0) as file:
                    while True:
                        file.write(b"\0" * 4096)
            except OSError:
                pass
            end = time.monotonic() + 60
            while "pauses" not in daemon.stderr() and time.monotonic() < end:
                time.sleep(0.1)
            assert "pauses" in daemon.stderr(), "the disk was never full to the sweep"
            assert daemon.get(f"/v1/jobs/{job}").json()["status"] == "running"
            os.remove(ballast)
            assert tables(daemon, daemon.finished(job, 300)) == undisturbed
    finally:
        if mounted:
            os.system(f"umount {folder}")
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    program.main(globals())
