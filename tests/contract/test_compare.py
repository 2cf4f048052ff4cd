#!/usr/bin/env python3
"""Comparisons: the study compare, two results side by side, and a result beside a measured motion."""

import csv
import io
import json
import os
import sqlite3
import sys
import tempfile
import xml.etree.ElementTree

import numpy
import scipy.signal

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from asking import endless  # noqa: E402

SANITIZED = "nightly"
SVG = "{http://www.w3.org/2000/svg}"


def scene(**members):
    """A short free vibration of the sponge, with the samples that comparisons need."""
    return {**program.scene("paper_free_sponge"), "duration": 4,
            "output": {"channels": ["displacement", "acceleration", "mean_acceleration"],
                       "psd": {"channels": ["mean_acceleration"], "segment": 1024}}, **members}


def series(daemon, result):
    """A result's channels as arrays."""
    document = daemon.get(f"/v1/results/{result}/series.json").json()
    return {name: numpy.array(one["values"]) for name, one in document["channels"].items()}


def close(a, b, within=1e-9):
    return numpy.allclose(a, b, rtol=within, atol=1e-300)


def check_chart(text, names):
    """Well-formed, in both colours, without foreign things; each drawn name in the legend."""
    root = xml.etree.ElementTree.fromstring(text)
    assert root.tag == SVG + "svg" and "@media (prefers-color-scheme: dark)" in text
    assert "nan" not in text and "inf" not in text.replace("info", "") and "<script" not in text and "href" not in text
    texts = " ".join(one.text or "" for one in root.iter(SVG + "text"))
    for name in names:
        assert name in texts, (name, texts)


def test_the_study_sets_contact_models_side_by_side():
    """One entry per model and rule; the reference is the scene's own run; distances are those of NumPy."""
    with program.daemon() as daemon:
        job = program.finished(daemon, scene(study={"kind": "compare"}))
        base = "/v1/results/" + job["result"]
        result = daemon.get(base).json()
        answer = daemon.get(result["links"]["compare"]).json()
        assert answer == {**result["study"], "result": result["id"], "scene": result["scene"]}
        assert result["scene"]["study"]["separations"] == ["zero_penetration", "zero_force"]
        entries = {entry["name"]: entry for entry in answer["entries"]}
        assert len(entries) == 9 and list(entries)[0] == "spring_damper, zero_penetration"
        assert entries["hertz"]["status"] == "refused" and "must be 1" in entries["hertz"]["why"]
        own = answer["entries"][0]
        assert own["summary"].items() <= result["summary"].items() and own["derived"] == result["plan"]["derived"]
        a = series(daemon, job["result"])["displacement"]
        frequency, wanted = numpy.array(answer["frequency"]), numpy.array(own["density"])
        psd = daemon.get(base + "/psd.json").json()["channels"]["mean_acceleration"]["values"]
        assert psd == own["density"]
        for name, model, separation in (("impulse", "impulse", None), ("spring_damper, zero_force", "spring_damper",
                                                                       "zero_force"), ("flores", "flores", None)):
            contact = {"model": model, **({"separation": separation} if separation else {})}
            other = program.finished(daemon, scene(contact=contact))
            entry = entries[name]
            force = {"peak_contact_force": None} if name == "impulse" else {}  # impulses have none
            assert entry["summary"].items() <= {**other["summary"], **force}.items(), name
            b = series(daemon, other["result"])["displacement"]
            density = numpy.array(entry["density"])
            band = (frequency >= entry["psd"]["from"]) & (frequency <= entry["psd"]["to"])
            level = numpy.sqrt(numpy.mean((10 * numpy.log10(density[band] / wanted[band])) ** 2))
            assert close(entry["psd"]["level"], level), name
            assert close(entry["psd"]["difference"], abs(density - wanted)[band].sum() / wanted[band].sum())
            assert close(entry["psd"]["power"], density[band].sum() / wanted[band].sum() - 1, 1e-7)
            told = entry["displacement"]
            assert close(told["relative"], numpy.sqrt(((b - a) ** 2).sum() / (a ** 2).sum()))
            assert close(told["correlation"], numpy.corrcoef(a, b)[0, 1])
            apart = numpy.flatnonzero(abs(b - a) > 0.01 * abs(a).max())
            assert close(entry["divergence"]["time"], apart[0] / 1000) and entry["divergence"]["is_trusted"]
            ratio = entry["summary"]["rms_displacement"] / own["summary"]["rms_displacement"] - 1
            assert close(entry["differences"]["rms_displacement"], ratio, 1e-7)
            assert entry["differences"]["impacts"] == entry["summary"]["impacts"] - own["summary"]["impacts"]
            assert min(entry["trace"]["minimum"]) == b.min() and max(entry["trace"]["maximum"]) == b.max()
        rows = list(csv.DictReader(io.StringIO(daemon.get(base + "/compare.csv").body.decode())))
        assert len(rows) == 9
        for row, entry in zip(rows, answer["entries"]):
            assert row["model"] == entry["contact_model"] and row["why"] == (entry["why"] or "")
            for cell, value in (("rms_displacement [m]", entry["summary"]["rms_displacement"]),
                                ("psd.level [dB]", entry["psd"]["level"]),
                                ("divergence [s]", entry["divergence"]["time"])):
                assert row[cell] == "nan" if value is None else float(row[cell]) == value, (row, cell)
        chart = daemon.get(base + "/compare.svg")
        check_chart(chart.body.decode(), ["impulse", "spring_damper, zero_force"])
        known = daemon.get(base + "/compare.svg", headers={"If-None-Match": chart.headers["etag"]})
        assert known.status == 304
        for told in (chart, known): # its own rules and nothing else
            policy = told.headers["content-security-policy"]
            assert policy.startswith("default-src 'none'; style-src 'unsafe-inline'; ") and "script" not in policy, policy
        assert daemon.get(base + "/compare", headers={"Accept": "text/csv"}).headers["content-type"].startswith("text/csv")
        assert daemon.get(base + "/sensitivity.json").status == 404
        assert daemon.get(base + "/compare.npy").status == 404


def test_models_and_rules_can_be_chosen():
    """Models alone take the scene's rule, rules alone the scene's model; the reference stays first."""
    with program.daemon() as daemon:
        def names(**members):
            job = program.finished(daemon, scene(duration=1, study={"kind": "compare", **members}))
            answer = daemon.get(f"/v1/results/{job['result']}/compare.json").json()
            return [entry["name"] for entry in answer["entries"]]
        own = "spring_damper, zero_penetration"
        assert names(models=["impulse", "spring_damper"]) == [own, "impulse"]
        assert names(separations=["zero_force"]) == [own, "spring_damper, zero_force"]
        assert names(models=["flores"], separations=["zero_force"]) == [own, "flores"]
        for members, pointer in (({"models": ["hertzz"]}, "/study/models/0"), ({"band": [3, 2]}, "/study/band"),
                                 ({"storey": 2}, "/study/storey"), ({"part": 0}, "/study/part"),
                                 ({"separations": ["none"]}, "/study/separations/0")):
            reply = daemon.submit(scene(study={"kind": "compare", **members}))
            assert reply.status == 422 and reply.json()["errors"][0]["pointer"] == pointer, (members, reply)


def test_aluminium_may_take_impulses_and_the_sponge_may_not():
    """The paper's thesis as spectra's distances in dB, 0.5 to 15 and 15 to 100 Hz, in free vibration of 30 s."""
    for buffer, wanted in (("aluminium", (2.8, 7.6)), ("sponge", (8.6, 20.4))):
        for band, level in zip(([0.5, 15], [15, 100]), wanted):
            document = {**program.scene("paper_free_" + buffer), "duration": 30, "output": {"channels": []},
                        "study": {"kind": "compare", "models": ["impulse"], "band": band}}
            code, out, errors = program.run("study", "-", text=json.dumps(document))
            assert code == 0, errors
            assert abs(json.loads(out)["entries"][1]["psd"]["level"] - level) < 0.06, (buffer, band)


def test_the_command_makes_the_study_of_the_document():
    """`impactd study` prints the daemon's bytes, or writes all formats; without a study it says so."""
    text = json.dumps(scene(study={"kind": "compare", "models": ["impulse"]}))
    code, out, errors = program.run("study", "-", text=text)
    assert code == 0 and errors == "", errors
    with program.daemon() as daemon:
        job = program.finished(daemon, json.loads(text))
        assert daemon.get(f"/v1/results/{job['result']}/compare.json").body.decode() == out
        with tempfile.TemporaryDirectory() as folder:
            paths = [os.path.join(folder, "out." + ending) for ending in ("json", "csv", "svg")]
            code, printed, errors = program.run("study", "-", *[word for path in paths for word in ("-o", path)], text=text)
            assert (code, printed, errors) == (0, "", ""), (code, printed, errors)
            for path in paths:
                with open(path, "rb") as file:
                    ending = path.rsplit(".", 1)[1]
                    assert file.read() == daemon.get(f"/v1/results/{job['result']}/compare.{ending}").body, path
    code, out, errors = program.run("study", "-", text=json.dumps(scene()))
    assert code == 3 and out == "" and "/study: is required" in errors, errors
    assert program.run("study", "-", "-o", "out.npy", text=text)[0] == 2


def test_two_results_are_set_side_by_side():
    """Metrics, only the inputs that differ, motions and spectra as NumPy has them; jobs stand for their results."""
    with program.daemon() as daemon:
        one = program.finished(daemon, scene(title="one"))
        other = scene(title="other")
        other["dampers"] = [{**other["dampers"][0], "clearance": 0.016}]
        two = program.finished(daemon, other)
        reply = daemon.get(f"/v1/compare?a={one['result']}&b={two['result']}")
        told = reply.json()
        assert told["inputs"] == [{"pointer": "/dampers/0/clearance", "a": 0.015, "b": 0.016, "detail": None}], told["inputs"]
        assert told["more_inputs"] == 0 and told["warnings"] == [] and told["a"]["id"] == one["result"]
        for metric in told["metrics"]:
            a, b = one["summary"][metric["name"]], two["summary"][metric["name"]]
            assert (metric["a"], metric["b"]) == (a, b), metric
            if a is not None and b is not None:
                assert metric["difference"] == b - a
        a, b = (series(daemon, job["result"]) for job in (one, two))
        assert [channel["channel"] for channel in told["channels"]] == list(a)
        for channel in told["channels"]:
            x, y = a[channel["channel"]], b[channel["channel"]]
            assert close(channel["difference_rms"], numpy.sqrt(numpy.mean((y - x) ** 2)))
            assert close(channel["correlation"], numpy.corrcoef(x, y)[0, 1])
        x, y = a["displacement"], b["displacement"]
        apart = numpy.flatnonzero(abs(y - x) > 0.01 * abs(x).max())[0] / 1000
        assert close(told["divergence"]["time"], apart) and told["divergence"]["is_trusted"]
        assert [spectrum["channel"] for spectrum in told["psd"]] == ["mean_acceleration"] and told["psd"][0]["level"] > 1
        assert daemon.get(f"/v1/compare?a={one['id']}&b={two['id']}").body == reply.body
        tag = {"If-None-Match": reply.headers["etag"]}
        assert daemon.get(f"/v1/compare?a={one['result']}&b={two['result']}", headers=tag).status == 304
        assert daemon.get(f"/v1/compare?a={two['result']}&b={one['result']}", headers=tag).status == 200
        same = daemon.get(f"/v1/compare?a={one['result']}&b={one['result']}").json()
        assert same["inputs"] == [] and same["divergence"]["time"] is None and same["psd"][0]["level"] == 0


def test_other_rates_and_durations_are_compared_over_the_common_span():
    """At the samples of the coarser one, with a warning each; a channel that one lacks is left out."""
    with program.daemon() as daemon:
        one = program.finished(daemon, scene())
        two = program.finished(daemon, scene(sample_rate=250, duration=2, output={"channels": ["displacement"], "psd": None}))
        told = daemon.get(f"/v1/compare?a={one['result']}&b={two['result']}").json()
        details = " ".join(warning["detail"] for warning in told["warnings"])
        assert "1000 and 250 Hz" in details and "4 and 2 s" in details, details
        (channel,) = told["channels"]
        assert channel["channel"] == "displacement" and channel["samples"] == 501 and channel["to"] == 2
        assert channel["relative"] < 1e-12 and told["psd"] == [] and told["divergence"]["time"] is None
        pointers = [one["pointer"] for one in told["inputs"]]
        assert "/duration" in pointers and "/sample_rate" in pointers


def test_series_are_computed_again_where_they_are_not_in_memory():
    """After a restart the comparison waits for both, and has the same bytes."""
    with tempfile.TemporaryDirectory() as folder:
        with program.daemon(data=folder) as daemon:
            one, two = (program.finished(daemon, scene(duration=duration)) for duration in (3, 4))
            path = f"/v1/compare?a={one['result']}&b={two['result']}"
            first = daemon.get(path).body
            ask = {"a": one["result"], "channel": "displacement", "align": "auto", "measured": {
                "samples": list(series(daemon, one["result"])["displacement"][1000:2000]), "interval": 0.001,
                "quantity": "displacement"}}
            beside = daemon.request("POST", "/v1/compare", json=ask).body
        for _ in range(2):
            with program.daemon(data=folder) as daemon:
                assert daemon.get(path).body == first
        with program.daemon(data=folder) as daemon:
            assert daemon.request("POST", "/v1/compare", json=ask).body == beside


def test_what_another_engine_made_is_compared_without_its_series():
    """Metrics and inputs stay, motions and spectra are null with a warning, and the answer is not for ever; POST: 410."""
    with tempfile.TemporaryDirectory() as folder:
        # Series on the disk would outlast the engine.
        with program.daemon("--store-bytes", "0", data=folder) as daemon:
            one, two = (program.finished(daemon, scene(duration=duration)) for duration in (1, 2))
        with sqlite3.connect(os.path.join(folder, "impactd.db")) as database:
            # Without the checksums of id and engine, which stand at the end, as rows of earlier versions are.
            database.execute("UPDATE results SET engine = 'impactd-0', checks = substr(checks, 1, length(checks) - 8) WHERE id = ?",
                             (two["result"],))
        database.close()
        with program.daemon(data=folder) as daemon:
            reply = daemon.get(f"/v1/compare?a={one['result']}&b={two['result']}")
            told = reply.json()
            assert told["b"]["engine"] == "impactd-0" and told["inputs"][0]["pointer"] == "/duration"
            assert told["channels"] is None and told["psd"] is None and told["divergence"] is None
            assert "made by impactd-0" in told["warnings"][0]["detail"], told["warnings"]
            assert "etag" not in reply.headers and "immutable" not in reply.headers.get("cache-control", "")
            assert told["metrics"][0]["b"] == two["summary"]["peak_displacement"]
            assert daemon.request("POST", "/v1/compare", json={
                "a": two["result"], "measured": measured(range(100))}).status == 410


def test_faults_of_a_comparison_are_told():
    """400 without an id, 404 for none such, 409 for a job without a result."""
    with program.daemon() as daemon:
        job = program.finished(daemon, scene(duration=1))
        for query, status in (("", 400), (f"?a={job['id']}", 400), ("?a=&b=", 400), (f"?a={job['id']}&b=r-0", 404),
                              (f"?a=j-0&b={job['id']}", 404), (f"?a={job['id']}&b={job['id']}&c=1", 400)):
            assert daemon.get("/v1/compare" + query).status == status, query
        slow = endless()
        running = daemon.submit(slow, headers={"Prefer": "respond-async"}).json()["id"]
        reply = daemon.get(f"/v1/compare?a={running}&b={job['id']}")
        assert reply.status == 409 and "has no result" in reply.json()["detail"], reply
        daemon.request("DELETE", f"/v1/jobs/{running}")


def measured(samples, interval=0.001, **members):
    return {"samples": list(samples), "interval": interval, **members}


def test_a_measured_motion_is_set_beside_a_result():
    """Its numbers are those of the definitions; a shift is applied as given or found to a part of a sample."""
    with program.daemon() as daemon:
        job = program.finished(daemon, scene())
        a = series(daemon, job["result"])["mean_acceleration"]
        noise = numpy.random.default_rng(1).normal(size=3000) * 0.05
        ask = {"a": job["result"], "channel": "mean_acceleration"}

        def post(**members):
            reply = daemon.request("POST", "/v1/compare", json={**ask, **members})
            assert reply.status == 200, reply
            return reply.json()

        part = a[400:3400] + noise
        told = post(measured=measured(part), shift=0.4)
        motion, x = told["motion"], a[400:3400]
        assert told["shift"] == 0.4 and told["unit"] == "m/s^2" and motion["samples"] == 3000 and told["warnings"] == []
        assert close([motion["from"], motion["to"]], [0.4, 3.399])
        for name, value in (("rms", (x ** 2).mean() ** 0.5), ("other_rms", (part ** 2).mean() ** 0.5),
                            ("relative", ((part - x) ** 2).sum() ** 0.5 / (x ** 2).sum() ** 0.5),
                            ("correlation", numpy.corrcoef(x, part)[0, 1]), ("difference_peak", abs(part - x).max())):
            assert close(motion[name], value), (name, motion[name], value)
        frequency, wanted = scipy.signal.welch(x, 1000, nperseg=3000)
        _, density = scipy.signal.welch(part, 1000, nperseg=3000)
        band = (frequency >= told["psd"]["from"]) & (frequency <= told["psd"]["to"])
        level = numpy.sqrt(numpy.mean((10 * numpy.log10(density[band] / wanted[band])) ** 2))
        assert told["psd"]["segment"] == 3000 and close(told["psd"]["level"], level, 1e-6)
        both = post(measured=measured(part), shift=0.4, densities=True)
        lists = {name: both["psd"].pop(name) for name in ("frequency", "a", "measured")}
        assert both == told
        for name, values in (("frequency", frequency), ("a", wanted), ("measured", density)):
            assert numpy.allclose(lists[name], values, 1e-9, 1e-12 * max(values)), name
        found = post(measured=measured(part), align="auto")
        assert abs(found["shift"] - 0.4) < 1e-3 and found["motion"]["correlation"] > 0.99
        assert abs(post(measured=measured(part), align="auto", most_shift=0.1)["shift"]) <= 0.101
        coarse = post(measured=measured(a[::4], 0.004))
        assert coarse["motion"]["samples"] == 1001 and coarse["motion"]["relative"] < 1e-12
        fine = post(measured=measured(numpy.interp(numpy.arange(8000) / 2000, numpy.arange(a.size) / 1000, a), 0.0005))
        assert fine["motion"]["relative"] < 1e-9 and "2000 samples a second" in fine["warnings"][0]["detail"]
        own = daemon.request("POST", "/v1/compare", json={"a": job["id"], "measured": measured(
            series(daemon, job["result"])["displacement"], quantity="displacement")}).json()
        assert own["channel"] == "displacement" and own["motion"]["relative"] == 0
        forces = program.finished(daemon, scene(output={"channels": ["contact_force"]}))["result"]
        own = daemon.request("POST", "/v1/compare", json={"a": forces, "channel": "contact_force", "measured": measured(
            series(daemon, forces)["contact_force"], quantity="force")}).json()
        assert own["unit"] == "N" and own["motion"]["relative"] == 0


def test_what_does_not_fit_a_comparison_is_told():
    """Channels and spectra beyond those that are compared: as many as there are, in a warning."""
    storeys = 25
    frame = {"kind": "frame", "masses": [1] * storeys, "stiffnesses": [1e4] * storeys, "dampings": [1] * storeys}
    channels = [f"{name}_{i}" for name in ("displacement", "velocity", "mean_acceleration") for i in range(1, storeys + 1)]
    with program.daemon() as daemon:
        jobs = [program.finished(daemon, {"structure": frame, "duration": 1, "sample_rate": 200, "excitation": {
            "kind": "sine", "frequency": f, "amplitude": 1}, "output": {"channels": channels, "psd": {"channels": channels, "segment": 64}}})
            for f in (1, 2)]
        told = daemon.get(f"/v1/compare?a={jobs[0]['id']}&b={jobs[1]['id']}").json()
        assert len(told["channels"]) == 64 and len(told["psd"]) == 64
        details = [warning["detail"] for warning in told["warnings"]]
        assert any(detail.startswith("11 more channels of both") for detail in details), details
        assert any(detail.startswith("11 more spectra of both") for detail in details), details


def test_a_measurement_comes_as_a_table_too():
    """text/csv and text/plain as `impactd import` reads them, with the rest in the query, answer what the same JSON does."""
    with program.daemon() as daemon:
        result = program.finished(daemon, scene())["result"]
        table = daemon.get(f"/v1/results/{result}/series.csv?channels=acceleration&from=0.4&to=2").body
        samples = [float(line.split(",")[1]) for line in table.decode().splitlines()[1:]]

        def post(query, body, kind="text/csv"):
            return daemon.request("POST", f"/v1/compare?a={result}{query}", body=body, headers={"Content-Type": kind})
        asked = {"a": result, "measured": measured(samples, start=0.4), "shift": 0.01}
        wanted = daemon.request("POST", "/v1/compare", json=asked)
        told = post("&shift=0.01", table)
        assert told.status == 200 and told.body == wanted.body, told
        assert post("&shift=0.01", table.replace(b",", b" "), "text/plain").body == wanted.body
        # One column in g, its interval told beside it.
        column = "\n".join(repr(sample / 9.80665) for sample in samples)
        told = post("&interval=0.001&unit=g&shift=0.4&channel=acceleration", column, "text/plain; charset=utf-8").json()
        assert told["motion"]["samples"] == 1601 and told["motion"]["relative"] < 1e-12, told["motion"]
        found = daemon.request("POST", "/v1/compare", json={**asked, "align": "auto"})
        assert post("&align=auto", table).body == found.body
        found = daemon.request("POST", "/v1/compare", json={**asked, "densities": True})
        assert post("&shift=0.01&densities=1", table).body == found.body
        for query, body, status, words in (
                ("", b"time [s],acceleration [m/s^2]\n0,1\n0.1,x\n", 400, "line 3"),
                ("&align=best", table, 422, "given, auto"), ("&unit=mm", table, 422, "cm/s^2"), ("&shift=x", table, 400, "shift"),
                ("&interval=1", table, 400, "interval"), ("&channel=displacement", table, 422, "m/s^2"),
                ("&quantity=force", table, 400, "quantity"), ("", b"", 400, "no body"), ("", column, 400, "interval"),
                ("", b"time [s],acceleration [m/s^2]\n0,1\n0.1,2\n0.2,3\n", 422, "at least 16 samples, are 3")):
            reply = post(query, body)
            assert reply.status == status and words in json.dumps(reply.json()), (query, reply)
        # A decimal comma is no separator.
        assert post("", table, "text/plain").status == 400
        refused = post("", table, "application/x-npy")
        assert refused.status == 415 and "text/csv" in refused.json()["detail"] and "application/json" in refused.json()["detail"], refused
        both = daemon.request("POST", "/v1/compare?shift=1", json=asked)
        assert both.status == 400 and '"shift" is a member' in both.json()["detail"], both
        assert daemon.request("POST", "/v1/compare", body=table, headers={"Content-Type": "text/csv"}).status == 422


def test_faults_of_a_measurement_are_told_at_their_places():
    """422 with the pointer, 400 for what is not JSON, 404 for no result, 415 for another type, 413 for too much."""
    with program.daemon() as daemon:
        job = program.finished(daemon, scene(duration=1))
        good = {"a": job["result"], "measured": measured(range(100))}
        for change, pointer in (({"measured": {"samples": [1] * 100}}, "/measured/interval"),
                                ({"measured": measured(range(15))}, "/measured/samples"),
                                ({"measured": measured(range(100), 0)}, "/measured/interval"),
                                ({"measured": measured(["x"] * 100)}, "/measured/samples/0"),
                                ({"measured": measured(range(100), quantity="strain")}, "/measured/quantity"),
                                ({"channel": "contact_force"}, "/channel"), ({"channel": "displacement"}, "/channel"),
                                ({"align": "best"}, "/align"), ({"shift": "auto"}, "/shift"), ({"b": 1}, "/b"),
                                ({"most_shift": 0}, "/most_shift")):
            reply = daemon.request("POST", "/v1/compare", json={**good, **change})
            assert reply.status == 422 and reply.json()["errors"][0]["pointer"] == pointer, (change, reply)
            assert reply.json()["title"].startswith("The comparison has "), reply
            if "channel" in change:
                assert reply.json()["errors"][0]["value"] == change["channel"], reply
        far = daemon.request("POST", "/v1/compare", json={**good, "shift": 1e6})
        assert far.status == 422 and "only 0 samples" in far.json()["detail"], far
        assert daemon.request("POST", "/v1/compare", json={**good, "shift": 1e10}).json()["errors"][0]["pointer"] == "/shift"
        assert daemon.request("POST", "/v1/compare", json={**good, "measured": measured([1] * 100), "align": "auto"}).status == 422
        assert daemon.request("POST", "/v1/compare", json={**good, "a": "r-0"}).status == 404
        assert daemon.request("POST", "/v1/compare", json={**good, "measured": measured([1e300, -1e300] * 50)}).status in (200, 422)
        for start in (1e308, -1e9, 1e9):
            reply = daemon.request("POST", "/v1/compare", json={**good, "measured": measured(range(100), start=start), "align": "auto"})
            assert reply.status in (200, 422), reply
        for interval in (5e-324, 1e-9, 1e6):
            for align in ("auto", "given"):
                reply = daemon.request("POST", "/v1/compare", json={**good, "measured": measured(range(100), interval), "align": align})
                assert reply.status in (200, 422), reply
        typed = {"Content-Type": "application/json"}
        assert daemon.request("POST", "/v1/compare", body="{", headers=typed).status == 400
        assert daemon.request("POST", "/v1/compare", body="{}").status == 415
        assert daemon.request("POST", "/v1/compare", body=b" " * (1 << 24) + b"x", headers=typed).status == 413


if __name__ == "__main__":
    program.main(globals())
