#!/usr/bin/env python3
"""A job that was accepted is finished, once, whatever happens to the daemon in between."""

import concurrent.futures
import http.client
import json
import os
import shutil
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from database import rows  # noqa: E402

NIGHTLY = True

JOBS, ROUNDS = 200, 10
RUN = 0.01  # [s] of CPU a job


def long_scene(number, duration):
    """A long scene of which only the summary is wanted, each different: its ledger would be megabytes to store."""
    scene = program.scene("paper_sine_aluminium")
    scene.update(duration=duration, output={"channels": [], "psd": None, "impacts": False})
    scene["dampers"][0]["clearance"] = 0.012 + 0.00002 * number
    return scene


def fitting_duration():
    """How long a scene takes RUN seconds here, so that 200 of them outlast their being submitted."""
    took = min(json.loads(program.run("run", "-", text=json.dumps(long_scene(0, 500)))[1])["timing"]["run"]
               for _ in range(3))
    return round(500 * RUN / took)


def submit(daemon, scene):
    reply = daemon.submit(scene, headers={"Prefer": "respond-async"})
    # It may be done before the disk has it, and both are told only then.
    assert reply.status in (200, 202), reply
    return reply.json()["id"]


def listed(daemon):
    """The ids of all jobs, page by page."""
    found, target = [], "/v1/jobs?limit=100"
    while target:
        reply = daemon.get(target)
        found += [job["id"] for job in reply.json()["jobs"]]
        link = reply.headers.get("link", "")
        target = link[link.index("<") + 1:link.index(">")] if 'rel="next"' in link else None
    return found


def one_round(number, duration, tries=3):
    """How many were unfinished at the kill, and how long scenes had to be for half of them to be."""
    folder = tempfile.mkdtemp(prefix="impactd-")
    try:
        with program.Daemon(program.build, "--workers", "2", data=folder) as daemon:
            with concurrent.futures.ThreadPoolExecutor(4) as pool:
                ids = list(pool.map(lambda i: submit(daemon, long_scene(i, duration)), range(JOBS)))
            time.sleep(0.02 * number)  # not always at the same moment
            daemon.kill()
        assert len(set(ids)) == JOBS
        before = dict(rows(folder, "SELECT id, finished_unix_ms FROM jobs WHERE state = 2"))
        unfinished = rows(folder, "SELECT count(*) FROM jobs WHERE state < 2")[0][0]
        assert len(before) + unfinished == JOBS, (len(before), unfinished)
        # A slow disk holds the answers up while the jobs are computed: then they are to take longer.
        if unfinished < JOBS / 2 and tries > 0:
            return one_round(number, 2 * duration, tries - 1)
        assert unfinished >= JOBS / 2, f"only {unfinished} of {JOBS} were unfinished"

        with program.daemon("--workers", "2", data=folder) as daemon:
            jobs = [daemon.finished(one, 120) for one in ids]
            assert [job["id"] for job in jobs] == ids
            assert all(job["status"] == "successful" for job in jobs), \
                [job for job in jobs if job["status"] != "successful"][:2]
            assert len({job["result"] for job in jobs}) == JOBS
            assert sorted(listed(daemon)) == sorted(ids), "a job was lost or doubled"
        after = dict(rows(folder, "SELECT id, finished_unix_ms FROM jobs WHERE state = 2"))
        assert len(after) == JOBS
        assert all(after[one] == finished for one, finished in before.items()), "a finished job ran again"
        assert rows(folder, "SELECT count(*), count(DISTINCT id) FROM results") == [(JOBS, JOBS)]
        return unfinished, duration
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def test_accepted_jobs_survive_a_kill():
    """kill -9 with 200 jobs accepted, at least half unfinished: afterwards all finish, none twice, none lost; 10 rounds."""
    duration = fitting_duration()
    unfinished = []
    for number in range(ROUNDS):
        count, duration = one_round(number, duration)
        unfinished.append(count)
    print(f"      unfinished at the kill: {unfinished}")


def quick_scene(number):
    scene = program.scene("paper_free_sponge")
    scene.update(duration=1, output={"channels": [], "psd": None})
    scene["dampers"][0]["clearance"] = 0.012 + 1e-6 * number
    return scene


def storm(daemon, thread, answers, stopped):
    """Submits until the daemon is gone; some new scenes, some known ones, some without waiting, some dismissed."""
    for number in range(100000):
        kind = number % 4
        scene = quick_scene(thread if kind == 3 else 1000 * (thread + 1) + number)
        if kind == 2:
            scene = long_scene(number + 0.1 * thread, 3000)
        try:
            reply = daemon.submit(scene, headers={"Prefer": "respond-async" if kind in (1, 2) else "wait=0.05"})
            answers.append((reply.status, reply.json()))
            if kind == 2 and number % 8 == 2:
                gone = daemon.request("DELETE", f"/v1/jobs/{answers[-1][1]['id']}")
                answers.append((gone.status, gone.json()))
        except (OSError, http.client.HTTPException, ValueError):
            assert stopped.is_set(), "the daemon was gone before it was killed"
            return


def test_what_was_answered_is_in_the_database_at_the_kill():
    """kill -9 amid a storm of quick, long, known and dismissed jobs: whatever an answer said is there afterwards."""
    told = {}
    for number in range(5):
        folder = tempfile.mkdtemp(prefix="impactd-")
        try:
            with program.Daemon(program.build, "--workers", "2", data=folder) as daemon:
                answers, stopped = [[] for _ in range(6)], threading.Event()
                with concurrent.futures.ThreadPoolExecutor(6) as pool:
                    storms = [pool.submit(storm, daemon, i, answers[i], stopped) for i in range(6)]
                    time.sleep(0.3 + 0.1 * number)
                    stopped.set()
                    daemon.kill()
                    [one.result() for one in storms]
            replies = [one for some in answers for one in some]
            assert {status for status, _ in replies} <= {200, 202, 409}, replies[-1]
            before = dict(rows(folder, "SELECT id, state FROM jobs"))
            states = {"successful": 2, "dismissed": 4}
            with program.daemon("--workers", "2", data=folder) as daemon:
                for status, job in replies:
                    if status == 409:
                        continue
                    told[job["status"], job.get("cached")] = told.get((job["status"], job.get("cached")), 0) + 1
                    if job["status"] in states and not job["cached"]:
                        assert before[job["id"]] == states[job["status"]], (status, job, before[job["id"]])
                    now = daemon.finished(job["id"], 120)
                    if job["status"] in states:
                        assert now["status"] == job["status"] and now["created"] == job["created"], (job, now)
            both = rows(folder, "SELECT count(*), count(DISTINCT id) FROM jobs")[0]
            assert both[0] == both[1], both
        finally:
            shutil.rmtree(folder, ignore_errors=True)
    print(f"      told before the kills: {told}")
    assert all(any(key[0] == state for key in told) for state in ("successful", "dismissed")), told


if __name__ == "__main__":
    program.main(globals())
