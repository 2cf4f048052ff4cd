#!/usr/bin/env python3
"""Tokens: who may do what, as clients meet it; test_access.py asks every route."""

import http.client
import json
import os
import socket
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from access import bearer, impactd, token  # noqa: E402
from asking import endless  # noqa: E402
from client import client  # noqa: E402
from daemon import Daemon  # noqa: E402
from program import until  # noqa: E402

SCENE = program.scene("paper_free_sponge")

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
    for option, value in (("--rate", "1"), ("--quota", "1")):
        with program.daemon(option, value) as daemon:
            greedy, other = token(daemon.data, "greedy"), token(daemon.data, "other")
            assert until(lambda: daemon.get("/v1/jobs").status == 401)

            def submit(who, more):
                return daemon.submit(endless(more), headers={**bearer(who), "Prefer": "respond-async"})
            replies = [submit(greedy, i) for i in range(3)]
            refused = next(reply for reply in replies if reply.status != 202)
            assert refused.status == 429 and int(refused.headers["retry-after"]) >= 1, (option, refused)
            for path in ("/v1/jobs?dry_run=1", "/v1/cache/explain"):
                reply = daemon.request("POST", path, json=endless(), headers=bearer(greedy))
                assert reply.status == (429 if option == "--rate" else 200), (option, path, reply)
                assert option != "--rate" or int(reply.headers["retry-after"]) > 1, reply.headers
            assert submit(other, 9).status == 202, option
            job = replies[0].json()["links"]["self"]
            assert daemon.request("DELETE", job, headers=bearer(greedy)).status == 200
            assert option == "--rate" or submit(greedy, 5).status == 202


def test_a_job_is_cancelled_by_its_owner_or_an_admin_alone():
    """Another's DELETE and retry: 403 with the owner's name, and the job goes on; its sender stands in the job and the list."""
    with program.daemon() as daemon:
        nobodys = daemon.submit(endless(99), headers={"Prefer": "respond-async"}).json()
        names = {name: bearer(token(daemon.data, name, scopes)) for name, scopes in
                 (("ann", "read,submit"), ("bob", "read,submit"), ("chief", "read,admin"))}
        assert until(lambda: daemon.get("/v1/jobs").status == 401)

        def submit(who, more):
            reply = daemon.submit(endless(more), headers={**names[who], "Prefer": "respond-async"})
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


def test_a_token_without_read_follows_its_own_jobs():
    """Scope submit alone: its own job and the events of it, also while it waits; of others 403, as if they did not exist."""
    with program.daemon() as daemon:
        ann, bob = (bearer(token(daemon.data, name, "submit")) for name in ("ann", "bob"))
        assert until(lambda: daemon.get("/v1/jobs").status == 401)
        path = "/v1/jobs/" + daemon.submit(SCENE, headers={**ann, "Prefer": "respond-async"}).json()["id"]
        assert daemon.get(path + "?wait=30", headers=ann).json()["status"] == "successful"
        assert b"event: finished" in daemon.get(path + "/events", headers=ann).body
        for target in (path, path + "/events", "/v1/jobs/j-0"):
            reply = daemon.get(target, headers=bob)
            assert reply.status == 403 and '"read"' in reply.json()["detail"], (target, reply)
        for target in (path + "/scene", "/v1/jobs"):
            assert daemon.get(target, headers=ann).status == 403, target
        code, out, errors = client(daemon.url, "submit", "-", "--wait", "60", text=json.dumps({**SCENE, "duration": 4}),
                                   environment={"IMPACTD_TOKEN": ann["Authorization"].split()[1]})
        assert code == 0 and out.startswith("j-"), (code, out, errors)


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
        slow = daemon.submit(endless(), headers={**bearer(ann), "Prefer": "respond-async"}).json()
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
                (("create", "--name", "impactd"), 2, "own name"),
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
        # In a wrong folder nothing is made but by create.
        wrong = os.path.join(data, "wrong")
        for arguments in (("list",), ("revoke", "lab"), ("forget", "lab")):
            done = impactd("token", *arguments, "--data", wrong)
            assert done.returncode == 4 and "there is no database in" in done.stderr and not os.path.exists(wrong), (arguments, done)


def test_a_token_that_cannot_be_shown_is_not_made():
    """Where standard output takes nothing, the command fails and there is no token, so that loopback stays open."""
    with program.daemon() as daemon:
        for target in ("/dev/full", None):
            if target is not None:
                out = os.open(target, os.O_WRONLY)
            else:
                gone, out = os.pipe()
                os.close(gone)
            made = subprocess.run([program.impactd(), "token", "create", "--name", "lab", "--data", daemon.data], stdout=out,
                                  stderr=subprocess.PIPE, text=True, timeout=60)
            os.close(out)
            assert made.returncode == 1 and "cannot be written" in made.stderr, made
            assert json.loads(program.run("token", "list", "--json", "--data", daemon.data)[1]) == {"tokens": []}
        time.sleep(1.2)
        assert daemon.get("/v1/jobs").status == 200


def test_beyond_loopback_nothing_starts_without_a_token():
    """0.0.0.0 and --require-tokens refuse with the command that makes one; with a token both start and ask for it."""
    with tempfile.TemporaryDirectory(prefix="impactd-") as data:
        for arguments in (("--listen", "0.0.0.0:0"), ("--listen", "127.0.0.1:0", "--require-tokens"), ("--listen", "[::]:0")):
            done = impactd("serve", *arguments, "--data", data)
            assert done.returncode == 5 and "create one with impactd token create --name NAME --scopes read,submit, and" in done.stderr, done
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


if __name__ == "__main__":
    program.main(globals())
