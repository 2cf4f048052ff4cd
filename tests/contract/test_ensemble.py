#!/usr/bin/env python3
"""The study ensemble: its command, its jobs, its statistics set beside NumPy's, its CSV and its chart."""

import csv
import io
import json
import os
import sys
import tempfile
import xml.etree.ElementTree

import numpy
import scipy.special

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

SANITIZED = "nightly"
SPONGE = os.path.join(program.EXAMPLES, "paper_random_sponge.json")
INPUTS = [{"pointer": "/dampers/0/clearance", "distribution": "normal", "mean": 0.015, "deviation": 0.001},
          {"pointer": "/dampers/0/buffer", "distribution": "material", "contact_time_deviation": 0.1}]
SVG = "{http://www.w3.org/2000/svg}"
STATISTICS = ["peak_displacement", "rms_displacement", "peak_acceleration", "rms_acceleration", "impacts",
              "peak_contact_force", "peak_storey_drift", "peak_base_shear"]


def study(duration=5, **members):
    """A short scene under a random base, with an ensemble of it."""
    return {**program.scene("paper_random_sponge"), "duration": duration,
            "study": {"kind": "ensemble", "runs": 12, **members}}


def student(share, freedom):
    """The quantile of Student's t; that of scipy.stats misses some by 1e-9."""
    x = scipy.special.betaincinv(freedom / 2, 0.5, 1 - share)
    return numpy.sqrt(freedom * (1 - x) / x)


def close(a, b):
    return numpy.allclose(numpy.asarray(a, float), numpy.asarray(b, float), rtol=1e-9, atol=0)


def check_statistics(answer):
    """Every statistic is NumPy's of the table's rows."""
    rows = [row for row in answer["table"] if row["why"] is None]
    assert list(answer["statistics"]) == STATISTICS
    for name, told in answer["statistics"].items():
        values = numpy.array([row[name] for row in rows if row[name] is not None], float)
        n = len(values)
        assert told["count"] == n
        if n < 2:
            continue
        error = values.std(ddof=1) / n ** 0.5
        half = student(0.95, n - 1) * error
        wanted = {"mean": values.mean(), "standard_deviation": values.std(ddof=1), "standard_error": error,
                  "low": values.mean() - half, "high": values.mean() + half, "minimum": values.min(),
                  "maximum": values.max(), "median": numpy.median(values), "q05": numpy.quantile(values, 0.05),
                  "q16": numpy.quantile(values, 0.16), "q84": numpy.quantile(values, 0.84),
                  "q25": numpy.quantile(values, 0.25), "q75": numpy.quantile(values, 0.75),
                  "q95": numpy.quantile(values, 0.95)}
        for member, value in wanted.items():
            # Equal values deviate by rounding alone.
            assert close(told[member], value) or abs(value) < 1e-14 * values.mean(), (name, member, told[member], value)
        for member in ("minimum", "maximum"):
            seeds = [row["seed"] for row in rows if row[name] == told[member]]
            assert told[member + "_seed"] == seeds[0], (name, member)


def check_spectra(answer, densities):
    """Mean and band are those of the runs' densities, one row each."""
    (told,) = answer["spectra"]
    n = len(densities)
    mean, deviation = densities.mean(0), densities.std(0, ddof=1)
    factor = numpy.exp(student(0.95, n - 1) * deviation / mean / n ** 0.5)
    assert close(told["mean"], mean) and close(told["standard_deviation"], deviation)
    assert close(told["low"], mean / factor) and close(told["high"], mean * factor)


def check_chart(text, answer):
    """Well-formed, in the page's colours by media query, no foreign thing, with spectra and statistics in it."""
    root = xml.etree.ElementTree.fromstring(text)
    assert root.tag == SVG + "svg" and root.get("viewBox").startswith("0 0 640 ")
    assert "@media (prefers-color-scheme: dark)" in text and "nan" not in text and "inf" not in text
    assert "url(" not in text and "href" not in text and "@import" not in text and "<script" not in text
    texts = [one.text for one in root.iter(SVG + "text")]
    for name in STATISTICS:
        assert name.replace("_", " ") in texts, name
    bands = [path for path in root.iter(SVG + "path") if (path.get("class") or "").startswith("band")]
    assert len(bands) == min(len(answer["spectra"]), 4) + 2 * len(answer["displacement"])
    assert f"{answer['runs']} runs, seeds from" in root.find(SVG + "desc").text


def check_csv(text, answer):
    """A row for each run with its seed and its inputs, as the JSON has it."""
    rows = list(csv.reader(io.StringIO(text)))
    assert rows[0][:4] == ["seed", "steps", "peak_displacement [m]", "rms_displacement [m]"], rows[0]
    assert len(rows) == 1 + len(answer["table"]) and all(len(row) == len(rows[0]) for row in rows)
    for row, run in zip(rows[1:], answer["table"]):
        assert int(row[0]) == run["seed"] and row[-1] == (run["why"] or "")
        values = [run["steps"]] + [value for name, value in run.items() if name not in ("seed", "why", "steps", "inputs")]
        values += run["inputs"] or [None] * len(answer["inputs"])
        for cell, value in zip(row[1:-1], values):
            assert (cell == "nan") if value is None else float(cell) == value, (row, run)


def test_a_metric_that_does_not_vary_has_no_indices():
    """The peak of a free vibration is its release: its indices are null, and the answer can be read."""
    with program.daemon() as daemon:
        base = "/v1/results/" + program.finished(daemon, program.scene("ensemble_inputs"))["result"]
        for ending in ("json", "csv", "svg"):
            assert daemon.get(f"{base}/ensemble.{ending}").status == 200
        answer = daemon.get(base + "/ensemble.json").json()
        flat = [one for one in answer["indices"] if one["metric"] == "peak_displacement"]
        assert flat and all(one["first"] is None and one["total"] is None for one in flat), flat


def test_the_command_writes_all_formats():
    """-o may be given again, for json, csv and svg; nothing is printed then where no terminal is."""
    with tempfile.TemporaryDirectory() as folder:
        paths = [os.path.join(folder, "out." + ending) for ending in ("json", "csv", "svg")]
        other = json.dumps({**program.scene("paper_random_sponge"), "study": {"kind": "compare"}})
        code, _, errors = program.run("ensemble", "-", text=other)
        assert code == 3 and "is compare, not ensemble" in errors, errors
        code, out, errors = program.run("ensemble", SPONGE, "--runs", "20",
                                        *[word for path in paths for word in ("-o", path)])
        assert code == 0 and "must" not in errors, (code, errors)
        texts = []
        for path in paths:
            with open(path, encoding="utf-8") as file:
                texts.append(file.read())
    answer = json.loads(texts[0])
    assert answer["kind"] == "ensemble" and answer["runs"] == 20 and answer["target"] is None
    assert answer["first_seed"] == 1 and [row["seed"] for row in answer["table"]] == list(range(1, 21))
    assert answer["trust"]["whole"] + answer["trust"]["beyond"] == 20
    check_statistics(answer)
    check_csv(texts[1], answer)
    check_chart(texts[2], answer)
    assert out == ""


def test_every_row_can_be_run_again():
    """A row's numbers are those of `impactd run` with its seed, to the last digit; so are the spectra."""
    scene = study(first_seed=40)
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "out.json")
        assert program.run("ensemble", "-", "-o", path, text=json.dumps(scene))[0] == 0
        with open(path, encoding="utf-8") as file:
            answer = json.load(file)
        densities = []
        del scene["study"]
        scene.setdefault("output", {})["reduction"] = False
        for row in answer["table"]:
            scene["excitation"]["seed"] = row["seed"]
            again = os.path.join(folder, "run.json")
            code, _, errors = program.run("run", "-", "-o", again, text=json.dumps(scene))
            assert code == 0, errors
            with open(again, encoding="utf-8") as file:
                run = json.load(file)
            for name, value in run["job"]["summary"].items():
                assert row[name] == value, (row, name, value)
            densities.append(run["psd"]["channels"]["mean_acceleration"]["values"])
    assert [row["seed"] for row in answer["table"]] == list(range(40, 52))
    check_spectra(answer, numpy.array(densities))


def test_a_target_is_kept_with_fewer_runs():
    """--target ends it early and says how; against all runs the error is within it; the flags come first."""
    scene = json.dumps(study(runs=200, target=0.5, metric="impacts"))
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "out.json")

        def answer(*words):
            code, out, errors = program.run("ensemble", "-", *words, "-o", path, "--json", text=scene)
            assert code == 0, errors
            with open(path, encoding="utf-8") as file:
                return json.load(file), out

        whole, _ = answer("--target", "1e-12")
        assert whole["runs"] == 200 and whole["target"]["estimated_error"] == 0 and whole["target"]["is_kept"]
        loose, out = answer()
        assert loose["target"]["metric"] == "impacts" and loose["runs"] < 30 and loose["target"]["why"] in out
        for metric in ("rms_displacement", "psd"):
            part, out = answer("--target", "0.1", "--metric", metric)
            told = part["target"]
            assert 8 <= part["runs"] < 200 and told["is_kept"] and told["estimated_error"] <= 0.1, told
            assert told["pilot"] == 8 and told["why"] in out
            assert part["table"] == whole["table"][:part["runs"]]
            if metric == "psd":
                mean, all_ = (numpy.array(one["spectra"][0]["mean"]) for one in (part, whole))
                error = numpy.linalg.norm(mean - all_) / numpy.linalg.norm(all_)
            else:
                error = abs(part["statistics"][metric]["mean"] / whole["statistics"][metric]["mean"] - 1)
            assert error <= 0.1, (metric, error)


def test_a_job_makes_the_study():
    """POST with "study": the result has statistics, table and chart beside the scene's own series."""
    with program.daemon() as daemon:
        scene = study()
        plan = daemon.request("POST", "/v1/jobs?dry_run=1", json=scene).json()
        alone = {name: value for name, value in scene.items() if name != "study"}
        single = daemon.request("POST", "/v1/jobs?dry_run=1", json=alone).json()
        assert plan["cost"]["cpu_seconds"] > 3 * single["cost"]["cpu_seconds"] and plan["result"] != single["result"]
        assert plan["scene"]["study"] == {"kind": "ensemble", "runs": 12, "first_seed": 1, "sobol_indices": False}
        job = program.finished(daemon, scene)
        assert job["result"] == plan["result"]
        base = "/v1/results/" + job["result"]
        result = daemon.get(base).json()
        whole = daemon.get(base + "/ensemble.json")
        answer = whole.json()
        assert answer == {**result["study"], "result": result["id"], "scene": result["scene"]}
        assert result["links"]["ensemble"] == base + "/ensemble.json"
        summary = {name: value for name, value in result["summary"].items() if not name.endswith("_reduction")}
        assert {name: answer["table"][0][name] for name in summary} == summary
        check_statistics(answer)
        table = daemon.get(result["links"]["ensemble.csv"])
        assert table.headers["content-type"] == "text/csv; charset=utf-8"
        check_csv(table.body.decode(), answer)
        chart = daemon.get(result["links"]["ensemble.svg"])
        assert chart.headers["content-type"] == "image/svg+xml"
        check_chart(chart.body.decode(), answer)
        for accept, same in (("image/svg+xml", chart), ("application/json", whole), ("text/csv", table)):
            reply = daemon.get(base + "/ensemble", headers={"Accept": accept})
            assert reply.body == same.body and "accept" in reply.headers["vary"].lower(), accept
        assert daemon.get(base + "/ensemble.json", headers={"If-None-Match": whole.headers["etag"]}).status == 304
        assert daemon.get(base + "/ensemble.npy").status == 404
        manifest = daemon.get(base + "/manifest").json()
        assert manifest["scene"]["study"]["kind"] == "ensemble" and "CPU time" not in manifest["again"]["why"]
        again = daemon.submit(scene, wait=20).json()
        assert again["cached"] and again["result"] == job["result"]
        reply = daemon.get(base + "/tradeoff.json")
        assert reply.status == 404 and 'not for "tradeoff"' in reply.json()["detail"]
        own = program.finished(daemon, alone)
        assert daemon.get(f"/v1/results/{own['result']}/ensemble.csv").status == 404


def test_the_same_bytes_by_any_number_of_workers():
    """One worker or four, this time or after a restart, or the command: the answer has the same bytes."""
    scenes = [study(duration=3, first_seed=10 * i, **members) for i in range(3)
              for members in ({}, {"target": 0.2, "runs": 60}, {"target": 0.2, "runs": 60, "metric": "psd"})]
    scenes += [study(duration=3, inputs=INPUTS, sampling=name, sobol_indices=name == "sobol", runs=16)
               for name in ("random", "latin_hypercube", "sobol")]
    seen = []
    with tempfile.TemporaryDirectory() as folder:
        for workers, data in (("1", None), ("4", folder), ("2", folder)):
            with program.daemon("--workers", workers, **({"data": data} if data else {})) as daemon:
                jobs = [daemon.submit(scene, headers={"Prefer": "respond-async"}).json() for scene in scenes]
                for job in jobs:
                    while daemon.get(f"/v1/jobs/{job['id']}?wait=20").json()["status"] in ("accepted", "running"):
                        pass
                found = [daemon.get(f"/v1/jobs/{job['id']}").json()["result"] for job in jobs]
                seen.append([daemon.get(f"/v1/results/{result}/ensemble.{ending}").body
                             for result in found for ending in ("json", "csv", "svg")])
        assert seen[0] == seen[1] == seen[2]
        path = os.path.join(folder, "out.json")
        for index, scene in enumerate(scenes[:3]):
            assert program.run("ensemble", "-", "-o", path, text=json.dumps(scene))[0] == 0
            with open(path, "rb") as file:
                assert file.read() == seen[0][3 * index]


def test_uncertain_inputs_have_quantiles_and_indices():
    """Rows are those of `impactd run` with the drawn numbers; quantiles of them are NumPy's; indices add up."""
    scene = {**program.scene("paper_free_sponge"), "duration": 3}
    scene["study"] = {"kind": "ensemble", "runs": 12, "inputs": INPUTS, "sampling": "sobol", "sobol_indices": True}
    scene.pop("output", None)
    with tempfile.TemporaryDirectory() as folder:
        paths = [os.path.join(folder, "out." + ending) for ending in ("json", "csv", "svg")]
        code, out, errors = program.run("ensemble", "-", *[word for path in paths for word in ("-o", path)],
                                        text=json.dumps(scene))
        assert code == 0, errors
        answer, table, chart = (open(path, encoding="utf-8").read() for path in paths)  # noqa: SIM115
        answer = json.loads(answer)
        assert answer["runs"] == 12 * 4 and len(answer["table"]) == 24 and answer["failed"] == 0
        check_statistics(answer)
        check_csv(table, answer)
        check_chart(chart, answer)
        assert table.splitlines()[0].endswith(",/dampers/0/clearance [m],/dampers/0/buffer/contact_time [factor],why")
        assert [one["is_factor"] for one in answer["inputs"]] == [False, True] and "Sobol" not in out
        motions, densities = [], []
        del scene["study"]
        scene["output"] = {"reduction": False}
        code, plan, _ = program.run("check", "--json", "-", text=json.dumps(scene))
        buffer = {name: json.loads(plan)["scene"]["dampers"][0]["buffer"][name]
                  for name in ("restitution", "contact_time")}
        for row in answer["table"]:
            scene["dampers"][0]["clearance"] = row["inputs"][0]
            scene["dampers"][0]["buffer"] = {**buffer, "contact_time": buffer["contact_time"] * row["inputs"][1]}
            again = os.path.join(folder, "run.json")
            assert program.run("run", "-", "-o", again, text=json.dumps(scene))[0] == 0
            with open(again, encoding="utf-8") as file:
                run = json.load(file)
            for name, value in run["job"]["summary"].items():
                assert row[name] == value, (row, name, value)
            motions.append(run["series"]["channels"]["displacement"]["values"])
            densities.append(run["psd"]["channels"]["mean_acceleration"]["values"])
    (told,) = answer["displacement"]
    motions = numpy.array(motions)[:, ::-(-len(motions[0]) // 1000)]
    assert len(answer["time"]) == motions.shape[1] and told["quantile_runs"] == 24
    for members, rows in ((told, motions), (answer["spectra"][0], numpy.array(densities))):
        for name, share in (("q05", 0.05), ("q16", 0.16), ("median", 0.5), ("q84", 0.84), ("q95", 0.95)):
            assert numpy.allclose(members[name], numpy.quantile(rows, share, axis=0), rtol=1e-9, atol=1e-15), name
    for one in answer["indices"]:
        assert one["samples"] == 12 and (one["total"] is None) == (one["total_interval_95"] is None), one
        low, high = one["total_interval_95"] or (0, 0)
        assert one["total"] is None or low <= one["total"] <= high, one
    assert {one["pointer"] for one in answer["indices"]} == {"/dampers/0/clearance", "/dampers/0/buffer"}


def test_a_material_gives_its_recorded_spread():
    """Distribution material has the deviations of the revision; the completed scene has them and the same result."""
    scene = {**program.scene("paper_free_sponge"), "duration": 1}
    scene["study"] = {"kind": "ensemble", "runs": 8, "inputs": [{"pointer": "/dampers/0/buffer", "distribution": "material"}]}
    with program.daemon() as daemon:
        refused = daemon.request("POST", "/v1/jobs?dry_run=1", json=scene)  # nobody recorded the paper's
        assert [fault["pointer"] for fault in refused.json()["errors"]] == ["/study/inputs/0"]
        foam = {"slug": "foam", "name": "Foam", "restitution": 0.5, "restitution_deviation": 0.05, "contact_time": 0.02,
                "contact_time_deviation": 0.001, "source": "a test"}
        reply = daemon.request("POST", "/v1/materials", json=foam)
        assert reply.status == 201, reply.body
        scene["dampers"][0]["buffer"] = "foam"
        plan = daemon.request("POST", "/v1/jobs?dry_run=1", json=scene).json()
        (told,) = plan["scene"]["study"]["inputs"]
        assert abs(told["restitution_deviation"] - 0.1) < 1e-15 and abs(told["contact_time_deviation"] - 0.05) < 1e-15
        assert daemon.request("POST", "/v1/jobs?dry_run=1", json=plan["scene"]).json()["result"] == plan["result"]
        result = program.finished(daemon, scene)["result"]
        answer = daemon.get(f"/v1/results/{result}/ensemble.json").json()
        assert [one["pointer"].rsplit("/", 1)[1] for one in answer["inputs"]] == ["restitution", "contact_time"]
        assert all(0.5 < factor < 2 for row in answer["table"] for factor in row["inputs"])


def test_seeds_that_fail_are_rows():
    """Where some seeds meet a limit, the study goes on, counts them and tells why; the rest is of the others."""
    scene = study(duration=5, runs=40)
    with program.daemon() as daemon:
        base = "/v1/results/" + program.finished(daemon, scene)["result"]
        whole = daemon.get(base + "/ensemble.json").json()
    # The first seed's own run must pass, as that of any job.
    most = max(whole["table"][0]["impacts"], sorted(row["impacts"] for row in whole["table"])[20])
    with program.daemon("--max-impacts", str(most)) as daemon:
        base = "/v1/results/" + program.finished(daemon, scene)["result"]
        answer = daemon.get(base + "/ensemble.json").json()
        table = daemon.get(base + "/ensemble.csv").body.decode()
        check_chart(daemon.get(base + "/ensemble.svg").body.decode(), answer)
    failed = [row["seed"] for row in answer["table"] if row["why"]]
    assert failed == [row["seed"] for row in whole["table"] if row["impacts"] > most] and 0 < len(failed) < 40
    assert answer["failed"] == len(failed) and answer["runs"] == 40
    (failure,) = answer["failures"]
    assert failure["reason"] == "limit" and failure["count"] == len(failed) and failure["first_seed"] == failed[0]
    check_statistics(answer)
    check_csv(table, answer)


def test_odd_ensembles_have_odd_charts():
    """No spectra, no damper, no motion at all, more channels than can be drawn: every chart is whole."""
    still = study(runs=3)
    still["excitation"]["rms"] = 0
    bare = study(runs=3)
    del bare["dampers"]
    none = study(runs=2)
    none["output"] = {"psd": None}
    many = study(runs=3)
    many["output"] = {"psd": {"channels": ["displacement", "velocity", "acceleration", "mean_acceleration",
                                           "damper_displacement", "contact_force"], "segment": 256}}
    impulse = study(runs=3)
    impulse["contact"] = {"model": "impulse"}
    with tempfile.TemporaryDirectory() as folder:
        paths = [os.path.join(folder, "out." + ending) for ending in ("json", "svg")]
        for scene in (still, bare, none, many, impulse):
            code, _, errors = program.run("ensemble", "-", "-o", paths[0], "-o", paths[1], text=json.dumps(scene))
            assert code == 0, errors
            with open(paths[0], encoding="utf-8") as file:
                answer = json.load(file)
            with open(paths[1], encoding="utf-8") as file:
                text = file.read()
            if scene is still:
                answer["spectra"] = []  # all zero: nothing to draw on a logarithmic scale
            check_chart(text, answer)
            check_statistics(answer)
            if scene is impulse:
                assert answer["statistics"]["peak_contact_force"]["mean"] is None


if __name__ == "__main__":
    program.main(globals())
