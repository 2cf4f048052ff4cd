#!/usr/bin/env python3
"""Tokens and scopes, Host names, base URL, request ids, headers, settings together, the daemon's end: as clients meet them."""

import contextlib
import fcntl
import http.client
import json
import os
import pty
import re
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import termios
import threading
import time
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from daemon import Daemon  # noqa: E402

SCENE = program.scene("paper_free_sponge")


def impactd(*arguments, environment=None, seconds=20):
    """Runs a command to its end."""
    return subprocess.run([program.impactd(), *arguments], capture_output=True, text=True, timeout=seconds,
                          env={**os.environ, **(environment or {})})


def token(data, name, scopes="read,submit", *more):
    done = impactd("token", "create", "--name", name, "--scopes", scopes, "--data", data, *more)
    assert done.returncode == 0, done
    assert re.fullmatch(r"impactd_[0-9a-f]{64}\n", done.stdout), done.stdout
    return done.stdout.strip()


def bearer(text):
    return {"Authorization": f"Bearer {text}"}


def until(condition, seconds=30):
    """True as soon as `condition` is; a loaded machine takes longer than the second that is promised."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


def scopes_of_routes():
    with open(os.path.join(program.SOURCE, "server", "api", "routes.c"), encoding="utf-8") as file:
        return re.findall(r'^\s*\{"([A-Z]+)",\s*"([^"]+)",\s*"(\w+)",', file.read(), re.M)


def test_loopback_is_open_until_there_is_a_token_and_shut_from_then_on():
    """No token: open. The first one made beside the daemon shuts it; revoking it opens nothing, forgetting it does."""
    with program.daemon() as daemon:
        assert daemon.get("/v1/jobs").status == 200
        lab = token(daemon.data, "lab")
        assert until(lambda: daemon.get("/v1/jobs").status == 401)
        reply = daemon.get("/v1/jobs")
        assert reply.headers["www-authenticate"].startswith("Bearer"), reply.headers
        assert "impactd token create" in reply.json()["detail"], reply
        assert daemon.get("/v1/jobs", headers=bearer(lab)).status == 200
        assert impactd("token", "revoke", "lab", "--data", daemon.data).returncode == 0
        assert until(lambda: daemon.get("/v1/jobs", headers=bearer(lab)).status == 401)
        assert "revoked" in daemon.get("/v1/jobs", headers=bearer(lab)).json()["detail"]
        assert daemon.get("/v1/jobs").status == 401
        assert impactd("token", "forget", "--name", "lab", "--data", daemon.data).returncode == 0
        assert until(lambda: daemon.get("/v1/jobs").status == 200)


def test_a_token_beyond_its_rate_or_quota_waits():
    """--rate and --quota: 429 with Retry-After for that token alone; a job that ends gives its place back."""
    slow = dict(program.scene("paper_sine_aluminium"), duration=2e6, sample_rate=10, output={"channels": [], "psd": None})
    for option, value in (("--rate", "1"), ("--quota", "1")):
        with program.daemon(option, value) as daemon:
            greedy, other = token(daemon.data, "greedy"), token(daemon.data, "other")
            assert until(lambda: daemon.get("/v1/jobs").status == 401)

            def submit(who, more):
                return daemon.submit({**slow, "duration": 2e6 + more}, headers={**bearer(who), "Prefer": "respond-async"})
            replies = [submit(greedy, i) for i in range(3)]
            refused = next(reply for reply in replies if reply.status != 202)
            assert refused.status == 429 and int(refused.headers["retry-after"]) >= 1, (option, refused)
            assert submit(other, 9).status == 202, option
            job = replies[0].json()["links"]["self"]
            assert daemon.request("DELETE", job, headers=bearer(greedy)).status == 200
            assert option == "--rate" or submit(greedy, 5).status == 202


SLOW = dict(program.scene("paper_sine_aluminium"), duration=2e6, sample_rate=10, output={"channels": [], "psd": None})


def test_a_job_is_cancelled_by_its_owner_or_an_admin_alone():
    """Another's DELETE and retry: 403 with the owner's name, and the job goes on; its sender stands in the job and the list."""
    with program.daemon() as daemon:
        nobodys = daemon.submit({**SLOW, "duration": 1.9e6}, headers={"Prefer": "respond-async"}).json()
        names = {name: bearer(token(daemon.data, name, scopes)) for name, scopes in
                 (("ann", "read,submit"), ("bob", "read,submit"), ("chief", "read,admin"))}
        assert until(lambda: daemon.get("/v1/jobs").status == 401)

        def submit(who, more):
            reply = daemon.submit({**SLOW, "duration": 2e6 + more}, headers={**names[who], "Prefer": "respond-async"})
            assert reply.status == 202 and "client" not in reply.json(), reply
            return reply.json()["links"]["self"]
        for i, (who, other) in enumerate((("ann", "bob"), ("bob", "ann"))):
            job = submit(who, i)
            for method, path in (("DELETE", job), ("POST", job + "/retry")):
                refused = daemon.request(method, path, headers=names[other])
                assert refused.status == 403 and f'the token "{who}"' in refused.json()["detail"], refused
            shown = daemon.get(job, headers=names[other]).json()
            assert shown["status"] in ("accepted", "running") and shown["client"] == who, shown
            listed = daemon.get("/v1/jobs", headers=names[other]).json()["jobs"]
            assert {one["id"]: one.get("client") for one in listed}[shown["id"]] == who, listed
            dismissed = daemon.request("DELETE", job, headers=names[who])
            assert dismissed.status == 200 and dismissed.json()["client"] == who, dismissed
            again = daemon.request("DELETE", job, headers=names[other])
            assert again.status == 403, again
        assert daemon.request("DELETE", submit("ann", 5), headers=names["chief"]).status == 200
        # What was sent before anybody had a name is anybody's.
        assert "client" not in daemon.get(f"/v1/jobs/{nobodys['id']}", headers=names["ann"]).json()
        assert daemon.request("DELETE", f"/v1/jobs/{nobodys['id']}", headers=names["ann"]).status == 200
        assert daemon.request("DELETE", "/v1/jobs/j-none", headers=names["ann"]).status == 404


def test_a_result_that_others_share_is_not_one_clients_to_delete():
    """403 naming the other client, by whom the result is still read; alone with it, or as admin, it goes."""
    with program.daemon() as daemon:
        names = {name: bearer(token(daemon.data, name, scopes)) for name, scopes in
                 (("ann", "read,submit"), ("bob", "read,submit"), ("chief", "read,admin"))}
        assert until(lambda: daemon.get("/v1/jobs").status == 401)
        for scene, deleter in ((SCENE, "chief"), ({**SCENE, "duration": 3}, "ann")):
            for who in ("ann", "bob") if deleter == "chief" else ("ann", "ann"):
                # Known to the byte the second time, so that its row comes behind the answer.
                result = daemon.submit(scene, headers={**names[who], "Prefer": "wait=30"}).json()["result"]
            path = f"/v1/results/{result}"
            if deleter == "chief":
                for who, other in (("ann", "bob"), ("bob", "ann")):
                    refused = daemon.request("DELETE", path, headers=names[who])
                    assert refused.status == 403 and f'the token "{other}"' in refused.json()["detail"], refused
            assert daemon.get(path, headers=names["bob"]).status == 200
            assert daemon.request("DELETE", path, headers=names[deleter]).status == 204, deleter
            assert daemon.get(path, headers=names["bob"]).status == 404
        assert daemon.request("DELETE", "/v1/results/r-none", headers=names["ann"]).status == 404


def test_what_is_sent_piece_by_piece_ends_with_its_token():
    """Events and a long series under way when their token is revoked are cut off; those of another token go on."""
    with program.daemon() as daemon:
        ann, bob = token(daemon.data, "ann"), token(daemon.data, "bob")
        assert until(lambda: daemon.get("/v1/jobs").status == 401)
        scene = {**SCENE, "duration": 1000, "output": {"psd": None}}
        done = daemon.submit(scene, headers={**bearer(ann), "Prefer": "wait=30"}).json()
        series = f"/v1/results/{done['result']}/series.npy"
        slow = daemon.submit(SLOW, headers={**bearer(ann), "Prefer": "respond-async"}).json()
        open_now = {}
        for who, key in (("ann", ann), ("bob", bob)):
            for path in (series, slow["links"]["self"] + "/events"):
                connection = http.client.HTTPConnection("127.0.0.1", daemon.port, timeout=60)
                connection.request("GET", path, headers=bearer(key))
                reply = connection.getresponse()
                assert reply.status == 200 and len(reply.read(10)) == 10, (who, path)
                open_now[who, path] = reply
        assert impactd("token", "revoke", "ann", "--data", daemon.data).returncode == 0
        assert until(lambda: daemon.get("/v1/jobs", headers=bearer(ann)).status == 401)
        time.sleep(0.6)
        for path in (series, slow["links"]["self"] + "/events"):
            try:
                rest = open_now["ann", path].read()
                raise AssertionError(f"{path} was sent to its end, {len(rest)} bytes")
            except (http.client.IncompleteRead, ConnectionError):
                pass
        assert len(open_now["bob", series].read()) > 40e6
        events = open_now["bob", slow["links"]["self"] + "/events"]
        assert daemon.request("DELETE", slow["links"]["self"], headers=bearer(bob)).status == 403
        chief = token(daemon.data, "chief", "admin")
        assert until(lambda: daemon.request("DELETE", slow["links"]["self"], headers=bearer(chief)).status == 200)
        assert b"event: finished" in events.read()


def test_every_route_asks_for_its_scope():
    """Each route of routes.c with no token, each single scope, and admin: 401, 403 naming the scope, or what it does."""
    with program.daemon() as daemon:
        tokens = {scope: token(daemon.data, scope, scope) for scope in ("read", "submit", "materials", "admin")}
        assert until(lambda: daemon.get("/v1/jobs").status == 401)
        routes = scopes_of_routes()
        assert len(routes) > 25, "routes.c is not read as it is written"
        for method, pattern, needed in routes:
            target = re.sub(r"\{format\}", "json", pattern)
            target = re.sub(r"\{\w+\}", "0", target)
            body = {"json": {}} if method in ("POST", "PUT", "PATCH") else {}
            assert daemon.request(method, target, headers={"Host": "evil.example.org"}, **body).status == 421, target
            if needed == "open":
                assert daemon.request(method, target, **body).status not in (401, 403), target
                continue
            assert daemon.request(method, target, **body).status == 401, target
            for scope, text in tokens.items():
                reply = daemon.request(method, target, headers=bearer(text), **body)
                if scope in (needed, "admin"):
                    assert reply.status not in (401, 403), (method, target, scope, reply)
                else:
                    assert reply.status == 403 and f'"{needed}"' in reply.json()["detail"], (method, target, scope, reply)


def test_wrong_credentials_stay_out_wherever_they_stand():
    """Another scheme, a cut token, a token in the query, an empty header: 401, also for a large body; who asks first is spared sending it."""
    with program.daemon() as daemon:
        good = token(daemon.data, "lab", "admin")
        assert until(lambda: daemon.get("/v1/jobs").status == 401)
        for value in ("", "Bearer", "Bearer ", good, f"Basic {good}", f"Bearer {good[:-1]}", f"Bearer {good}0",
                      f"Bearer {good.upper()}", f"Bearer {good}, Bearer {good}"):
            assert daemon.get("/v1/jobs", headers={"Authorization": value}).status == 401, value
        for query in (f"access_token={good}", f"token={good}"):
            assert daemon.get(f"/v1/jobs?{query}").status == 401, query
            assert daemon.get(f"/v1/jobs?{query}", headers=bearer(good)).status == 400, query
        for scope, expected in ((None, 401), (token(daemon.data, "reader", "read"), 403)):
            headers = {"Content-Type": "application/json", **(bearer(scope) if scope else {})}
            assert daemon.request("POST", "/v1/jobs", body=b" " * 10_000_000, headers=headers).status == expected
        with socket.create_connection(("127.0.0.1", daemon.port), 20) as client:
            client.sendall(b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                           b"Content-Length: 10000000\r\nExpect: 100-continue\r\n\r\n")
            assert client.recv(100).startswith(b"HTTP/1.1 401 "), "the body was waited for"
        assert daemon.get("/v1/jobs", headers={"Authorization": f"bearer {good}"}).status == 200


def test_tokens_are_listed_without_secrets_and_their_use_is_noted():
    """list shows names, scopes, times and states, no digest and no token; the last use is there after the daemon's end."""
    with Daemon(program.build) as daemon:
        lab = token(daemon.data, "lab", "read", "--expires", "30")
        assert until(lambda: daemon.get("/v1/jobs").status == 401)
        assert daemon.get("/v1/jobs", headers=bearer(lab)).status == 200
        daemon.stop()
        shown = impactd("token", "list", "--data", daemon.data)
        row = next(line for line in shown.stdout.splitlines() if line.startswith("lab"))
        assert "read" in row and "good" in row and row.count("Z ") + row.count("Z\n") >= 3 and "never" not in row, row
        assert lab not in shown.stdout
        with open(os.path.join(daemon.data, "impactd.db"), "rb") as file:
            content = file.read()
        assert lab.encode() not in content and lab[8:].encode() not in content


def test_token_commands_tell_what_is_wrong():
    """Bad names, scopes, unknown and double tokens: exit codes and what would be right."""
    with tempfile.TemporaryDirectory(prefix="impactd-") as data:
        token(data, "lab")
        for arguments, code, text in (
                (("create", "--name", "lab"), 1, "another name"),
                (("create", "--name", "a b"), 2, "letters"),
                (("create", "--name", "x" * 65), 2, "64"),
                (("create", "--name", "x", "--scopes", "write"), 2, "read, submit"),
                (("create", "--name", "x", "--expires", "0"), 2, "above 0"),
                (("create",), 2, "--name"),
                (("revoke", "nobody"), 4, "token list"),
                (("forget", "lab"), 1, "revoke it first"),
                (("list", "lab"), 2, "too many"),
                ((), 2, "create, list, revoke or forget"),
                (("lsit",), 2, "create, list, revoke or forget")):
            done = impactd("token", *arguments, "--data", data)
            assert done.returncode == code and text in done.stderr and done.stdout == "", (arguments, done)


def test_beyond_loopback_nothing_starts_without_a_token():
    """0.0.0.0 and --require-tokens refuse with the command that makes one; with a token both start and ask for it."""
    with tempfile.TemporaryDirectory(prefix="impactd-") as data:
        for arguments in (("--listen", "0.0.0.0:0"), ("--listen", "127.0.0.1:0", "--require-tokens"), ("--listen", "[::]:0")):
            done = impactd("serve", *arguments, "--data", data)
            assert done.returncode == 5 and "impactd token create" in done.stderr, done
        lab = token(data, "lab")
        impactd("token", "revoke", "lab", "--data", data)
        done = impactd("serve", "--listen", "0.0.0.0:0", "--data", data)
        assert done.returncode == 5, done
        lab = token(data, "other")
        with program.daemon("--listen", "0.0.0.0:0", "--host", "sim.example.org,second.example.org", "--host", "third", data=data) as daemon:
            assert daemon.get("/v1/jobs").status == 401
            for host, status in (("localhost", 200), ("127.0.0.1:99", 200), ("192.168.7.7", 200), ("[fe80::7]:80", 200),
                                 ("sim.example.org:8080", 200), ("second.example.org", 200), ("third", 200),
                                 ("evil.example.org", 421), ("127.0.0.1.example.org", 421)):
                reply = daemon.get("/v1/jobs", headers={**bearer(lab), "Host": host})
                assert reply.status == status, (host, reply)
            assert "sim.example.org" in daemon.get("/", headers={"Host": "evil"}).json()["detail"]


def walk_links(value, found):
    if isinstance(value, dict):
        for name, inner in value.items():
            if name == "links":
                found += [one for one in inner.values() if isinstance(one, str)]
            walk_links(inner, found)
    elif isinstance(value, list):
        for inner in value:
            walk_links(inner, found)
    return found


def test_behind_a_base_url_every_link_begins_with_it():
    """Links, Location, Link, landing page and openapi's server carry the base; paths come in with and without it."""
    base = "https://sim.example.org/impactd"
    with program.daemon("--base-url", base + "/") as daemon:
        host = {"Host": "sim.example.org"}
        reply = daemon.request("POST", "/impactd/v1/jobs", json=SCENE, headers={**host, "Prefer": "wait=30"})
        assert reply.status in (200, 202), reply
        job = daemon.finished(reply.json()["id"])
        found = []
        for path in (f"/v1/jobs/{job['id']}", "/v1/jobs", f"/v1/results/{job['result']}",
                     f"/v1/results/{job['result']}/manifest", "/v1/materials", "/v1/materials/sponge", "/v1/examples", "/schemas"):
            for prefix in ("", "/impactd"):
                answer = daemon.get(prefix + path)
                assert answer.status == 200, (path, answer)
                walk_links(answer.json(), found)
        assert len(found) > 50, len(found)
        for link in found:
            assert link.startswith("/impactd/"), link
        for link in sorted(set(found))[:40]:
            assert daemon.get(link).status in (200, 404), link
        slow = dict(SCENE, duration=2e6, sample_rate=10, output={"channels": [], "psd": None},
                    excitation={"kind": "sine", "frequency": 2, "amplitude": 1})
        accepted = daemon.request("POST", "/v1/jobs", json=slow, headers={"Prefer": "respond-async"})
        assert accepted.status == 202 and accepted.headers["location"].startswith("/impactd/v1/jobs/"), accepted.headers
        assert daemon.request("DELETE", accepted.headers["location"]).status == 200
        assert daemon.get("/v1/jobs?limit=1").headers["link"].startswith("</impactd/v1/jobs?"), "Link"
        assert daemon.get("/impactd/impactd/version").status == 404, "the base is taken off once"
        page = daemon.get("/impactd").body.decode()
        assert f"{base}/v1/jobs" in page and "127.0.0.1" not in page
        html = daemon.get("/impactd/", headers={"Accept": "text/html"}).body.decode()
        assert 'href="/impactd/v1/jobs"' in html
        assert daemon.get("/impactd/openapi.json").json()["servers"] == [{"url": base}]
        assert daemon.get("/impactdx/v1/jobs").status == 404
        for path in ("/v1/jobz", "/impactd/v1/jobz"):
            assert "did you mean /impactd/v1/jobs?" in daemon.get(path).json()["detail"], path
        assert "GET /impactd/openapi.json" in daemon.get("/impactd/none/at/all").json()["detail"]
        # What a proxy says is not believed.
        forwarded = daemon.get("/", headers={"X-Forwarded-Host": "evil.example.org", "X-Forwarded-Proto": "gopher",
                                             "X-Forwarded-Prefix": "/evil", "Forwarded": "host=evil.example.org"})
        assert b"evil" not in forwarded.body and b"gopher" not in forwarded.body


def test_no_link_is_written_without_the_base():
    """In the server's sources every path of ours that stands in an answer's quotes comes behind link_base()."""
    found = []
    for folder, _, files in os.walk(os.path.join(program.SOURCE, "server")):
        for file in files:
            if file.endswith(".c"):
                with open(os.path.join(folder, file), encoding="utf-8") as source:
                    found += [f"{file}: {line.strip()}" for line in source if re.search(r'\\"/(v1|schemas)\b', line)]
    assert not found, found


def test_every_answer_carries_the_protecting_headers_and_a_request_id():
    """Good ones, refusals of the gate and of the token: nosniff, CSP, no referrer, no CORS, no Server; ids come back."""
    with program.daemon() as daemon:
        answers = [daemon.get("/"), daemon.get("/v1/none"), daemon.get("/v1/jobs?x=1"), daemon.get("/", headers={"Host": "evil"}),
                   daemon.request("OPTIONS", "/v1/jobs", headers={"Origin": "http://evil", "Access-Control-Request-Method": "POST"}),
                   daemon.request("HEAD", "/version"), daemon.get("/metrics")]
        for reply in answers:
            headers = reply.headers
            assert headers["x-content-type-options"] == "nosniff", reply
            assert "frame-ancestors 'none'" in headers["content-security-policy"], reply
            assert headers["referrer-policy"] == "no-referrer" and headers["cross-origin-resource-policy"] == "same-origin", reply
            assert "server" not in headers and "strict-transport-security" not in headers, reply
            assert not any(name.startswith("access-control-") for name in headers), reply
            assert re.fullmatch(r"q-[0-9a-f]{12}", headers["x-request-id"]), reply
            if reply.status >= 400:
                assert reply.json()["request_id"] == headers["x-request-id"], reply
        assert len({reply.headers["x-request-id"] for reply in answers}) == len(answers)
        assert daemon.get("/none", headers={"X-Request-Id": "My-1.id_2"}).json()["request_id"] == "My-1.id_2"
        for bad in ("a b", "x" * 65, 'a"b', "\u00e9".encode().decode("latin-1")):
            assert daemon.get("/", headers={"X-Request-Id": bad}).headers["x-request-id"].startswith("q-"), bad


def test_the_journal_has_a_line_per_request_and_no_secrets():
    """--journal all: who, what, code and id, without query, with control characters escaped; off: nothing."""
    with Daemon(program.build, "--journal", "all") as daemon:
        lab = token(daemon.data, "lab", "read")
        assert until(lambda: daemon.get("/v1/jobs").status == 401)
        daemon.get("/v1/jobs?limit=1", headers={**bearer(lab), "X-Request-Id": "mine"})
        daemon.get("/none%22%0d%0a/x?access_token=" + lab)
        daemon.get("/", headers={"Host": "evil"})
        daemon.stop()
        text = daemon.stderr()
        assert re.search(r'^impactd: \S+Z request="mine" client="lab" method="GET" path="/v1/jobs" code=200 ms=\d+\.\d+ sent=\d+$', text, re.M), text
        assert 'path="/none%22%0d%0a/x" code=404' in text and "code=421" in text, text
        assert lab not in text and "limit=1" not in text
    with Daemon(program.build, "--journal", "off") as daemon:
        daemon.get("/none")
        daemon.stop()
        assert "request=" not in daemon.stderr()


def test_a_journal_that_nobody_reads_holds_up_nobody():
    """Standard error is a full pipe: requests are answered, SIGTERM ends the daemon; once it is read, what was lost is told."""
    taken, full = os.pipe()
    os.set_blocking(full, False)
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(full, b"0" * 4096)
    os.set_blocking(full, True)
    with tempfile.TemporaryDirectory() as data:
        process = subprocess.Popen([program.impactd(), "serve", "--listen", "127.0.0.1:0", "--data", data, "--journal", "all"],
                                   stdout=subprocess.PIPE, stderr=full, text=True)
        os.close(full)
        try:
            port = int(re.search(r":(\d+)$", process.stdout.readline())[1])

            def ask():
                connection = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
                connection.request("GET", "/version")
                code = connection.getresponse().status
                connection.close()
                return code

            assert [ask() for _ in range(20)] == 20 * [200]
            os.set_blocking(taken, False)
            with contextlib.suppress(BlockingIOError):
                while True:
                    os.read(taken, 4096)
            os.set_blocking(taken, True)
            assert ask() == 200
            assert os.read(taken, 4096).startswith(b"impactd: 20 lines were lost")
            process.send_signal(signal.SIGTERM)
            assert process.wait(20) == 0
        finally:
            process.kill()
            process.wait()
            process.stdout.close()
            os.close(taken)


def test_settings_that_contradict_each_other_do_not_start():
    """Each with both names and what would be right, all at once, and exit code 2; --print-config shows all settings."""
    with tempfile.TemporaryDirectory(prefix="impactd-") as data:
        plain = os.path.join(data, "plain.pem")
        with open(plain, "w", encoding="utf-8") as file:
            file.write("not a certificate\n")
        os.chmod(plain, 0o600)
        for arguments, texts in (
                (("--queue-bytes", "2048", "--max-body", "4096"), ("--queue-bytes", "--max-body", "4096")),
                (("--workers", "9", "--queue", "8"), ("--queue", "--workers", "9")),
                (("--base-url", "sim.example.org"), ("--base-url", "http://")),
                (("--base-url", "http://a/v1"), ("/v1",)),
                (("--base-url", "http://a:99999/b"), ("--base-url", "65535", "a:99999")),
                (("--base-url", "http://a:0"), ("--base-url", "65535")),
                (("--tls-cert", plain), ("--tls-cert", "--tls-key")),
                (("--tls-key", plain), ("--tls-key", "--tls-cert")),
                (("--tls-cert", "/none", "--tls-key", "/none"), ("--tls-cert", "--tls-key", "/none")),
                (("--tls-cert", plain, "--tls-key", plain), (plain, "PEM")),
                (("--host", "http://a"), ("--host", "http://a")),
                (("--host", "a:80"), ("--host",)),
                (("--journal", "some"), ("off, errors, all",)),
                (("--workers", "9", "--queue", "8", "--host", "a/b", "--tls-cert", plain), ("--queue", "--host", "--tls-key"))):
            done = impactd("serve", "--listen", "127.0.0.1:0", "--data", data, *arguments)
            assert done.returncode == 2, (arguments, done)
            assert all(text in done.stderr for text in texts), (arguments, done.stderr)
        shown = impactd("serve", "--print-config", "--host", "a", "--host", "b", environment={"IMPACTD_BASE_URL": "http://x/y"}).stdout
        assert "host = a, b  # flag" in shown and "base_url = http://x/y  # environment" in shown, shown
        assert "journal = errors  # default" in shown and "# tls_cert" in shown, shown


def certificate(folder, days=2):
    cert, key = os.path.join(folder, f"cert{days}.pem"), os.path.join(folder, f"key{days}.pem")
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", key, "-out", cert, "-days", str(days),
                    "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1"],
                   check=True, capture_output=True)
    os.chmod(key, 0o600)
    return cert, key


def test_tls_serves_and_refuses_bad_files():
    """A certificate and its key: HTTPS with HSTS; a key of another, a key open to all: refused with the mend."""
    if shutil.which("openssl") is None:
        raise program.Skipped("openssl is not installed")
    with tempfile.TemporaryDirectory(prefix="impactd-") as folder:
        cert, key = certificate(folder)
        _, other = certificate(folder, 3)
        done = impactd("serve", "--data", folder, "--tls-cert", cert, "--tls-key", other)
        assert done.returncode == 2 and "not that of the certificate" in done.stderr, done
        os.chmod(other, 0o644)
        done = impactd("serve", "--data", folder, "--tls-cert", cert, "--tls-key", other)
        assert done.returncode == 2 and "chmod 600" in done.stderr, done
        process = subprocess.Popen([program.impactd(), "serve", "--listen", "127.0.0.1:0", "--data", folder, "--tls-cert", cert,
                                    "--tls-key", key], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            url = re.search(r"listens on (https://\S+)", process.stdout.readline())[1]
            with urllib.request.urlopen(url + "/", context=ssl.create_default_context(cafile=cert), timeout=20) as reply:
                assert reply.headers["Strict-Transport-Security"].startswith("max-age="), reply.headers
                assert f"{url}/v1/jobs" in reply.read().decode()
        finally:
            process.terminate()
            process.wait(20)
            process.stdout.close()


def test_a_renewed_certificate_is_used_without_an_end():
    """SIGHUP: new connections see the new certificate, old ones go on; faulty files change nothing and are told."""
    if shutil.which("openssl") is None:
        raise program.Skipped("openssl is not installed")
    with tempfile.TemporaryDirectory(prefix="impactd-") as folder:
        cert, key = certificate(folder)
        other_cert, other_key = certificate(folder, 3)
        journal = os.path.join(folder, "journal")
        with open(journal, "w", encoding="utf-8") as errors:
            process = subprocess.Popen([program.impactd(), "serve", "--listen", "127.0.0.1:0", "--data", folder, "--tls-cert", cert,
                                        "--tls-key", key], stdout=subprocess.PIPE, stderr=errors, text=True)
        try:
            port = int(re.search(r"listens on https://\S+:(\d+)", process.stdout.readline())[1])

            def said():
                with open(journal, encoding="utf-8") as file:
                    return file.read()

            def seen():
                return ssl.get_server_certificate(("127.0.0.1", port), timeout=20)

            def wanted(path):
                with open(path, encoding="utf-8") as file:
                    return file.read()
            first = wanted(cert)
            assert seen().split() == first.split()
            old = http.client.HTTPSConnection("127.0.0.1", port, context=ssl._create_unverified_context(), timeout=20)
            old.request("GET", "/version")
            assert old.getresponse().read()
            # A key of another: told, and nothing changes.
            shutil.copy(other_key, key)
            process.send_signal(signal.SIGHUP)
            assert until(lambda: "the certificate stays as it was" in said() and "not that of the certificate" in said()), said()
            assert seen().split() == first.split()
            shutil.copy(other_cert, cert)
            process.send_signal(signal.SIGHUP)
            assert until(lambda: f"the certificate in {cert} is used from now on" in said()), said()
            assert seen().split() == wanted(other_cert).split() != first.split()
            with urllib.request.urlopen(f"https://localhost:{port}/version", context=ssl.create_default_context(cafile=other_cert), timeout=20) as reply:
                assert reply.status == 200
            old.request("GET", "/version")
            assert old.getresponse().read(), "the connection from before has ended"
            os.remove(cert)
            process.send_signal(signal.SIGHUP)
            assert until(lambda: said().count("stays as it was") == 2 and f"cannot be read: {cert}" in said()), said()
            assert seen().split() == wanted(other_cert).split()
        finally:
            process.terminate()
            assert process.wait(20) == 0
            process.stdout.close()


def test_a_hangup_ends_what_has_lost_its_terminal_alone():
    """SIGHUP without TLS is told and nothing else; where the terminal it was started in is gone it ends well."""
    with Daemon(program.build) as daemon:
        daemon.process.send_signal(signal.SIGHUP)
        assert until(lambda: "nothing to read anew" in daemon.stderr()), daemon.stderr()
        assert daemon.get("/health/ready").status == 200
    with tempfile.TemporaryDirectory(prefix="impactd-") as folder:
        terminal, inside = pty.openpty()
        process = subprocess.Popen([program.impactd(), "serve", "--listen", "127.0.0.1:0", "--data", folder], stdin=inside,
                                   stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, start_new_session=True,
                                   preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0))
        os.close(inside)
        try:
            assert "listens on" in process.stdout.readline()
            process.send_signal(signal.SIGHUP)
            time.sleep(0.2)
            assert process.poll() is None, "it has its terminal still"
            os.close(terminal)
            assert process.wait(20) == 0
        finally:
            process.kill()
            process.wait()
            process.stdout.close()


def test_systemd_is_told_of_the_beginning_and_the_end():
    """READY=1 when it answers, WATCHDOG=1 as asked, STOPPING=1 when it ends."""
    with tempfile.TemporaryDirectory(prefix="impactd-") as folder:
        path = os.path.join(folder, "notify")
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as door:
            door.bind(path)
            door.settimeout(30)
            with Daemon(program.build, environment={"NOTIFY_SOCKET": path, "WATCHDOG_USEC": "200000"}) as daemon:
                assert door.recv(100) == b"READY=1"
                assert daemon.get("/health/ready").status == 200
                assert door.recv(100) == b"WATCHDOG=1"
                daemon.stop()
                said = b"WATCHDOG=1"
                while said == b"WATCHDOG=1":
                    said = door.recv(100)
                assert said == b"STOPPING=1"


def test_the_end_answers_those_who_wait_and_takes_no_new_jobs():
    """SIGTERM with clients waiting on a long job: each is answered, the job goes on at the next start, within 5 s."""
    slow = dict(program.scene("paper_sine_aluminium"), duration=2e6, sample_rate=10, output={"channels": [], "psd": None})
    with Daemon(program.build, "--workers", "1") as daemon:
        job = daemon.request("POST", "/v1/jobs", json=slow, headers={"Prefer": "respond-async"}).json()
        answers = []

        def wait():
            answers.append(daemon.get(f"/v1/jobs/{job['id']}?wait=30"))

        waiters = [threading.Thread(target=wait) for _ in range(8)]
        for waiter in waiters:
            waiter.start()
        time.sleep(0.3)
        code, seconds = daemon.stop()
        for waiter in waiters:
            waiter.join()
        assert code == 0 and seconds < 5, (code, seconds)
        assert [answer.status for answer in answers] == [200] * 8, answers
        daemon.start()
        assert daemon.get(f"/v1/jobs/{job['id']}").json()["status"] in ("accepted", "running")


def test_a_job_that_comes_while_it_stops_is_refused_with_when_to_come_again():
    """A POST whose body arrives after SIGTERM gets 503 with Retry-After, and leaves no job behind."""
    with Daemon(program.build) as daemon:
        body = json.dumps(SCENE).encode()
        with socket.create_connection(("127.0.0.1", daemon.port), 20) as client:
            client.sendall(b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
                           b"Content-Length: %d\r\n\r\n" % len(body) + body[:10])
            time.sleep(0.3)
            daemon.process.send_signal(signal.SIGTERM)
            assert until(lambda: "stopping" in daemon.stderr())
            client.sendall(body[10:])
            answer = client.recv(10000)
            assert answer.startswith(b"HTTP/1.1 503 ") and b"\r\nRetry-After: " in answer, answer
        daemon.stop()
        daemon.start()
        assert daemon.get("/v1/jobs").json()["jobs"] == []


def test_a_second_signal_ends_it_at_once():
    """While an answer is being waited for at the end, another SIGTERM kills; what was accepted is there again."""
    with Daemon(program.build) as daemon:
        # A client that never reads its answer keeps the first end waiting for its grace.
        client = socket.create_connection(("127.0.0.1", daemon.port), 20)
        client.sendall(b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 9\r\n\r\n")
        time.sleep(0.2)
        process = daemon.process
        process.send_signal(signal.SIGTERM)
        assert until(lambda: "stopping" in daemon.stderr())
        process.send_signal(signal.SIGTERM)
        process.wait(20)
        client.close()
        assert process.returncode in (-signal.SIGTERM, 0), process.returncode
        daemon.stop()
        daemon.start()
        assert daemon.get("/health/ready").status == 200


if __name__ == "__main__":
    program.main(globals())
