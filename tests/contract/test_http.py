#!/usr/bin/env python3
"""The API over loopback: statuses, headers, waiting, ranges, all bad input, with the daemon unharmed."""

import concurrent.futures
import csv
import gzip
import http.client
import io
import json
import os
import re
import shutil
import signal
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

SANITIZED = True
JSON_TYPE = {"Content-Type": "application/json"}
JSON_FILES = os.path.join(program.SOURCE, "tests", "contract", "json")


def sponge(**changes):
    return {**program.scene("paper_free_sponge"), **changes}


def endless(duration=2e6):
    """A scene that takes many seconds: few samples, millions of impacts."""
    scene = program.scene("paper_sine_aluminium")
    scene.update(duration=duration, sample_rate=10, output={"channels": [], "psd": None})
    return scene


def problem(reply, status, *pointers):
    """The problem document of a reply, which must have that status and just these faults."""
    assert reply.status == status, reply
    assert reply.headers["content-type"] == "application/problem+json", reply
    document = reply.json()
    assert document["status"] == status and document["title"] and document["detail"], document
    assert re.fullmatch(r"/problems/[a-z-]+", document["type"]), document
    if pointers:
        assert sorted(fault["pointer"] for fault in document["errors"]) == sorted(pointers), document
        assert all(fault["detail"] for fault in document["errors"]), document
    return document


def test_a_scene_is_answered_with_its_finished_job():
    """POST of a quick scene: 200, the finished job, links that lead to every part of the result."""
    with program.daemon() as daemon:
        reply = daemon.submit(sponge())
        assert reply.status == 200 and "location" not in reply.headers, reply
        job = reply.json()
        assert job["status"] == "successful" and job["progress"] == 100 and job["problem"] is None, job
        assert job["cached"] is False and job["summary"]["impacts"] == 22, job
        assert daemon.get(job["links"]["self"]).json() == job
        result = daemon.get(job["links"]["result"]).json()
        assert result["id"] == job["result"] and result["plan"] == job["plan"], result
        assert result["summary"] == job["summary"] and result["count"] == 10001, result
        assert result["units"]["peak_displacement"] == "m" and result["units"]["contact_force"] == "N", result
        for name, link in result["links"].items():
            assert daemon.get(link.replace("{number}", "1")).status == 200, (name, link)
        again = daemon.submit(result["scene"]).json()
        assert again["cached"] is True and again["result"] == job["result"], again
        manifest = daemon.get(result["links"]["manifest"]).json()
        assert manifest["scene"] == result["scene"] and manifest["engine"] == result["engine"], manifest
        assert [m["slug"] for m in manifest["materials"]] == ["sponge"], manifest
        assert manifest["materials"][0]["restitution"] == 0.61, manifest


def test_waiting_follows_prefer():
    """Prefer: respond-async and wait= decide between 202 at once and 200 later; GET ?wait= waits likewise."""
    with program.daemon("--workers", "1") as daemon:
        scene = endless()
        began = time.monotonic()
        reply = daemon.submit(scene, headers={"Prefer": "respond-async"})
        assert reply.status == 202 and time.monotonic() - began < 1, reply
        job = reply.json()
        assert reply.headers["location"] == f"/v1/jobs/{job['id']}", reply.headers
        assert int(reply.headers["retry-after"]) >= 1, reply.headers
        assert reply.headers["preference-applied"] == "respond-async", reply.headers
        assert job["status"] in ("accepted", "running") and job["result"] is None, job

        began = time.monotonic()
        reply = daemon.submit(scene, wait=0.3)
        assert reply.status == 202 and 0.25 < time.monotonic() - began < 2, reply
        assert reply.headers["preference-applied"] == "wait=0.3", reply.headers
        began = time.monotonic()
        assert daemon.submit(scene).status == 202
        assert 1.8 < time.monotonic() - began < 4, "without Prefer the wait is 2 s"

        began = time.monotonic()
        reply = daemon.get(f"/v1/jobs/{job['id']}?wait=0.3")
        assert reply.status == 200 and 0.25 < time.monotonic() - began < 2, reply
        assert daemon.get(f"/v1/jobs/{job['id']}?wait=-1").status == 400
        running = reply.json()
        assert running["status"] == "running" and 0 <= running["progress"] < 100, running

        with concurrent.futures.ThreadPoolExecutor() as pool:
            waiter = pool.submit(daemon.get, f"/v1/jobs/{job['id']}?wait=25")
            time.sleep(0.2)
            began = time.monotonic()
            for one in daemon.get("/v1/jobs").json()["jobs"]:
                reply = daemon.request("DELETE", f"/v1/jobs/{one['id']}")
                assert reply.status == 200 and reply.json()["status"] == "dismissed", reply
            assert waiter.result().json()["status"] == "dismissed"
            assert time.monotonic() - began < 2, "a waiter is woken at once"
        problem(daemon.request("DELETE", f"/v1/jobs/{job['id']}"), 409)

        for _ in range(4):  # computed, from memory, by its body
            for preference in ("wait=1", "respond-async"):
                reply = daemon.submit(sponge(), headers={"Prefer": preference})
                assert reply.headers.get("preference-applied") == preference, reply.headers


def test_jobs_are_listed_by_pages():
    """GET /v1/jobs: newest first, and Link next leads through all of them."""
    with program.daemon() as daemon:
        ids = [daemon.submit(sponge(duration=1 + i)).json()["id"] for i in range(7)]
        seen, path = [], "/v1/jobs?limit=3"
        while path:
            reply = daemon.get(path)
            page = reply.json()["jobs"]
            assert len(page) <= 3 and all("plan" not in job for job in page)
            seen += [job["id"] for job in page]
            link = re.fullmatch(r'<(/v1/jobs\?[^>]*)>; rel="next"', reply.headers.get("link", ""))
            path = link[1] if link else None
        assert seen == ids[::-1], (seen, ids)
        problem(daemon.get("/v1/jobs?before=j-none"), 404)
        for limit in ("0", "101", "1.5", "x", ""):
            problem(daemon.get(f"/v1/jobs?limit={limit}"), 400)


def test_dry_run_runs_nothing():
    """?dry_run=1 answers scene, plan and cost, makes no job, and refuses a faulty scene as without it."""
    with program.daemon() as daemon:
        reply = daemon.request("POST", "/v1/jobs?dry_run=1", json=sponge())
        assert reply.status == 200, reply
        document = reply.json()
        assert document["dry_run"] is True and document["samples"] == 10001 and not document["cached"], document
        assert document["plan"]["contact_model"] == "spring_damper", document
        assert document["cost"]["cpu_seconds"] > 0 and document["cost"]["bytes"] > 0, document
        assert daemon.get("/v1/jobs").json() == {"jobs": []}
        assert daemon.submit(sponge()).json()["result"] == document["result"]
        assert daemon.request("POST", "/v1/jobs?dry_run=true", json=sponge()).json()["cached"] is True
        assert "dry_run" not in daemon.request("POST", "/v1/jobs?dry_run=0", json=sponge()).json()
        problem(daemon.request("POST", "/v1/jobs?dry_run=maybe", json=sponge()), 400)
        problem(daemon.request("POST", "/v1/jobs?dry_run=1", json=sponge(duration=0)), 422, "/duration")


def test_what_takes_too_long_is_refused_at_the_door():
    """--max-cpu-seconds (60) and --max-run-bytes bound what a scene may be foretold to take: 422 with the cost."""
    with program.daemon() as daemon:
        slow = sponge(duration=1000, accuracy={"solver": "rk4", "step": 1e-7})
        for path in ("/v1/jobs", "/v1/jobs?dry_run=1"):
            reply = daemon.request("POST", path, json=slow)
            problem(reply, 422, "/accuracy")
            assert "at most 60 s are allowed" in reply.json()["errors"][0]["detail"], reply
    with program.daemon("--max-cpu-seconds", "0.001", "--max-run-bytes", "2000000") as daemon:
        problem(daemon.submit(sponge(duration=1e4)), 422, "/output/psd")
        problem(daemon.submit(sponge(duration=1e4, output={"psd": None})), 422, "/duration")
        cost = daemon.request("POST", "/v1/jobs?dry_run=1", json=sponge()).json()["cost"]
        assert cost["cpu_seconds"] < 0.001 and 4e5 < cost["bytes"] < 1e6, cost
    with program.daemon("--max-run-bytes", "2000000") as daemon:
        problem(daemon.submit(sponge(duration=100)), 422, "/output/channels")


def test_series_by_channel_window_and_format():
    """series.json, csv and npy hold the same numbers; channels, from and to choose; what is not there is told."""
    with program.daemon() as daemon:
        base = f"/v1/results/{program.finished(daemon, sponge())['result']}"
        query = "?channels=contact_force,displacement&from=0.05&to=0.06"
        document = daemon.get(f"{base}/series.json{query}").json()
        assert document["start"] == 0.05 and document["count"] == 11, document
        assert list(document["channels"]) == ["contact_force", "displacement"], document
        rows = list(csv.reader(io.StringIO(daemon.get(f"{base}/series.csv{query}").body.decode())))
        assert rows[0] == ["time [s]", "contact_force [N]", "displacement [m]"], rows[0]
        raw = daemon.get(f"{base}/series.npy{query}").body
        assert raw[:6] == b"\x93NUMPY", raw[:6]
        header = struct.unpack("<H", raw[8:10])[0]
        numbers = struct.unpack("<33d", raw[10 + header:])
        for i in range(11):
            row = [float(cell) for cell in rows[1 + i]]
            assert row == [numbers[i], numbers[11 + i], numbers[22 + i]], (i, row)
            assert row[1:] == [document["channels"][name]["values"][i] for name in document["channels"]], i

        whole = daemon.get(f"{base}/series.json").json()
        assert whole["count"] == 10001 and len(whole["channels"]["velocity"]["values"]) == 10001
        assert daemon.get(f"{base}/series.json?from=9.9995").json()["count"] == 1
        assert daemon.get(f"{base}/series.json?from=0.001&to=0.001").json()["count"] == 1
        assert daemon.get(f"{base}/series.json?to=1e6").json()["count"] == 10001
        document = problem(daemon.get(f"{base}/series.json?channels=displacement,penetration"), 404)
        assert "penetration" in document["detail"] and "contact_force" in document["detail"], document
        for query in ("channels=", "channels=velocity,velocity", "from=-1", "from=x", "from=nan", "from=11",
                      "from=2&to=1", "to=1&to=2", "from=0.0001&to=0.0002", "chanels=velocity", "points=0", "points=1.5"):
            reply = daemon.get(f"{base}/series.json?{query}")
            problem(reply, 404 if query == "channels=" else 400)
        assert "did you mean" in daemon.get(f"{base}/series.json?chanels=velocity").json()["detail"]
        problem(daemon.get(f"{base}/series.xlsx"), 404)


def test_formats_are_negotiated():
    """Without an extension Accept chooses the format, with Vary; what fits none is 406."""
    with program.daemon() as daemon:
        base = f"/v1/results/{program.finished(daemon, sponge())['result']}"
        for accept, expected in ((None, "application/json"), ("text/csv", "text/csv; charset=utf-8"),
                                 ("application/x-npy, */*;q=0.1", "application/x-npy"),
                                 ("text/html, text/*;q=0.5", "text/csv; charset=utf-8")):
            reply = daemon.get(f"{base}/series", headers={"Accept": accept} if accept else {})
            assert reply.status == 200 and reply.headers["content-type"] == expected, (accept, reply.headers)
            assert reply.headers["vary"] in ("Accept", "Accept, Accept-Encoding"), reply.headers
        for part in ("series", "psd", "impacts"):
            problem(daemon.get(f"{base}/{part}", headers={"Accept": "image/png"}), 406)
        page = daemon.get("/", headers={"Accept": "text/html,application/xhtml+xml,*/*;q=0.8"})
        assert page.headers["content-type"] == "text/html; charset=utf-8" and b"<pre>" in page.body, page
        assert daemon.get("/").headers["content-type"] == "text/plain; charset=utf-8"


def test_the_landing_page_has_lines_that_work():
    """Each curl line of GET / runs as it stands."""
    with program.daemon("--workers", "1") as daemon, tempfile.TemporaryDirectory() as folder:
        text = daemon.get("/", headers={"Host": f"localhost:{daemon.port}"}).body.decode()
        lines = [line for line in text.splitlines() if re.match(r"(\w=\$\()?curl ", line)]
        assert len(lines) >= 8 and all(f"http://localhost:{daemon.port}/" in line for line in lines), text
        # The worker is busy for longer than the default wait: what needs a finished job must ask to wait for it.
        busy = daemon.submit(endless(), headers={"Prefer": "respond-async"}).headers["location"]
        timer = threading.Timer(3, daemon.request, ("DELETE", busy))
        timer.start()
        # -x names the line, -fS its fault.
        script = "set -ex\n" + "\n".join(re.sub(r"\bcurl -s", "curl -fsS", line) for line in lines[1:] + lines[:1])
        # Where it is instrumented a study may outlast its wait; it goes on, and is known the next time.
        for _ in range(6 if program.is_sanitized() else 1):
            done = subprocess.run(["bash", "-c", script], cwd=folder, capture_output=True, text=True, check=False)
            if done.returncode == 0:
                break
        timer.join()
        assert done.returncode == 0, (done.returncode, done.stderr[-1500:], done.stdout[-500:])
        assert done.stdout.count('"status": "successful"') >= 1, done.stdout[-2000:]
        assert os.path.getsize(os.path.join(folder, "series.npy")) == 128 + 8 * 6 * 10001


def test_a_run_says_how_far_it_can_be_trusted():
    """Beyond trust_horizon a warning of the run joins the scene's: on the job, again, on the result, after a restart."""
    random = {**program.scene("paper_random_sponge"), "duration": 30,
              "output": {"channels": [], "psd": {"channels": ["mean_acceleration"], "segment": 65536}}}
    folder = tempfile.mkdtemp(prefix="impactd-")
    try:
        documents = []
        with program.daemon(data=folder) as daemon:
            job = program.finished(daemon, random)
            documents += [job, daemon.get(job["links"]["self"]).json(), daemon.get(job["links"]["result"]).json(),
                          program.finished(daemon, {**random, "title": "the same"})]
            assert documents[-1]["cached"] is True, documents[-1]
            calm = program.finished(daemon, sponge())
        with program.daemon(data=folder) as daemon:
            documents += [daemon.get(job["links"]["self"]).json(), daemon.get(job["links"]["result"]).json(),
                          program.finished(daemon, random)]
        for document in documents:
            summary, warnings = document["summary"], document["warnings"]
            assert [warning["pointer"] for warning in warnings] == ["/output/psd/segment", "/duration"], warnings
            assert 2 < summary["trust_horizon"] < 30 and 1e-6 < summary["error_estimate"] <= 1, summary
            assert f"{summary['trust_horizon']:.6g} s" in warnings[1]["detail"], warnings
            assert "only statistics hold" in warnings[1]["detail"], warnings
        assert calm["summary"]["trust_horizon"] is None and calm["warnings"] == [], calm
        assert 0 < calm["summary"]["error_estimate"] < 1e-6, calm
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def test_results_never_change():
    """A result has a strong ETag and is immutable; If-None-Match answers 304 without a body; HEAD is GET without."""
    with program.daemon() as daemon:
        base = f"/v1/results/{program.finished(daemon, sponge())['result']}"
        tags = set()
        for part in ("", "/series.json", "/series.csv", "/series.npy", "/psd.json", "/psd.csv", "/impacts.json",
                     "/impacts.csv", "/energy.json"):
            reply = daemon.get(base + part)
            tag = reply.headers["etag"]
            tags.add(tag)
            assert re.fullmatch(r'"[!-~]+"', tag) and "immutable" in reply.headers["cache-control"], reply.headers
            for match in (tag, f'"x", W/{tag}', "*"):
                known = daemon.get(base + part, headers={"If-None-Match": match})
                assert known.status == 304 and known.body == b"" and known.headers["etag"] == tag, known
            assert daemon.get(base + part, headers={"If-None-Match": '"x"'}).body == reply.body
            head = daemon.request("HEAD", base + part)
            assert head.status == 200 and head.body == b"", head
            assert head.headers["content-length"] == str(len(reply.body)), head.headers
        assert len(tags) == 9, "every representation has a tag of its own"
        reply = daemon.get(base + "/manifest")  # it tells the material's status, which may change
        tag = reply.headers["etag"]
        assert tag.startswith('"') and tag not in tags and reply.headers["cache-control"] == "no-cache", reply.headers
        known = daemon.get(base + "/manifest", headers={"If-None-Match": tag})
        assert known.status == 304 and known.body == b"" and known.headers["etag"] == tag, known
        assert daemon.get(base + "/manifest", headers={"If-None-Match": '"x"'}).body == reply.body
        reply = daemon.get("/v1/materials/sponge")
        known = daemon.get("/v1/materials/sponge", headers={"If-None-Match": reply.headers["etag"]})
        assert known.status == 304 and "immutable" not in reply.headers["cache-control"], known


def test_refusals_are_not_kept():
    """What is refused of something immutable may be there tomorrow: no cache keeps the refusal."""
    with program.daemon() as daemon:
        base = f"/v1/results/{program.finished(daemon, sponge())['result']}"
        for path in ("/series.json?points=0", "/series.npy?from=11", "/series.csv?channels=foo", "/psd.xml",
                     "/impacts/99/force.csv", "/nothing"):
            reply = daemon.get(base + path)
            assert reply.status in (400, 404) and reply.headers["cache-control"] == "no-store", (path, reply.headers)
            assert "etag" not in reply.headers, reply.headers
        reply = daemon.get(base + "/series.npy", headers={"Range": "bytes=99999999-"})
        assert reply.status == 416 and reply.headers["cache-control"] == "no-store", reply.headers


def test_links_lead_somewhere():
    """A result links to what its scene asked for and to nothing else."""
    with program.daemon() as daemon:
        for output, left_out in (({"psd": None}, "psd"), ({"impacts": False}, "impacts"), ({"channels": []}, "none")):
            result = program.finished(daemon, {**sponge(), "output": output})["result"]
            links = daemon.get(f"/v1/results/{result}").json()["links"]
            assert not [name for name in links if name.startswith(left_out)], links
            assert ("force" in links) == (left_out != "impacts"), links
            for name, link in links.items():
                assert daemon.get(link.replace("{number}", "1")).status == 200, (name, link)
        for change in ({"contact": {"model": "impulse"}}, {"dampers": []},
                       {"dampers": [{**sponge()["dampers"][0], "buffer": {"restitution": 0.6}}]}):
            result = program.finished(daemon, sponge(**change))["result"]
            links = daemon.get(f"/v1/results/{result}").json()["links"]
            assert "impacts" in links and "force" not in links, (change, links)


def test_parts_of_binary_formats():
    """Range on npy: 206 with Content-Range, 416 outside, ignored on text and for a stale If-Range."""
    with program.daemon() as daemon:
        path = f"/v1/results/{program.finished(daemon, sponge())['result']}/series.npy"
        reply = daemon.get(path)
        whole, size = reply.body, len(reply.body)
        assert reply.headers["accept-ranges"] == "bytes", reply.headers
        for text, first, last in (("0-99", 0, 99), ("100-", 100, size - 1), ("-8", size - 8, size - 1)):
            part = daemon.get(path, headers={"Range": f"bytes={text}"})
            assert part.status == 206 and part.body == whole[first:last + 1], (text, part.status)
            assert part.headers["content-range"] == f"bytes {first}-{last}/{size}", part.headers
        outside = daemon.get(path, headers={"Range": f"bytes={size}-"})
        problem(outside, 416)
        assert outside.headers["content-range"] == f"bytes */{size}", outside.headers
        tag = reply.headers["etag"]
        assert daemon.get(path, headers={"Range": "bytes=0-1", "If-Range": tag}).status == 206
        assert daemon.get(path, headers={"Range": "bytes=0-1", "If-Range": '"x"'}).body == whole
        assert daemon.get(path, headers={"Range": "bytes=0-1,4-5"}).body == whole
        text = path.replace("npy", "csv")
        assert daemon.get(text, headers={"Range": "bytes=0-1"}).status == 200


def test_text_is_packed_for_whoever_asks():
    """Also when somebody else had it plain before, and the other way round."""
    with program.daemon() as daemon:
        result = "/v1/results/" + daemon.submit(sponge()).json()["result"]
        for path in (result, f"{result}/series.json", f"{result}/psd.csv"):
            plain = daemon.get(path)
            for _ in range(2):
                packed = daemon.get(path, headers={"Accept-Encoding": "gzip"})
                assert packed.headers.get("content-encoding") == "gzip", (path, packed.headers)
                assert packed.headers["etag"] != plain.headers["etag"]
                assert gzip.decompress(packed.body) == plain.body
                again = daemon.get(path)
                assert "content-encoding" not in again.headers and again.body == plain.body


def test_materials_are_listed_and_shown():
    """The five materials of Table I, found by word, by slug and by revision."""
    with program.daemon() as daemon:
        listed = daemon.get("/v1/materials").json()["materials"]
        assert [m["slug"] for m in listed] == ["aluminium", "hard_acrylic", "hard_rubber", "soft_rubber", "sponge"]
        assert all(m["status"] == "approved" and m["revision"] == 1 for m in listed), listed
        assert [m["slug"] for m in daemon.get("/v1/materials?q=RUBBER").json()["materials"]] == ["hard_rubber",
                                                                                                "soft_rubber"]
        assert daemon.get("/v1/materials?q=wood").json() == {"materials": []}
        assert daemon.get("/v1/materials/sponge").json() == listed[4]
        assert daemon.get("/v1/materials/sponge@1").json() == listed[4]
        for name in ("wood", "sponge@2", "sponge@0", "sponge@x", "sponge@1@1", "sponge@-1",
                     "sponge@99999999999999999999"):
            problem(daemon.get(f"/v1/materials/{name}"), 404)


def test_the_catalogue():
    """Examples run as they are; schemas, health and version answer."""
    with program.daemon() as daemon:
        listed = daemon.get("/v1/examples").json()["examples"]
        assert [e["name"] for e in listed] == program.examples()
        for example in listed:
            assert example["title"], example["name"]
            shown = daemon.get(example["links"]["self"])
            assert shown.json() == example["scene"] == program.scene(example["name"]), example["name"]
        problem(daemon.get("/v1/examples/none"), 404)
        for schema in daemon.get("/schemas").json()["schemas"]:
            document = daemon.get(schema["links"]["self"]).json()
            assert document["$schema"].startswith("https://json-schema.org/"), schema
        problem(daemon.get("/schemas/none"), 404)
        assert daemon.get("/health/live").json() == {"status": "live"}
        assert daemon.get("/health/ready").json()["status"] == "ready"
        version = daemon.get("/version").json()
        with open(os.path.join(program.SOURCE, "CMakeLists.txt"), encoding="utf-8") as file:
            assert f"VERSION {version['version']} " in file.read(), version


def test_what_is_not_there_is_told_apart():
    """Unknown paths 404 with the nearest one, wrong methods 405 with Allow, unknown ids 404."""
    with program.daemon() as daemon:
        assert "/v1/jobs" in problem(daemon.get("/v1/job"), 404)["detail"]
        assert "/v1/materials/sponge" in problem(daemon.get("/v1/material/sponge"), 404)["detail"]
        problem(daemon.get("/nothing/like/it/at/all"), 404)
        for path in ("/v1/jobs/j-1", "/v1/results/r-1", "/v1/results/r-1/series.csv", "/v1/results/r-1/psd.csv",
                     "/v1/results/r-1/manifest", "/v1/results/r-1/energy.json", "/v1/jobs/%27%3B--", "/v1/jobs/" + 900 * "a"):
            problem(daemon.get(path), 404)
        problem(daemon.request("DELETE", "/v1/jobs/j-1"), 404)
        problem(daemon.request("DELETE", "/v1/results/r-1"), 404)
        for method, path, allow in (("PUT", "/v1/jobs", {"GET", "HEAD", "POST"}), ("POST", "/version", {"GET", "HEAD"}),
                                    ("DELETE", "/v1/results/r-1/psd.csv", {"GET", "HEAD"}), ("OPTIONS", "/", {"GET", "HEAD"}),
                                    ("PATCH", "/v1/jobs/j-1", {"GET", "HEAD", "DELETE"})):
            reply = daemon.request(method, path)
            problem(reply, 405)
            assert set(reply.headers["allow"].split(", ")) == allow, reply.headers


def test_every_answer_carries_the_safety_headers():
    """nosniff, a policy that allows nothing, a request id of its own, on good and bad answers."""
    with program.daemon() as daemon:
        ids = set()
        for path in ("/", "/version", "/nothing", "/v1/jobs?x=1"):
            headers = daemon.get(path).headers
            assert headers["x-content-type-options"] == "nosniff", headers
            assert "default-src 'none'" in headers["content-security-policy"], headers
            ids.add(headers["x-request-id"])
        assert len(ids) == 4, ids


def test_bad_bodies():
    """Every kind of bad scene is a 4xx problem that names its places, all faults at once."""
    sine = program.scene("paper_sine_sponge")
    random = program.scene("paper_random_sponge")
    damper = sponge()["dampers"][0]

    def damped(**changes):
        return sponge(dampers=[{**damper, **changes}])

    cases = [
        (sponge(structure={"stiffness": 865}), ["/structure/mass"]),
        (sponge(structure={"mass": 1, "stiffness": -1, "damping": 0}), ["/structure/stiffness"]),
        (sponge(structur=1), ["/structur"]),
        (damped(buffer={"restitution": 0, "contact_time": 0.01}), ["/dampers/0/buffer/restitution"]),
        (damped(buffer={"restitution": 1.1, "contact_time": 0.01}), ["/dampers/0/buffer/restitution"]),
        (damped(buffer={"restitution": 0.5, "contact_time": 0}), ["/dampers/0/buffer/contact_time"]),
        (damped(clearance=-0.001), ["/dampers/0/clearance"]),
        (damped(position=0.008), ["/dampers/0/position"]),
        (sponge(duration=0), ["/duration"]),
        (sponge(duration=1e9), ["/duration"]),
        (sponge(sample_rate=1e300, duration=1e300), None),
        ({**random, "excitation": {**random["excitation"], "band": [1, 501]}}, None),
        (damped(buffer="wood", mass=-1), ["/dampers/0/buffer", "/dampers/0/mass"]),
        ({**sine, "excitation": {"kind": "sine"}}, None),
        ([], [""]), ([sponge()], [""]), ("text", [""]), (17, [""]), (None, [""]),
        ({}, ["/structure", "/duration", "/sample_rate"]),
    ]
    with program.daemon() as daemon:
        for scene, pointers in cases:
            reply = daemon.request("POST", "/v1/jobs", body=json.dumps(scene), headers=JSON_TYPE)
            assert reply.status in (400, 422), (scene, reply)
            problem(reply, reply.status, *(pointers or ()))
        allowed = damped(buffer={"restitution": 0})
        allowed["contact"] = {"model": "impulse"}
        assert daemon.submit(allowed).json()["status"] == "successful"
        meant = problem(daemon.submit(sponge(duratoin=1)), 422)["errors"]
        assert meant[0]["did_you_mean"] == "duration", meant

        text = json.dumps(sponge())
        for body in ("", " ", "{", "nul", text + "x", text[:-1], text.replace("10", "NaN"), text.replace("10", "Infinity"),
                     text.replace("{", '{"duration": 1, "duration": 2, ', 1), "[" * 33 + "]" * 33, "[" * 100000,
                     b"\xff\xfe", b"\xef\xbb\xbf", 2 * b"\xef\xbb\xbf" + text.encode(), b'{"a\x00": 1}', b'{"title": "\xed\xa0\x80"}'):
            problem(daemon.request("POST", "/v1/jobs", body=body, headers=JSON_TYPE), 400)
        assert daemon.request("POST", "/v1/jobs", body=b"\xef\xbb\xbf" + text.encode(), headers=JSON_TYPE).status == 200
        assert daemon.request("POST", "/v1/jobs", body=text,
                              headers={"Content-Type": "Application/JSON; charset=utf-8"}).status == 200
        for kind in ("text/plain", "application/x-www-form-urlencoded", "application/jsonx", ""):
            reply = daemon.request("POST", "/v1/jobs", body=text, headers={"Content-Type": kind})
            assert "--json" in problem(reply, 415)["detail"], reply
        for encoding, sent, status in (("gzip", gzip.compress(text.encode()), 415), ("br", text, 415), ("identity, gzip", text, 415),
                                       ("Identity", text, 200), ("", text, 200)):
            reply = daemon.request("POST", "/v1/jobs", body=sent, headers={**JSON_TYPE, "Content-Encoding": encoding})
            assert reply.status == status, (encoding, reply)
            assert status == 200 or f"without Content-Encoding, is encoded as {encoding}" in problem(reply, 415)["detail"], reply
        assert daemon.submit(sponge()).json()["status"] == "successful"


def test_wrong_types_at_every_field():
    """Each member of the fullest example in turn gets a value of every other type: never a crash, 4xx or a job."""
    whole = program.scene("all_keys")

    def places(value, path=()):
        yield path
        items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
        for key, inner in items:
            yield from places(inner, path + (key,))

    with program.daemon() as daemon:
        refused = 0
        for path in places(whole):
            for wrong in (None, True, -1, 1e308, 0.5, "x", [], {}, [[]], {"x": 1}):
                scene = json.loads(json.dumps({"scene": whole}))
                inner = scene
                for key in ("scene",) + path[:-1]:
                    inner = inner[key] if path else inner
                inner[path[-1] if path else "scene"] = wrong
                reply = daemon.request("POST", "/v1/jobs?dry_run=1", body=json.dumps(scene["scene"]),
                                       headers=JSON_TYPE)
                assert reply.status in (200, 400, 422), (path, wrong, reply)
                if reply.status != 200:
                    document = problem(reply, reply.status)
                    refused += 1
                    if reply.status == 422:
                        assert document["errors"], (path, wrong, reply)
        assert refused > 200, refused


def test_bodies_over_the_limit():
    """A body of just the limit is read, one byte more is a 413 that is seen, also chunked and without Content-Length."""
    limit = 65536
    with program.daemon("--max-body", str(limit)) as daemon:
        text = json.dumps(sponge()).encode()
        assert daemon.request("POST", "/v1/jobs", body=text.ljust(limit), headers=JSON_TYPE).status == 200
        for size in (limit + 1, 2 * limit, 4 * limit, 4 * limit + 1):
            document = problem(daemon.request("POST", "/v1/jobs", body=text.ljust(size), headers=JSON_TYPE), 413)
            assert str(limit) in document["detail"], document
        for size in (limit + 1, 4 * limit - 100):
            chunks = (text.ljust(size)[i:i + 8000] for i in range(0, size, 8000))
            connection = http.client.HTTPConnection("127.0.0.1", daemon.port)
            connection.request("POST", "/v1/jobs", body=chunks, headers=JSON_TYPE, encode_chunked=True)
            assert connection.getresponse().status == 413
            connection.close()


def test_a_refusal_is_seen_by_who_sends_much():
    """What is refused by its head alone is answered once the body is through, and the connection stays open."""
    with program.daemon() as daemon:
        body = b" " * 10_000_000
        connection = http.client.HTTPConnection("127.0.0.1", daemon.port)
        for method, target, expected in (("POST", "/v1/none", 404), ("PUT", "/v1/jobs", 405), ("POST", "/v1/jobs?q=%zz", 400)) * 3:
            connection.request(method, target, body=body, headers=JSON_TYPE)
            reply = connection.getresponse()
            assert reply.status == expected and json.loads(reply.read())["status"] == expected, (method, target, reply.status)
        connection.request("GET", "/version")
        assert connection.getresponse().status == 200
        connection.close()


def test_all_json_files_as_bodies():
    """The 318 files of the JSON parsing suite: refused as they should be, never a crash."""
    with program.daemon("--max-body", "200000") as daemon:
        names = sorted(name for name in os.listdir(JSON_FILES) if name.endswith(".json"))
        assert len(names) == 318, len(names)
        for name in names:
            with open(os.path.join(JSON_FILES, name), "rb") as file:
                reply = daemon.request("POST", "/v1/jobs", body=file.read(), headers=JSON_TYPE)
            expected = {"n": (400, 413), "y": (400, 422), "i": (400, 413, 422)}[name[0]]
            assert reply.status in expected, (name, reply)
            problem(reply, reply.status)
        assert daemon.submit(sponge()).status == 200


def test_a_full_queue_is_503():
    """Beyond --queue unfinished jobs: 503 with Retry-After, not ready, and all is well afterwards."""
    with program.daemon("--workers", "1", "--queue", "3") as daemon:
        jobs = [daemon.submit(endless(2e6 + i), headers={"Prefer": "respond-async"}) for i in range(3)]
        assert [reply.status for reply in jobs] == [202] * 3, jobs
        reply = daemon.submit(endless(3e6), headers={"Prefer": "respond-async"})
        problem(reply, 503)
        assert int(reply.headers["retry-after"]) >= 1, reply.headers
        problem(daemon.get("/health/ready"), 503)
        for one in jobs:
            assert daemon.request("DELETE", one.headers["location"]).status == 200
        assert daemon.submit(sponge()).json()["status"] == "successful"
        assert daemon.get("/health/ready").status == 200


def test_many_at_once():
    """200 clients who wait while others ask: every answer comes, none is mixed up, none stalls."""
    with program.daemon("--workers", "2") as daemon:
        def one(i):
            began = time.monotonic()
            job = daemon.submit(sponge(duration=1 + 0.01 * i), wait=30).json()
            document = daemon.get(f"/v1/results/{job['result']}").json()
            assert document["scene"]["duration"] == 1 + 0.01 * i, (i, document["scene"])
            return time.monotonic() - began
        with concurrent.futures.ThreadPoolExecutor(64) as pool:
            times = sorted(pool.map(one, range(200)))
        assert times[-1] < 20, times[-5:]


class Crowd:
    """As many connections at once, each with one request under way and its answers in their order."""

    def __init__(self, port, count):
        self.sockets = [socket.create_connection(("127.0.0.1", port), timeout=60) for _ in range(count)]
        self.files = [one.makefile("rb") for one in self.sockets]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for one in (*self.files, *self.sockets):
            one.close()

    def ask(self, i, target):
        self.sockets[i].sendall(f"GET {target} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())

    def answer(self, i):
        code = int(self.files[i].readline().split()[1])
        headers = http.client.parse_headers(self.files[i])
        return code, json.loads(self.files[i].read(int(headers["Content-Length"])))


def test_no_number_of_ready_connections_stalls():
    """127 to 512 connections ready at once: no number of them takes much longer than its neighbours."""
    with program.daemon("--workers", "1") as daemon:
        job = program.finished(daemon, sponge())["id"]
        usual = None
        # Over two event loops some of them make as many for each.
        for count in (120, 127, 128, 129, 254, 255, 256, 257, 258, 512):
            times = []
            with Crowd(daemon.port, count) as crowd:
                for turn in range(15):
                    # Sent while the daemon is stopped: it finds all of them ready.
                    daemon.process.send_signal(signal.SIGSTOP)
                    for i in range(count):
                        crowd.ask(i, f"/v1/jobs/{job}" if (i + turn) % 2 else "/version")
                    began = time.monotonic()
                    daemon.process.send_signal(signal.SIGCONT)
                    for i in range(count):
                        code, document = crowd.answer(i)
                        assert code == 200 and ("id" in document) == bool((i + turn) % 2), (count, i, document)
                    times.append((time.monotonic() - began) / count)
            took = statistics.median(times)
            usual = usual or took
            # A stall made it hundreds of times slower.
            assert took < 20 * usual, (count, took, usual)


def test_sleepers_wake_while_others_ask():
    """As many who wait for a job's end as ask other things: when it ends each is answered, and nobody is forgotten."""
    with program.daemon("--workers", "1") as daemon:
        for count in (127, 128, 129, 255, 256, 257):
            with Crowd(daemon.port, count) as crowd, Crowd(daemon.port, count) as sleepers:
                job = daemon.submit(endless(3e6 + count), headers={"Prefer": "respond-async"}).json()["id"]
                for i in range(count):
                    sleepers.ask(i, f"/v1/jobs/{job}?wait=30")
                    crowd.ask(i, "/version")
                assert daemon.request("DELETE", f"/v1/jobs/{job}").status == 200
                for i in range(count):
                    assert "engine" in crowd.answer(i)[1]
                    crowd.ask(i, f"/v1/jobs/{job}")
                for i in range(count):
                    assert crowd.answer(i)[1]["status"] == "dismissed"
                    code, document = sleepers.answer(i)
                    # Who had waited in vain would have been told of a job that runs.
                    assert code == 200 and document["status"] == "dismissed", (count, i, document)


def test_stopping_answers_those_who_wait():
    """SIGTERM while clients wait: each gets its unfinished job, and the daemon ends well and soon."""
    daemon = program.Daemon(program.build, "--workers", "1")
    try:
        daemon.start()
        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            waiters = [pool.submit(daemon.submit, endless(2e6 + i), 30) for i in range(8)]
            time.sleep(1)
            code, seconds = daemon.stop(30)
            replies = [waiter.result() for waiter in waiters]
        assert code == 0 and (seconds < 5 or program.is_sanitized()), (code, seconds)
        assert all(reply.status == 202 for reply in replies), replies
    finally:
        daemon.kill()
        shutil.rmtree(daemon.data, ignore_errors=True)


if __name__ == "__main__":
    program.main(globals())
