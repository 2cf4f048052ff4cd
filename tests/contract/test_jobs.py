#!/usr/bin/env python3
"""What jobs offer: keys, search, events, cancelling, fairness, limits, deletion and retention."""

import concurrent.futures
import http.client
import json
import os
import resource
import shutil
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

WAITS = True

ASYNC = {"Prefer": "respond-async"}


def quick(number=0, **more):
    """A scene of some 20 us, each number another one."""
    scene = program.scene("paper_free_sponge")
    scene["dampers"][0]["clearance"] = 0.01 + 1e-6 * number
    scene.pop("title", None)
    scene.pop("labels", None)
    scene.update(more)
    return scene


def slow(number, duration, **more):
    """A scene of fixed small steps, which takes `duration` times what slow(0, 1) does."""
    scene = program.scene("paper_sine_aluminium")
    scene.pop("title", None)
    scene.update(duration=duration, sample_rate=100, output={"channels": [], "psd": None},
                 accuracy={"solver": "rk4", "step": 1e-5}, **more)
    scene["dampers"][0]["clearance"] = 0.012 + 1e-6 * number
    return scene


def duration_of(seconds):
    """How long a slow scene takes so many seconds of a processor here, whatever else that has to do now."""
    text = json.dumps(slow(0, 5))

    def used():
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        assert program.run("run", "-", text=text)[0] == 0
        return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    return max(1, round(5 * seconds / min(used() for _ in range(2))))


def ids(reply):
    assert reply.status == 200, reply
    return [job["id"] for job in reply.json()["jobs"]]


def pages(daemon, target):
    found = []
    while target:
        reply = daemon.get(target)
        found += ids(reply)
        link = reply.headers.get("link", "")
        target = link[1:link.index(">")] if link else None
    return found


def stream(daemon, job, headers=None, timeout=120):
    """An open stream of events."""
    connection = http.client.HTTPConnection("127.0.0.1", daemon.port, timeout=timeout)
    connection.request("GET", f"/v1/jobs/{job}/events", headers=headers or {})
    return connection, connection.getresponse()


def events(text):
    """[(event, id, data)] of a whole stream."""
    found = []
    for block in text.decode().split("\n\n"):
        fields = [line.split(": ", 1) for line in block.split("\n") if ": " in line and line[0] != ":"]
        if any(name == "event" for name, _ in fields):
            one = dict(fields)
            data = "\n".join(value for name, value in fields if name == "data")
            found.append((one["event"], int(one["id"]) if "id" in one else None, json.loads(data)))
    return found


def test_a_key_is_done_once():
    """Same key and body: the same job, said so; another body: 422; also after a restart and where a result's scene is submitted again, not under dry_run."""
    folder = tempfile.mkdtemp(prefix="impactd-jobs-")
    try:
        with program.daemon(data=folder) as daemon:
            first = daemon.submit(quick(1), headers={"Idempotency-Key": '"one"'})
            assert first.status == 200 and "idempotency-replayed" not in first.headers, first
            for key in ('"one"', "one"):
                again = daemon.submit(quick(1), headers={"Idempotency-Key": key})
                assert again.status == 200 and again.headers["idempotency-replayed"] == "true", again
                assert again.json()["id"] == first.json()["id"]
            other = daemon.submit(quick(2), headers={"Idempotency-Key": '"one"'})
            assert other.status == 422 and other.json()["type"] == "/problems/key-reused", other
            assert first.json()["id"] in other.json()["detail"]
            dry = daemon.request("POST", "/v1/jobs?dry_run=1", json=quick(2), headers={"Idempotency-Key": '"one"'})
            assert dry.status == 200, dry
            for bad in ('""', "k" * 256, '"a\\"b"', "ä".encode("latin-1")):
                refused = daemon.submit(quick(3), headers={"Idempotency-Key": bad})
                assert refused.status == 400 and "Idempotency-Key" in refused.json()["detail"], (bad, refused)
            wrong = daemon.submit({**quick(4), "duration": -1}, headers={"Idempotency-Key": '"two"'})
            right = daemon.submit(quick(4), headers={"Idempotency-Key": '"two"'})
            assert (wrong.status, right.status) == (422, 200), "a refused request used the key up"
        with program.daemon(data=folder) as daemon:
            again = daemon.submit(quick(1), headers={"Idempotency-Key": '"one"'})
            assert again.json()["id"] == first.json()["id"] and again.headers["idempotency-replayed"] == "true"
            assert len(pages(daemon, "/v1/jobs")) == 2
            path = f"/v1/results/{first.json()['result']}/again"
            once, twice = [daemon.request("POST", path, headers={"Idempotency-Key": '"three"'}) for _ in range(2)]
            assert once.json()["id"] == twice.json()["id"] and twice.headers["idempotency-replayed"] == "true", (once, twice)
            for key, status in (('"two"', 422), ('""', 400)):
                assert daemon.request("POST", path, headers={"Idempotency-Key": key}).status == status, key
            assert len(pages(daemon, "/v1/jobs")) == 3
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def test_a_key_sent_many_times_at_once_is_one_job():
    """24 equal requests with one key at once are one job and no error, in flight and finished."""
    duration = duration_of(0.5)
    with program.daemon("--workers", "1") as daemon:
        for number, scene in enumerate((quick(1), slow(1, duration))):
            headers = {"Idempotency-Key": f'"k{number}"', "Prefer": "respond-async"}
            with concurrent.futures.ThreadPoolExecutor(24) as pool:
                replies = list(pool.map(lambda _, s=scene, h=headers: daemon.submit(s, headers=h), range(24)))
            assert {reply.status for reply in replies} <= {200, 202}, replies
            assert len({reply.json()["id"] for reply in replies}) == 1
            assert sum("idempotency-replayed" in reply.headers for reply in replies) == 23
            daemon.finished(replies[0].json()["id"])
        assert len(pages(daemon, "/v1/jobs")) == 2


def test_jobs_are_listed_and_searched():
    """Newest first, page by page; by status, words, label, result, kind and time; nothing in a text is a pattern."""
    with program.daemon() as daemon:
        made = [daemon.submit(quick(i)).json()["id"] for i in range(7)]
        named = daemon.submit(quick(50, title="Ärmel 100%_\\", labels={"run": "A7", "who": "me"})).json()
        listed = daemon.submit(quick(51, title="run=A7", labels=["draft"])).json()["id"]
        study = daemon.submit({**quick(52), **{"study": program.scene("ensemble_random_sponge")["study"]},
                               "excitation": program.scene("ensemble_random_sponge")["excitation"]}, wait=30)
        newest_first = [study.json()["id"], listed, named["id"]] + made[::-1]
        assert pages(daemon, "/v1/jobs?limit=3") == newest_first
        assert named["labels"] == ["run=A7", "who=me"], named
        for query, expected in (
                ("q=%C3%A4RMEL", [named["id"]]), ("q=100%25_%5C", [named["id"]]), ("q=%25", [named["id"]]),
                ("q=_", [named["id"]]), ("q=a*", []), ("q=a%3Fmel", []), ("q=run%3Da7", [listed, named["id"]]),
                ("label=RUN=a7", [named["id"]]), ("label=run", [named["id"]]), ("label=ru", []),
                ("label=draft", [listed]), ("q=me&label=who", [named["id"]]), ("q=zzz", []), ("q=", newest_first),
                ("result=" + named["result"], [named["id"]]), ("result=r-0", []),
                ("kind=ensemble", [study.json()["id"]]), ("kind=none", newest_first[1:]), ("kind=tradeoff", []),
                ("status=successful", newest_first), ("status=failed", []), ("status=running", []),
                ("status=dismissed", []), ("since=2026-01-01&until=2999-12-31", newest_first),
                ("since=2999-01-01T00:00:00%2B02:00", []), ("until=2000-01-01", []),
                ("since=" + named["created"] + "&until=" + named["created"], [named["id"]])):
            found = ids(daemon.get("/v1/jobs?limit=100&" + query))
            assert found == expected or query.startswith("since=2026-") and set(found) == set(expected) \
                or query.startswith("since=" + named["created"]) and named["id"] in found, (query, found, expected)
        assert pages(daemon, "/v1/jobs?limit=2&kind=none&q=") == newest_first[1:]
        assert pages(daemon, "/v1/jobs?limit=1&q=run%3Da7") == [listed, named["id"]]
        for bad in ("status=x", "kind=x", "since=yesterday", "until=2026-13-01", "q=" + "x" * 201, "limit=0",
                    "since=2026-02-30", "since=2026-11-21T25:00:00Z"):
            assert daemon.get("/v1/jobs?" + bad).status == 400, bad
        assert daemon.get("/v1/jobs?before=j-0").status == 404
        title = "é" * 100  # as long as a title may be
        long = [daemon.submit(quick(60 + i, title=title, labels={"run": "x" * 90})).json()["id"] for i in range(2)]
        assert pages(daemon, "/v1/jobs?limit=1&kind=none&status=successful&since=2026-01-01T00:00:00Z&until=2999-01-01T00:00:00Z&label=run="
                     + "x" * 90 + "&q=" + "%C3%A9" * 100) == long[::-1]
        refused = daemon.submit(quick(60, labels=["x" * 9000]))
        assert refused.status == 422 and refused.json()["errors"][0]["pointer"] == "/labels", refused


def test_unfinished_jobs_are_listed_by_their_state():
    """status=running and status=accepted are what the queue says."""
    duration = duration_of(5)
    with program.daemon("--workers", "1") as daemon:
        made = [daemon.submit(slow(i, duration), headers=ASYNC).json()["id"] for i in range(5)]
        running = pages(daemon, "/v1/jobs?status=running")
        waiting = pages(daemon, "/v1/jobs?status=accepted&limit=2")
        assert len(running) == 1 and sorted(running + waiting) == sorted(made), (running, waiting)
        for job in made:
            assert daemon.request("DELETE", f"/v1/jobs/{job}").status == 200
        assert sorted(pages(daemon, "/v1/jobs?status=dismissed&limit=2")) == sorted(made)


def test_events_tell_a_job_to_its_end():
    """Progress with rising ids, then "finished" with the job's document; Last-Event-ID goes on where it stood."""
    duration = duration_of(2)
    with program.daemon("--workers", "1") as daemon:
        job = daemon.submit(slow(1, duration), headers=ASYNC).json()["id"]
        connection, reply = stream(daemon, job)
        assert reply.status == 200 and reply.headers["Content-Type"] == "text/event-stream"
        assert reply.headers["X-Accel-Buffering"] == "no", "a proxy may hold the events back"
        text = reply.read()
        connection.close()
        assert text.startswith(b"retry: "), text[:80]
        told = events(text)
        assert [one[0] for one in told] == ["progress"] * (len(told) - 1) + ["finished"] and len(told) >= 3, told
        numbers = [one[1] for one in told]
        assert numbers == sorted(set(numbers)), numbers
        assert told[-2][2]["status"] == "running" and told[-2][2]["progress"] > 0
        assert told[-1][2] == daemon.get(f"/v1/jobs/{job}").json()
        again = daemon.get(f"/v1/jobs/{job}/events")
        assert [one[0] for one in events(again.body)] == ["finished"]
        assert daemon.get(f"/v1/jobs/{job}/events", headers={"Last-Event-ID": str(numbers[-1])}).status == 204
        later = daemon.get(f"/v1/jobs/{job}/events", headers={"Last-Event-ID": str(numbers[0])})
        assert [one[0] for one in events(later.body)] == ["finished"]
        assert daemon.get("/v1/jobs/j-0/events").status == 404


def test_events_tell_of_dismissal_and_of_the_end_of_the_daemon():
    """A dismissed job ends its stream with that; a daemon that stops says so, in time."""
    duration = duration_of(30)
    with program.daemon("--workers", "1") as daemon:
        jobs = [daemon.submit(slow(i, duration), headers=ASYNC).json()["id"] for i in range(2)]
        streams = [stream(daemon, job) for job in jobs]
        assert daemon.request("DELETE", f"/v1/jobs/{jobs[0]}").status == 200
        told = events(streams[0][1].read())
        assert told[-1][0] == "finished" and told[-1][2]["status"] == "dismissed", told
        with concurrent.futures.ThreadPoolExecutor(1) as pool:
            last = pool.submit(streams[1][1].read)
            time.sleep(0.5)
            daemon.stop(20)
            told = events(last.result(20))
        assert told[-1][0] == "stopping", told
        for connection, _ in streams:
            connection.close()
        daemon.start()


def test_two_hundred_streams_at_once():
    """200 streams of one job all hear of its end; clients that leave early leave nothing behind."""
    duration = duration_of(3)
    with program.daemon("--workers", "1") as daemon:
        job = daemon.submit(slow(1, duration), headers=ASYNC).json()["id"]
        files = len(os.listdir(f"/proc/{daemon.process.pid}/fd"))
        gone = [stream(daemon, job) for _ in range(50)]
        open_streams = [stream(daemon, job) for _ in range(200)]
        for connection, _ in gone:
            connection.close()
        with concurrent.futures.ThreadPoolExecutor(200) as pool:
            texts = list(pool.map(lambda one: one[1].read(), open_streams))
        for text in texts:
            assert events(text)[-1][0] == "finished", text[-300:]
        for connection, _ in open_streams:
            connection.close()
        end = time.monotonic() + 20
        while len(os.listdir(f"/proc/{daemon.process.pid}/fd")) > files + 2 and time.monotonic() < end:
            time.sleep(0.1)
        assert len(os.listdir(f"/proc/{daemon.process.pid}/fd")) <= files + 2


def test_a_job_dismissed_while_it_waits_has_only_waited():
    """Its time in the queue is all its time."""
    with program.daemon("--workers", "1") as daemon:
        jobs = [daemon.submit(slow(i, duration_of(30)), headers=ASYNC).json()["id"] for i in range(3)]
        job = daemon.request("DELETE", f"/v1/jobs/{jobs[-1]}").json()
        assert job["status"] == "dismissed" and job["started"] is None, job
        assert job["timing"]["queued"] == job["timing"]["total"] > 0 == job["timing"]["run"], job


def test_a_long_poll_ends_with_the_job():
    """?wait= answers when the job is finished, or when the time is up."""
    duration = duration_of(1.5)
    with program.daemon("--workers", "1") as daemon:
        job = daemon.submit(slow(1, duration), headers=ASYNC).json()["id"]
        early = daemon.get(f"/v1/jobs/{job}?wait=0.05").json()
        assert early["status"] in ("accepted", "running"), early
        # More than is given is no fault, as in Prefer.
        assert daemon.get(f"/v1/jobs/{job}?wait=3600").json()["status"] == "successful"


def test_a_short_job_overtakes_fifty_long_ones():
    """With 1, 2 and 4 workers a short job behind 50 long ones is answered while they still run."""
    for workers in ("1", "2", "4"):
        with program.daemon("--workers", workers) as daemon:
            # Long is what is predicted to be: on a loaded machine much takes long that is not.
            cost = daemon.request("POST", "/v1/jobs?dry_run=1", json=slow(0, 5)).json()["cost"]["cpu_seconds"]
            duration = round(5 * 3 / cost)
            long = [daemon.submit(slow(i, duration), headers=ASYNC).json()["id"] for i in range(50)]
            short = daemon.submit(quick(9), wait=30)
            assert short.status == 200 and short.json()["status"] == "successful", (workers, short)
            unfinished = pages(daemon, "/v1/jobs?status=running") + pages(daemon, "/v1/jobs?status=accepted")
            assert len(unfinished) >= 50 - int(workers), (workers, len(unfinished))
            for job in long:
                daemon.request("DELETE", f"/v1/jobs/{job}")


def test_equal_scenes_in_flight_are_computed_once():
    """64 clients with one scene: 64 jobs, one computation, one result."""
    duration = duration_of(1)
    with program.daemon("--workers", "2") as daemon:
        with concurrent.futures.ThreadPoolExecutor(64) as pool:
            replies = list(pool.map(lambda _: daemon.submit(slow(1, duration), wait=30), range(64)))
        jobs = [daemon.finished(reply.json()["id"]) for reply in replies]
        assert len({job["id"] for job in jobs}) == 64 and len({job["result"] for job in jobs}) == 1
        assert {job["status"] for job in jobs} == {"successful"}
        fresh = [job for job in jobs if not job["cached"]]
        assert len({job["timing"]["run"] for job in fresh}) == 1, "it was computed more than once"


def test_a_study_beyond_its_limit_is_refused():
    """--max-study-seconds: a study predicted to take more CPU time is a fault at /study with both numbers, by a dry run too."""
    study = {"kind": "sweep", "axes": [{"pointer": "/dampers/0/clearance", "from": 0.005, "to": 0.02, "count": 100000}]}
    asked = {**program.scene("paper_random_sponge"), "duration": 1000, "study": study}
    with program.daemon("--max-study-seconds", "1") as daemon:
        for path in ("/v1/jobs", "/v1/jobs?dry_run=1"):
            reply = daemon.request("POST", path, json=asked)
            fault = reply.json()["errors"][0]
            assert reply.status == 422 and fault["pointer"] == "/study" and "at most 1 s" in fault["detail"], reply
        small = {**asked, "duration": 1, "study": {**study, "axes": [{**study["axes"][0], "count": 3}]}}
        assert daemon.submit(small).json()["status"] == "successful"
    with program.daemon("--max-study-seconds", "0") as daemon:
        assert daemon.request("POST", "/v1/jobs?dry_run=1", json=asked).status == 200


def test_a_full_queue_says_when_to_come_back():
    """503 with Retry-After within [1, 3600] that grows with the work ahead; a dismissed job gives its place back."""
    found = []
    for seconds in (2, 40):
        duration = duration_of(seconds)
        with program.daemon("--workers", "1", "--queue", "3") as daemon:
            jobs = [daemon.submit(slow(i, duration), headers=ASYNC).json()["id"] for i in range(3)]
            full = daemon.submit(quick(1))
            assert full.status == 503 and full.json()["type"] == "/problems/busy", full
            assert full.json()["detail"] == "the queue is full: of unfinished jobs it has 3, and may have 3", full
            found.append(int(full.headers["retry-after"]))
            assert daemon.request("DELETE", f"/v1/jobs/{jobs[2]}").status == 200
            assert daemon.submit(quick(1)).status == 200
            for job in jobs:
                daemon.request("DELETE", f"/v1/jobs/{job}")
    assert 1 <= found[0] < found[1] <= 3600, found


def test_settings_that_contradict_each_other_are_refused_with_the_mend():
    """A quota beyond the queue, and a database kept smaller than an empty one."""
    for flags, word in ((("--quota", "20", "--queue", "10"), "at most --queue, 10"), (("--keep-bytes", "5"), "at least")):
        code, _, errors = program.run("serve", "--listen", "127.0.0.1:0", *flags)
        assert code == 2 and word in errors, (code, errors)


def test_a_result_is_deleted_and_its_jobs_say_so():
    """204, then 404; the job stays; the scene is computed anew; 409 while it is computed."""
    duration = duration_of(5)
    with program.daemon("--workers", "1") as daemon:
        job = daemon.submit(quick(1)).json()
        path = f"/v1/results/{job['result']}"
        series = daemon.get(path + "/series.npy").body
        assert daemon.request("DELETE", path).status == 204
        for gone in (path, path + "/series.npy", path + "/psd.json", path + "/manifest"):
            assert daemon.get(gone).status == 404, gone
        assert daemon.request("DELETE", path).status == 404
        told = daemon.get(f"/v1/jobs/{job['id']}").json()
        assert told["status"] == "successful" and told["result_deleted"] is True, told
        assert "result" not in told["links"] and told["summary"] is None, told
        assert daemon.get("/v1/jobs").json()["jobs"][0]["result_deleted"] is True
        anew = daemon.submit(quick(1)).json()
        assert anew["result"] == job["result"] and anew["cached"] is False, anew
        assert daemon.get(path + "/series.npy").body == series
        running = daemon.submit(slow(1, duration), headers=ASYNC).json()["id"]
        dry = daemon.request("POST", "/v1/jobs?dry_run=1", json=slow(1, duration)).json()["result"]
        assert daemon.request("DELETE", f"/v1/results/{dry}").status == 409
        daemon.request("DELETE", f"/v1/jobs/{running}")


def test_a_jobs_scene_is_there_whatever_became_of_it():
    """GET /v1/jobs/{id}/scene: of a successful, cached, running, dismissed and failed job, also after a start; it runs as it stands."""
    with program.daemon("--workers", "1") as daemon:
        sent = quick(1)
        jobs = {state: daemon.submit(sent).json() for state in ("successful", "cached")}
        assert jobs["cached"]["cached"] and not jobs["successful"]["cached"]
        scene = daemon.get(f"/v1/results/{jobs['cached']['result']}").json()["scene"]
        jobs["running"] = daemon.submit(slow(1, 100), headers=ASYNC).json()
        jobs["waiting"] = daemon.submit({**slow(2, 100), "study": {"kind": "tradeoff"}}, headers=ASYNC).json()
        asked = {state: daemon.get(f"/v1/jobs/{job['id']}/scene") for state, job in jobs.items()}
        assert asked["successful"].json() == asked["cached"].json() == scene, asked
        assert asked["running"].json()["accuracy"] == {"solver": "rk4", "step": 1e-5}, asked["running"]
        assert asked["waiting"].json()["study"]["kind"] == "tradeoff", asked["waiting"]
        assert daemon.request("POST", "/v1/jobs?dry_run=1", json=asked["waiting"].json()).status == 200
        assert daemon.submit(asked["successful"].json()).json()["result"] == jobs["successful"]["result"]
        for state in ("waiting", "running"):
            assert daemon.request("DELETE", f"/v1/jobs/{jobs[state]['id']}").status == 200
        daemon.stop()
        daemon.start()
        for state, job in jobs.items():
            assert daemon.get(f"/v1/jobs/{job['id']}/scene").json() == asked[state].json(), state
        # A fault that only running shows: a narrow clearance where the start is far out.
        axes = [{"pointer": "/dampers/0/clearance", "values": [0.02, 0.01, 0.02]},
                {"pointer": "/dampers/0/position", "from": 0, "to": 0.006, "count": 3000}]
        failed = daemon.finished(daemon.submit(quick(2, study={"kind": "sweep", "axes": axes})).json()["id"])
        assert failed["status"] == "failed", failed
        assert daemon.get(f"/v1/jobs/{failed['id']}/scene").json()["study"]["kind"] == "sweep"
        assert daemon.get("/v1/jobs/j-none/scene").status == 404
        assert daemon.request("DELETE", f"/v1/results/{jobs['successful']['result']}").status == 204
        for state in ("successful", "cached"):
            assert daemon.get(f"/v1/jobs/{jobs[state]['id']}/scene").status == 410


def test_a_page_whose_place_is_gone_goes_on():
    """Retention between two pages: the next page has what is still there behind that place, no 404."""
    folder = tempfile.mkdtemp(prefix="impactd-jobs-")
    try:
        with program.daemon(data=folder) as daemon:
            for i in range(8):
                daemon.submit(quick(i))
            link = daemon.get("/v1/jobs?limit=6").headers["link"]
            place = link[1:link.index(">")]
            assert len(ids(daemon.get(place))) == 2
        with program.daemon("--keep-jobs", "3", data=folder) as daemon:
            end = time.monotonic() + 60
            while len(ids(daemon.get("/v1/jobs"))) > 3 and time.monotonic() < end:
                time.sleep(0.2)
            reply = daemon.get(place)
            assert reply.status == 200 and ids(reply) == [] and "link" not in reply.headers, reply
            assert daemon.get("/v1/jobs?before=j-7f3a").status == 404
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def test_what_is_not_to_be_kept_goes():
    """--keep-jobs: the oldest finished jobs go, and the results that no job names any more."""
    folder = tempfile.mkdtemp(prefix="impactd-jobs-")
    try:
        with program.daemon(data=folder) as daemon:
            made = [daemon.submit(quick(i)).json() for i in range(150)]
            same = daemon.submit(quick(0)).json()
        with program.daemon("--keep-jobs", "5", data=folder) as daemon:
            end = time.monotonic() + 60
            while len(pages(daemon, "/v1/jobs?limit=100")) > 5 and time.monotonic() < end:
                time.sleep(0.2)
            assert pages(daemon, "/v1/jobs") == [same["id"]] + [job["id"] for job in made[:-5:-1]]
            assert daemon.get(f"/v1/jobs/{made[0]['id']}").status == 404
            assert daemon.get(f"/v1/results/{made[0]['result']}").status == 200, "a later job names it"
            assert daemon.get(f"/v1/results/{made[1]['result']}").status == 404
            assert daemon.submit(quick(1)).json()["cached"] is False
        with program.daemon("--keep-days", "1e-7", data=folder) as daemon:
            end = time.monotonic() + 60
            while pages(daemon, "/v1/jobs") and time.monotonic() < end:
                time.sleep(0.2)
            assert pages(daemon, "/v1/jobs") == []
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    program.main(globals())
