#!/usr/bin/env python3
"""The commands that ask a daemon: submit, watch, get, cancel, compare; and what they do with a server that is none."""

import http.server
import json
import os
import pty
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time

import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from asking import endless  # noqa: E402
from client import Fake, client, endless_body, endless_headers, fake, raw, say  # noqa: E402

SANITIZED = "nightly"
WAITS = True
SPONGE = os.path.join(program.EXAMPLES, "paper_free_sponge.json")


def test_submit_prints_the_job_and_waits_for_it():
    """submit prints the id alone; with --wait it ends when the job does, and --json prints that job."""
    with program.daemon() as daemon:
        code, out, errors = client(daemon.url, "submit", SPONGE, "--wait", "60")
        assert code == 0 and out.startswith("j-") and out.count("\n") == 1, (code, out, errors)
        assert daemon.get("/v1/jobs/" + out.strip()).json()["status"] == "successful"
        code, out, errors = client(daemon.url, "submit", "-", "--wait", "60", "--json", "--title", 'a "b"\n',
                                   "--label", "batch=7", text=json.dumps(program.scene("paper_random_sponge")))
        job = json.loads(out)
        assert code == 0 and job["status"] == "successful" and job["title"] == 'a "b"\n', (code, job, errors)
        # On a terminal, submit --wait and get show the numbers of the result.
        code, out = program.on_terminal("submit", SPONGE, "--wait", "60", IMPACTD_SERVER=daemon.url)
        result = re.search("^Result (r-[0-9a-f]{64})$", out, re.M)[1]
        assert code == 0 and out.startswith("j-") and re.search(r"rms displacement \[m\] +0.00258388 +-30.7641\n", out), out
        assert f"\nNext  impactd get {result[:14]} series -o motion.csv\n" in out and max(map(len, out.splitlines())) <= 80, out
        code, shown = program.on_terminal("get", result, IMPACTD_SERVER=daemon.url)
        assert code == 0 and shown[shown.index("Result"):] == out[out.index("Result"):], (shown, out)
        code, shown = program.on_terminal("get", result, "result", IMPACTD_SERVER=daemon.url)
        assert code == 0 and json.loads(shown)["id"] == result, shown
        code, out, errors = client(daemon.url, "submit", SPONGE, "--dry-run")
        assert code == 0 and json.loads(out)["dry_run"] is True, (code, out, errors)
        edits = ("--set", "dampers.0.clearance=10mm", "--vary", "duration=1:2:3")
        sent, here = (json.loads(program.run(*words, SPONGE, *edits, environment={**os.environ, "IMPACTD_SERVER": daemon.url})[1])
                      for words in (("submit", "--dry-run"), ("check", "--json")))
        assert sent["result"] == here["result"] and sent["scene"]["dampers"][0]["clearance"] == 0.01, sent
        code, _, errors = client(daemon.url, "submit", SPONGE, "--set", "duration=1kg")
        assert code == 2 and "impactd submit: --set duration is a time in s, 1kg is a mass" in errors, errors


def test_jobs_lists_and_open_names_the_page():
    """jobs prints the newest jobs, with --all every page of them; open prints the address of a page."""
    with program.daemon() as daemon:
        scene = program.scene("no_damper")
        ids = [program.finished(daemon, {**scene, "title": f"number {i}", "duration": 1 + i})["id"] for i in range(3)]
        code, out, errors = client(daemon.url, "jobs")
        lines = out.splitlines()
        assert code == 0 and errors == "" and lines[0].split() == ["id", "status", "age", "time", "title"], (out, errors)
        assert [line.split()[0] for line in lines[1:]] == ids[::-1] and lines[1].endswith("number 2"), out
        assert "successful" in lines[1] and " s " in lines[1] and " ms " in lines[1], out
        code, out, errors = client(daemon.url, "jobs", "--limit", "2")
        assert code == 0 and out.count("j-") == 2 and "--all shows more" in errors, (out, errors)
        for options, count in ((("--all",), 3), (("-j", "--limit=1"), 1), (("--status", "failed"), 0), (("--q", "number 1"), 1)):
            code, out, _ = client(daemon.url, "jobs", *options)
            assert code == 0 and len(re.findall(r'^j-|"id": "j-', out, re.M)) == count, (options, out)
        assert client(daemon.url, "jobs", "--status", "done")[0] == 2
        for arguments in (("watch", ids[0][:-1]), ("get", ids[0][:-1], "job")):
            code, out, errors = client(daemon.url, *arguments)
            assert code == 0 and ids[0][:-1] in out and "successful" in out, (arguments, out, errors)
    pages = [say(body=json.dumps({"jobs": [{"id": f"j-{page}{i:02}", "status": "running", "progress": 5} for i in range(100)]}).encode(),
                 Link=f'</v1/jobs?before={page}>; rel="next"' if page < 2 else "") for page in range(3)]
    for options, count in ((("--limit", "150"), 150), (("--all",), 300), (("--limit", "100"), 100)):
        with fake(*pages) as (url, seen):
            code, out, _ = client(url, "jobs", *options)
            assert code == 0 and out.count("j-") == count and out.count("running") == count and "5 %" in out, (options, out)
            assert seen[0][1] == "/v1/jobs?limit=100" and len(seen) == (count + 99) // 100, seen
    plain = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    for arguments, page in (((), ""), (("j-1",), "#/jobs/j-1"), (("r-2",), "#/results/r-2")):
        done = program.run("open", *arguments, "--server", "https://sim.example/x/", environment=plain)
        assert done == (0, f"https://sim.example/x/{page}\n", ""), done
    # A browser that runs on is not waited for.
    with tempfile.TemporaryDirectory() as folder:
        started = os.path.join(folder, "started")
        with open(os.path.join(folder, "xdg-open"), "w", encoding="utf-8", opener=lambda p, f: os.open(p, f, 0o755)) as file:
            file.write(f"#!/bin/sh\necho noise\necho $1 > {started}.part\nmv {started}.part {started}\nexec sleep 5\n")
        began = time.monotonic()
        done = program.run("open", environment={**plain, "DISPLAY": ":9", "PATH": folder + ":" + os.environ["PATH"]})
        assert done == (0, "http://127.0.0.1:8080/\n", "") and time.monotonic() - began < 4, done
        while not os.path.exists(started) and time.monotonic() - began < 20:
            time.sleep(0.02)
        with open(started, encoding="utf-8") as file:
            assert file.read() == "http://127.0.0.1:8080/\n"


def test_a_title_and_labels_change_no_number():
    """A scene sent with --title has the result it has without."""
    with program.daemon() as daemon:
        for name in ("paper_random_aluminium", "contact_table", "chirp"):
            path = os.path.join(program.EXAMPLES, name + ".json")
            plain, named = (json.loads(client(daemon.url, "submit", path, "--dry-run", *more)[1])
                            for more in ((), ("--title", "x", "--label", "a=b=c", "--label", "d=")))
            assert plain["result"] == named["result"], name


def test_faults_of_a_scene_are_told_as_by_check():
    """A scene with faults is exit code 3, and stderr reads as that of `check`."""
    with program.daemon() as daemon:
        scene = program.scene("paper_free_sponge")
        scene["structure"]["mass"] = -1
        scene["structur"] = {}
        for text in (json.dumps(scene), "{", '{"a": NaN}'):
            asked, judged = (client(daemon.url, command, "-", text=text) for command in ("submit", "check"))
            assert asked[0] == judged[0] == 3 and asked[2] == judged[2] != "", (asked, judged)
            assert client(daemon.url, "submit", "-", "--title", "x", text=text)[0] == 3
        assert 'did you mean "structure"' in client(daemon.url, "submit", "-", text=json.dumps(scene))[2]


def test_get_brings_what_the_daemon_has():
    """get writes a result's parts to files and to standard output, byte for byte, by result or job."""
    with program.daemon() as daemon, tempfile.TemporaryDirectory() as folder:
        job = program.finished(daemon, program.scene("paper_free_sponge"))
        result = job["result"]
        for what, target in (("series", "a.npy"), ("series", "a.csv"), ("series", "a.json"), ("psd", "a.csv"),
                             ("impacts", "a.csv"), ("energy", "a.json"), ("manifest", "a.json"), ("result", "a.json")):
            path = os.path.join(folder, target)
            code, out, errors = client(daemon.url, "get", result, what, "-o", path)
            assert (code, out, errors) == (0, "", ""), (what, code, out, errors)
            ending = "" if what in ("manifest", "result") else target[1:]
            part = "" if what == "result" else "/" + what + ending
            with open(path, "rb") as file:
                assert file.read() == daemon.get(f"/v1/results/{result}{part}").body, what
            os.unlink(path)
        path = os.path.join(folder, "x.npy")
        assert client(daemon.url, "get", job["id"], "-o", path)[0] == 0
        assert numpy.load(path).shape == (10001, 6)
        code, out, _ = client(daemon.url, "get", job["id"], "series.csv", "--channels", "displacement,velocity",
                              "--from", "1", "--to", "1.003")
        assert code == 0 and out.splitlines()[0] == "time [s],displacement [m],velocity [m/s]" and len(out.splitlines()) == 5
        assert json.loads(client(daemon.url, "get", result)[1])["id"] == result
        assert json.loads(client(daemon.url, "get", job["id"], "job")[1])["id"] == job["id"]
        os.unlink(path)
        for arguments, expected, words in (((result, "series", "--channels", "foo", "-o", path), 4, "displacement"),
                                           (("r-0000", "-o", path), 4, "r-0000"), (("j-0000",), 4, "j-0000"),
                                           ((result, "nothing"), 4, "path"), ((result, "../x"), 2, "series"),
                                           (("../jobs",), 2, "id"), ((result, "series", "-o", "x.xls"), 2, ".csv"),
                                           ((result, "series", "--from", "-1"), 2, "--from"),
                                           ((result, "series", "--max-bytes", "1000", "-o", path), 3, "1000 bytes")):
            code, out, errors = client(daemon.url, "get", *arguments)
            assert code == expected and out == "" and words in errors, (arguments, code, errors)
        assert os.listdir(folder) == [], "a file appears whole or not at all"


def test_binary_data_is_kept_off_a_terminal():
    """get of a binary format refuses to print on a terminal and names the way out."""
    try:
        master, slave = pty.openpty()
    except OSError as error:
        raise program.Skipped(f"no terminal can be made here: {error}") from None
    done = subprocess.run([program.impactd(), "get", "r-1", "series.npy"], stdout=slave, stderr=subprocess.PIPE,
                          text=True, check=False)
    os.close(slave)
    os.close(master)
    assert done.returncode == 2 and "-o FILE.npy" in done.stderr, done
    with fake(say(body=b"NUMPY\x1b", kind="application/x-npy")) as (url, _):
        code, out = program.on_terminal("get", "r-1", "series.npy", "-o", "-", IMPACTD_SERVER=url)
        assert code == 0 and out == "NUMPY\x1b", out


def test_waits_that_time_out_leave_the_job():
    """A job that outlives --wait is exit code 8 of submit, watch and get, and goes on; cancel stops it, once."""
    with program.daemon() as daemon:
        code, out, errors = client(daemon.url, "submit", "-", "--wait", "0.5", text=json.dumps(endless()))
        job = out.strip()
        assert code == 8 and f"impactd cancel {job}" in errors, (code, out, errors)
        for command in ("watch", "get"):
            code, _, errors = client(daemon.url, command, job, "--wait", "0.3")
            assert code == 8 and "running" in errors, (command, code, errors)
        assert daemon.get("/v1/jobs/" + job).json()["status"] == "running"
        code, out, errors = client(daemon.url, "cancel", job)
        assert (code, out, errors) == (0, job + " dismissed\n", ""), (code, out, errors)
        code, out, errors = client(daemon.url, "cancel", job)
        assert code == 1 and "dismissed already" in errors, (code, errors)
        assert client(daemon.url, "watch", job)[0] == 1
        assert client(daemon.url, "get", job)[0] == 1
        assert client(daemon.url, "cancel", "j-0000")[0] == 4


def test_interrupts_end_the_watching_alone():
    """Ctrl-C during watch and submit --wait is exit code 130; the job goes on, and how to stop it is told."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("IMPACTD_")}
    with program.daemon() as daemon:
        for arguments in (("watch", None), ("submit", "-", "--wait", "100")):
            if arguments[0] == "watch":
                job = client(daemon.url, "submit", "-", text=json.dumps(endless()))[1].strip()
                arguments = ("watch", job)
            with subprocess.Popen([program.impactd(), *arguments], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, text=True,
                                  env={**kept, "IMPACTD_SERVER": daemon.url}) as process:
                process.stdin.write(json.dumps(endless()) if arguments[0] == "submit" else "")
                process.stdin.close()
                job = process.stdout.readline().split()[0]
                if arguments[0] == "submit":  # its lines are on stderr
                    process.stderr.readline()
                process.send_signal(signal.SIGINT)
                assert process.wait(20) == 130
                assert f"impactd cancel {job}" in process.stderr.read()
            assert daemon.get("/v1/jobs/" + job).json()["status"] == "running"
            assert client(daemon.url, "cancel", job)[0] == 0


def test_watch_draws_a_bar_on_a_terminal():
    """On a terminal watch shows a bar that does not go back, and in the end one line of the job's state."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("IMPACTD_")}
    try:
        master, slave = pty.openpty()
    except OSError as error:
        raise program.Skipped(f"no terminal can be made here: {error}") from None
    with program.daemon() as daemon:
        job = client(daemon.url, "submit", "-", text=json.dumps(endless()))[1].strip()
        with subprocess.Popen([program.impactd(), "watch", job, "--server", daemon.url], stdout=subprocess.PIPE,
                              stderr=slave, text=True, env=kept) as process:
            os.close(slave)
            shown = b""
            while shown.count(b"%") < 3:
                shown += os.read(master, 4096)
            assert client(daemon.url, "cancel", job)[0] == 0
            assert process.stdout.read() == job + " dismissed\n" and process.wait(20) == 1
    os.close(master)
    percents = [int(part.split("%")[0].split("]")[1]) for part in shown.decode().split("\r") if "%" in part]
    assert percents == sorted(percents) and percents[-1] <= 100, shown


def test_watch_shows_the_progress_of_the_job():
    """watch requests the job again until it has finished; lines show new states and every ten percent."""
    def job(status, progress):
        return say(body=json.dumps({"id": "j-1", "status": status, "progress": progress, "result": None}).encode())
    with fake(job("accepted", 0), job("running", 20), job("running", 25), job("running", 45.5), job("successful", 100)) as (url, seen):
        code, out, errors = client(url, "watch", "j-1")
        assert code == 0 and out.splitlines() == ["j-1 accepted 0 %", "j-1 running 20 %", "j-1 running 46 %", "j-1 successful 100 %"], (out, errors)
        assert {path.partition("?")[0] for _, path, _ in seen} == {"/v1/jobs/j-1"} and len(seen) == 5, seen
    with program.daemon() as daemon:
        scene = endless()
        slow = client(daemon.url, "submit", "-", text=json.dumps(scene))[1].strip()
        code, out, errors = client(daemon.url, "watch", slow, "--wait", "3.2")
        assert code == 8 and slow in out, (code, out, errors)
        assert client(daemon.url, "cancel", slow)[0] == 0


def test_tls_and_plain_http_taken_for_each_other_are_told():
    """A plain URL of a TLS server hints at https://, and the other way round."""
    with program.daemon() as daemon, tempfile.TemporaryDirectory() as folder:
        code, _, errors = client(daemon.url.replace("http:", "https:"), "submit", SPONGE)
        assert code == 7 and f"plain HTTP, name it as {daemon.url}" in errors, (code, errors)
        certificate, key = program.certificate(folder)
        with subprocess.Popen([program.impactd(), "serve", "--listen", "127.0.0.1:0", "--data", folder, "--tls-cert", certificate,
                               "--tls-key", key], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
            try:
                url = re.search(r"listens on (https://\S+)", process.stdout.readline())[1]
                for arguments in (("submit", SPONGE), ("watch", "j-1"), ("cancel", "j-1")):
                    code, _, errors = client(url.replace("https:", "http:"), *arguments)
                    assert code == 7 and f"speaks TLS, name it as {url}" in errors, (code, errors)
            finally:
                process.terminate()


def test_a_daemon_started_anew_is_found_again():
    """watch survives a restart of the daemon and sees the job's end."""
    with tempfile.TemporaryDirectory() as data, program.daemon(data=data) as daemon:
        port = daemon.port
        job = client(daemon.url, "submit", "-", text=json.dumps(endless()))[1].strip()
        kept = {name: value for name, value in os.environ.items() if not name.startswith("IMPACTD_")}
        with subprocess.Popen([program.impactd(), "watch", job, "--server", daemon.url], stdout=subprocess.PIPE,
                              text=True, env=kept) as process:
            process.stdout.readline()
            daemon.kill()
            with program.daemon("--listen", f"127.0.0.1:{port}", data=data) as again:
                assert client(again.url, "cancel", job)[0] == 0
                assert process.wait(30) == 1 and "dismissed" in process.stdout.read()
        daemon.start()


def test_no_daemon_is_told_with_the_way_to_one():
    """A refused connection is exit code 7 with what would be right, for every command."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{taken.getsockname()[1]}"
        for arguments in (("submit", SPONGE), ("watch", "j-1"), ("get", "r-1"), ("cancel", "j-1"),
                          ("compare", "r-1", "r-2")):
            code, out, errors = client(url, *arguments)
            assert code == 7 and out == "" and "impactd serve" in errors and "--server" in errors, (arguments, code, errors)


def test_wrong_words_are_usage():
    """Bad URLs, ids, labels and tokens are exit code 2, told before anything is sent, and no token is shown."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "token")
        with open(path, "w", encoding="utf-8") as file:
            file.write("secret-of-mine\n")
        os.chmod(path, 0o644)
        for arguments, words in ((("get", "r-1", "--server", "ftp://h"), "only http and https"),
                                 (("get", "r-1", "--server", "file:///etc/passwd"), "only http and https"),
                                 (("get", "r-1", "--server", "http://u:p@h"), "IMPACTD_TOKEN"),
                                 (("get", "r-1", "--server", "http://h/?x"), "query"),
                                 (("get", "r-1", "--server", "http://h\r\nX: y"), "control"),
                                 (("get", "r-1", "--token-file", path), "chmod 600"),
                                 (("get", "r-1", "--token-file", folder), "regular file"),
                                 (("get", "r-1", "--token-file", path + "x"), "cannot be read"),
                                 (("get", "r-1", "--token", "x"), "--token is not an option"),
                                 (("submit", SPONGE, "--label", "x"), "KEY=VALUE"),
                                 (("submit", SPONGE, "--idempotency-key", "a\nb"), "printable"),
                                 (("compare", "r-1"), "ids of two results"), (("watch",), "job's id"),
                                 (("cancel", "a/b"), "job's id")):
            code, out, errors = client("http://127.0.0.1:1", *arguments)
            assert code == 2 and out == "" and words in errors and "secret" not in errors, (arguments, code, errors)
        code, _, errors = client("http://127.0.0.1:1", "get", "r-1", environment={"IMPACTD_TOKEN": "secret of mine"})
        assert code == 2 and "IMPACTD_TOKEN" in errors and "secret" not in errors, (code, errors)
        # A table in another format than its name says.
        code, _, errors = client("http://127.0.0.1:1", "get", "r-1", "series.csv", "-o", os.path.join(folder, "out.npy"))
        assert code == 2 and "must end in .csv for series.csv" in errors, (code, errors)
        code, _, errors = client("http://127.0.0.1:1", "get", "r-1", "seires")
        assert code == 2 and "did you mean series?" in errors, (code, errors)


def test_a_hostile_server_is_bounded_and_refused():
    """Redirects, other schemes, endless headers and bodies, depth, no JSON and no HTTP end with 7 and a reason."""
    job = b'{"id": "j-1", "status": "running"}'
    for name, speak, words in (
            ("redirect", say(302, Location="http://127.0.0.1:1/"), "redirects are not followed"),
            ("to a file", say(301, Location="file:///etc/passwd"), "redirects are not followed"),
            ("headers", endless_headers, "headers"), ("body", endless_body, "more than"),
            ("text", say(body=b"<html>", kind="text/html"), "really impactd"), ("nothing", say(body=b""), "really impactd"),
            ("array", say(body=b"[1]"), "really impactd"), ("depth", say(body=b"[" * 5000000), "really impactd"),
            ("wide", say(body=b"[" + b"{}," * 300000 + b"{}]"), "really impactd"),
            ("types", say(body=b'{"id": [1], "status": {}}'), "really impactd"),
            ("NUL", say(body=b'{"id": "j\\u0000", "status": "x"}'), "really impactd"),
            ("bad id", say(body=b'{"id": "../../x", "status": "running"}'), "not a job"),
            ("no HTTP", raw(b"SSH-2.0-OpenSSH\r\n"), "HTTP"), ("cut", raw(b"HTTP/1.1 200 OK\r\nContent-Length: 50\r\n\r\n{"), "broke"),
            ("silence", raw(b""), "broke")):
        with fake(speak) as (url, seen):
            code, out, errors = client(url, "submit", SPONGE, "--json")
            assert code == 7 and out == "" and words in errors, (name, code, out[:200], errors[:500])
            assert len(seen) == 1, (name, seen)
    # An answer without its list is not an empty list.
    for body in (b"", b"[]", b"{}", b"<html>\xff", b'{"%s": {}}', b'{"%s": [1]}'):
        for name, arguments in (("jobs", ("jobs",)), ("jobs", ("jobs", "--json")), ("materials", ("materials", "list")),
                                ("records", ("records", "list")), ("history", ("materials", "history", "foam"))):
            with fake(say(body=body.replace(b"%s", name.encode()))) as (url, _):
                code, out, errors = client(url, *arguments)
                assert code == 7 and out == "" and f'list "{name}"' in errors and "begins with" in errors, (arguments, body, out, errors)
    for arguments in (("compare", "r-1", "r-2"), ("materials", "show", "foam"), ("records", "show", "a")):
        with fake(say()) as (url, _):
            code, out, errors = client(url, *arguments)
            assert code == 7 and out == "" and "really impactd" in errors, (arguments, out, errors)
    # Gzip that was not asked for is not unpacked, and a job that never ends obeys --wait.
    with fake(say(body=b"\x1f\x8b\x08" + b"x" * 100, Content_Encoding="gzip")) as (url, _):
        assert client(url, "watch", "j-1")[0] == 7
    with fake(say(body=job)) as (url, _):
        assert client(url, "watch", "j-1", "--wait", "0.5")[0] == 8


def test_a_silent_server_ends_the_wait():
    """submit --wait and watch give a server that accepts and never answers up a few seconds after --wait, with 7."""
    def silent(handler):
        handler.rfile.read(1)  # until the client closes
    done = say(body=b'{"id": "j-1", "status": "running"}')
    for arguments, plan in ((("submit", SPONGE), (silent,)), (("watch", "j-1"), (done, silent))):
        with fake(*plan) as (url, _):
            began = time.monotonic()
            code, _, errors = client(url, *arguments, "--wait", "1")
            assert code == 7 and "no answer" in errors and time.monotonic() - began < 30, (arguments, code, errors)


def test_problems_from_a_server_cannot_command_the_terminal():
    """Control characters of a problem document are replaced, long ones cut, and wrong types survived."""
    errors = [{"pointer": "/\x1b[2Ja", "detail": "x" * 5000 + "\x9b31m", "value": {"a": 1}, "did_you_mean": "\x07"},
              {"pointer": "/b", "detail": "bad \u009b1m"}]
    with fake(say(422, json.dumps({"detail": "d", "errors": errors, "more": 10**18}).encode())) as (url, _):
        code, _, told = client(url, "submit", SPONGE)
        assert code == 3 and "/?[2Ja: xxx" in told and "(did you mean \"?\"?)" in told, told[:300]
        assert not any(c in told for c in "\x1b\x07\x9b\u009b"), "a control character came through"
    for body in (b"", b"[]", b'{"errors": 5, "detail": [], "title": {}}', b'{"errors": [1, {"pointer": 7}]}', b"\xff"):
        with fake(say(500, body)) as (url, _):
            code, _, told = client(url, "submit", SPONGE)
            assert code == 1 and told != "", (body, code, told)


def test_codes_mean_what_the_shell_is_told():
    """401 and 403 are 5, 404 and 410 are 4, 409 is 1, 503 without patience is 7."""
    for http_code, expected in ((400, 2), (401, 5), (403, 5), (404, 4), (409, 1), (410, 4), (413, 3), (415, 3), (422, 3),
                                (429, 7), (500, 1), (503, 7), (507, 1)):
        with fake(say(http_code, b'{"title": "Because"}')) as (url, _):
            code, _, errors = client(url, "get", "r-1")
            assert code == expected and "Because" in errors, (http_code, code, errors)
            assert ("set IMPACTD_TOKEN or give --token-file" in errors) == (http_code == 401), errors


def test_a_busy_daemon_is_asked_again():
    """503 and 429 are asked again after Retry-After while --wait lasts, with the same Idempotency-Key."""
    done = say(body=b'{"id": "j-1", "status": "successful", "progress": 100, "result": "r-1"}')
    with fake(say(503, Retry_After="1"), say(429, Retry_After="1"), done) as (url, seen):
        began = time.monotonic()
        code, out, errors = client(url, "submit", SPONGE, "--wait", "20", "--idempotency-key", "k 1")
        assert (code, out) == (0, "j-1\n"), (code, out, errors)
        assert time.monotonic() - began >= 2 and len(seen) == 3
        assert all(headers.get("Idempotency-Key") == "k 1" for _, _, headers in seen), seen
    with fake(say(503, b'{"detail": "full"}', Retry_After="600"), done) as (url, seen):
        code, _, errors = client(url, "submit", SPONGE, "--wait", "20")
        assert code == 7 and "full" in errors and len(seen) == 1, (code, errors, seen)


def test_the_token_travels_in_its_header_alone():
    """A token of a file or the environment is sent as Bearer; the file wins; no other header tells of us."""
    with tempfile.TemporaryDirectory() as folder, fake(say()) as (url, seen):
        path = os.path.join(folder, "token")
        with open(path, "w", encoding="utf-8", opener=lambda p, f: os.open(p, f, 0o600)) as file:
            file.write("abc-123\nsecond line\n")
        client(url, "get", "r-1", environment={"IMPACTD_TOKEN": "of.environment"})
        client(url, "get", "r-1", "--token-file", path, environment={"IMPACTD_TOKEN": "of.environment"})
        client(url + "/base/", "get", "r-1")
        headers = [one for _, _, one in seen]
        assert [one.get("Authorization") for one in headers] == ["Bearer of.environment", "Bearer abc-123", None]
        assert seen[2][1] == "/base/v1/results/r-1", seen[2]
        assert set(headers[2]) <= {"Host", "Accept", "User-Agent"}, headers[2]


def test_a_download_that_is_cut_goes_on_once():
    """A cut download is gone on with by Range and If-Range once, and given up where the rest does not fit."""
    data = bytes(range(256)) * 4096
    half = len(data) // 2
    first = say(body=data[:half], kind="application/x-npy", length=len(data), ETag='"e"', Accept_Ranges="bytes")
    rest = say(206, data[half:], ETag='"e"', Content_Range=f"bytes {half}-{len(data) - 1}/{len(data)}")
    for plan, expected in (((first, rest), 0), ((first, say(200, data, ETag='"f"')), 7),
                           ((first, say(206, data[:half], Content_Range=f"bytes 0-{half - 1}/{len(data)}")), 7),
                           ((first, say(206, data[half:half + 9], length=half, Content_Range=f"bytes {half}-/x")), 7),
                           ((say(body=data[:half], length=len(data)),), 7)):
        with tempfile.TemporaryDirectory() as folder, fake(*plan) as (url, seen):
            path = os.path.join(folder, "x.npy")
            code, _, errors = client(url, "get", "r-1", "series", "-o", path)
            assert code == expected, (code, errors, seen)
            if expected == 0:
                with open(path, "rb") as file:
                    assert file.read() == data
                assert seen[1][2]["Range"] == f"bytes={half}-" and seen[1][2]["If-Range"] == '"e"', seen[1]
            else:
                assert os.listdir(folder) == [] and len(seen) <= 2, (os.listdir(folder), seen)


def test_a_file_is_written_only_of_what_was_asked():
    """A 200 of another Content-Type, as that of a proxy's page of sign-in, is no result: exit code 7, and no file."""
    page = say(body=b"<html>sign in</html>", kind="text/html; charset=utf-8")
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "x.csv")
        with fake(page) as (url, _):
            for arguments in (("series", "-o", path), ("result",), ("psd.svg",)):
                code, out, errors = client(url, "get", "r-1", *arguments)
                assert code == 7 and out == "" and "the answer is text/html" in errors and "really impactd" in errors, (code, errors)
        assert os.listdir(folder) == []
        with fake(say(body=b"time [s]\n0\n", kind="text/csv; charset=utf-8")) as (url, _):
            assert client(url, "get", "r-1", "series", "-o", path) == (0, "", "")


def test_compare_prints_what_differs():
    """compare asks for both results and prints each pair in a row; --json prints the answer."""
    answer = {"a": "r-1", "metrics": {"peak_displacement": {"a": 0.015, "b": 0.0151, "unit": "m", "difference": 1e-4}},
              "inputs": [{"pointer": "/dampers/0/clearance", "a": 0.015, "b": 0.02}, {"pointer": "/title", "a": None, "b": "x\x1b"}],
              "psd": {"distance": 1.25, "frequency": [1, 2, 3]}, "divergence": None,
              "channels": [{"channel": "velocity\x1b", "unit": "m/s", "rms": 0.06174418, "relative": None}]}
    with fake(say(body=json.dumps(answer).encode())) as (url, seen):
        code, out, errors = client(url, "compare", "r-1", "r-2")
        assert code == 0 and errors == "" and seen[0][1] == "/v1/compare?a=r-1&b=r-2", (code, errors, seen)
        assert "peak_displacement" in out and "0.0151" in out and re.search("difference +0.0001", out), out
        assert "/dampers/0/clearance" in out and re.search("distance +1.25", out) and "\x1b" not in out, out
        assert re.search(r"^channel +unit +rms$\nvelocity\S +m/s +0.0617442$", out, re.M), out
        assert json.loads(client(url, "compare", "r-1", "r-2", "--json")[1]) == answer
    for body in (b"", b"[1]", b"{", b"[" * 100000):
        with fake(say(body=body)) as (url, _):
            assert client(url, "compare", "r-1", "r-2")[0] == 7, body[:20]


def test_lists_are_printed_with_all_their_pages():
    """A list is followed by its Link headers to the last page, under the base path of the server."""
    first = say(body=b'{"records": [{"name": "a", "count": 2}]}', Link='</v1/records?limit=500&after=a>; rel="next"')
    with fake(first, say(body=b'{"records": [{"name": "b", "count": 3}]}')) as (url, seen):
        code, out, errors = client(url + "/base", "records", "list", "--q", "x y")
        assert code == 0 and errors == "" and [line.split()[0] for line in out.splitlines()] == ["name", "a", "b"], (code, out, errors)
        assert [path for _, path, _ in seen] == ["/base/v1/records?limit=500&q=x%20y", "/base/v1/records?limit=500&after=a"], seen
    with fake(first, say(body=b'{"records": [{"name": "b", "count": 3}]}')) as (url, _):
        listed = json.loads(client(url, "records", "list", "--json")[1])["records"]
        assert [record["name"] for record in listed] == ["a", "b"], listed
    with fake(first, first, first) as (url, seen):
        code, out, errors = client(url, "records", "list")
        assert code == 7 and out == "" and "no end" in errors and len(seen) == 2, (code, out, errors, seen)


def test_hostile_text_reaches_no_terminal():
    """Control and bidirectional characters of operands and answers are replaced; progress stays within 0 to 100 %; a title replaces an empty detail."""
    job = {"id": "j-1", "status": "running", "progress": 1e308, "title": "a\u202eb\u2066c\u200bd\u2028e"}
    with fake(say(body=json.dumps({"jobs": [job]}).encode())) as (url, _):
        code, out, _ = client(url, "jobs")
        assert code == 0 and "a???b???c???d???e" in out and " 100 %" in out, out
    with fake(say(404, b'{"title": "gone away", "detail": ""}')) as (url, _):
        code, _, errors = client(url, "get", "r-1")
        assert code == 4 and "gone away" in errors, errors
    for words in (("\x1b[31mx",), ("help", "\x1b[31mx"), ("check", "\x1b[31mx.json"), ("examples", "\x1b[31mx"),
                  ("examples", "chirp", "-o", "/none/\x1b[31mx"), ("run", SPONGE, "-o", "\x1b[31mx.xls"), ("import", "\x1b[31mx")):
        code, out, errors = client(url, *words)
        assert code != 0 and "[31mx" in errors and "\x1b" not in out + errors, (words, errors)
    with fake(say(body=b'{"name": "a\x7fb"}')) as (url, _):
        code, out = program.on_terminal("records", "show", "a", IMPACTD_SERVER=url)
        assert code == 0 and "a?b" in out, out
    # Lines for people break between words at the terminal's width.
    code, out = program.on_terminal("check", "/none/" + "x" * 70 + ".json", "--record", "y", columns=60)
    assert code == 4 and "\n  /none/" not in out and "xxx.json:\n  cannot be read: No such file" in out, out
    code, _, errors = client(url, "check", SPONGE, "--vary", "duration=" + "1" * 2000 + ",2")
    assert code == 2 and "characters" in errors, errors


def test_tls_is_verified():
    """A certificate that nobody trusts is refused with the mend; --ca-file trusts it."""
    import ssl
    with tempfile.TemporaryDirectory() as folder:
        certificate, key = program.certificate(folder)
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Fake)
        server.plan, server.seen, server.daemon_threads = [say(body=b'{"id": "r-1"}')], [], True
        server.handle_error = lambda *_: None
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(certificate, key)
        server.socket = context.wrap_socket(server.socket, server_side=True)
        thread = threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True)
        thread.start()
        try:
            url = f"https://localhost:{server.server_port}"
            code, _, errors = client(url, "get", "r-1")
            assert code == 7 and "--ca-file" in errors and not server.seen, (code, errors)
            code, out, errors = client(url, "get", "r-1", "--ca-file", certificate)
            assert code == 0 and json.loads(out) == {"id": "r-1"}, (code, out, errors)
        finally:
            server.shutdown()
            server.server_close()


if __name__ == "__main__":
    program.main(globals())
