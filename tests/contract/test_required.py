#!/usr/bin/env python3
"""Only what a scene requires: what is left out, as users see it and as it is stored."""

import json
import os
import shutil
import sqlite3
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import daemon as daemons  # noqa: E402
import program  # noqa: E402

SANITIZED = "nightly"
STORED_MOST = 4096
SUMMARY = {"channels": [], "psd": None}


def omissions(plan):
    """What a plan leaves out, by name."""
    return {line["about"]: line for line in plan["decisions"] if line["chose"] == "left_out"}


def summary_only(name, **changes):
    return {**program.scene(name), "output": {**SUMMARY, **changes.pop("output", {})}, **changes}


def stored(data, columns_left_out):
    """Bytes of every value of results and jobs, each result with its job, the keys of their indexes twice."""
    rows = []
    connection = sqlite3.connect(os.path.join(data, "impactd.db"))
    connection.row_factory = sqlite3.Row
    jobs = {row["result"]: row for row in connection.execute("SELECT * FROM jobs")}
    for result in connection.execute("SELECT * FROM results"):
        size = 0
        for row in (result, jobs[result["id"]]):
            for key in row.keys():
                if key not in columns_left_out and row[key] is not None:
                    size += len(row[key].encode()) if isinstance(row[key], str) else 8
            size += len(row["id"])
        rows.append((result["id"], size))
    connection.close()
    return rows


def test_a_summary_is_small():
    """Without channels and spectra a result is stored in 4 KiB beside its ledger, its job included, all told."""
    scenes = [summary_only("paper_random_sponge", duration=60), summary_only("paper_random_aluminium"),
              summary_only("paper_free_sponge"), summary_only("contact_hertz"),
              summary_only("paper_random_sponge", duration=60, title="t" * 200, labels={"campaign": "all"})]
    with program.daemon() as daemon:
        for scene in scenes:
            job = program.finished(daemon, scene)
            assert {"channels", "psd"} <= set(omissions(job["plan"])), job["plan"]
        sizes = stored(daemon.data, {"impacts"})
    assert len(sizes) == 4, sizes  # a title is no other scene
    for result, size in sizes:
        assert size <= STORED_MOST, (result, size)


def test_the_file_grows_by_as_little():
    """200 summaries without a ledger make the database grow by less than 4 KiB each, as the file system sees it."""
    data = tempfile.mkdtemp(prefix="impactd-")
    count = 200
    try:
        sizes = []
        for first, last in ((0, 20), (20, 20 + count)):
            with daemons.Daemon(program.build, data=data) as daemon:
                for seed in range(first, last):
                    # By its numbers: pages hold whole results, and what is warned of a material's is beside.
                    scene = summary_only("paper_random_sponge", duration=1, output={"impacts": False})
                    scene["dampers"][0]["buffer"] = {"restitution": 0.61, "contact_time": 0.025}
                    scene["excitation"]["seed"] = seed
                    program.finished(daemon, scene)
            sizes.append(os.path.getsize(os.path.join(data, "impactd.db")))
        assert 0 < sizes[1] - sizes[0] <= count * STORED_MOST, sizes
    finally:
        shutil.rmtree(data, ignore_errors=True)


def test_no_ledger_is_told():
    """Without a ledger impacts.json and .csv are 404 and say what would be right; summary and energies are the same."""
    scene = program.scene("paper_free_sponge")
    unlisted = {**scene, "output": {"impacts": False}}
    with program.daemon() as daemon:
        whole, bare = program.finished(daemon, scene), program.finished(daemon, unlisted)
        assert whole["result"] != bare["result"]
        assert bare["summary"] == whole["summary"] and bare["summary"]["impacts"] == 22, bare
        assert whole["work"]["ledger_rows"] == 22 and bare["work"]["ledger_rows"] == 0
        assert bare["work"]["contacts"] == 22
        line = omissions(bare["plan"])["impacts"]
        assert line["unit"] == "rows" and line["value"] > 0, line
        for part in ("impacts.json", "impacts.csv", "impacts"):
            reply = daemon.get(f"/v1/results/{bare['result']}/{part}")
            assert reply.status == 404 and "\"impacts\": true" in reply.json()["detail"], reply
            assert daemon.get(f"/v1/results/{whole['result']}/{part}").status == 200
        for part in ("series.csv", "psd.json", "energy.json"):
            both = [daemon.get(f"/v1/results/{job['result']}/{part}").body for job in (whole, bare)]
            assert both[0] == both[1], part
        # The default by name is no other scene.
        assert program.finished(daemon, {**scene, "output": {"impacts": True}})["result"] == whole["result"]
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "out.json")
        code, _, errors = program.run("run", "-", "-o", out, text=json.dumps(unlisted))
        assert code == 0, errors
        with open(out, encoding="utf-8") as file:
            document = json.load(file)
    assert document["impacts"] is None and document["job"]["work"] == bare["work"]


def test_work_is_shown_everywhere():
    """The counted work stands in job, result and a later answer, and is that of `impactd run`."""
    scene = program.scene("paper_random_sponge")
    data = tempfile.mkdtemp(prefix="impactd-")
    try:
        with daemons.Daemon(program.build, data=data) as daemon:
            job = program.finished(daemon, scene)
            work = job["work"]
            assert work["base_samples"] > 30000 and work["channel_values"] == 6 * 30001, work
            assert work["contacts"] == job["summary"]["impacts"] > 100, work
            assert daemon.get(f"/v1/results/{job['result']}").json()["work"] == work
            assert daemon.get(f"/v1/jobs/{job['id']}").json()["work"] == work
            again = program.finished(daemon, scene)
            assert again["cached"] is True and again["work"] == work
        with daemons.Daemon(program.build, data=data) as daemon:
            assert daemon.get(f"/v1/jobs/{job['id']}").json()["work"] == work
            assert program.finished(daemon, scene)["work"] == work
    finally:
        shutil.rmtree(data, ignore_errors=True)
    code, out, errors = program.run("run", "-", text=json.dumps(scene))
    assert code == 0 and json.loads(out)["work"] == work, errors


def test_no_contact_machinery_without_contact():
    """With stops out of reach no stop is looked for, told with the bound; a dry run tells what it can."""
    near, far = program.scene("paper_free_sponge"), program.scene("paper_free_sponge")
    far["dampers"][0]["clearance"] = 0.1
    shaken = program.scene("paper_random_sponge")
    with program.daemon() as daemon:
        for scene, is_clear in ((near, False), (far, True)):
            job = program.finished(daemon, scene)
            assert (job["work"]["stop_searches"] == 0) is is_clear, job["work"]
            assert ("contacts" in omissions(job["plan"])) is is_clear
            dry = daemon.request("POST", "/v1/jobs?dry_run=1", json=scene).json()
            assert omissions(dry["plan"]).get("contacts") == omissions(job["plan"]).get("contacts"), dry["plan"]
        line = omissions(program.finished(daemon, far)["plan"])["contacts"]
        assert abs(line["value"] - 0.6) < 1e-9, line
        dry = daemon.request("POST", "/v1/jobs?dry_run=1", json=shaken).json()
        assert [line["chose"] for line in dry["plan"]["decisions"] if line["about"] == "contacts"] == ["open"]


if __name__ == "__main__":
    program.main(globals())
