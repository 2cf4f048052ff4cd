#!/usr/bin/env python3
"""A full disk: writes are answered 507, reads go on, and all goes on without a restart when there is room."""

import os
import sqlite3
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from disk import fill, small_disk  # noqa: E402
from program import until  # noqa: E402

ASYNC = {"Prefer": "respond-async"}


def scene(number, psd=True):
    """A scene whose spectrum alone takes some 100 KB."""
    made = program.scene("paper_free_sponge")
    made["dampers"][0]["clearance"] = 0.01 + 1e-6 * number
    made["output"] = {"channels": ["displacement"], "psd": {"channels": ["displacement"], "segment": 8192}
                      if psd else None}
    return made


def long_scene(number, duration):
    made = program.scene("paper_sine_aluminium")
    made.update(duration=duration, sample_rate=100, output={"channels": [], "psd": None, "reduction": False},
                accuracy={"solver": "rk4", "step": 1e-5})
    made["dampers"][0]["clearance"] = 0.012 + 1e-6 * number
    return made


def test_a_full_disk_stops_writes_alone():
    """POST 507 naming the folder and what is free; GET 200; with room again all as before, without a restart."""
    with small_disk() as folder:
        with program.daemon("--workers", "2", data=folder) as daemon:
            before = daemon.submit(scene(0)).json()
            endless = daemon.submit(long_scene(0, 2000), headers=ASYNC).json()
            shake = {"name": "shake", "interval": 0.02, "samples": [0, 1, -2, 2, -1]}
            assert daemon.request("POST", "/v1/records", json=shake).status == 201
            ballast = fill(folder)
            refused = None
            for number in range(1, 400):
                reply = daemon.submit(scene(number))
                if reply.status != 200:
                    refused = reply
                    break
            assert refused is not None and refused.status == 507, refused
            problem = refused.json()
            assert problem["type"] == "/problems/no-room", problem
            assert folder in problem["detail"] and "bytes are free" in problem["detail"], problem
            assert daemon.get("/health/live").status == 200
            ready = daemon.get("/health/ready")
            assert ready.status == 503 and "database" in ready.json()["detail"], ready
            for path in (f"/v1/results/{before['result']}", f"/v1/jobs/{endless['id']}", "/v1/records/shake"):
                assert daemon.request("DELETE", path).status == 507, path
            assert daemon.request("PATCH", f"/v1/jobs/{before['id']}", json={"title": "x"}).status == 507
            assert daemon.request("POST", "/v1/records", json={**shake, "name": "more"}).status == 507
            felt = {"name": "Felt", "restitution": 0.3, "source": "here", "comment": "x"}
            for path, body in (("", {"slug": "felt", **felt}), ("/sponge/revisions", felt), ("/sponge/revert", {"to": 1, "comment": "x"}),
                               ("/sponge@1/review", {"status": "deprecated", "reason": "x"}),
                               ("/sponge/measurements", {"drops": [{"contact_time": 0.001}]})):
                assert daemon.request("POST", "/v1/materials" + path, json=body, headers={"If-Match": "*"}).status == 507, path
            table = "slug,name,source,restitution\n" + "".join(f"m{i},M,s,0.5\n" for i in range(2000))
            assert daemon.request("POST", "/v1/materials/import", body=table, headers={"Content-Type": "text/csv"}).status == 507
            assert len(daemon.get("/v1/materials.json").json()["materials"]) == 5
            assert daemon.get("/v1/materials/sponge/history").json()["version"] == 2
            for path in (f"/v1/jobs/{before['id']}", "/v1/jobs", f"/v1/results/{before['result']}",
                         f"/v1/results/{before['result']}/series.npy", f"/v1/results/{before['result']}/psd.json",
                         "/health/live", "/v1/records/shake", "/v1/records/shake/samples.csv"):
                assert daemon.get(path).status == 200, path
            os.remove(ballast)
            assert until(lambda: daemon.get("/health/ready").status == 200), "not ready again"
            assert until(lambda: daemon.submit(scene(1000)).status == 200), "no recovery"
            assert daemon.get(f"/v1/jobs/{before['id']}").json()["status"] == "successful"


def test_jobs_under_way_wait_for_room():
    """Jobs whose results cannot be stored go on when there is room; none is lost, none is told to have finished before."""
    with small_disk() as folder:
        with program.daemon("--workers", "2", data=folder) as daemon:
            jobs = [daemon.submit(long_scene(i, 10), headers=ASYNC).json()["id"] for i in range(6)]
            ballast = fill(folder)
            # The journal has room for some; it is filled with what is refused in the end.
            for number in range(1, 400):
                if daemon.submit(scene(number)).status == 507:
                    break
            time.sleep(3)
            states = [daemon.get(f"/v1/jobs/{job}").json()["status"] for job in jobs]
            assert "failed" not in states, states
            os.remove(ballast)
            done = [daemon.finished(job, 90) for job in jobs]
            assert {job["status"] for job in done} == {"successful"}, done
            for job in done:
                assert daemon.get(f"/v1/results/{job['result']}").status == 200
        with program.daemon(data=folder) as daemon:
            assert {daemon.get(f"/v1/jobs/{job}").json()["status"] for job in jobs} == {"successful"}


def test_a_full_disk_at_the_start_is_told():
    """A daemon that cannot write at its start says so, or starts and refuses; it neither hangs nor crashes."""
    with small_disk() as folder:
        fill(folder)
        code, _, errors = program.run("serve", "--listen", "127.0.0.1:0", "--data", folder)
        assert code not in (0, -6, -11) and "room" in errors or "full" in errors, (code, errors)


def test_a_journal_that_nobody_reads_holds_up_no_worker():
    """What cannot be saved is told where there is room for it; all else goes on without a reader."""
    with program.full_pipe() as (_, full), program.daemon("--workers", "1", errors=full) as daemon:
        job = daemon.submit(long_scene(0, 10), headers=ASYNC).json()["id"]
        file = os.path.join(daemon.data, "impactd.db")
        os.rename(file, file + ".away")
        assert until(lambda: daemon.get(f"/v1/jobs/{job}").json()["progress"] >= 90), "it does not run"
        time.sleep(1)  # it cannot be saved
        os.rename(file + ".away", file)
        assert daemon.submit(scene(1)).json()["status"] == "successful"
        assert daemon.finished(job, 90)["status"] == "successful"


def test_a_database_that_was_moved_away_takes_no_jobs():
    """Nothing is promised that only an unlinked file would hold, of the database, its log or the index of it; put back, it is written to again."""
    with program.daemon() as daemon:
        known = [daemon.submit(scene(0)).json()]
        for number, name in enumerate(("impactd.db", "impactd.db-wal", "impactd.db-shm")):
            file = os.path.join(daemon.data, name)
            os.rename(file, file + ".away")
            refused = daemon.submit(scene(2 * number + 1))
            assert refused.status == 500 and f"{file} was deleted, moved or replaced" in refused.json()["detail"], (name, refused)
            assert daemon.get(known[-1]["links"]["self"]).status == 200
            os.rename(file + ".away", file)
            known.append(daemon.submit(scene(2 * number + 2)).json())
            assert known[-1]["status"] == "successful", known
        daemon.kill()
        daemon.start()
        for job in known:
            assert daemon.get(job["links"]["self"]).status == 200, job


def test_a_result_that_the_database_refuses_makes_failed_jobs():
    """Refused for good, as what is too large is: all jobs of the scene fail with the reason, and the daemon goes on; later the
    same scene runs."""
    with program.daemon() as daemon:
        long = long_scene(0, 8)
        jobs = [daemon.submit({**long, "title": title}, headers=ASYNC).json()["id"] for title in ("one", "two")]
        base = sqlite3.connect(os.path.join(daemon.data, "impactd.db"), timeout=20)
        base.executescript("CREATE TRIGGER refuses BEFORE INSERT ON results BEGIN SELECT RAISE(ABORT, 'refused by a trigger'); END")
        for job in jobs:
            ended = daemon.finished(job)
            assert ended["status"] == "failed" and "refused by a trigger" in ended["problem"]["detail"], ended
        reply = daemon.submit(scene(1), wait=30)
        assert reply.status in (200, 202, 409) and "refused by a trigger" in reply.body.decode(), reply
        base.executescript("DROP TRIGGER refuses")
        base.close()
        assert daemon.submit(scene(1), wait=30).json()["status"] == "successful"
        assert program.finished(daemon, {**long, "title": "three"})["status"] == "successful"


if __name__ == "__main__":
    program.main(globals())
