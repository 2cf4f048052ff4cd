#!/usr/bin/env python3
"""Base URL, headers, the journal, settings together, TLS, the daemon's end: as clients and operators meet them."""

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
from access import bearer, impactd, token  # noqa: E402
from asking import endless  # noqa: E402
from daemon import Daemon  # noqa: E402
from program import until  # noqa: E402

SCENE = program.scene("paper_free_sponge")


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


def test_one_daemon_has_a_folder():
    """A second daemon on one folder is refused and names the first, also after impactd.lock was removed; when it has ended it starts."""
    with program.daemon() as daemon:
        for _ in range(2):
            done = impactd("serve", "--listen", "127.0.0.1:0", "--data", daemon.data)
            assert done.returncode != 0 and "uses the folder" in done.stderr and daemon.data in done.stderr, done
            lock = os.path.join(daemon.data, "impactd.lock")
            if os.path.exists(lock):
                assert str(daemon.process.pid) in done.stderr, done
                os.remove(lock)
        daemon.stop()
        daemon.start()
        assert daemon.get("/version").status == 200


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
        # The dashboard's links are relative, so that it needs the slash.
        moved = daemon.get("/impactd", headers={"Accept": "text/html"})
        assert moved.status == 308 and moved.headers["location"] == "/impactd/", moved.headers
        html = daemon.get("/impactd/", headers={"Accept": "text/html"}).body.decode()
        for link in re.findall(r'(?:href|src)="([^"#]+)"', html):
            assert not link.startswith("/") and daemon.get(f"/impactd/{link}").status == 200, link
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
    """In the server's sources every path of ours that stands in an answer's quotes comes behind base_path(), but for the identifiers of schemas."""
    found = []
    for folder, _, files in os.walk(os.path.join(program.SOURCE, "server")):
        for file in files:
            if file.endswith(".c"):
                with open(os.path.join(folder, file), encoding="utf-8") as source:
                    found += [f"{file}: {line.strip()}" for line in source
                              if re.search(r'\\"/(v1|schemas)\b', line.replace('\\"$id\\":\\"/', ""))]
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
    with program.full_pipe() as (taken, full), Daemon(program.build, "--journal", "all", errors=full) as daemon:
        for _ in range(20):
            assert daemon.get("/version").status == 200
        os.set_blocking(taken, False)
        with contextlib.suppress(BlockingIOError):
            while True:
                os.read(taken, 4096)
        os.set_blocking(taken, True)
        assert daemon.get("/version").status == 200
        assert os.read(taken, 4096).startswith(b"impactd: 20 log lines dropped")
        code, _ = daemon.stop()
        assert code == 0


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


def test_tls_serves_and_refuses_bad_files():
    """A certificate and its key: HTTPS with HSTS; a key of another, a key open to all: refused with the mend."""
    with tempfile.TemporaryDirectory(prefix="impactd-") as folder:
        cert, key = program.certificate(folder)
        _, other = program.certificate(folder, "other")
        done = impactd("serve", "--data", folder, "--tls-cert", cert, "--tls-key", other)
        assert done.returncode == 2 and "not that of the certificate" in done.stderr, done
        chain = os.path.join(folder, "chain.pem")
        with open(cert, encoding="utf-8") as one, open(chain, "w", encoding="utf-8") as many:
            many.write(33 * one.read())
        done = impactd("serve", "--data", folder, "--tls-cert", chain, "--tls-key", key)
        assert done.returncode == 2 and "chain.pem has 33 certificates; must be at most 32" in done.stderr, done
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
            port = int(url.rsplit(":", 1)[1])
            for ciphers, is_taken in (("ECDHE+AESGCM", True), ("AES128-GCM-SHA256", False)):
                context = ssl.create_default_context(cafile=cert)
                context.maximum_version = ssl.TLSVersion.TLSv1_2
                context.set_ciphers(ciphers)
                try:
                    with socket.create_connection(("127.0.0.1", port), timeout=20) as plain, \
                            context.wrap_socket(plain, server_hostname="localhost"):
                        assert is_taken, "a key exchange without forward secrecy was accepted"
                except ssl.SSLError:
                    assert not is_taken, ciphers
        finally:
            process.terminate()
            process.wait(20)
            process.stdout.close()


def test_a_renewed_certificate_is_used_without_an_end():
    """SIGHUP: new connections see the new certificate, old ones go on; faulty files change nothing and are told."""
    with tempfile.TemporaryDirectory(prefix="impactd-") as folder:
        cert, key = program.certificate(folder)
        other_cert, other_key = program.certificate(folder, "other")
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
            assert until(lambda: "the certificate is unchanged" in said() and "not that of the certificate" in said()), said()
            assert seen().split() == first.split()
            shutil.copy(other_cert, cert)
            process.send_signal(signal.SIGHUP)
            assert until(lambda: f"the certificate in {cert} is in use" in said()), said()
            assert seen().split() == wanted(other_cert).split() != first.split()
            with urllib.request.urlopen(f"https://localhost:{port}/version", context=ssl.create_default_context(cafile=other_cert), timeout=20) as reply:
                assert reply.status == 200
            old.request("GET", "/version")
            assert old.getresponse().read(), "the connection from before has ended"
            os.remove(cert)
            process.send_signal(signal.SIGHUP)
            assert until(lambda: said().count("is unchanged") == 2 and f"cannot be read: {cert}" in said()), said()
            assert seen().split() == wanted(other_cert).split()
            # A pipe without a writer: the server would wait for one, deaf to SIGTERM.
            os.mkfifo(cert)
            process.send_signal(signal.SIGHUP)
            assert until(lambda: said().count("is unchanged") == 3 and f"is a pipe, which cannot be read again: {cert}" in said()), said()
        finally:
            process.terminate()
            assert process.wait(20) == 0
            process.stdout.close()


def test_a_hangup_ends_what_has_lost_its_terminal_alone():
    """SIGHUP without TLS is told and nothing else; where the terminal it was started in is gone it ends well."""
    with Daemon(program.build) as daemon:
        daemon.process.send_signal(signal.SIGHUP)
        assert until(lambda: "nothing to reload" in daemon.stderr()), daemon.stderr()
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
    slow = endless()
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
