#!/usr/bin/env python3
"""What is known is answered from where it is known, the same each time, and can be explained."""

import json
import os
import sqlite3
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402


def test_a_scene_that_came_before_is_answered_from_the_cache():
    """The third time the same body comes, the answer is the first one's but for id, times and "cached"; each is a job."""
    scene = {**program.scene("paper_free_sponge"), "title": "a \"title\": 0.000000", "labels": ["x"]}
    with program.daemon() as daemon:
        replies = [daemon.submit(scene) for _ in range(6)]
        jobs = [reply.json() for reply in replies]
        layers = daemon.get("/v1/cache").json()
        assert layers["documents"]["hits"] == 5 and layers["documents"]["count"] == 1, layers
        assert [job["cached"] for job in jobs] == [False] + 5 * [True]
        assert len({job["id"] for job in jobs}) == 6 and sorted(job["id"] for job in jobs) == [job["id"] for job in jobs]
        differing = {"id", "created", "started", "finished", "timing", "links", "cached"}
        for job, reply in zip(jobs, replies):
            assert reply.status == 200 and reply.headers["content-type"] == "application/json"
            assert {k: v for k, v in job.items() if k not in differing} == \
                {k: v for k, v in jobs[0].items() if k not in differing}
            assert job["links"] == {**jobs[0]["links"], "self": f"/v1/jobs/{job['id']}"}
            assert daemon.get(f"/v1/jobs/{job['id']}").json() == job
        assert [job["id"] for job in daemon.get("/v1/jobs").json()["jobs"]] == [job["id"] for job in reversed(jobs)]
        # Another writing of the same scene is another body and the same result.
        other = daemon.submit(json.loads(json.dumps(scene), object_pairs_hook=lambda pairs: dict(reversed(pairs)))).json()
        assert other["cached"] and other["result"] == jobs[0]["result"]


def test_known_answers_survive_a_kill():
    """kill -9 right behind the answers: each job is there afterwards, once."""
    scene = program.scene("paper_free_sponge")
    with program.Daemon(program.build) as daemon:
        for _ in range(3):
            jobs = [daemon.submit(scene).json() for _ in range(200)]
            daemon.kill()
            daemon.start()
            for job in jobs:
                assert daemon.get(f"/v1/jobs/{job['id']}").json()["created"] == job["created"], job
        found, target = [], "/v1/jobs?limit=100"
        while target:
            reply = daemon.get(target)
            found += [job["id"] for job in reply.json()["jobs"]]
            link = reply.headers.get("link", "")
            target = link[link.index("<") + 1:link.index(">")] if 'rel="next"' in link else None
        assert len(found) == len(set(found)) == 600, (len(found), len(set(found)))


def test_a_miss_is_explained_by_the_nearest_known_scene():
    """explain names the members in which a new scene differs from the nearest known one, with both values."""
    scene = program.scene("paper_free_sponge")
    other = program.scene("paper_random_sponge")
    with program.daemon() as daemon:
        def explained(one):
            reply = daemon.request("POST", "/v1/cache/explain", json=one)
            assert reply.status == 200, reply
            return reply.json()

        assert explained(scene)["nearest"] is None and not explained(scene)["cached"]
        known = [program.finished(daemon, one)["result"] for one in (scene, other)]
        now = explained(scene)
        assert now["cached"] and now["nearest"] is None and now["result"] == known[0], now
        assert now["layers"]["memory"] and now["layers"]["database"] and now["layers"]["series_memory"]
        changed = json.loads(json.dumps(scene))
        changed["dampers"][0]["clearance"] = 0.016
        changed["duration"] = 11
        now = explained(changed)
        assert not now["cached"] and now["nearest"]["result"] == known[0], now
        assert not now["nearest"]["engine_differs"] and now["nearest"]["count"] == 2
        assert {one["pointer"]: (one["here"], one["there"]) for one in now["nearest"]["differences"]} == \
            {"/dampers/0/clearance": (0.016, 0.015), "/duration": (11, 10)}, now
        faulty = daemon.request("POST", "/v1/cache/explain", json={**scene, "duration": -1})
        assert faulty.status == 422 and faulty.json()["errors"][0]["pointer"] == "/duration", faulty
        assert len(daemon.get("/v1/jobs").json()["jobs"]) == 2, "explaining made a job"


def test_each_layer_tells_its_own_bytes():
    """A result without channels takes documents and next to no series; one with channels its samples beside."""
    scene = program.scene("paper_free_sponge")
    with program.daemon() as daemon:
        program.finished(daemon, {**scene, "output": {"channels": [], "psd": None}})
        bare = daemon.get("/v1/cache").json()
        assert 0 < bare["documents"]["bytes"] < 1 << 14 > bare["series"]["bytes"], bare
        program.finished(daemon, {**scene, "output": {"channels": ["displacement"], "psd": None}})
        both = daemon.get("/v1/cache").json()
        grown = {layer: both[layer]["bytes"] - bare[layer]["bytes"] for layer in ("documents", "series")}
        assert grown["series"] > 8 * 10001 and 0 < grown["documents"] < 1 << 14, (bare, both)
        ready = daemon.get("/health/ready").json()
        assert ready["cached_bytes"] == both["documents"]["bytes"] + both["series"]["bytes"], (ready, both)


def test_what_another_engine_made_names_the_way_to_have_it_again():
    """Summary, impacts, psd and energy stay in every format, to the byte; the series answers 410 with a link, and POST there makes it by this engine."""
    old = "r-" + 64 * "0"
    with tempfile.TemporaryDirectory() as folder:
        with program.daemon(data=folder) as daemon:
            made = program.finished(daemon, program.scene("paper_free_sponge"))
            kept = [f"{part}.{form}" for part in ("psd", "impacts", "energy") for form in ("json", "csv", "npy", "npz", "mat")]
            before = {what: daemon.get(f"/v1/results/{made['result']}/{what}") for what in kept}
        with sqlite3.connect(os.path.join(folder, "impactd.db")) as database:
            # Without the checksums of id and engine, which stand at the end, as rows of earlier versions are.
            database.execute("UPDATE results SET engine = 'impactd-0', id = ?, checks = substr(checks, 1, length(checks) - 8) WHERE id = ?",
                             (old, made["result"]))
        database.close()
        with program.daemon(data=folder) as daemon:
            assert daemon.get(f"/v1/results/{old}").json()["summary"] == made["summary"]
            assert daemon.get(f"/v1/results/{old}/impacts.json").json()["count"] == made["summary"]["impacts"]
            reply = daemon.get(f"/v1/results/{old}/series.csv")
            assert reply.status == 410 and "impactd-0" in reply.json()["detail"], reply
            for what in kept:
                there = daemon.get(f"/v1/results/{old}/{what}")
                assert there.status == 200 and there.body == before[what].body, (what, there)
            assert daemon.get(f"/v1/results/{old}/psd", headers={"Accept": "application/x-npy"}).body == before["psd.npy"].body
            for what, accept in (("series", "*/*"), ("bundle.zip", "*/*"), ("impacts/1/force.csv", "*/*"), ("impacts/1/force", "*/*")):
                refused = daemon.get(f"/v1/results/{old}/{what}", headers={"Accept": accept})
                assert refused.status == 410 and refused.headers["link"] == reply.headers["link"], (what, refused)
            link = reply.headers["link"]
            again = daemon.request("POST", link[link.index("<") + 1:link.index(">")])
            assert again.status == 200 and again.json()["result"] == made["result"], again
            assert again.json()["summary"] == made["summary"]
            assert daemon.get(f"/v1/results/{made['result']}/series.csv").status == 200
            assert daemon.request("POST", f"/v1/results/r-{64 * '1'}/again").status == 404


if __name__ == "__main__":
    program.main(globals())
