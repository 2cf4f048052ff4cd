#!/usr/bin/env python3
"""Many clients at once: full queues, waiting, connections ready together, the end."""

import concurrent.futures
import http.client
import json
import os
import shutil
import signal
import socket
import statistics
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from asking import endless, problem, sponge  # noqa: E402

SANITIZED = "nightly"


def test_a_full_queue_is_503():
    """Beyond --queue unfinished jobs: 503 with Retry-After, not ready, and all is well afterwards."""
    with program.daemon("--workers", "1", "--queue", "3") as daemon:
        jobs = [daemon.submit(endless(i), headers={"Prefer": "respond-async"}) for i in range(3)]
        assert [reply.status for reply in jobs] == [202] * 3, jobs
        reply = daemon.submit(endless(3), headers={"Prefer": "respond-async"})
        problem(reply, 503)
        assert int(reply.headers["retry-after"]) >= 1, reply.headers
        problem(daemon.get("/health/ready"), 503)
        for one in jobs:
            assert daemon.request("DELETE", one.headers["location"]).status == 200
        assert daemon.submit(sponge()).json()["status"] == "successful"
        assert daemon.get("/health/ready").status == 200


def test_dry_runs_of_large_scenes_leave_room_for_others():
    """Of many dry runs and explanations of 200 storeys some get 503 with Retry-After; reads are answered meanwhile, and later ones are taken."""
    large = sponge(structure={"kind": "frame", "masses": [1] * 200, "stiffnesses": [900] * 200, "damping_ratio": 0.02},
                   excitation={"kind": "random", "band": [1, 50], "rms": 1, "seed": 1})
    with program.daemon("--workers", "1") as daemon, concurrent.futures.ThreadPoolExecutor(48) as pool:
        paths = 12 * ["/v1/jobs?dry_run=1"] + 36 * ["/v1/cache/explain"]
        asked = [pool.submit(daemon.request, "POST", path, json=large) for path in paths]
        while not all(one.done() for one in asked):
            assert daemon.get("/v1/jobs").status == 200
        replies = [one.result() for one in asked]
        refused = [reply for reply in replies if reply.status != 200]
        assert 0 < len(refused) < len(replies), [reply.status for reply in replies]
        assert 503 in [reply.status for reply in replies[12:]], [reply.status for reply in replies]
        for reply in refused:
            problem(reply, 503)
            assert int(reply.headers["retry-after"]) >= 1, reply.headers
        assert daemon.request("POST", "/v1/jobs?dry_run=1", json=large).status == 200


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
                job = daemon.submit(endless(count), headers={"Prefer": "respond-async"}).json()["id"]
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
            waiters = [pool.submit(daemon.submit, endless(i), 30) for i in range(8)]
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
