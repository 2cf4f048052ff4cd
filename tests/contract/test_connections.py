#!/usr/bin/env python3
"""Connections that bring nothing: chunk headers that never fit, and idle clients where few files may be open; what is listened on."""

import contextlib
import os
import re
import resource
import socket
import ssl
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from access import token  # noqa: E402

HEAD = b"POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"


def connect(daemon):
    return socket.create_connection(("127.0.0.1", daemon.port), timeout=30)


def test_a_chunk_header_that_never_fits_is_closed():
    """A chunk's header of 60,000 bytes: the connection is closed at once, whether its client stays or leaves, and no CPU is spent."""
    with program.daemon() as daemon:
        stay = connect(daemon)
        began = time.monotonic()
        stay.sendall(HEAD + b"1;" + 60000 * b"a")
        try:
            assert stay.recv(1000) == b"", "an answer"
        except ConnectionError:
            pass
        assert time.monotonic() - began < 15, time.monotonic() - began
        for _ in range(20):
            with connect(daemon) as leave:
                leave.sendall(HEAD + b"1;" + 60000 * b"a")
        time.sleep(3)
        before = program.cpu_of(daemon.process.pid)
        time.sleep(4)
        assert program.cpu_of(daemon.process.pid) - before < 0.4, program.cpu_of(daemon.process.pid) - before
        assert daemon.get("/version").status == 200


def test_a_chunk_header_that_never_fits_is_closed_under_tls():
    """The same where the library holds bytes that it has deciphered and not read."""
    with tempfile.TemporaryDirectory() as folder:
        cert, key = program.certificate(folder)
        context = ssl.create_default_context(cafile=cert)
        with program.daemon("--tls-cert", cert, "--tls-key", key, data=folder) as daemon:
            for _ in range(5):
                with context.wrap_socket(connect(daemon), server_hostname="localhost") as client:
                    client.sendall(HEAD)
                    client.sendall(b"1;" + 16382 * b"a")  # one record
                    began = time.monotonic()
                    with contextlib.suppress(OSError):
                        assert client.recv(1000) == b"", "an answer"
                    assert time.monotonic() - began < 15, time.monotonic() - began


def test_a_slow_chunked_body_is_read():
    """A chunked body that pauses within a chunk's header and within a chunk is taken whole."""
    with program.daemon() as daemon, connect(daemon) as client:
        client.sendall(HEAD + b"2;" + 2000 * b"a")
        time.sleep(1)
        client.sendall(b"\r\n{")
        time.sleep(1)
        client.sendall(b"}\r\n0\r\n\r\n")
        assert client.recv(1000).startswith(b"HTTP/1.1 422 "), "no answer"


def test_idle_connections_make_room_where_few_files_may_be_open():
    """With 90 files at most and 120 idle clients a new client is answered within seconds."""
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    with program.daemon() as daemon:
        resource.prlimit(daemon.process.pid, resource.RLIMIT_NOFILE, (90, 90))
        idle = [connect(daemon) for _ in range(120)]
        time.sleep(1.5)
        for i in range(5):
            began = time.monotonic()
            assert daemon.get("/version").status == 200
            assert time.monotonic() - began < 5, (i, time.monotonic() - began)
        for client in idle:
            client.close()
    assert limits == resource.getrlimit(resource.RLIMIT_NOFILE)


def test_each_kind_of_loopback_is_served_and_a_taken_port_is_reported():
    """127.0.0.1, another address of 127/8 and [::1]: with their own names as Host; a second daemon there is told of the port."""
    for address in ("127.0.0.1", "127.3.2.1", "[::1]"):
        with program.daemon("--listen", f"{address}:0") as daemon, tempfile.TemporaryDirectory() as folder:
            assert daemon.host == address, daemon.url
            for host, status in ((f"{address}:{daemon.port}", 200), ("localhost", 200), ("evil.example.org", 421)):
                reply = urllib.request.Request(f"{daemon.url}/version", headers={"Host": host})
                try:
                    with urllib.request.urlopen(reply, timeout=20) as answer:
                        assert answer.status == status, (address, host)
                except urllib.error.HTTPError as error:
                    assert error.code == status, (address, host, error.code)
            code, _, said = program.run("serve", "--listen", f"{address}:{daemon.port}", "--data", folder)
            assert code == 1 and f"port {daemon.port}" in said and "is taken" in said and f"--listen {address}:PORT" in said, (code, said)
    with tempfile.TemporaryDirectory() as folder:
        token(folder, "lab")
        code, _, said = program.run("serve", "--listen", "192.0.2.1:0", "--data", folder)
        assert code == 1 and "cannot listen on 192.0.2.1" in said, (code, said)


def test_a_soft_limit_of_open_files_is_raised():
    """A daemon that may open more files than its soft limit says opens more."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 256), hard))
    try:
        with program.daemon() as daemon:
            assert resource.prlimit(daemon.process.pid, resource.RLIMIT_NOFILE) == (hard, hard)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_an_expired_certificate_is_refused():
    """With the time at which it expired; so is a file without one."""
    with tempfile.TemporaryDirectory() as folder:
        cert, key, asked = (os.path.join(folder, name) for name in ("cert.pem", "key.pem", "request.pem"))
        for command in (["req", "-new", "-newkey", "rsa:2048", "-nodes", "-keyout", key, "-out", asked, "-subj", "/CN=localhost"],
                        ["x509", "-req", "-in", asked, "-signkey", key, "-days", "-1", "-out", cert]):
            subprocess.run(["openssl", *command], check=True, capture_output=True)
        os.chmod(key, 0o600)
        for path, reason in ((cert, r"expired at \d{4}-\d\d-\d\dT.*; renew it"), (asked, "must be a certificate and its key")):
            code, _, said = program.run("serve", "--listen", "127.0.0.1:0", "--data", folder, "--tls-cert", path, "--tls-key", key)
            assert code == 2 and re.search(reason, said), (code, said)


if __name__ == "__main__":
    program.main(globals())
