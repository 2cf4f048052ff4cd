#!/usr/bin/env python3
"""Small features of all routes: other origins, slashes at the end, indented JSON, short ids; changes of jobs; previews."""

import json
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from access import bearer, token  # noqa: E402
from asking import endless, problem, sponge  # noqa: E402
from program import until  # noqa: E402

LAB = "https://lab.example.org"
HTML = "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8"


def test_pages_of_an_allowed_origin_may_use_the_api():
    """--allow-origin: preflight, exposed headers and unsafe methods for that origin; all others are refused as before."""
    with program.daemon("--allow-origin", LAB, "--allow-origin", "http://other.example.org:8000") as daemon:
        asked = {"Origin": LAB, "Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": "authorization"}
        reply = daemon.request("OPTIONS", "/v1/jobs", headers=asked)
        assert reply.status == 204 and reply.headers["access-control-allow-origin"] == LAB, reply.headers
        assert "POST" in reply.headers["access-control-allow-methods"].split(", "), reply.headers
        assert "Authorization" in reply.headers["access-control-allow-headers"].split(", "), reply.headers
        reply = daemon.request("POST", "/v1/jobs", json=sponge(), headers={"Origin": LAB, "Sec-Fetch-Site": "cross-site"})
        assert reply.status in (200, 202) and reply.headers["access-control-allow-origin"] == LAB, reply
        assert set(reply.headers["access-control-expose-headers"].split(", ")) == {"ETag", "Location", "Link", "Retry-After"}
        result = "/v1/results/" + program.finished(daemon, sponge())["result"]
        for _ in range(3):  # from the cache as well
            for origin in (LAB, None, "http://other.example.org:8000", "https://lab.example.org.evil.org"):
                reply = daemon.get(result, headers={"Origin": origin} if origin else {})
                assert reply.status == 200 and "Origin" in reply.headers["vary"].split(", "), reply.headers
                allowed = origin if origin and "evil" not in origin else None
                assert reply.headers.get("access-control-allow-origin") == allowed, (origin, reply.headers)
        problem(daemon.get("/v1/results/r-0", headers={"Origin": LAB}), 404)
        assert daemon.get("/nothing", headers={"Origin": LAB}).headers["access-control-allow-origin"] == LAB
        for origin in ("https://evil.example.org", LAB + ":444", "null", LAB.upper()):
            problem(daemon.request("POST", "/v1/jobs", json=sponge(), headers={"Origin": origin}), 403)
            reply = daemon.request("OPTIONS", "/v1/jobs", headers={**asked, "Origin": origin})
            assert reply.status == 405 and "access-control-allow-origin" not in reply.headers, reply.headers
        problem(daemon.request("OPTIONS", "/nothing", headers=asked), 404)
        assert daemon.get("/version", headers=asked).json()["engine"]  # no preflight
    for bad in ("*", "null", "lab.example.org", "https://lab.example.org/", "https://Lab.example.org"):
        code, _, errors = program.run("serve", "--allow-origin", bad, "--listen", "127.0.0.1:0", "--data", "/nonexistent/x")
        assert code == 2 and "--allow-origin" in errors, (code, errors)


def test_a_slash_at_the_end_redirects():
    """A path with a slash too many: 308 to the one without, with its query, for GET and HEAD alone; never to another server."""
    with program.daemon() as daemon:
        for method in ("GET", "HEAD"):
            for path, query in (("/v1/jobs", "?limit=1"), ("/v1/results/r-0", ""), ("/schemas", ""), ("/health/live", "")):
                reply = daemon.request(method, path + "/" + query)
                assert reply.status == 308 and reply.headers["location"] == path + query, (method, path, reply)
        problem(daemon.request("DELETE", "/v1/jobs/j-1/"), 404)
        long = "?" + "x" * 3000  # no Location has room for it
        for path in ("//evil.example.org/", "/guide/nothing/", "/web/nothing/", "/nothing/", "/v1/jobs//", "/v1/jobs/" + long):
            assert daemon.get(path).status == 404, path
    with program.daemon("--base-url", "https://sim.example.org/sim", "--host", "localhost") as daemon:
        assert daemon.get("/sim/v1/jobs/").headers["location"] == "/sim/v1/jobs"


def test_json_is_indented_where_it_is_asked_for():
    """?pretty=1 or an Accept that prefers text/html: the same value with a tag of its own, on every route."""
    with program.daemon() as daemon:
        job = program.finished(daemon, sponge())
        paths = ("/v1/results/" + job["result"], "/v1/jobs/" + job["id"], "/v1/materials/sponge", "/v1/examples",
                 f"/v1/results/{job['result']}/psd.json", "/v1/materials?q=nothing")
        for _ in range(2):
            for path in paths:
                plain = daemon.get(path)
                asked = daemon.get(path + ("&" if "?" in path else "?") + "pretty=1")
                preferred = daemon.get(path, headers={"Accept": HTML})
                assert asked.status == preferred.status == plain.status == 200, (path, asked, preferred)
                assert "Accept" in plain.headers["vary"].split(", "), plain.headers
                assert "Accept" in preferred.headers["vary"].split(", "), preferred.headers
                assert asked.body == preferred.body != plain.body, path
                assert asked.body.startswith(b'{\n  "') and asked.body.endswith(b"}\n"), asked.body[:40]
                if path != paths[1]:
                    assert asked.json() == plain.json(), path
                else:
                    assert asked.json().keys() == plain.json().keys()
                if "etag" in plain.headers:
                    assert asked.headers["etag"] == preferred.headers["etag"] != plain.headers["etag"]
                    known = daemon.get(path, headers={"Accept": HTML, "If-None-Match": preferred.headers["etag"]})
                    assert known.status == 304 and known.headers["etag"] == preferred.headers["etag"], known.headers
                    assert "Accept" in known.headers["vary"], known.headers
                    assert daemon.get(path, headers={"If-None-Match": preferred.headers["etag"]}).status == 200
        packed = daemon.get(paths[4] + "?pretty=1", headers={"Accept-Encoding": "gzip"})
        assert packed.headers["etag"].endswith('-p-gz"'), packed.headers
        assert daemon.get(paths[0] + "?pretty=0", headers={"Accept": HTML}).body == daemon.get(paths[0]).body
        problem(daemon.get(paths[0] + "?pretty=x"), 400)
        problem(daemon.get("/v1/jobs/j-0?pretty=1"), 404)
        assert daemon.get("/v1/jobs/j-0?pretty=1").body.startswith(b'{\n  "')
        reply = daemon.request("POST", "/v1/jobs?pretty=1", json=sponge())
        assert reply.status == 200 and reply.body.startswith(b'{\n  "'), reply
        assert daemon.get(f"/v1/results/{job['result']}/series.csv?pretty=1").body == daemon.get(
            f"/v1/results/{job['result']}/series.csv").body


def test_ids_may_be_shortened():
    """8 or more digits of an id in GET: 307 to the full one with path and query, 409 with the candidates, 404 as before."""
    with program.daemon() as daemon:
        job = program.finished(daemon, sponge())
        other = program.finished(daemon, sponge(duration=7))
        for kind, full, rest in (("results", job["result"], ""), ("results", job["result"], "/series.csv?to=0.1"),
                                 ("results", job["result"], "/impacts/1/force.json"), ("jobs", job["id"], "/scene")):
            for digits in (29,) if kind == "jobs" else (8, 20, 63):
                reply = daemon.get(f"/v1/{kind}/{full[:2 + digits]}{rest}")
                assert reply.status == 307 and reply.headers["location"] == f"/v1/{kind}/{full}{rest}", (rest, reply, reply.headers)
        common = len(os.path.commonprefix([job["id"], other["id"]]))
        if common >= 10:
            reply = daemon.get(f"/v1/jobs/{job['id'][:common]}")
            problem(reply, 409)
            assert job["id"] in reply.json()["detail"] and other["id"] in reply.json()["detail"], reply
        for path in (f"/v1/results/{job['result'][:9]}", "/v1/results/r-0123456789", f"/v1/jobs/{job['id'][:9]}",
                     "/v1/jobs/j-00000000", f"/v1/results/{job['id'][:12]}x", f"/v1/results/{job['id'][:20]}",
                     f"/v1/jobs/{job['result'][:20]}"):
            problem(daemon.get(path), 404)
        problem(daemon.request("DELETE", f"/v1/results/{job['result'][:20]}"), 404)
    with program.daemon("--base-url", "https://lab.example.org/a/v1/b") as daemon:
        reply = daemon.request("POST", "/a/v1/b/v1/jobs", body=json.dumps(sponge()), headers={"Content-Type": "application/json"})
        assert reply.status == 200, reply
        result = reply.json()["result"]
        reply = daemon.get(f"/a/v1/b/v1/results/{result[:20]}/psd.csv")
        assert reply.status == 307 and reply.headers["location"] == f"/a/v1/b/v1/results/{result}/psd.csv", reply.headers


def test_a_title_belongs_to_a_job():
    """PATCH: title and labels of one job, also of an unfinished one, in lists, searches and after a start; its result has none."""
    with program.daemon("--workers", "1") as daemon:
        sent = [daemon.submit(sponge(title=f"Run {i}", labels={"lab": f"no {i}"})).json() for i in range(2)]
        first, second = (job["links"]["self"] for job in sent)
        assert sent[0]["result"] == sent[1]["result"] and [job["title"] for job in sent] == ["Run 0", "Run 1"], sent

        def change(path, body, **options):
            return daemon.request("PATCH", path, json=body, **options)

        def found(query):
            return [job["id"] for job in daemon.get("/v1/jobs?" + query).json()["jobs"]]
        reply = change(first, {"title": "Überlandleitung"})
        assert reply.status == 200 and reply.json() == {**sent[0], "title": "Überlandleitung", "cached": False}, reply
        assert daemon.get(first).json() == reply.json() and daemon.get(second).json()["title"] == "Run 1"
        assert found("q=ÜBERLAND".replace("Ü", "%C3%9C")) == [sent[0]["id"]] and not found("q=run%200")
        assert found("label=lab") == [sent[1]["id"], sent[0]["id"]]
        labelled = change(first, {"labels": ["a", "b=c"]}).json()
        assert labelled["labels"] == ["a", "b=c"] and labelled["title"] == "Überlandleitung", labelled
        assert found("label=b") == found("label=a") == found("q=leitung") == [sent[0]["id"]] == found("q=b%3Dc")
        for body, title, labels in (({}, "Überlandleitung", ["a", "b=c"]), ({"title": None}, None, ["a", "b=c"]),
                                    ({"labels": []}, None, None), ({"title": "x", "labels": {"k": "v"}}, "x", ["k=v"]),
                                    ({"title": "", "labels": []}, None, None), ({"title": "y", "labels": ["z"]}, "y", ["z"]),
                                    ({"labels": None}, "y", None), ({"title": None}, None, None), ({"labels": ["only"]}, None, ["only"])):
            shown = change(first, body).json()
            assert (shown.get("title"), shown.get("labels")) == (title, labels), (body, shown)
        assert found("q=only") == [sent[0]["id"]]
        result = daemon.get(f"/v1/results/{sent[0]['result']}").json()
        assert "title" not in result and "title" not in result["scene"], result
        running = [daemon.submit({**endless(i), "title": "slow"}, headers={"Prefer": "respond-async"}).json() for i in range(2)]
        for job in running:
            assert change(job["links"]["self"], {"title": "very slow", "labels": ["x"]}).json()["title"] == "very slow", job
        listed = daemon.get("/v1/jobs?limit=2").json()["jobs"]
        assert [(job["title"], job["labels"]) for job in listed] == [("very slow", ["x"])] * 2, listed
        for job in running:
            assert daemon.request("DELETE", job["links"]["self"]).json()["title"] == "very slow"
        faulty = problem(change(first, {"title": 1, "label": []}), 422, "/title", "/label")
        assert (faulty["type"], faulty["title"]) == ("/problems/bad-request", "The change has 2 faults"), faulty
        problem(change(first, {"title": "x" * 300, "labels": ["x\ny"] * 40}), 422)
        problem(change(first, ["title"]), 422)
        problem(change("/v1/jobs/j-none", {"title": "x"}), 404)
        problem(change(first + "?wait=1", {}), 400)
        problem(daemon.request("PATCH", first, body="{", headers={"Content-Type": "application/json"}), 400)
        problem(daemon.request("PATCH", first, body="{}", headers={"Content-Type": "text/plain"}), 415)
        problem(daemon.request("PATCH", first, body=" " * (17 << 20), headers={"Content-Type": "application/json"}), 413)
        daemon.stop()
        daemon.start()
        assert daemon.get(first).json()["labels"] == ["only"] and daemon.get(second).json()["title"] == "Run 1"
        ann, bob = (bearer(token(daemon.data, name, "read,submit")) for name in ("ann", "bob"))
        assert until(lambda: daemon.get("/v1/jobs").status == 401)
        anns = daemon.submit(sponge(title="ann's"), headers=ann).json()["links"]["self"]
        problem(change(anns, {"title": "bob's"}, headers=bob), 403)
        assert change(anns, {"title": "mine"}, headers=ann).json()["title"] == "mine"
        assert change(first, {"title": "ours"}, headers=bob).json()["title"] == "ours"


def test_a_finished_job_is_removed():
    """DELETE ?purge=1: 204 and it is in no list; its result goes with the last job that has it; 409 while it is not finished."""
    with program.daemon("--workers", "1") as daemon:
        jobs = [daemon.submit(sponge(title=f"Run {i}"), headers={"Idempotency-Key": f"k{i}"}).json() for i in range(2)]
        result = f"/v1/results/{jobs[0]['result']}"
        series = daemon.get(result + "/series.npy").body

        def purge(job, query="purge=1", **options):
            return daemon.request("DELETE", f"/v1/jobs/{job['id']}?{query}", **options)
        for refused, status in (("purge=2", 400), ("purge=0", 409), ("forever=1", 400)):
            problem(purge(jobs[0], refused), status)
        assert purge(jobs[0]).status == 204
        assert [job["id"] for job in daemon.get("/v1/jobs").json()["jobs"]] == [jobs[1]["id"]]
        for path in ("", "/scene", "/events"):
            problem(daemon.get(f"/v1/jobs/{jobs[0]['id']}{path}"), 404)
        problem(purge(jobs[0]), 404)
        assert daemon.get(result + "/series.npy").body == series
        again = daemon.submit(sponge(), headers={"Idempotency-Key": "k0"}).json()
        assert again["id"] != jobs[0]["id"] and again["cached"], again
        assert purge(again).status == 204 and daemon.get(result).status == 200
        assert purge(jobs[1]).status == 204
        for path in ("", "/series.npy", "/impacts.json", "/manifest"):
            problem(daemon.get(result + path), 404)
        anew = daemon.submit(sponge()).json()
        assert not anew["cached"] and anew["summary"] == jobs[0]["summary"], anew
        assert daemon.get(result + "/series.npy").body == series
        running = daemon.submit(endless(), headers={"Prefer": "respond-async"}).json()
        problem(purge(running), 409)
        assert daemon.request("DELETE", running["links"]["self"]).json()["status"] == "dismissed"
        assert until(lambda: purge(running).status == 204)
        daemon.stop()
        daemon.start()
        assert [job["id"] for job in daemon.get("/v1/jobs").json()["jobs"]] == [anew["id"]]
        ann, bob = (bearer(token(daemon.data, name, "read,submit")) for name in ("ann", "bob"))
        assert until(lambda: daemon.get("/v1/jobs").status == 401)
        anns = daemon.submit(sponge(), headers=ann).json()
        problem(purge(anns, headers=bob), 403)
        assert purge(anns, headers=ann).status == 204


def test_a_preview_is_the_result_and_is_stored_nowhere():
    """POST /v1/preview: plan, summary, series and impacts of the result to the bit; no job and no cache entry; 422, 429 and 503."""
    scenes = [program.scene(name) for name in ("paper_free_sponge", "paper_sine_aluminium", "paper_random_sponge")]
    for scene in scenes:
        scene.update(duration=5, sample_rate=500)
    scenes.append({**sponge(), "output": {"impacts": False, "channels": ["displacement"]}})
    with program.daemon() as daemon:
        def preview(scene, query="", **options):
            return daemon.request("POST", "/v1/preview" + query, json=scene, **options)
        before = daemon.get("/v1/cache").json()
        for scene in scenes:
            for query in ("", "?points=100"):
                replies = [preview(scene, query) for _ in range(2)]
                assert replies[0].status == 200 and replies[0].body == replies[1].body, replies
        assert daemon.get("/v1/jobs").json()["jobs"] == [] and daemon.get("/v1/cache").json() == before
        for scene in scenes:
            assert not daemon.request("POST", "/v1/jobs?dry_run=1", json=scene).json()["cached"]
            short, usual = (preview(scene, query).json() for query in ("?points=100", ""))
            job = program.finished(daemon, scene)
            assert not job["cached"], job
            result = f"/v1/results/{job['result']}"
            assert short["plan"] == usual["plan"] == job["plan"] and short["summary"] == job["summary"], short
            assert short["series"] == daemon.get(result + "/series.json?points=100").json()
            assert usual["series"] == daemon.get(result + "/series.json?points=2000").json()
            impacts = daemon.get(result + "/impacts.json")
            assert short["impacts"] == (impacts.json() if impacts.status == 200 else None), short["impacts"]
            assert preview(scene, "?points=100").json() == short
        problem(preview(endless()), 422)
        problem(preview({**sponge(), "study": {"kind": "tradeoff"}}), 422, "/study")
        faulty = {**sponge(), "duration": -1, "sample_rat": 1}
        assert preview(faulty).json()["errors"] == daemon.request("POST", "/v1/jobs", json=faulty).json()["errors"]
        problem(preview(sponge(), "?points=0"), 400)
        problem(daemon.request("POST", "/v1/preview", body="{", headers={"Content-Type": "application/json"}), 400)
        problem(daemon.request("POST", "/v1/preview", body="{}", headers={"Content-Type": "text/plain"}), 415)
        problem(daemon.request("POST", "/v1/preview", body=" " * (17 << 20), headers={"Content-Type": "application/json"}), 413)
    with program.daemon("--rate", "3") as daemon:
        ann = bearer(token(daemon.data, "ann"))
        assert until(lambda: daemon.get("/v1/jobs").status == 401)
        replies = [daemon.request("POST", "/v1/preview", json=sponge(), headers=ann) for _ in range(4)]
        assert [reply.status for reply in replies] == [200] * 3 + [429] and int(replies[3].headers["retry-after"]) > 0, replies


def test_a_sweep_is_made_again_only_when_it_was_finished():
    """While it runs, and once it was dismissed: 409 with what to do."""
    with program.daemon() as daemon:
        axis = {"pointer": "/dampers/0/clearance", "from": 0.005, "to": 0.02, "count": 3000}
        long = sponge(duration=300, study={"kind": "sweep", "axes": [axis]})
        job = "/v1/jobs/" + daemon.submit(long, headers={"Prefer": "respond-async"}).json()["id"]
        assert until(lambda: daemon.get(job + "/table.json").json().get("done", 0) > 0)
        assert "is not finished" in problem(daemon.request("POST", job + "/retry"), 409)["detail"]
        assert daemon.request("DELETE", job).status == 200
        assert until(lambda: daemon.get(job).json()["status"] == "dismissed")
        assert "submit its scene again" in problem(daemon.request("POST", job + "/retry"), 409)["detail"]


if __name__ == "__main__":
    program.main(globals())
