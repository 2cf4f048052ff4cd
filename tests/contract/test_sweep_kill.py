#!/usr/bin/env python3
"""kill -9 in the middle of a sweep, and a disk that is full for a while: no row lost, none twice, the same bytes."""

import os
import random
import shutil
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from database import rows  # noqa: E402
from disk import fill, small_disk  # noqa: E402
from program import until  # noqa: E402

POINTS, KILLS = 6000, 6
DURATION = 30  # of a scene [s]: the sweep is some seconds of CPU, in a dozen chunks or more


def scene(duration):
    return {**program.scene("paper_random_sponge"), "duration": duration, "sample_rate": 500,
            "study": {"kind": "sweep", "axes": [
                {"pointer": "/dampers/0/buffer", "values": ["sponge", "hard_rubber", "aluminium"]},
                {"pointer": "/dampers/0/clearance", "from": 0.005, "to": 0.03, "count": POINTS // 3}]}}


def stored(folder):
    """(chunks written down, chunks there, chunks twice) as the killed daemon left them."""
    wanted = rows(folder, "SELECT chunks FROM sweeps")
    (there, distinct), = rows(folder, "SELECT count(*), count(DISTINCT chunk) FROM sweep_chunks")
    return (wanted[0][0] if wanted else None), there, there - distinct


def tables(daemon, job):
    """What the finished sweep is, in bytes."""
    assert job["status"] == "successful", job
    return [daemon.get(f"/v1/results/{job['result']}/table.{kind}").body for kind in ("json", "csv")]


def test_a_sweep_survives_being_killed_again_and_again():
    """Killed at random times, when some rows had come: the table is to the byte that of a run that nobody disturbed."""
    asked = scene(DURATION)
    with program.daemon("--workers", "2") as daemon:
        whole = daemon.finished(daemon.submit(asked, headers={"Prefer": "respond-async"}).json()["id"], 300)
        longest = min(0.6, whole["timing"]["run"] / (2 * KILLS))  # so that the kills fall into the sweep
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
                time.sleep(chance.uniform(0, longest))
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
        longest = min(0.6, whole["timing"]["run"] / (2 * KILLS))  # so that the kills fall into the sweep
        undisturbed = tables(daemon, whole)
    with small_disk() as folder, program.Daemon(program.build, "--workers", "2", data=folder) as daemon:
        job = daemon.submit(asked, headers={"Prefer": "respond-async"}).json()["id"]
        while daemon.get(f"/v1/jobs/{job}").json().get("points") is None:
            time.sleep(0.02)
        ballast = fill(folder)
        assert until(lambda: "pauses" in daemon.stderr()), "the disk was never full to the sweep"
        assert daemon.get(f"/v1/jobs/{job}").json()["status"] == "running"
        os.remove(ballast)
        assert tables(daemon, daemon.finished(job, 300)) == undisturbed


def test_a_sweep_that_cannot_be_written_down_begins_when_there_is_room():
    """The disk is full when its turn comes: it waits, and is neither failed nor lost."""
    # Many values, more than a disk that is full but for a page or two takes; too long for the spare worker.
    asked = {**program.scene("paper_random_sponge"), "duration": 20, "study": {"kind": "sweep", "axes": [
        {"pointer": "/dampers/0/clearance", "values": [0.01 + 1e-6 * (i + 1 / 3) for i in range(2000)]}]}}
    before = {**program.scene("paper_sine_aluminium"), "duration": 2000, "sample_rate": 100,
              "output": {"channels": [], "psd": None, "reduction": False}, "accuracy": {"solver": "rk4", "step": 1e-5}}
    with program.daemon() as daemon:
        undisturbed = tables(daemon, daemon.finished(daemon.submit(asked).json()["id"]))
    with small_disk() as folder, program.Daemon(program.build, "--workers", "1", data=folder) as daemon:
        first = daemon.submit(before, headers={"Prefer": "respond-async"}).json()["id"]
        job = daemon.submit(asked, headers={"Prefer": "respond-async"}).json()["id"]
        ballast = fill(folder)
        for number in range(400):  # what the journal of the database has room for
            small = {**program.scene("paper_free_sponge"), "duration": 1 + 1e-3 * number}
            if daemon.submit(small, headers={"Prefer": "respond-async"}).status == 507:
                break
        document = {}

        def is_at_it():
            document.update(daemon.get(f"/v1/jobs/{job}").json())
            return document["status"] != "accepted" and document["progress"] > 13  # judged
        assert daemon.get(f"/v1/jobs/{job}").json()["status"] == "accepted", "it began before the disk was full"
        daemon.request("DELETE", f"/v1/jobs/{first}")  # which makes way, though that cannot be written down
        assert until(is_at_it), document
        time.sleep(1)
        document.update(daemon.get(f"/v1/jobs/{job}").json())
        assert document["status"] == "running" and document.get("points") is None, document
        os.remove(ballast)
        assert tables(daemon, daemon.finished(job, 300)) == undisturbed
        assert daemon.finished(first, 300)["status"] == "dismissed"


if __name__ == "__main__":
    program.main(globals())
