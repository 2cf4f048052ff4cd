#!/usr/bin/env python3
"""The study tradeoff: its command, its jobs, its table and its chart."""

import json
import os
import sys
import tempfile
import xml.etree.ElementTree

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

SANITIZED = "nightly"
SPONGE = os.path.join(program.EXAMPLES, "paper_free_sponge.json")
SVG = "{http://www.w3.org/2000/svg}"
ERRORS = ["displacement", "mean_acceleration", "peak_force", "impacts", "psd", "rms_displacement",
          "peak_storey_drift", "peak_base_shear"]
QUICK = ["--repeats", "1", "--point-steps", "1e6"]


def study(name="paper_free_sponge", **members):
    """A scene with a quick study."""
    return {**program.scene(name), "study": {"kind": "tradeoff", "repeats": 1, "point_steps": 1e6, **members}}


def check_table(table):
    """What holds in every table."""
    points = table["points"]
    assert list(points[0]["errors"]) == ERRORS
    for point in points:
        if point["status"] == "measured":
            assert 0 < point["cpu_minimum"] <= point["cpu_median"], point
            assert point["steps"] > 0 and point["runs"] >= table["repeats"] and point["why"] is None, point
        else:
            assert point["why"] and point["cpu_minimum"] is None and not point["is_best"], point
            assert all(value is None for value in point["errors"].values()), point

    def both(point):
        return point["cpu_minimum"], point["errors"][table["metric"]]

    sound = [p for p in points if p["status"] == "measured" and both(p)[1] is not None]
    for point in sound:
        beaten = any(all(a <= b for a, b in zip(both(other), both(point))) and both(other) != both(point)
                     for other in sound)
        assert point["is_best"] != beaten, point
    chosen = table["recommendation"]["point"]
    keep = [p for p in sound if both(p)[1] <= table["error"]]
    assert (chosen is None) == (not keep)
    if keep:
        alike = [p for p in keep if p["cpu_minimum"] <= 1.25 * min(q["cpu_minimum"] for q in keep)]
        assert points[chosen - 1] == min(alike, key=lambda p: (p["errors"][table["metric"]], p["cpu_minimum"]))
        assert points[chosen - 1]["name"] in table["recommendation"]["why"]


def check_chart(text, table):
    """Well-formed, in the page's colours by media query, no foreign thing, and every point is in it."""
    root = xml.etree.ElementTree.fromstring(text)
    assert root.tag == SVG + "svg" and root.get("viewBox").startswith("0 0 640 ")
    assert "@media (prefers-color-scheme: dark)" in text
    assert "url(" not in text and "href" not in text and "@import" not in text and "<script" not in text
    titles = [mark.find(SVG + "title").text for mark in root.iter(SVG + "path") if mark.find(SVG + "title") is not None]
    told = root.find(SVG + "desc").text
    drawn = 0
    for point in table["points"]:
        if point["status"] == "measured" and point["errors"][table["metric"]] is not None:
            assert sum(title.startswith(point["name"] + ": ") for title in titles) == 1, point["name"]
            drawn += 1
        else:
            assert "Not drawn: " + point["name"] in told, point["name"]
    assert drawn == len(titles) > 3


def test_the_command_writes_table_and_chart():
    """`tradeoff` writes its files and, where its output is no terminal, prints nothing beside them."""
    with tempfile.TemporaryDirectory() as folder:
        paths = [os.path.join(folder, name) for name in ("out.json", "out.svg")]
        code, out, errors = program.run("tradeoff", SPONGE, *QUICK, "-o", paths[0], "-o", paths[1])
        assert (code, out, errors) == (0, "", ""), (code, out, errors)
        assert sorted(os.listdir(folder)) == ["out.json", "out.svg"]
        with open(paths[0], encoding="utf-8") as file:
            table = json.load(file)
        check_table(table)
        with open(paths[1], encoding="utf-8") as file:
            check_chart(file.read(), table)
    assert table["kind"] == "tradeoff" and table["repeats"] == 1 and table["error"] == 1e-3
    solvers = {point["solver"] for point in table["points"]}
    assert {"exact", "precise", "rk4", "newmark"} <= solvers, solvers


def test_settings_are_the_studys():
    """--error, --metric, --solver and a study in the scene say the same; flags come first."""
    code, out, errors = program.run("tradeoff", SPONGE, *QUICK, "--metric", "psd", "--error", "30",
                                    "--solver", "exact", "--solver", "rk4")
    assert code == 0 and "newmark" not in out and "precise" not in out and "rk4, step" in out, (out, errors)
    assert "within 30 dB" in out
    scene = json.dumps(study(metric="impacts", solvers=["exact"]))
    code, out, errors = program.run("tradeoff", "-", *QUICK, text=scene)
    assert code == 0 and "keeps impacts within 0" in out and "rk4" not in out, (out, errors)
    code, out, errors = program.run("tradeoff", "-", *QUICK, "--metric", "peak_force", text=scene)
    assert code == 0 and "keeps peak_force within 0.01" in out, (out, errors)
    code, out, errors = program.run("tradeoff", "-", *QUICK, "--error", "1e-20", text=json.dumps(study()))
    assert code == 0 and "no point keeps displacement within 1e-20; the closest, exact, is at 1.7e-13" in out


def test_errors_are_the_same_each_time():
    """Two runs differ in their CPU times and in what follows of them, in nothing else."""
    tables = []
    with tempfile.TemporaryDirectory() as folder:
        for name in ("a.json", "b.json"):
            path = os.path.join(folder, name)
            assert program.run("tradeoff", SPONGE, *QUICK, "-o", path)[0] == 0
            with open(path, encoding="utf-8") as file:
                tables.append(json.load(file))
    for table in tables:
        del table["recommendation"]
        for point in table["points"]:
            for name in ("cpu_minimum", "cpu_median", "runs", "is_best"):
                del point[name]
    assert tables[0] == tables[1]


def test_a_job_makes_the_study():
    """POST with "study": the result has the table and the scene's own series; both never change."""
    with program.daemon() as daemon:
        scene = study()
        plan = daemon.request("POST", "/v1/jobs?dry_run=1", json=scene).json()
        alone = daemon.request("POST", "/v1/jobs?dry_run=1", json=program.scene("paper_free_sponge")).json()
        assert plan["cost"]["cpu_seconds"] > 10 * alone["cost"]["cpu_seconds"] and plan["result"] != alone["result"]
        assert plan["scene"]["study"]["error"] == 1e-3, plan["scene"]["study"]
        job = program.finished(daemon, scene)
        assert job["result"] == plan["result"] and job["summary"]["impacts"] == 22
        base = "/v1/results/" + job["result"]
        result = daemon.get(base).json()
        table = daemon.get(base + "/tradeoff.json")
        assert table.json() == {**result["study"], "result": result["id"], "scene": result["scene"]}
        assert result["links"]["tradeoff"] == base + "/tradeoff.json"
        check_table(table.json())
        chart = daemon.get(result["links"]["tradeoff.svg"])
        assert chart.headers["content-type"] == "image/svg+xml"
        check_chart(chart.body.decode(), table.json())
        assert daemon.get(base + "/tradeoff", headers={"Accept": "image/svg+xml"}).body == chart.body
        assert daemon.get(base + "/tradeoff", headers={"Accept": "application/json"}).body == table.body
        assert daemon.get(base + "/tradeoff.json", headers={"If-None-Match": table.headers["etag"]}).status == 304
        manifest = daemon.get(base + "/manifest").json()
        assert manifest["scene"]["study"]["kind"] == "tradeoff" and "CPU time" in manifest["again"]["why"]
        series = daemon.get(base + "/series.json").json()
        own = program.finished(daemon, program.scene("paper_free_sponge"))
        assert series == daemon.get(f"/v1/results/{own['result']}/series.json").json()
        again = daemon.submit(scene, wait=20).json()
        assert again["cached"] and again["result"] == job["result"]
        assert daemon.get(base + "/tradeoff.json").body == table.body
        anew = program.finished(daemon, study(trial=2))
        assert not anew["cached"] and anew["result"] != job["result"]
        other = daemon.get(f"/v1/results/{anew['result']}/tradeoff.json").json()
        assert [p["errors"] for p in other["points"]] == [p["errors"] for p in table.json()["points"]]
        reply = daemon.get(f"/v1/results/{own['result']}/tradeoff.json")
        assert reply.status == 404 and "study" in reply.json()["detail"]
        assert daemon.get(f"/v1/results/{own['result']}").json()["study"] is None


def test_a_study_outlives_the_daemon():
    """Table and chart are the same bytes after a restart, and the series is computed anew."""
    with tempfile.TemporaryDirectory() as folder:
        bodies = []
        for _ in range(2):
            with program.daemon(data=folder) as daemon:
                job = program.finished(daemon, study(solvers=["exact", "rk4"]))
                base = "/v1/results/" + job["result"]
                bodies.append([daemon.get(base + way).body for way in
                               ("", "/tradeoff.json", "/tradeoff.svg", "/series.csv")])
        assert bodies[0] == bodies[1]


if __name__ == "__main__":
    program.main(globals())
