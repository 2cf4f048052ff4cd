#!/usr/bin/env python3
"""Ground-motion records: uploaded once, named by scenes, the same for ever, deleted only when nothing uses them."""

import hashlib
import io
import json
import math
import os
import random
import shutil
import struct
import sys
import tempfile
import threading
import time
import urllib.parse

import numpy
import scipy.io
import scipy.signal

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from access import bearer, token  # noqa: E402
from asking import problem  # noqa: E402
from program import until  # noqa: E402

SANITIZED = "nightly"
WAITS = True
G = 9.80665
TEXT = {"Content-Type": "text/plain"}
AT2 = ("STRONG MOTION RECORD\nSOMEWHERE, STATION 7, 090\nACCELERATION TIME HISTORY IN UNITS OF G\n"
       "NPTS= 4, DT= .01000 SEC\n .1 -.2\n .3 -.1\n")


def shake(seed=1, count=400, interval=0.02):
    """A base that comes to rest again, near enough: nobody doubts it."""
    chance = random.Random(seed)
    samples = [math.sin(math.pi * i / count) * math.sin(0.7 * i) * chance.uniform(0.8, 1) for i in range(count)]
    mean = sum(samples) / count
    return {"interval": interval, "samples": [value - mean for value in samples]}


def scene(excitation, **changes):
    return {**program.scene("paper_free_sponge"), "excitation": {"kind": "record", **excitation}, "duration": 4,
            **changes}


def upload(daemon, name, status=201, **more):
    reply = daemon.request("POST", "/v1/records", json={"name": name, **shake(), **more})
    assert reply.status == status, reply
    return reply.json()


def send(daemon, text, status=201, headers=None, **query):
    reply = daemon.request("POST", "/v1/records?" + urllib.parse.urlencode(query), body=text,
                           headers={**TEXT, **(headers or {})})
    assert reply.status == status, reply
    return reply.json()


def digest(interval, samples):
    return hashlib.sha256(struct.pack(f"<{1 + len(samples)}d", interval, *samples)).hexdigest()


def places(document):
    return {warning["pointer"] for warning in document["warnings"]}


def samples_of(daemon, name):
    return daemon.get(f"/v1/records/{name}/samples.json").json()["channels"]["acceleration"]["values"]


def test_every_layout_comes_back_in_si():
    """Files in the layouts of `impactd import`, and JSON: interval, unit, peak, digest and samples are what they hold."""
    cases = [
        (AT2, {}, "at2", "g", "g", 0.01, [.1, -.2, .3, -.1], G),
        ("4 0.01 NPTS, DT\n.1 -.2 .3\n-.1\n", {"unit": "cm/s^2"}, "at2_value_first", "cm/s^2", None, 0.01,
         [.1, -.2, .3, -.1], 0.01),
        ("test\n4 0.01\n.1\n-.2\n.3\n-.1\n", {"unit": "m/s^2"}, "count_line", "m/s^2", None, 0.01, [.1, -.2, .3, -.1], 1),
        ("0 .1\n.01 -.2\n.02 .3\n.03 -.1\n", {"unit": "g"}, "time_acceleration", "g", None, 0.01, [.1, -.2, .3, -.1], G),
        (".1 -.2 .3\n-.1 .4 0\n", {"unit": "g", "interval": 0.02}, "columns", "g", None, 0.02,
         [.1, -.2, .3, -.1, .4, 0], G),
        (".1\n-.2\n-0\n", {"unit": "m/s^2", "interval": 0.5}, "one_column", "m/s^2", None, 0.5, [.1, -.2, 0.0], 1),
    ]
    with program.daemon() as daemon:
        for i, (text, query, layout, unit, stated, interval, values, size) in enumerate(cases):
            for suffix, headers in (("t", TEXT), ("o", {"Content-Type": "application/octet-stream"})):
                name = f"r{i}{suffix}"
                told = send(daemon, text, name=name, headers=headers, **query)
                expected = [value * size for value in values]
                assert samples_of(daemon, name) == expected, name
                peak = max(map(abs, expected))
                at = list(map(abs, expected)).index(peak)
                assert (told["layout"], told["unit"], told["stated_unit"], told["interval"], told["count"]) == (
                    layout, unit, stated, interval, len(values)), told
                assert told["peak"] == peak and math.isclose(told["peak_time"], at * interval), told
                assert told["digest"] == digest(interval, expected), told
                assert told["author"] is None and told["used_by"] == {"results": 0, "unfinished_jobs": 0}, told
                assert {"/source", "/processing"} <= places(told), told
                twins = [w["detail"] for w in told["warnings"] if "under another name" in w["detail"]]
                assert suffix == "t" or f"r{i}t" in twins[0], told
        assert "STATION 7" in daemon.get("/v1/records/r0t").json()["header"]
        told = upload(daemon, "json", samples=[1, -2, 2, -1], unit="cm/s^2", source="made", processing="none",
                      earthquake="none", station="here", notes="a \"note\"")
        assert told["layout"] == "json" and told["notes"] == 'a "note"' and told["warnings"] == [], told
        assert samples_of(daemon, "json") == [0.01, -0.02, 0.02, -0.01]
        commas = send(daemon, "0,.1\n.01,-.2\n.02,.1\n", name="csv", unit="g", headers={"Content-Type": "text/csv"})
        assert commas["layout"] == "time_acceleration" and commas["count"] == 3, commas


def test_published_files_are_taken_as_they_are():
    """The published motions that are here are kept with their peaks, and a scene runs on each."""
    folder = os.path.join(program.SOURCE, "..", "shared", "data", "records")
    if not os.path.isdir(folder):
        raise program.Skipped("the published records are not here")
    with program.daemon() as daemon:
        for name, peak in (("elcentro1940_array9_180_IELC180.AT2", 0.312881), ("kobe1995_nishiakashi_NIS090.AT2", 0.502749),
                           ("northridge1994_castaic_090_time_accel.dat", 0.5683)):
            with open(os.path.join(folder, name), "rb") as file:
                told = send(daemon, file.read(), name=name, source="PEER", processing="as published")
            assert abs(told["peak"] / G - peak) <= 5.01e-7 and told["warnings"] == [], told
            assert program.finished(daemon, scene({"name": name}))["summary"]["peak_displacement"] > 0


def test_samples_are_had_in_every_format():
    """json, csv, npy, npz and mat hold the same numbers and times, to the bit."""
    with program.daemon() as daemon:
        given = shake()
        upload(daemon, "r")
        time = numpy.arange(400) / 50
        get = lambda kind: daemon.get(f"/v1/records/r/samples.{kind}").body  # noqa: E731
        table = numpy.loadtxt(io.StringIO(get("csv").decode()), delimiter=",", skiprows=1)
        assert get("csv").startswith(b"time [s],acceleration [m/s^2]\n")
        assert (table == numpy.load(io.BytesIO(get("npy")))).all()
        assert (table[:, 0] == time).all() and table[:, 1].tolist() == given["samples"]
        packed, matlab = numpy.load(io.BytesIO(get("npz"))), scipy.io.loadmat(io.BytesIO(get("mat")))
        for one in (packed, matlab):
            assert one["acceleration"].ravel().tolist() == given["samples"]
        reply = daemon.get("/v1/records/r/samples", headers={"Accept": "text/csv"})
        assert reply.body == get("csv")
        assert daemon.get("/v1/records/r/samples.npy", headers={"If-None-Match": daemon.get(
            "/v1/records/r/samples.npy").headers["etag"]}).status == 304
        assert daemon.get("/v1/records/r/samples.xml").status == 404


def test_a_window_and_extremes_of_samples():
    """from, to and points are those of a result's series: both ends, every peak, faults of the query told."""
    with program.daemon() as daemon:
        given = numpy.array(shake()["samples"])
        upload(daemon, "r")
        get = lambda query: daemon.get(f"/v1/records/r/samples.json?{query}").json()  # noqa: E731
        part = get("from=1&to=2.5")
        assert part["start"] == 1 and part["count"] == 76
        assert part["channels"]["acceleration"]["values"] == given[50:126].tolist()
        thin = get("from=1&to=2.5&points=10")
        assert (thin["start"], thin["bucket"]) == (1, 8)
        buckets = [given[at:min(at + 8, 126)] for at in range(50, 126, 8)]
        assert thin["channels"]["acceleration"]["min"] == [each.min() for each in buckets]
        assert thin["channels"]["acceleration"]["max"] == [each.max() for each in buckets]
        table = numpy.load(io.BytesIO(daemon.get("/v1/records/r/samples.npy?points=10").body))
        assert table.shape == (10, 3) and table[:, 1].min() == given.min() and table[:, 2].max() == given.max()
        assert len(get("from=7.98")["channels"]["acceleration"]["values"]) == 1
        for query in ("from=8", "from=2&to=1", "points=0", "points=x", "channels=acceleration"):
            for headers in ({}, {"If-None-Match": "*"}):
                problem(daemon.get(f"/v1/records/r/samples.json?{query}", headers=headers), 400)


def test_a_named_record_is_the_same_as_its_samples():
    """A scene that names a record has to the byte the series of one with those samples; its canonical form is small."""
    with program.daemon() as daemon:
        told = upload(daemon, "r")
        named = program.finished(daemon, scene({"name": "r", "scale": 2}))
        inline = program.finished(daemon, scene({**shake(), "scale": 2}))
        assert named["result"] != inline["result"] and named["summary"] == inline["summary"]
        series = [daemon.get(f"/v1/results/{job['result']}/series.npy").body for job in (named, inline)]
        assert series[0] == series[1]
        result = daemon.get(f"/v1/results/{named['result']}").json()
        assert result["scene"]["excitation"] == {"kind": "record", "displacement": 0, "velocity": 0, "name": "r",
                                                 "digest": told["digest"], "scale": 2}
        again = program.finished(daemon, result["scene"])
        assert again["cached"] and again["result"] == named["result"]
        kept = daemon.get(f"/v1/results/{inline['result']}").json()["scene"]["excitation"]
        assert list(kept) == ["kind", "displacement", "velocity", "samples", "interval", "scale"], list(kept)
        manifest = daemon.get(f"/v1/results/{named['result']}/manifest").json()
        assert told["digest"] in json.dumps(manifest)
        compared = daemon.get(f"/v1/compare?a={named['result']}&b={inline['result']}").json()
        assert "/excitation/name" in json.dumps(compared), compared


def test_names_that_cannot_stand_for_anything():
    """An unknown name is told with the nearest; what stands beside a name, or a digest without one, is a fault."""
    with program.daemon() as daemon:
        faults = problem(daemon.submit(scene({"name": "elcentro"})), 422, "/excitation/name")["errors"]
        assert "there are none" in faults[0]["detail"], faults
        upload(daemon, "elcentro")
        fault = problem(daemon.submit(scene({"name": "elcentr"})), 422, "/excitation/name")["errors"][0]
        assert fault["did_you_mean"] == "elcentro" and fault["value"] == "elcentr", fault
        for name in ("", "..", "a/b", "x" * 64, "é"):
            problem(daemon.submit(scene({"name": name})), 422, "/excitation/name")
        problem(daemon.submit(scene({"name": "elcentro", **shake()})), 422, "/excitation/samples", "/excitation/interval")
        problem(daemon.submit(scene({"name": "elcentro", "digest": "00"})), 422, "/excitation/digest")
        problem(daemon.submit(scene({**shake(), "digest": "00"})), 422, "/excitation/digest")
        problem(daemon.submit(scene({})), 422, "/excitation/samples", "/excitation/interval")
        problem(daemon.submit(scene({"name": "elcentro", "named": 1})), 422, "/excitation/named")
        problem(daemon.submit(scene({"name": "none"}, duration=-1)), 422, "/excitation/name", "/duration")
        doubt = daemon.request("POST", "/v1/jobs?dry_run=1", json=scene({"name": "elcentro", "scale": 1e3})).json()
        assert any(w["pointer"] == "/excitation/name" and "5 g" in w["detail"] for w in doubt["warnings"]), doubt
    code, _, errors = program.run("run", "-", text=json.dumps(scene({"name": "elcentro"})))
    assert code == 3 and "/excitation/name" in errors and "impactd import" in errors, (code, errors)


def test_a_name_never_comes_to_mean_other_samples_in_silence():
    """After a record was replaced under its name, the canonical scene of before is refused and says why."""
    with program.daemon() as daemon:
        upload(daemon, "r")
        job = program.finished(daemon, scene({"name": "r"}))
        kept = daemon.get(f"/v1/results/{job['result']}").json()["scene"]
        assert daemon.request("DELETE", f"/v1/results/{job['result']}").status == 204
        assert daemon.request("DELETE", "/v1/records/r").status == 204
        # What was answered a moment ago to the byte is no longer known.
        problem(daemon.submit(scene({"name": "r"})), 422, "/excitation/name")
        upload(daemon, "r", **shake(2))
        detail = problem(daemon.submit(kept), 422, "/excitation/digest")["detail"]
        assert "has been deleted" in detail, detail
        other = program.finished(daemon, scene({"name": "r"}))
        assert other["result"] != job["result"]


def test_a_record_goes_only_when_nothing_uses_it():
    """409 tells how many results and unfinished jobs use it; records of other names do not count."""
    with program.daemon("--workers", "1") as daemon:
        upload(daemon, "r")
        upload(daemon, "r2", **shake(2))
        job = program.finished(daemon, scene({"name": "r"}))
        endless = scene({"name": "r", "scale": 3}, duration=2000, sample_rate=10, output={"channels": [], "psd": None, "reduction": False},
                        accuracy={"solver": "rk4", "step": 1e-5})
        running = daemon.submit(endless, headers={"Prefer": "respond-async"}).json()["id"]
        assert "1 result and 1 unfinished job" in problem(daemon.request("DELETE", "/v1/records/r"), 409)["detail"]
        before = daemon.get("/v1/records/r")
        assert before.json()["used_by"] == {"results": 1, "unfinished_jobs": 1}, before
        daemon.request("DELETE", f"/v1/jobs/{running}")
        assert until(lambda: daemon.get("/v1/records/r").json()["used_by"]["unfinished_jobs"] == 0)
        after = daemon.get("/v1/records/r", headers={"If-None-Match": before.headers["etag"]})
        assert after.status == 200 and after.headers["etag"] != before.headers["etag"], after
        problem(daemon.request("DELETE", "/v1/records/r"), 409)
        assert daemon.request("DELETE", f"/v1/results/{job['result']}").status == 204
        for name in ("r", "r2"):
            assert daemon.request("DELETE", f"/v1/records/{name}").status == 204, name
            for path in (f"/v1/records/{name}", f"/v1/records/{name}/samples.csv"):
                assert daemon.get(path).status == 404, path
            problem(daemon.request("DELETE", f"/v1/records/{name}"), 404)
        assert daemon.get("/v1/records").json() == {"records": []}


def test_a_scene_and_a_deletion_at_once():
    """Of a scene that names a record and the record's deletion, sent at once, one is refused, 150 times."""
    with program.daemon("--workers", "1") as daemon:
        codes, jobs = [], []
        # The worker has something to do, so that rows of jobs are not written at once.
        slow = {"duration": 60, "output": {"channels": [], "psd": None}, "accuracy": {"solver": "rk4", "step": 1e-4}}
        for turn in range(150):
            name = f"r{turn}"
            upload(daemon, name)
            answers = {}

            def submit(name=name, answers=answers):
                answers["job"] = daemon.submit(scene({"name": name}, **slow), headers={"Prefer": "respond-async"})

            def delete(name=name, answers=answers, pause=(turn % 10) / 2000):
                time.sleep(pause)
                answers["record"] = daemon.request("DELETE", f"/v1/records/{name}")

            threads = [threading.Thread(target=one) for one in (submit, delete)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            codes.append((answers["job"].status, answers["record"].status))
            if answers["job"].status != 422:
                jobs.append(answers["job"].json()["id"])
            if len(jobs) > 20:
                daemon.request("DELETE", f"/v1/jobs/{jobs.pop(0)}")
        assert set(codes) <= {(422, 204), (202, 409), (200, 409)}, sorted(set(codes))
        for job in jobs:
            daemon.request("DELETE", f"/v1/jobs/{job}")


def test_two_uploads_of_one_name_at_once():
    """Of the same record sent eight times at once one is kept, the others are told it is there; other samples get 409."""
    with program.daemon() as daemon:
        codes = []

        def send_one(values):
            codes.append(daemon.request("POST", "/v1/records", json={"name": "r", **values}).status)

        for values, expected in ((shake(), [200] * 7 + [201]), (shake(2), [409] * 8)):
            codes.clear()
            threads = [threading.Thread(target=send_one, args=(values,)) for _ in range(8)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            assert sorted(codes) == expected, codes
        twin = upload(daemon, "same")
        assert any("of r," in warning["detail"] for warning in twin["warnings"]), twin
        problem(daemon.request("POST", "/v1/records", json={"name": "r", **shake(), "source": "x"}), 409)
        assert len(daemon.get("/v1/records").json()["records"]) == 2


def test_bad_uploads_are_refused_at_their_place():
    """What cannot be read has line and column; all faults of what is told of it come at once; nothing is kept."""
    with program.daemon() as daemon:
        for text, query, status, said in (
                ("0.1\n0.2 x 0.3\n", {"unit": "g", "interval": 1}, 400, "line 2, column 5"),
                ("", {}, 400, "no body"), ("nothing\n", {"unit": "g", "interval": 1}, 400, "line"),
                (AT2.replace("4,", "5,"), {}, 400, "line"), (AT2, {"interval": 0.02}, 400, "0.02 s is given"),
                (b"\0\1\2\3" * 100, {"unit": "g", "interval": 1}, 400, "line 1"),
                (b"PK\3\4\xff\xfe" * 100, {"unit": "g", "interval": 1}, 400, "line 1"),
                ("1e999\n", {"unit": "g", "interval": 1}, 400, "line 1"),
                (AT2, {"unit": "gal"}, 422, "cm/s^2"), (AT2, {"interval": "x"}, 400, "interval"),
                (AT2, {"interval": -1}, 400, "interval"), (AT2, {"samples": "1"}, 400, "samples"),
                (AT2, {"name": "../x"}, 422, "/name"), (AT2, {"name": "x" * 65}, 422, "/name"),
                (AT2, {"source": "x" * 1001}, 422, "/source"), (AT2, {"name": ""}, 422, "/name")):
            reply = daemon.request("POST", "/v1/records?" + urllib.parse.urlencode({"name": "r", **query}), body=text,
                                   headers=TEXT)
            assert said in json.dumps(problem(reply, status)), (text[:20], query, reply)
        for body, pointers in (({}, ["/name", "/interval", "/samples"]),
                               ({"name": ".", "interval": 0, "samples": []}, ["/name", "/interval", "/samples"]),
                               ({"name": "r", "interval": 1, "samples": ["a", 1], "x": 1}, ["/samples/0", "/x"]),
                               ({"name": "r", "interval": 1, "samples": [1e308], "unit": "g"}, ["/samples/0"]),
                               ({"name": "r", "interval": 1e6, "samples": [1e305, 1e305]}, ["/samples"]),
                               ({"name": "r", "interval": 1e-310, "samples": [1, 1]}, ["/interval"]),
                               ({"name": "r", "interval": 1.1e6, "samples": [1, 1]}, ["/interval"]),
                               ({"name": "r", "interval": 1, "samples": [[1]]}, ["/samples/0"]),
                               ({"name": 1, "interval": "1", "samples": 1}, ["/name", "/interval", "/samples"])):
            problem(daemon.request("POST", "/v1/records", json=body), 422, *pointers)
        problem(daemon.request("POST", "/v1/records?name=r", json={"name": "r", **shake()}), 400)
        problem(daemon.request("POST", "/v1/records", body='{"name": "r", "name": "s"}',
                               headers={"Content-Type": "application/json"}), 400)
        problem(daemon.request("POST", "/v1/records", body='{"name": "r", "interval": 1, "samples": [NaN]}',
                               headers={"Content-Type": "application/json"}), 400)
        for kind in ("application/x-www-form-urlencoded", "image/png", "multipart/form-data; boundary=x"):
            assert "text/plain" in problem(daemon.request("POST", "/v1/records?name=r", body=AT2,
                                                          headers={"Content-Type": kind}), 415)["detail"]
        for query in ("?limit=0", "?limit=501", "?x=1", "?q=" + 201 * "x", "?after=" + 201 * "x"):
            problem(daemon.get("/v1/records" + query), 400)
        assert daemon.get("/v1/records").json() == {"records": []}
    with program.daemon("--max-body", "2048") as daemon:
        problem(daemon.request("POST", "/v1/records?name=r&unit=g&interval=1", body="0.1\n" * 600, headers=TEXT), 413)


def test_lists_are_paged_and_searched():
    """Pages follow each other by Link and hold every record once; q searches what is told of them."""
    with program.daemon() as daemon:
        names = [f"r{i:02}" for i in range(23)]
        for i, name in enumerate(names):
            upload(daemon, name, samples=[i, 1, -1], earthquake="Imperial Valley & sons" if i % 2 else "Kobe",
                   processing=f"filter {i}")
        found, path, pages = [], "/v1/records?limit=5", 0
        while path:
            reply = daemon.get(path)
            found += [record["name"] for record in reply.json()["records"]]
            link = reply.headers.get("link")
            path = link[1:link.index(">")] if link else None
            pages += 1
        assert found == names and pages == 5, (found, pages)
        reply = daemon.get("/v1/records?limit=5&q=" + urllib.parse.quote("VALLEY & s"))
        assert [record["name"] for record in reply.json()["records"]] == names[1:11:2]
        following = daemon.get(reply.headers["link"][1:reply.headers["link"].index(">")]).json()["records"]
        assert [record["name"] for record in following] == names[11:21:2], following
        assert len(daemon.get("/v1/records?q=filter+7").json()["records"]) == 1


def test_tokens_say_who_may():
    """Uploads and deletions take the scope materials; a record is its author's or an administrator's to delete."""
    data = tempfile.mkdtemp(prefix="impactd-")
    try:
        lab, other, reader, admin = (bearer(token(data, name, scopes)) for name, scopes in (
            ("lab", "read,submit,materials"), ("other", "read,materials"), ("reader", "read,submit"), ("root", "admin")))
        with program.daemon(data=data) as daemon:
            post = lambda who, name, **more: daemon.request(  # noqa: E731
                "POST", "/v1/records", json={"name": name, **shake(), **more}, headers=who)
            assert post({}, "r").status == 401
            assert post(reader, "r").status == 403
            assert post(lab, "r").json()["author"] == "lab"
            assert post(other, "r").status == 200  # the very same
            assert daemon.get("/v1/records/r", headers=reader).json()["author"] == "lab"
            assert daemon.get("/v1/records/r/samples.csv", headers=reader).status == 200
            for who in (reader, other):
                assert daemon.request("DELETE", "/v1/records/r", headers=who).status == 403
            assert daemon.request("DELETE", "/v1/records/r", headers=lab).status == 204
            assert post(lab, "s").status == 201
            assert daemon.request("DELETE", "/v1/records/s", headers=admin).status == 204
    finally:
        shutil.rmtree(data, ignore_errors=True)


def test_a_sweep_runs_over_records():
    """Names of records are an axis like any other: every point is what the scene that names it comes to."""
    with program.daemon("--workers", "2") as daemon:
        for seed, name in enumerate(("a", "b", "c")):
            upload(daemon, name, **shake(seed, 200 + seed, 0.01 * (1 + seed)))
        asked = scene({"name": "a"}, study={"kind": "sweep", "mode": "grid", "axes": [
            {"pointer": "/excitation/name", "values": ["a", "b", "c", "a"]},
            {"pointer": "/excitation/scale", "from": 1, "to": 3, "count": 3}]})
        job = program.finished(daemon, asked)
        table = daemon.get(f"/v1/results/{job['result']}/table.csv").body.decode().splitlines()
        assert len(table) == 13 and all(line.endswith(",made") for line in table[1:]), table
        for point in (0, 4, 8, 11):
            its = daemon.get(f"/v1/results/{job['result']}/points/{point}/scene").json()
            one = program.finished(daemon, its)
            row = daemon.get(f"/v1/results/{job['result']}/points/{point}").json()
            for name, value in row["metrics"].items():
                assert math.isclose(value, one["summary"][name], rel_tol=1e-9), (point, name, value, one["summary"])
        kept = daemon.get(f"/v1/results/{job['result']}").json()["scene"]
        assert [r["name"] for r in kept["study"]["records"]] == ["a", "b", "c"], kept["study"]
        assert program.finished(daemon, kept)["cached"]
        for name in ("b", "c"):
            problem(daemon.request("DELETE", f"/v1/records/{name}"), 409)
        asked["study"]["axes"][0]["values"] = ["a", "bb", 7]
        problem(daemon.submit(asked), 422, "/study/axes/0/values/1", "/study/axes/0/values/2")
        inline = scene({**shake()}, study={"kind": "sweep", "axes": [{"pointer": "/excitation/name", "values": ["a", "b"]}]})
        assert daemon.submit(inline).status == 422
        digests = scene({"name": "a"}, study={"kind": "sweep", "axes": [{"pointer": "/excitation/digest", "values": ["0"]}]})
        assert daemon.submit(digests).status == 422


def test_a_file_is_a_record_where_there_is_no_daemon():
    """--record FILE: the scene names it as on a daemon, and its result has the same id; 3 and 4 for what is no record."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "shaken.txt")
        with open(path, "w", encoding="ascii") as file:
            file.write("5 0.02\n0\n0.1\n-0.2\n0.1\n0\n")
        asked = json.dumps(scene({"name": "shaken"}))
        code, out, _ = program.run("run", "-", "--record", path, "--unit", "g", text=asked)
        assert code == 0
        with open(path, "rb") as file, program.daemon() as daemon:
            made = daemon.request("POST", "/v1/records?name=shaken&unit=g", body=file.read(), headers={"Content-Type": "text/plain"})
            assert made.status == 201, made
            assert program.finished(daemon, scene({"name": "shaken"}))["result"] == json.loads(out)["result"]
        code, _, errors = program.run("run", "-", text=asked)
        assert code == 3 and "--record FILE" in errors, errors
        assert program.run("check", "-", "--record", path + "x", text=asked)[0] == 4
        assert program.run("run", "-", "--record", __file__, text=asked)[0] == 3


def test_studies_run_on_a_named_record():
    """compare, sensitivity and tradeoff of a scene that names a record answer as those of its samples."""
    with program.daemon("--workers", "2") as daemon:
        upload(daemon, "r")
        for study in ({"kind": "compare"}, {"kind": "sensitivity", "runs": 20, "restitution_deviation": 0.05}, {"kind": "tradeoff", "solvers": ["exact", "rk4"]}):
            named, inline = (program.finished(daemon, scene(excitation, study=study))
                             for excitation in ({"name": "r"}, shake()))
            answers = [daemon.get(f"/v1/results/{job['result']}").json()["study"] for job in (named, inline)]
            if study["kind"] != "tradeoff":  # whose times are never twice the same
                assert answers[0] == answers[1], study
            assert answers[0].keys() == answers[1].keys()


def test_a_new_daemon_goes_on_with_named_records():
    """Unfinished jobs and sweeps that name records go on after kill -9; series are computed again to the byte."""
    data = tempfile.mkdtemp(prefix="impactd-")
    try:
        with program.Daemon(program.build, "--workers", "1", data=data) as daemon:
            upload(daemon, "r")
            upload(daemon, "s", **shake(2))
            done = program.finished(daemon, scene({"name": "r"}))
            series = daemon.get(f"/v1/results/{done['result']}/series.npy").body
            long = scene({"name": "r"}, duration=30, study={"kind": "sweep", "axes": [
                {"pointer": "/excitation/name", "values": ["r", "s"]},
                {"pointer": "/excitation/scale", "from": 1, "to": 2, "count": 1500}]})
            jobs = [daemon.submit(asked, headers={"Prefer": "respond-async"}).json()["id"]
                    for asked in (long, scene({"name": "s", "scale": 2}))]
            assert until(lambda: daemon.get("/v1/records/s").json()["used_by"]["unfinished_jobs"] >= 1)
            daemon.kill()
        with program.daemon("--workers", "2", data=data) as daemon:
            problem(daemon.request("DELETE", "/v1/records/s"), 409)
            for job in jobs:
                found = daemon.finished(job, 300)
                assert found["status"] == "successful", found
            assert daemon.get(f"/v1/results/{done['result']}/series.npy").body == series
            assert daemon.get("/v1/records/s").json()["used_by"]["results"] == 2
    finally:
        shutil.rmtree(data, ignore_errors=True)


def test_an_upload_that_is_killed_is_whole_or_not_there():
    """kill -9 in the middle of uploads, 12 times: every record that is listed has all its samples, and what was told stays."""
    data = tempfile.mkdtemp(prefix="impactd-")
    chance = random.Random(5)
    told = set()
    try:
        for turn in range(12):
            with program.Daemon(program.build, data=data) as daemon:
                listed = {record["name"]: record for record in daemon.get("/v1/records?limit=500").json()["records"]}
                assert told <= set(listed), told - set(listed)
                for name, record in listed.items():
                    values = samples_of(daemon, name)
                    assert record["digest"] == digest(record["interval"], values), name
                timer = threading.Timer(chance.uniform(0.01, 0.15), daemon.process.kill)
                timer.start()
                try:
                    for i in range(1000):
                        name = f"r{turn}-{i}"
                        if daemon.request("POST", "/v1/records",
                                          json={"name": name, **shake(1000 * turn + i, 3000)}).status == 201:
                            told.add(name)
                except OSError:
                    pass
                except Exception as broken:  # noqa: BLE001 - an answer cut off
                    assert "http" in type(broken).__module__, broken
                timer.join()
                daemon.kill()
        assert told, "no upload was answered"
    finally:
        shutil.rmtree(data, ignore_errors=True)


def client(url, *arguments, text=""):
    kept = {name: value for name, value in os.environ.items() if not name.startswith("IMPACTD_")}
    return program.run(*arguments, text=text, environment={**kept, "IMPACTD_SERVER": url})


def test_the_command_line_adds_lists_shows_and_deletes():
    """impactd records does over HTTP what a person wants; faults have the file's name, exit codes tell what happened."""
    with program.daemon() as daemon, tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "I ELC-180.AT2")
        with open(path, "w", encoding="utf-8") as file:
            file.write(AT2)
        code, out, errors = client(daemon.url, "records", "add", path, "--source", "PEER & co", "--station", "7")
        assert (code, out) == (0, "I-ELC-180\n") and "at2, 4 samples" in errors and "/processing" in errors, (code, out, errors)
        assert daemon.get("/v1/records/I-ELC-180").json()["source"] == "PEER & co"
        code, out, errors = client(daemon.url, "records", "add", path, "--source", "PEER & co", "--station", "7")
        assert code == 0 and "already stored" in errors, (code, out, errors)
        code, _, errors = client(daemon.url, "records", "add", path)
        assert code == 1 and "another source" in errors and path in errors, (code, errors)
        code, out, _ = client(daemon.url, "records", "add", "-", "--name", "column", "--interval", "0.5", "--unit", "cm/s^2",
                              "--json", text="1\n-1\n")
        assert code == 0 and json.loads(out)["peak"] == 0.01, out
        code, _, errors = client(daemon.url, "records", "add", "-", "--name", "bad", "--interval", "1", text="1\nx\n")
        assert code == 3 and "standard input" in errors and "line 2" in errors, (code, errors)
        code, out, _ = client(daemon.url, "records", "list")
        assert code == 0 and [line.split()[0] for line in out.splitlines()] == ["name", "I-ELC-180", "column"], out
        code, out, _ = client(daemon.url, "records", "list", "--q", "peer", "--json")
        assert [record["name"] for record in json.loads(out)["records"]] == ["I-ELC-180"], out
        code, out, _ = client(daemon.url, "records", "show", "column")
        assert code == 0 and json.loads(out)["count"] == 2, out
        program.finished(daemon, scene({"name": "I-ELC-180"}))
        assert client(daemon.url, "records", "delete", "I-ELC-180")[0] == 1
        assert client(daemon.url, "records", "delete", "column")[0] == 0
        for action in ("show", "delete"):
            assert client(daemon.url, "records", action, "column")[0] == 4
            assert client(daemon.url, "records", action, "../jobs")[0] == 4
        for usage in ((), ("lists",), ("list", "x"), ("add",), ("show",), ("delete", "a", "b"), ("delete", "..")):
            assert client(daemon.url, "records", *usage)[0] == 2, usage
        for i in range(230):
            upload(daemon, f"n{i:03}", samples=[i, -1])
        code, out, _ = client(daemon.url, "records", "list")
        assert code == 0 and len(out.splitlines()) == 232, len(out.splitlines())
    assert client("http://127.0.0.1:9", "records", "list")[0] == 7


def test_the_response_spectrum_is_that_of_an_oscillator_for_each_period():
    """Displacement, pseudo-velocity and pseudo-acceleration, the same in every format; limits are refused."""
    with program.daemon() as daemon:
        upload(daemon, "r")
        motion = shake()
        spectrum = daemon.get("/v1/records/r/spectrum.json?from=0.1&to=4&points=9&damping_ratio=0.1").json()
        assert list(spectrum) == ["record", "damping_ratio", "period", "displacement", "pseudo_velocity",
                                  "pseudo_acceleration"], list(spectrum)
        assert spectrum["record"] == "r" and spectrum["damping_ratio"] == 0.1
        values = [spectrum[name]["values"] for name in ("period", "displacement", "pseudo_velocity", "pseudo_acceleration")]
        assert values[0][0] == 0.1 and values[0][-1] == 4 and len(values[0]) == 9
        base = numpy.array(motion["samples"])
        times = numpy.arange(len(base)) * motion["interval"]
        for period, displacement, velocity, acceleration in zip(*values):
            omega = 2 * math.pi / period
            assert abs(velocity / (omega * displacement) - 1) < 1e-14
            assert abs(acceleration / (omega * velocity) - 1) < 1e-14
            fine = numpy.linspace(0, times[-1], 40 * (len(base) - 1) + 1)
            oscillator = scipy.signal.StateSpace([[0, 1], [-omega ** 2, -0.2 * omega]], [[0], [-1]], [[1, 0]], [[0]])
            x = scipy.signal.lsim(oscillator, numpy.interp(fine, times, base), fine)[1]
            assert displacement >= abs(x).max() * (1 - 1e-9), (period, displacement, abs(x).max())
            assert displacement <= abs(x).max() * (1 + 1e-3) or period > 1, (period, displacement, abs(x).max())
        rows = daemon.get("/v1/records/r/spectrum.csv?from=0.1&to=4&points=9&damping_ratio=0.1").body.decode().split()
        assert " ".join(rows[:5]).startswith("period [s],displacement [m],"), rows[:5]
        last = daemon.get("/v1/records/r/spectrum.csv?from=0.1&to=4&points=9&damping_ratio=0.1").body.decode().splitlines()[-1]
        assert [float(cell) for cell in last.split(",")] == [column[-1] for column in values]
        chart = daemon.get("/v1/records/r/spectrum.svg")
        assert chart.headers["content-type"] == "image/svg+xml" and b"Response spectrum of r" in chart.body
        assert len(daemon.get("/v1/records/r/spectrum").json()["period"]["values"]) == 200
        tag = {"If-None-Match": chart.headers["etag"]}
        assert daemon.get("/v1/records/r/spectrum.svg", headers=tag).status == 304
        for query in ("from=3&to=2", "points=1", "points=2001", "damping_ratio=1", "damping_ratio=-0.1", "from=0", "to=x", "at=1"):
            problem(daemon.get(f"/v1/records/r/spectrum.json?{query}"), 400)
        assert daemon.get("/v1/records/r/spectrum.npy").status == 404
        assert daemon.get("/v1/records/none/spectrum.json").status == 404
        upload(daemon, "long", **shake(count=20000))
        slow = daemon.get("/v1/records/long/spectrum.json?points=400")
        assert slow.status == 200 and len(slow.json()["displacement"]["values"]) == 400
        for path in ("spectrum.json", "spectrum"):
            reply = daemon.get(f"/v1/records/long/{path}?from=0.0002&points=2000")
            problem(reply, 422)
            assert "ask for fewer points" in reply.json()["detail"], reply.json()


if __name__ == "__main__":
    program.main(globals())
