#!/usr/bin/env python3
"""The API over loopback: statuses, headers, waiting, pages, formats, ranges."""

import concurrent.futures
import csv
import gzip
import io
import os
import re
import shutil
import struct
import subprocess
import sys
import tempfile
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from asking import endless, problem, sponge  # noqa: E402

SANITIZED = True


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


def test_a_list_has_scenes_and_summaries_where_they_are_asked_for():
    """GET /v1/jobs?details=1: scene and summary of each job, null where there are none or the scene is long."""
    with program.daemon() as daemon:
        samples = {"kind": "record", "samples": [0.125] * 20000, "interval": 0.01}
        sent = [daemon.submit(scene).json() for scene in (sponge(), sponge(excitation=samples), sponge(duration=2))]
        failing = {"kind": "sweep", "axes": [{"pointer": "/dampers/0/clearance", "values": [0.02, 0.01, 0.02]},
                                             {"pointer": "/dampers/0/position", "from": 0, "to": 0.006, "count": 3000}]}
        failed = daemon.submit(sponge(study=failing)).json()
        failed = daemon.get(f"/v1/jobs/{failed['id']}?wait=20").json()
        assert daemon.request("DELETE", f"/v1/results/{sent[2]['result']}").status == 204
        jobs = {job["id"]: job for job in daemon.get("/v1/jobs?details=1").json()["jobs"]}
        first, long, deleted, failed = (jobs[job["id"]] for job in (*sent, failed))
        assert first["scene"] == daemon.get(f"/v1/results/{first['result']}").json()["scene"], first["scene"]
        assert first["summary"] == sent[0]["summary"], first
        assert long["scene"] is None and long["summary"] == sent[1]["summary"], long["summary"]
        assert deleted["scene"] is None and deleted["summary"] is None, deleted
        assert failed["scene"]["study"]["kind"] == "sweep" and failed["summary"] is None, failed
        assert "scene" not in daemon.get("/v1/jobs?details=0").json()["jobs"][0]


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


def test_a_path_with_a_slip_is_told_what_was_meant():
    """Whichever row of the table it is; the dashboard's files, whose names may be anything, are not meant."""
    with program.daemon() as daemon:
        for path, meant in (("/v1/jbos", "/v1/jobs"), ("/v2/records/x", "/v1/records/x"), ("/metrisc", "/metrics"), ("/vresion", "/version")):
            assert f"did you mean {meant}?" in problem(daemon.get(path), 404)["detail"], path
        # Nearest to a long path is one that was cut short.
        for path in ("/job/123456789", "/v1/materials/" + "x" * 130 + "/revision", "/" + "x" * 200):
            assert "did you mean" not in problem(daemon.get(path), 404)["detail"], path


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
        assert page.headers["content-type"] == "text/html; charset=utf-8" and b'<main id="main"' in page.body, page
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
            pointers = [warning["pointer"] for warning in warnings]
            assert pointers == ["/output/psd/segment", "/duration", "/dampers/0/buffer"], warnings
            assert 2 < summary["trust_horizon"] < 30 and 1e-6 < summary["error_estimate"] <= 1, summary
            assert f"{summary['trust_horizon']:.6g} s" in warnings[1]["detail"], warnings
            assert "only statistics are valid" in warnings[1]["detail"], warnings
            assert "were outside the speeds of sponge@1, 0.15 to 1 m/s" in warnings[2]["detail"], warnings
        assert calm["summary"]["trust_horizon"] is None, calm
        assert [warning["pointer"] for warning in calm["warnings"]] == ["/dampers/0/buffer"], calm
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
        landing = daemon.get("/", headers={"Accept": "text/html"}).headers["etag"]
        assert daemon.get("/", headers={"Accept": "text/html", "If-None-Match": landing}).status == 304


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
        for _ in range(2):  # the second one is cached, and not compressed either
            reply = daemon.get(path, headers={"Accept-Encoding": "gzip"})
            assert reply.body == whole and "content-encoding" not in reply.headers, reply.headers


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
                                    ("PUT", "/v1/jobs/j-1", {"GET", "HEAD", "PATCH", "DELETE"})):
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


if __name__ == "__main__":
    program.main(globals())
