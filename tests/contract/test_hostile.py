#!/usr/bin/env python3
"""Requests by raw socket: heads that two parsers could read differently, slow and broken clients, pipelining."""

import http.client
import json
import os
import re
import socket
import sys
import threading
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from access import bearer, impactd, token  # noqa: E402
from asking import endless  # noqa: E402
from program import until  # noqa: E402

SANITIZED = True
WAITS = True
HOST = b"Host: localhost\r\n"
GET = b"GET /version HTTP/1.1\r\n"
POST = b"POST /v1/jobs HTTP/1.1\r\n" + HOST + b"Content-Type: application/json\r\n"
WAIT = POST + b"Prefer: wait=30\r\n"
SECOND = GET + HOST + b"\r\n"


LIVE = b"GET /health/live HTTP/1.1\r\n" + HOST + b"\r\n"

# What must come is waited for this long [s], however busy the machine; less than the daemon bears an idle connection.
PATIENCE = 45


def connect(daemon):
    made = socket.create_connection(("127.0.0.1", daemon.port), timeout=PATIENCE)
    made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return made


def exchange(daemon, data, ends=False):
    """Sends bytes, then nothing more if `ends`; returns the statuses of all that the daemon sends until it closes."""
    with connect(daemon) as client:
        got = b""
        try:
            client.sendall(data)
            if ends:
                client.shutdown(socket.SHUT_WR)
            while piece := client.recv(65536):
                got += piece
        except ConnectionError:
            pass
        except TimeoutError:
            raise AssertionError(("left open", data[:80], got)) from None
    return [int(code) for code in re.findall(rb"^HTTP/1\.1 (\d{3}) ", got, re.M)], got


def converse(daemon, data, count):
    """Sends bytes; returns the statuses of so many answers and all of them. Then the connection must be open: the next
    answer is the next request's."""
    with connect(daemon) as client, client.makefile("rb") as stream:
        client.sendall(data)
        statuses, got = [], b""
        for _ in range(count):
            head = b""
            while not head.endswith(b"\r\n\r\n"):
                line = stream.readline()
                assert line, ("closed too early", data[:80], got + head)
                head += line
            statuses.append(int(head.split()[1]))
            got += head + stream.read(int(re.search(rb"^Content-Length: (\d+)", head, re.M | re.I)[1]))
        client.sendall(LIVE + LIVE.replace(b"\r\n\r\n", b"\r\nConnection: close\r\n\r\n"))
        last = stream.read()
    assert re.findall(rb"^HTTP/1\.1 (\d{3}) ", last, re.M) == [b"200", b"200"], ("not left open", data[:80], last)
    assert last.count(b'{"status": "live"}') == 2, ("answered more than was asked", data[:80], got, last)
    return statuses, got


def test_ambiguous_heads_are_refused_and_the_connection_closed():
    """Each is answered once, with its 4xx or 5xx, and a second request behind it is never served."""
    cases = [
        (400, GET + HOST + HOST),
        (400, GET + HOST + b"Host: example.org\r\n"),
        (421, GET + b"Host: example.org\r\n"),
        (421, GET + b"Host: localhost.example.org\r\n"),
        (400, GET),
        (400, GET + b"Host : localhost\r\n"),
        (505, b"GET /version HTTP/1.9\r\n" + HOST),
        (505, b"GET /version HTTP/2.0\r\n" + HOST),
        (501, b"BREW /version HTTP/1.1\r\n" + HOST),
        (501, b"TRACE /version HTTP/1.1\r\n" + HOST),
        (501, b"CONNECT localhost:80 HTTP/1.1\r\n" + HOST),
        (400, b"OPTIONS * HTTP/1.1\r\n" + HOST),
        (400, b"GET http://localhost/version HTTP/1.1\r\n" + HOST),
        (400, b"GET version HTTP/1.1\r\n" + HOST),
        (400, b"GET /version?a=b c HTTP/1.1\r\n" + HOST),
        (400, b"GET /version HTTP/1.0 HTTP/1.1\r\n" + HOST),
        (400, b"GET /v1/%2e%2e/version HTTP/1.1\r\n" + HOST),
        (400, b"GET /v1/.%2E/version HTTP/1.1\r\n" + HOST),
        (400, b"GET /v1/../version HTTP/1.1\r\n" + HOST),
        (400, b"GET /version%00.json HTTP/1.1\r\n" + HOST),
        (400, b"GET /version?a=%00 HTTP/1.1\r\n" + HOST),
        (400, b"GET /version?a=%zz HTTP/1.1\r\n" + HOST),
        (400, GET + HOST + b"X-A: a\rX-B: b\r\n"),
        (400, GET + HOST + b"X-A: a\x01b\r\n"),
        (400, GET + HOST + b"Content-Length: 0\r\nContent-Length: 5\r\n"),
        (400, POST + b"Content-Length: 2\r\nContent-Length: 2\r\n"),
        (400, POST + b"Content-Length: +2\r\n"),
        (400, POST + b"Content-Length: 2, 2\r\n"),
        (400, POST + b"Content-Length: -1\r\n"),
        (400, POST + b"Content-Length: 0x2\r\n"),
        (400, POST + b"Content-Length: 2\r\nTransfer-Encoding: chunked\r\n"),
        (501, POST + b"Transfer-Encoding: gzip\r\n"),
        (501, POST + b"Transfer-Encoding: chunked, gzip\r\n"),
        (501, POST + b"Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n"),
        (417, POST + b"Content-Length: 2\r\nExpect: miracles\r\n"),
        (413, POST + b"Content-Length: 99999999999999999999999\r\n"),
        (413, POST + b"Content-Length: 99999999999\r\n"),
        (414, b"GET /" + 5000 * b"a" + b" HTTP/1.1\r\n" + HOST),
        (414, b"GET /" + 40000 * b"a" + b" HTTP/1.1\r\n" + HOST),
        (431, GET + HOST + b"X-A: " + 40000 * b"a" + b"\r\n"),
    ]
    with program.daemon() as daemon:
        for expected, head in cases:
            statuses, got = exchange(daemon, head + b"\r\n" + SECOND)
            assert b'"engine"' not in got, (head[:80], "a second request was served", got)
            assert statuses[:1] == [expected], (head[:80], got[:300])
        assert daemon.get("/version").status == 200


def stop_within_a_head(daemon, data):
    """Sends less than a head and then nothing more: what the daemon says of that within a second. The connection may stay
    until the daemon's patience with an idle one ends."""
    with connect(daemon) as client:
        got = b""
        try:
            client.sendall(data)
            client.shutdown(socket.SHUT_WR)
            client.settimeout(1)
            while piece := client.recv(65536):
                got += piece
        except OSError:  # the daemon may be gone before the shutdown, or say nothing
            pass
    return [int(code) for code in re.findall(rb"^HTTP/1\.1 (\d{3}) ", got, re.M)], got


def test_a_request_that_waits_ends_with_its_token():
    """A token revoked while its requests wait for a job: 401, and nothing of what they waited for is left."""
    with program.daemon() as daemon:
        keys = {name: token(daemon.data, name, "admin") for name in ("stays", "goes")}
        assert until(lambda: daemon.get("/v1/jobs").status == 401)
        job = daemon.submit(endless(), headers={**bearer(keys["stays"]), "Prefer": "respond-async"}).json()
        waiting = [http.client.HTTPConnection(daemon.host, daemon.port, timeout=60) for _ in range(5)]
        for one in waiting:
            one.request("GET", job["links"]["self"] + "?wait=25", headers=bearer(keys["goes"]))
        time.sleep(0.5)
        assert impactd("token", "revoke", "goes", "--data", daemon.data).returncode == 0
        assert until(lambda: daemon.get("/v1/jobs", headers=bearer(keys["goes"])).status == 401)
        assert daemon.request("DELETE", job["links"]["self"], headers=bearer(keys["stays"])).status == 200
        assert [one.getresponse().status for one in waiting] == [401] * 5


def test_garbage_is_not_served():
    """Bytes that are no HTTP at all end in a 4xx or a closed connection, or are not answered."""
    with program.daemon() as daemon:
        for data in (b"garbage\r\n\r\n", b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", b"GET\r\n\r\n", b"GET /version\r\n\r\n",
                     b"\x00" * 5000, b"\r\n" * 3000, os.urandom(3000), b"GET /version HTTP/1.1 extra\r\n" + HOST + b"\r\n",
                     GET + HOST + b" folded: x\r\n\r\n", GET + b": x\r\n" + HOST + b"\r\n", b"A" * 70000):
            has_head = b"\r\n\r\n" in data.lstrip(b"\r\n")
            statuses, got = exchange(daemon, data, ends=True) if has_head else stop_within_a_head(daemon, data)
            assert all(status >= 400 for status in statuses), (data[:60], got)
        assert daemon.get("/version").status == 200


def test_lines_that_belong_to_no_header_are_refused():
    """Continued headers, which libmicrohttpd drops, and headers without a name: 400, and no body becomes a request."""
    inner = GET + HOST + b"X-Request-Id: smuggled\r\n\r\n"
    length = b"Content-Length: %d\r\n" % len(inner)
    with program.daemon() as daemon:
        for head in (GET + HOST + length + b" x\r\n\r\n", GET + HOST + length + b"\t0\r\nAccept: */*\r\n\r\n",
                     POST + length + b" 0\r\n\r\n", POST + b": x\r\n" + length + b"\r\n", POST + b":\r\n" + length + b"\r\n",
                     GET + HOST + b"Host: evil\r\n x\r\n" + length + b"\r\n", GET + HOST + b"X-B: c\r\n d\r\n" + length + b"\r\n"):
            statuses, got = exchange(daemon, head + inner)
            assert statuses == [400], (head, got)
        # A head that comes in pieces, blanks around values, values without any.
        head = GET + b"\r\n" .join([HOST.rstrip(), b"Accept:  */* \t", b"X-A:b", b"X-B:", b"X-C: " + b"c" * 9000]) + b"\r\n\r\n"
        with socket.create_connection((daemon.host, daemon.port), timeout=20) as line:
            for part in (head[:1], head[1:40], head[40:70], head[70:3000], head[3000:9050], head[9050:] + head + head[:50], head[50:]):
                line.sendall(part)
                time.sleep(0.02)
            got = b""
            while got.count(b"HTTP/1.1 200 OK") < 3:
                got += line.recv(65536)


def test_old_and_unusual_but_good_requests_are_served():
    """HTTP/1.0 without Host, [::1] and ports in Host, chunked bodies, Expect: 100-continue, leading blank lines."""
    body = json.dumps(program.scene("paper_free_sponge")).encode()
    with program.daemon() as daemon:
        for data, closes in ((b"GET /version HTTP/1.0\r\n\r\n", True),
                             (GET + b"Host: [::1]:65535\r\n\r\n", False), (GET + b"Host: LocalHost:1\r\n\r\n", False),
                             (b"\r\n" + SECOND, False), (GET + HOST + b"Connection: close\r\n\r\n", True),
                             (GET + HOST + b"Content-Length: 3\r\n\r\nabc", False)):
            statuses, got = exchange(daemon, data) if closes else converse(daemon, data, 1)
            assert statuses == [200], (data, got)
        half = len(body) // 2
        chunked = b"%x\r\n%s\r\n%x;a=b\r\n%s\r\n0\r\nTrailer: x\r\n\r\n" % (half, body[:half], len(body) - half, body[half:])
        statuses, got = converse(daemon, WAIT + b"Transfer-Encoding: chunked\r\n\r\n" + chunked, 1)
        assert statuses == [200] and b'"successful"' in got, got
        with connect(daemon) as client:
            client.sendall(WAIT + b"Expect: 100-continue\r\nContent-Length: %d\r\n\r\n" % len(body))
            assert client.recv(100).startswith(b"HTTP/1.1 100 "), "the body is asked for"
            client.sendall(body)
            assert client.recv(100).startswith(b"HTTP/1.1 200 ")
        statuses, got = exchange(daemon, POST + b"Expect: 100-continue\r\nContent-Length: 20000000\r\n\r\n")
        assert statuses == [413], got


def test_pipelined_requests_are_answered_in_order():
    """Requests sent at once, one of which waits: as many answers, in the same order."""
    with program.daemon() as daemon:
        body = json.dumps(program.scene("paper_random_sponge")).encode()
        data = (b"".join(b"GET /v1/materials/m%d HTTP/1.1\r\n" % i + HOST + b"\r\n" for i in range(20))
                + WAIT + b"Content-Length: %d\r\n\r\n" % len(body) + body + SECOND)
        statuses, got = converse(daemon, data, 22)
        assert statuses == [404] * 20 + [200, 200], statuses
        order = [int(i) for i in re.findall(rb'"instance": "/v1/materials/m(\d+)"', got)]
        assert order == list(range(20)), order
        assert got.index(b'"successful"') < got.index(b'"engine"')


def usual_time(daemon):
    """How long 45 of 50 short requests take at most, one after the other [s]."""
    times = []
    for _ in range(50):
        began = time.monotonic()
        assert daemon.get("/health/live").status == 200
        times.append(time.monotonic() - began)
    return sorted(times)[45]


def test_slow_and_silent_clients_hold_up_nobody():
    """400 clients who stop in the middle of head or body: others are answered at once, and descriptors come back."""
    with program.daemon() as daemon:
        folder = f"/proc/{daemon.process.pid}/fd"
        alone = usual_time(daemon)  # says how busy the machine is
        before = len(os.listdir(folder))
        slow = [connect(daemon) for _ in range(400)]
        for i, client in enumerate(slow):
            client.sendall((b"GET /ver", GET + b"X-A: b", POST + b"Content-Length: 100\r\n\r\n{",
                            POST + b"Transfer-Encoding: chunked\r\n\r\n5\r\n{")[i % 4])
        crowded = usual_time(daemon)
        assert crowded < max(2 if program.is_sanitized() else 0.2, 10 * alone), (crowded, alone)
        for client in slow:
            client.close()
        end = time.monotonic() + 9  # less than silence is borne
        while len(os.listdir(folder)) > before + 2 and time.monotonic() < end:
            time.sleep(0.05)
        assert len(os.listdir(folder)) <= before + 2, "descriptors are lost"


def test_a_dripping_head_is_cut_off():
    """A client who sends its head a byte at a time is thrown out after 10 s, whether or not it goes on."""
    with program.daemon() as daemon:
        client = connect(daemon)
        client.sendall(GET)
        began = time.monotonic()
        try:
            while time.monotonic() - began < 30:
                client.sendall(b"a")
                time.sleep(0.3)
            seconds = None
        except OSError:
            seconds = time.monotonic() - began
        client.close()
        assert seconds is not None and 8 < seconds < 20, seconds


def test_a_chunk_without_end_keeps_no_thread_busy():
    """A chunk's head longer than a connection's memory: while its client is waited for, and when it has gone, the event
    loop that has it sleeps in between."""
    def effort(daemon):
        """CPU [s] of the busiest thread, and how often it went to sleep, by thread."""
        threads = {}
        for task in os.listdir(f"/proc/{daemon.process.pid}/task"):
            with open(f"/proc/{daemon.process.pid}/task/{task}/stat", encoding="ascii") as file:
                spent = sum(int(part) for part in file.read().rsplit(")", 1)[1].split()[11:13]) / os.sysconf("SC_CLK_TCK")
            with open(f"/proc/{daemon.process.pid}/task/{task}/status", encoding="ascii") as file:
                threads[task] = spent, int(re.search(r"^voluntary_ctxt_switches:\s+(\d+)", file.read(), re.M)[1])
        return threads

    with program.daemon() as daemon:
        client = connect(daemon)
        client.sendall(POST + b"Transfer-Encoding: chunked\r\n\r\n2;" + 20000 * b"a")
        time.sleep(1)
        for state in ("there", "gone"):
            before = effort(daemon)
            time.sleep(2)
            for task, (spent, sleeps) in effort(daemon).items():
                spent, sleeps = spent - before[task][0], sleeps - before[task][1]
                assert spent < 0.1 or sleeps > 50, (state, spent, sleeps)
            client.close()
        assert daemon.get("/version").status == 200


def test_large_bodies_keep_no_scene_out():
    """Clients who hold back the last byte of large bodies: another large one is 503, a small one is run."""
    most = 1 << 16
    with program.daemon("--max-body", str(most)) as daemon:
        holders = [connect(daemon) for _ in range(17)]
        for client in holders:
            client.sendall(POST + b"Content-Length: %d\r\n\r\n" % most + b" " * (most - 1))
        time.sleep(1)  # until all are read
        scene = json.dumps(program.scene("paper_free_sponge"))
        headers = {"Content-Type": "application/json"}
        large = daemon.request("POST", "/v1/jobs", body=scene.ljust(most), headers=headers)
        assert large.status == 503 and int(large.headers["retry-after"]) >= 1, large
        assert daemon.request("POST", "/v1/jobs", body=scene, headers=headers).status == 200
        for client in holders:
            client.close()
        time.sleep(1)
        assert daemon.request("POST", "/v1/jobs", body=scene.ljust(most), headers=headers).status == 200


def test_who_takes_nothing_is_cut_off():
    """A client who asks for much and reads none of it is thrown out after a minute; a slow reader is not."""
    with program.daemon("--workers", "1") as daemon:
        result = daemon.submit({**program.scene("paper_free_sponge"), "duration": 2000}, wait=60).json()["result"]

        def ask(path):
            client = connect(daemon)
            client.sendall(b"GET /v1/results/%s/%s HTTP/1.1\r\n" % (result.encode(), path) + HOST + b"\r\n")
            return client

        silent = [ask(b"series.npy"), ask(b"series.json"), ask(b"series.npy?channels=displacement&to=400")]
        slow = ask(b"series.npy")
        time.sleep(1)  # until all are connected
        folder = f"/proc/{daemon.process.pid}/fd"
        before, began = len(os.listdir(folder)), time.monotonic()
        while len(os.listdir(folder)) > before - len(silent) and time.monotonic() < began + 120:
            time.sleep(1)
            assert slow.recv(1 << 16), "who reads slowly is served"
        assert 50 < time.monotonic() - began < 110, time.monotonic() - began
        assert slow.recv(1 << 16), "who reads slowly is served"


def test_clients_who_leave_while_waiting():
    """Many clients submit, wait and vanish: the daemon goes on, and its jobs can be dismissed."""
    scene = program.scene("paper_sine_aluminium")
    scene.update(sample_rate=10, output={"channels": [], "psd": None})
    with program.daemon("--workers", "1") as daemon:
        def leave(i):
            body = json.dumps({**scene, "duration": 2e5 + i}).encode()
            client = connect(daemon)
            client.sendall(POST + b"Prefer: wait=3\r\nContent-Length: %d\r\n\r\n" % len(body) + body)
            time.sleep(0.01 * (i % 5))
            if i % 3 == 0:
                client.shutdown(socket.SHUT_WR)
            client.close()
        threads = [threading.Thread(target=leave, args=(i,)) for i in range(60)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        def jobs():
            return daemon.get("/v1/jobs?limit=100").json()["jobs"]

        end = time.monotonic() + PATIENCE
        while len(jobs()) < 60 and time.monotonic() < end:  # whoever left early may not have been read yet
            time.sleep(0.1)
        time.sleep(3.2)  # nobody is there when their waits end
        job = daemon.submit(program.scene("paper_free_sponge"), headers={"Prefer": "respond-async"}).json()
        for other in jobs():
            if other["id"] != job["id"] and other["status"] in ("accepted", "running"):
                daemon.request("DELETE", f"/v1/jobs/{other['id']}")
        job = daemon.get(f"/v1/jobs/{job['id']}?wait={PATIENCE}").json()
        assert job["status"] == "successful", job
        others = [other["status"] for other in jobs() if other["id"] != job["id"]]
        assert len(others) == 60 and others.count("dismissed") > 50, others


def test_very_many_parameters_are_answered():
    """A target of its longest with as many parameters as fit into it: an answer, and no memory is kept of it."""
    with program.daemon() as daemon:
        for query in ("x&" * 2000, "a=1&" * 1000, "?" * 4000):
            reply = daemon.get("/v1/jobs?" + query)
            assert reply.status == 400 and "application/problem+json" in reply.headers["content-type"], reply


def test_the_number_of_connections_makes_no_stall():
    """Keep-alive connections around multiples of 128: every one is answered, round after round."""
    with program.daemon() as daemon:
        alone = usual_time(daemon)  # says how busy the machine is
        for count in (127, 128, 129, 256):
            clients = [http.client.HTTPConnection("127.0.0.1", daemon.port, timeout=PATIENCE) for _ in range(count)]
            began = time.monotonic()
            for _ in range(5):
                for client in clients:
                    client.request("GET", "/health/live")
                for client in clients:
                    reply = client.getresponse()
                    assert reply.status == 200 and reply.read() == b'{"status": "live"}\n'
            took = time.monotonic() - began
            assert took < max(30 if program.is_sanitized() else 5, 5 * count * alone), (count, took, alone)
            for client in clients:
                client.close()


if __name__ == "__main__":
    program.main(globals())
