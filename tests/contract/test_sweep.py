#!/usr/bin/env python3
"""The study sweep: its faults, its points set beside their own runs, its table while it comes and after, retry."""

import csv
import io
import json
import sqlite3
import os
import sys
import time

import numpy
import scipy.io

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from daemon import Daemon  # noqa: E402

SANITIZED = "nightly"
USUAL = ["peak_displacement", "rms_displacement", "peak_acceleration", "rms_acceleration", "impacts",
         "peak_contact_force"]


def sweep(*axes, scene="paper_free_sponge", **members):
    """A short scene with a sweep over these axes."""
    changes = members.pop("changes", {})
    return {**program.scene(scene), "duration": 2, **changes,
            "study": {"kind": "sweep", "axes": list(axes), **members}}


def values(pointer, *all_of_them):
    return {"pointer": pointer, "values": list(all_of_them)}


CLEARANCES = values("/dampers/0/clearance", 0.005, 0.01, 0.02)
MATERIALS = values("/dampers/0/buffer", "sponge", "aluminium")


def made(daemon, scene, seconds=60):
    """The finished job of a scene, which must be successful."""
    reply = daemon.submit(scene, wait=10)
    assert reply.status in (200, 202), reply
    job = daemon.finished(reply.json()["id"], seconds)
    assert job["status"] == "successful", job
    return job


def table(daemon, job):
    reply = daemon.get(f"/v1/results/{job['result']}/table.json")
    assert reply.status == 200, reply
    return reply.json()


def column(document, name):
    return document["columns"][name]["values"]


def errors(daemon, scene):
    reply = daemon.submit(scene)
    assert reply.status == 422, reply
    return {error["pointer"]: error for error in reply.json()["errors"]}


def test_a_grid_has_every_combination_and_each_row_is_its_scene_run_alone():
    """The last axis varies fastest, and a row is what its scene with nothing sampled says when submitted by itself."""
    with Daemon(program.build) as daemon:
        job = made(daemon, sweep(CLEARANCES, MATERIALS))
        document = table(daemon, job)
        assert document["status"] == "complete" and document["points"] == document["done"] == 6
        assert column(document, "index") == list(range(6))
        assert column(document, "/dampers/0/clearance") == [0.005, 0.005, 0.01, 0.01, 0.02, 0.02]
        assert column(document, "/dampers/0/buffer") == ["sponge@1", "aluminium@1"] * 3
        assert document["columns"]["/dampers/0/clearance"]["unit"] == "m"
        assert list(document["columns"])[3:-1] == USUAL and column(document, "status") == ["made"] * 6
        for index in range(6):
            point = daemon.get(f"/v1/results/{job['result']}/points/{index}").json()
            assert point["status"] == "made" and point["why"] is None
            alone = daemon.get(f"/v1/results/{job['result']}/points/{index}/scene")
            assert alone.json() == point["scene"] and "study" not in point["scene"]
            own = made(daemon, point["scene"])
            for name in USUAL:
                assert column(document, name)[index] == point["metrics"][name], (index, name)
                assert numpy.isclose(own["summary"][name], point["metrics"][name], rtol=1e-9), (index, name)
            bare = made(daemon, {**point["scene"], "output": {"channels": [], "psd": None, "impacts": False}})
            assert {name: bare["summary"][name] for name in USUAL} == point["metrics"]
            assert len(daemon.get(f"/v1/results/{own['result']}/series.csv").body.splitlines()) == 2002
        assert daemon.get(f"/v1/results/{job['result']}/points/6").status == 404
        assert daemon.get(f"/v1/results/{job['result']}/points/-1").status == 404


def test_a_list_goes_through_its_axes_together():
    """Mode list zips; ranges are linear or logarithmic with both ends exact."""
    with Daemon(program.build) as daemon:
        linear = {"pointer": "/dampers/0/clearance", "from": 0.01, "to": 0.02, "count": 5}
        ratio = {"pointer": "/dampers/0/mass", "from": 0.01, "to": 1, "count": 5, "spacing": "logarithmic"}
        document = table(daemon, made(daemon, sweep(linear, ratio, mode="list", metrics=["steps", "impacts"])))
        assert document["points"] == 5 and document["mode"] == "list"
        assert numpy.allclose(column(document, "/dampers/0/clearance"), numpy.linspace(0.01, 0.02, 5), rtol=1e-14)
        masses = column(document, "/dampers/0/mass")
        assert masses[0] == 0.01 and masses[-1] == 1 and numpy.allclose(masses, numpy.geomspace(0.01, 1, 5), rtol=1e-12)
        assert list(document["columns"])[3:] == ["steps", "impacts", "status"] and min(column(document, "steps")) > 0


def test_kinds_names_whole_numbers_and_truth_values_vary_too():
    """Pointers lead to kinds of contact and solver, seeds, flags and elements of lists."""
    with Daemon(program.build) as daemon:
        models = values("/contact/model", "spring_damper", "impulse", "hunt_crossley")
        solvers = values("/accuracy/solver", "newmark", "rk4")
        document = table(daemon, made(daemon, sweep(solvers, values("/accuracy/step", 1e-4, 1e-5),
                                                    metrics=["rms_displacement", "steps"])))
        steps = column(document, "steps")
        assert steps[1] > 5 * steps[0] and steps[3] > 5 * steps[2], steps
        document = table(daemon, made(daemon, sweep(models)))
        assert len(set(column(document, "rms_displacement"))) == 3
        seeds = values("/excitation/seed", 1, 2, 2**53 - 1)
        document = table(daemon, made(daemon, sweep(seeds, scene="paper_random_sponge")))
        assert column(document, "/excitation/seed") == [1, 2, 2**53 - 1]
        assert len(set(column(document, "rms_displacement"))) == 3
        masses = values("/structure/masses/1", 1.0, 2.0)
        document = table(daemon, made(daemon, sweep(masses, scene="frame_two_dampers", changes={"duration": 1})))
        assert len(set(column(document, "rms_displacement"))) == 2
        sides = values("/dampers/0/left_buffer", "sponge", "aluminium")
        document = table(daemon, made(daemon, sweep(sides)))
        whole = table(daemon, made(daemon, sweep(values("/dampers/0/buffer", "sponge"))))
        assert column(document, "rms_displacement")[0] == column(whole, "rms_displacement")[0]
        assert column(document, "rms_displacement")[1] != column(document, "rms_displacement")[0]


def test_tied_members_get_the_same_value():
    """Both sides' buffers, which the scene gives as one and which stay one; the document names all pointers."""
    sides = ["/dampers/0/left_buffer/restitution", "/dampers/0/right_buffer/restitution"]
    scene = sweep({"pointers": sides, "from": 0.3, "to": 0.5, "count": 3})
    with Daemon(program.build) as daemon:
        job = made(daemon, scene)
        document = table(daemon, job)
        assert document["axes"][0]["pointers"] == sides and document["axes"][0]["pointer"] == sides[0]
        point = daemon.get(document["links"]["point"].replace("{index}", "1")).json()["scene"]["dampers"][0]
        assert point["buffer"]["restitution"] == 0.4


def test_a_members_change_takes_its_materials_name_away():
    """A restitution beside a material's contact time is no longer that material's."""
    with Daemon(program.build) as daemon:
        job = made(daemon, sweep(values("/dampers/0/buffer/restitution", 0.3, 0.61)))
        scene = daemon.get(f"/v1/results/{job['result']}/points/0/scene").json()
        assert scene["dampers"][0]["buffer"] == {"restitution": 0.3, "contact_time": 0.025}
        whole = table(daemon, made(daemon, sweep(values("/dampers/0/buffer", "sponge"))))
        assert column(table(daemon, job), "rms_displacement")[1] == column(whole, "rms_displacement")[0]


def test_every_fault_of_every_point_is_told_at_its_value():
    """Names, numbers, types and pointers, all at once, before anything runs."""
    with Daemon(program.build) as daemon:
        found = errors(daemon, sweep(values("/dampers/0/clearance", 0.01, -1, "wide", -2),
                                     values("/dampers/0/buffer", "sponge", "aluminum"),
                                     values("/dampers/0/mas", 1)))
        assert set(found) == {"/study/axes/0/values/1", "/study/axes/0/values/2", "/study/axes/0/values/3",
                              "/study/axes/1/values/1", "/study/axes/2/pointer"}, found
        assert "must be at least 0 m, is -1" in found["/study/axes/0/values/1"]["detail"]
        assert "must be a number [m], is a text" in found["/study/axes/0/values/2"]["detail"]
        assert found["/study/axes/1/values/1"]["did_you_mean"] == "aluminium"
        assert "mass" in found["/study/axes/2/pointer"]["detail"]
        found = errors(daemon, sweep({"pointer": "/dampers/0/clearance", "from": 0.01, "to": -1, "count": 3}))
        assert "point 1" in found["/study/axes/0"]["detail"]
        wrong = sweep(values("/dampers/0/mas", 1))
        wrong["study"]["mod"] = "grid"  # an unknown key hides no other fault of the study
        assert set(errors(daemon, wrong)) == {"/study/mod", "/study/axes/0/pointer"}


def test_axes_that_make_no_sense_are_refused():
    """Values and a range, neither, unequal lists, doubled pointers, no axes, metrics twice, whole members."""
    with Daemon(program.build) as daemon:
        clearance = "/dampers/0/clearance"
        assert "/study/axes" in errors(daemon, sweep())
        assert "/study/axes/0" in errors(daemon, sweep({**CLEARANCES, "from": 1}))
        assert "/study/axes/0" in errors(daemon, sweep({"pointer": clearance, "from": 1, "to": 2}))
        assert "/study/axes/0" in errors(daemon, sweep({"pointer": clearance, "from": 0, "to": 1, "count": 3,
                                                        "spacing": "logarithmic"}))
        assert "/study/axes/1" in errors(daemon, sweep(CLEARANCES, MATERIALS, mode="list"))
        assert "/study/axes/1/pointer" in errors(daemon, sweep(CLEARANCES, CLEARANCES))
        tied = {"pointers": ["/dampers/0/mass", clearance], "values": [0.1]}
        assert "/study/axes/1/pointers/1" in errors(daemon, sweep(CLEARANCES, tied))
        assert "/study/axes/0" in errors(daemon, sweep({**tied, "pointer": "/duration"}))
        assert "/study/axes/0" in errors(daemon, sweep({"values": [1]}))
        assert "/study/metrics/1" in errors(daemon, sweep(CLEARANCES, metrics=["impacts", "impacts"]))
        assert "/study/metrics" in errors(daemon, sweep(CLEARANCES, metrics=[]))
        for pointer in ("", "dampers", "/dampers", "/dampers/0", "/dampers/1/mass", "/dampers/00/mass", "/title",
                        "/structure", "/dampers/0/mass/0", "/output/channels/0", "/study/kind", "/~2",
                        "/" + 190 * "x"):
            assert "/study/axes/0/pointer" in errors(daemon, sweep(values(pointer, 1))), pointer
        found = errors(daemon, sweep({"pointer": clearance, "from": 0.01, "to": 0.02, "count": 2000},
                                     {"pointer": "/dampers/0/mass", "from": 0.1, "to": 0.2, "count": 2000}))
        assert "4e+06 points" in found["/study/axes"]["detail"] and "fewer" in found["/study/axes"]["detail"]


def test_points_too_many_to_be_judged_at_once_are_judged_before_the_first_runs():
    """A fault within a large grid fails the job with that fault, and no row is made."""
    with Daemon(program.build) as daemon:
        # Only where the narrow clearance meets a start far out is that beyond a stop.
        scene = sweep(values("/dampers/0/clearance", 0.02, 0.01, 0.02),
                      {"pointer": "/dampers/0/position", "from": 0, "to": 0.006, "count": 3000})
        job = daemon.finished(daemon.submit(scene).json()["id"])
        assert job["status"] == "failed" and job["problem"]["status"] == 422, job
        assert job["problem"]["errors"][0]["pointer"].startswith("/study/axes/1"), job["problem"]
        assert daemon.get(f"/v1/jobs/{job['id']}/table.json").json()["done"] == 0


def test_a_hundred_million_points_begin_at_once_in_little_memory():
    """1e8 points are accepted where --max-points says so, rows come at once, memory does not grow with the points."""
    axes = [{"pointer": "/dampers/0/clearance", "from": 0.005, "to": 0.03, "count": 10000},
            {"pointer": "/dampers/0/mass", "from": 0.05, "to": 0.2, "count": 10000}]
    with program.daemon() as small:
        assert "at most 1000000 are allowed" in json.dumps(errors(small, sweep(*axes)))
    with program.daemon("--max-points", "100000000", "--max-study-seconds", "0") as daemon:
        job = daemon.submit(sweep(*axes, changes={"duration": 0.5}), headers={"Prefer": "respond-async"}).json()["id"]
        end = time.monotonic() + 20
        while not (points := daemon.get(f"/v1/jobs/{job}").json().get("points", {})).get("done"):
            assert time.monotonic() < end, points
            time.sleep(0.1)
        assert points["all"] == 10**8 and points["failed"] == 0
        with open(f"/proc/{daemon.process.pid}/statm", encoding="ascii") as file:
            assert int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE") < (1e9 if program.is_sanitized() else 200e6)
        assert daemon.request("DELETE", f"/v1/jobs/{job}").status in (200, 204)


def test_failed_points_are_rows_with_a_reason_and_can_be_made_again():
    """An unstable step is a row's status; a retry is a job of its own and changes nothing that was made."""
    with Daemon(program.build) as daemon:
        scene = sweep(values("/dampers/0/buffer", "sponge", "aluminium", "soft_rubber", "aluminium"),
                      changes={"accuracy": {"solver": "rk4", "step": 1e-3}})
        job = made(daemon, scene)
        document = table(daemon, job)
        assert column(document, "status") == ["made", "unstable", "made", "unstable"] and document["failed"] == 2
        (failure,) = document["failures"]
        assert failure["count"] == 2 and failure["first_point"] == 1 and failure["detail"]
        point = daemon.get(f"/v1/results/{job['result']}/points/3").json()
        assert point["status"] == "unstable" and point["why"] and point["metrics"]["rms_displacement"] is None
        again = daemon.request("POST", f"/v1/jobs/{job['id']}/retry")
        assert again.status == 202 and again.headers["location"] == f"/v1/jobs/{again.json()['id']}", again
        assert again.json()["id"] != job["id"]
        assert daemon.finished(again.json()["id"])["status"] == "successful"
        assert table(daemon, job) == document
        fine = made(daemon, sweep(CLEARANCES))
        assert daemon.request("POST", f"/v1/jobs/{fine['id']}/retry").status == 409
        assert daemon.request("POST", "/v1/jobs/j-nothing/retry").status == 404


def test_a_retry_is_never_answered_from_what_is_known():
    """The body is answered at once, a retry computes; with a key it is that retry once more."""
    with Daemon(program.build) as daemon:
        scene = sweep(values("/dampers/0/buffer", "sponge", "aluminium"),
                      changes={"accuracy": {"solver": "rk4", "step": 1e-3}})
        job = made(daemon, scene)
        for _ in range(3):
            known = daemon.submit(scene)
            assert known.status == 200 and known.json()["cached"] and known.json()["result"] == job["result"]
            assert table(daemon, known.json())["failed"] == 1
        for key in ({}, {"Idempotency-Key": "one"}, {"Idempotency-Key": "two"}):
            # Of a job that was answered from what is known, too.
            again = daemon.request("POST", f"/v1/jobs/{known.json()['id']}/retry", headers=key)
            assert again.status == 202, again
            done = daemon.finished(again.json()["id"])
            assert done["status"] == "successful" and not done["cached"] and done["result"] == job["result"]
            if key:
                same = daemon.request("POST", f"/v1/jobs/{known.json()['id']}/retry", headers=key)
                assert same.json()["id"] == again.json()["id"] and same.headers["idempotency-replayed"] == "true"
                assert daemon.request("POST", f"/v1/jobs/{job['id']}/retry", headers=key).status == 422
                assert daemon.submit(scene, headers=key).status == 422
        assert table(daemon, job)["status"] == "complete" and table(daemon, job)["failed"] == 1


def test_with_its_result_a_sweep_goes():
    """Deleted, there is neither table nor chunk nor a retry; submitted again it is made anew."""
    with Daemon(program.build) as daemon:
        job = made(daemon, sweep(CLEARANCES))
        document = table(daemon, job)
        assert daemon.request("DELETE", f"/v1/results/{job['result']}").status == 204
        assert daemon.get(f"/v1/results/{job['result']}/table.json").status == 404
        assert daemon.get(f"/v1/jobs/{job['id']}/table.json").status == 404
        again = daemon.request("POST", f"/v1/jobs/{job['id']}/retry")
        assert again.status == 409 and "submit its scene again" in again.json()["detail"], again
        base = sqlite3.connect(f"file:{daemon.data}/impactd.db?mode=ro", uri=True)
        assert base.execute("SELECT (SELECT count(*) FROM sweeps), (SELECT count(*) FROM sweep_chunks)").fetchone() == (0, 0)
        base.close()
        new = made(daemon, sweep(CLEARANCES))
        assert not new["cached"] and table(daemon, new) == document


def test_the_table_reads_the_same_in_every_format():
    """CSV, NPZ and JSON have the same numbers to the bit; formats go by extension or Accept."""
    with Daemon(program.build) as daemon:
        job = made(daemon, sweep(CLEARANCES, MATERIALS))
        document = table(daemon, job)
        text = daemon.get(f"/v1/results/{job['result']}/table", headers={"Accept": "text/csv"})
        assert text.headers["content-type"].startswith("text/csv")
        rows = list(csv.reader(io.StringIO(text.body.decode())))
        assert rows[0][:4] == ["index", "/dampers/0/clearance [m]", "/dampers/0/buffer", "peak_displacement [m]"]
        for k, name in enumerate(document["columns"]):
            for row, value in zip(rows[1:], column(document, name)):
                assert row[k] == value if isinstance(value, str) else float(row[k]) == value
        arrays = numpy.load(io.BytesIO(daemon.get(f"/v1/results/{job['result']}/table.npz").body))
        assert sorted(arrays) == sorted(name.lstrip("/") for name in document["columns"])
        for name in document["columns"]:
            read = arrays[name.lstrip("/")].tolist()
            assert [one.decode() if isinstance(one, bytes) else one for one in read] == column(document, name), name
        # Numbers alone: the place of a text among its axis's values, and of a status.
        told = [column(document, name) for name in document["columns"]]
        numbers = [[("sponge@1", "aluminium@1").index(one) if str(one).endswith("@1") else 0 if one == "made" else one
                    for one in values] for values in told]
        reply = daemon.get(f"/v1/results/{job['result']}/table.npy")
        array = numpy.load(io.BytesIO(reply.body))
        assert array.dtype == float and array.T.tolist() == numbers, array
        variables = scipy.io.loadmat(io.BytesIO(daemon.get(f"/v1/results/{job['result']}/table.mat").body))
        for name, values in zip(document["columns"], numbers):
            assert variables[name.lstrip("/").replace("/", "_")].ravel().tolist() == values, name
        part = daemon.get(f"/v1/results/{job['result']}/table.npy", headers={"Range": "bytes=100-299"})
        assert part.status == 206 and part.body == reply.body[100:300] and reply.headers["accept-ranges"] == "bytes"
        assert daemon.get(f"/v1/results/{job['result']}/table.xml").status == 404
        by_job = daemon.get(f"/v1/jobs/{job['id']}/table.csv")
        assert by_job.body == text.body
        tagged = daemon.get(f"/v1/results/{job['result']}/table.csv", headers={"If-None-Match": by_job.headers["etag"]})
        assert tagged.status == 304
        links = daemon.get(f"/v1/results/{job['result']}").json()["links"]
        assert links["table"].endswith("/table.json") and links["table.csv"].endswith("/table.csv")


def test_a_long_table_is_streamed_and_reads_the_same_in_every_format():
    """Rows that do not fit into one piece: none is left out or comes twice, and any range of the archive is its part."""
    with Daemon(program.build) as daemon:
        scene = sweep({"pointer": "/dampers/0/clearance", "from": 0.01, "to": 0.02, "count": 20000},
                      values("/dampers/0/buffer", "sponge", "aluminium"),
                      metrics=USUAL + ["energy_residual", "error_estimate", "trust_horizon", "steps"],
                      changes={"duration": 0.02, "accuracy": {"solver": "rk4", "step": 1e-3}})
        job = made(daemon, scene, 300)
        replies = {form: daemon.get(f"/v1/results/{job['result']}/table.{form}") for form in ("json", "csv", "npz", "svg")}
        assert all(reply.status == 200 for reply in replies.values())
        assert "content-length" not in replies["json"].headers and len(replies["csv"].body) > 4 << 20
        assert "content-length" in replies["npz"].headers and len(replies["svg"].body) < 1 << 20
        document = replies["json"].json()
        assert document["done"] == 40000 and column(document, "index") == list(range(40000))
        rows = list(csv.reader(io.StringIO(replies["csv"].body.decode())))[1:]
        arrays = numpy.load(io.BytesIO(replies["npz"].body))
        assert len(rows) == 40000
        for k, name in enumerate(document["columns"]):
            told, read = column(document, name), arrays[name.lstrip("/")]
            if isinstance(told[0], str):
                assert told == [row[k] for row in rows] == [one.decode() for one in read.tolist()], name
            else:
                there = numpy.array([numpy.nan if one is None else one for one in told], dtype=float)
                assert numpy.array_equal(there, read, equal_nan=True), name
                assert numpy.array_equal(there, [float(row[k]) for row in rows], equal_nan=True), name
        part = daemon.get(f"/v1/results/{job['result']}/table.npz", headers={"Range": "bytes=3000001-4100002"})
        assert part.status == 206 and part.body == replies["npz"].body[3000001:4100003]


def long_sweep(count=3000):
    """Some seconds of CPU."""
    return sweep({"pointer": "/dampers/0/clearance", "from": 0.01, "to": 0.02, "count": count},
                 scene="paper_random_sponge", changes={"duration": 20})


def test_rows_appear_as_they_come_and_single_jobs_go_between():
    """A running sweep shows rows, a job submitted beside it does not wait for its end, and it can be cancelled."""
    with Daemon(program.build, "--workers", "1") as daemon:
        job = daemon.submit(long_sweep(20000), headers={"Prefer": "respond-async"}).json()
        assert daemon.get(f"/v1/jobs/{job['id']}/table.json").json()["points"] == 20000
        end = time.monotonic() + 120
        while daemon.get(f"/v1/jobs/{job['id']}/table.json").json()["done"] == 0:
            assert time.monotonic() < end
            time.sleep(0.1)
        running = daemon.get(f"/v1/jobs/{job['id']}").json()
        assert running["status"] == "running" and running["points"]["all"] == 20000, running
        assert 0 < running["points"]["done"] and running["points"]["failed"] == 0
        assert made(daemon, program.scene("paper_free_sponge"))
        rows = daemon.get(f"/v1/jobs/{job['id']}/table.json").json()
        assert rows["status"] == "partial" and 0 < rows["done"] < 20000
        index = column(rows, "index")
        assert index == sorted(set(index)) and len(index) == rows["done"]
        assert daemon.request("DELETE", f"/v1/jobs/{job['id']}").json()["status"] == "dismissed"
        end = time.monotonic() + 60
        while daemon.get("/v1/jobs/" + job["id"] + "/table.json").json()["done"] > 0:
            assert time.monotonic() < end
            time.sleep(0.1)


def test_the_same_sweep_has_the_same_bytes_for_any_number_of_workers():
    """Chunks differ, tables do not."""
    tables = set()
    for workers in ("1", "2", "5"):
        with Daemon(program.build, "--workers", workers) as daemon:
            job = made(daemon, sweep(CLEARANCES, MATERIALS, {"pointer": "/dampers/0/mass", "from": 0.05, "to": 0.2,
                                                              "count": 11}))
            tables.add(daemon.get(f"/v1/results/{job['result']}/table.json").body)
            tables.add(daemon.get(f"/v1/results/{job['result']}/table.json").body)
    assert len(tables) == 1


def test_a_dry_run_predicts_and_says_what_is_asked():
    """Names are pinned to revisions, the cost grows with the points."""
    with Daemon(program.build) as daemon:
        few = daemon.request("POST", "/v1/jobs?dry_run=1", json=sweep(CLEARANCES)).json()
        many = daemon.request("POST", "/v1/jobs?dry_run=1",
                              json=sweep(CLEARANCES, {"pointer": "/dampers/0/mass", "from": 0.05, "to": 0.2,
                                                      "count": 1000})).json()
        assert many["cost"]["cpu_seconds"] > 100 * few["cost"]["cpu_seconds"] > 0
        asked = daemon.request("POST", "/v1/jobs?dry_run=1", json=sweep(MATERIALS)).json()
        assert asked["scene"]["study"]["axes"][0]["values"] == ["sponge@1", "aluminium@1"]
        assert [m["material"] for m in asked["scene"]["study"]["materials"]] == ["sponge@1", "aluminium@1"]
        same = daemon.request("POST", "/v1/jobs?dry_run=1", json=asked["scene"]).json()
        assert same["result"] == asked["result"] and same["scene"] == asked["scene"]
        found = errors(daemon, sweep(CLEARANCES, materials=[{"material": "sponge"}, {"restitution": 0.5},
                                                            {"material": "sponge@1"}]))
        assert set(found) == {"/study/materials/1", "/study/materials/2"}, found
        assert "must name a material" in found["/study/materials/1"]["detail"], found
        assert "listed twice" in found["/study/materials/2"]["detail"], found


if __name__ == "__main__":
    program.main(globals())
