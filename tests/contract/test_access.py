#!/usr/bin/env python3
"""Every route of routes.c against every credential, Host, Origin and hostile path: one rule says what each must answer.

A new route is tested without a change here, unless its scope departs from the rule of scope_of()."""

import base64
import http.client
import itertools
import os
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from access import bearer, impactd, token  # noqa: E402
from asking import sponge  # noqa: E402
from daemon import Daemon  # noqa: E402
from program import until  # noqa: E402

SANITIZED = "nightly"

SCOPES = ("read", "submit", "materials", "admin")

# What needs no token: what the API is, whether there is a daemon, the page that asks for a token and its files.
OPEN = r"/(schemas.*|openapi\.json|health/\w+|version|web/.*|guide/.*|problems/.*|client.*|favicon\.ico|)"
# A POST that stores nothing and starts no job reads.
READING = r"/v1/(compare|cache/explain|results/\{id\}/calibration/proposal)"
# The sender of a job follows it without the scope read; of other jobs it is told nothing.
FOLLOWED = r"/v1/jobs/\{id\}(/events)?"


def scope_of(method, pattern):
    """The rule: the scope that a route must ask for."""
    if re.fullmatch(OPEN, pattern):
        return "open"
    if method in ("GET", "HEAD") or re.fullmatch(READING, pattern):
        return "read"
    return "materials" if re.match("/v1/(materials|records)", pattern) else "submit"


def expected(scope, credential):
    """The rule: 401, 403 or None, which is any other status. `credential`: the scopes of a good token, or None."""
    if scope == "open":
        return None
    if credential is None:
        return 401
    return None if {scope, "admin"} & set(credential) else 403


def routes():
    """(method, pattern, scope) of the table."""
    with open(os.path.join(program.SOURCE, "server", "api", "routes.c"), encoding="utf-8") as file:
        rows = re.findall(r'^\s*\{"([A-Z]+)",\s*"([^"]+)",\s*"(\w+)",', file.read(), re.M)
    assert len(rows) > 100, "routes.c is not read as it is written"
    return rows


def filled(pattern, values):
    """The pattern with its names replaced; "0" is nothing's name."""
    kind = pattern.split("/")[2] if pattern.startswith("/v1/") else pattern.split("/")[1]
    return re.sub(r"\{(\w+)\}", lambda name: values.get((kind, name[1]), values.get(name[1], "0")), pattern)


class Caller:
    """One connection that stays open, as long as the daemon keeps it."""
    def __init__(self, daemon):
        self.connection = http.client.HTTPConnection("127.0.0.1", daemon.port, timeout=60)
        self.bodies = []

    def ask(self, method, target, headers):
        body = b"{}" if method in ("POST", "PATCH") else None
        kind = {"Content-Type": "application/json"} if body else {}
        self.connection.request(method, target, body=body, headers={**kind, **headers})
        reply = self.connection.getresponse()
        text = reply.read()
        self.bodies.append(str(reply.getheaders()).encode() + text)
        return reply.status, dict((name.lower(), value) for name, value in reply.getheaders()), text


def spellings(secret):
    """What a leaked token may look like."""
    digits = secret[len("impactd_"):]
    return [digits.encode(), digits.upper().encode(), bytes.fromhex(digits), base64.b64encode(secret.encode())[:80]]


def credentials(data):
    """name -> (headers, scopes of a good token or None), and all secrets: every set of scopes, and all that is no good."""
    table, secrets = {}, []

    def made(name, scopes, *more):
        secrets.append(token(data, name, scopes, *more))
        return secrets[-1]
    for size in range(1, len(SCOPES) + 1):
        for scopes in itertools.combinations(SCOPES, size):
            table["+".join(scopes)] = bearer(made("-".join(scopes), ",".join(scopes))), scopes
    good = secrets[-1]
    gone = {state: made(state, "admin", *(("--expires", "1e-6") if state == "expired" else ()))
            for state in ("expired", "revoked", "forgotten")}
    for name in ("revoked", "forgotten"):
        assert impactd("token", "revoke", name, "--data", data).returncode == 0
    assert impactd("token", "forget", "--name", "forgotten", "--data", data).returncode == 0
    malformed = ["Bearer ", good, f"Basic {good}", f"Bearer {good[:-1]}", f"Bearer {good[8:]}", "Bearer impactd_" + 64 * "0"]
    table.update({name: (bearer(text), None) for name, text in gone.items()})
    table.update({f"malformed {i}": ({"Authorization": value}, None) for i, value in enumerate(malformed)})
    table["no header"] = {}, None
    table["elsewhere"] = {"Cookie": f"token={good}", "X-Authorization": f"Bearer {good}", "Proxy-Authorization": f"Bearer {good}"}, None
    return table, secrets


def populated(daemon, headers):
    """Makes one of each resource; the value of each name in the patterns."""
    job = daemon.submit(sponge(output={"psd": None}), headers={**headers, "Prefer": "wait=60"}).json()
    assert job["status"] == "successful", job
    assert daemon.request("POST", "/v1/records?name=quake&interval=0.01&unit=g", body="0.1\n0.2\n0.1\n0.0\n",
                          headers={**headers, "Content-Type": "text/plain"}).status == 201
    return {("jobs", "id"): job["id"], ("results", "id"): job["result"], ("materials", "slug"): "sponge", "revision": "1",
            ("records", "name"): "quake", ("examples", "name"): "paper_free_sponge", "format": "json", "number": "1",
            ("schemas", "name"): "scene", ("guide", "file"): "index.html", ("client", "file"): "impactd.py"}


def read(path):
    with open(path, encoding="utf-8", errors="replace") as file:
        return file.read()


def contents(folder):
    """All files of the data folder, the database's log among them while the daemon runs."""
    found = []
    for place, _, names in os.walk(folder):
        for name in names:
            with open(os.path.join(place, name), "rb") as file:
                found.append(file.read())
    return found


def ask_all(daemon, table, values, known, credential):
    """Every route of the table with one credential, unknown names first: (how many, what departs from the rule, all answers)."""
    (headers, scopes), caller, count, wrong = known[credential], Caller(daemon), 0, []
    heads = [("HEAD", *rest) for method, *rest in table if method == "GET"]
    for there, rows in (({}, table), (values, [row for row in table if row[0] == "GET"]), (values, heads)):
        for method, pattern, scope in rows:
            must, target = expected(scope, scopes), filled(pattern, there)
            if not there and credential in ("no header", "admin"):
                # Recorded for test_traffic.py.
                reply = daemon.request(method, target, headers=headers, **({"json": {}} if method in ("POST", "PATCH") else {}))
                status, text = reply.status, reply.body
            else:
                status, _, text = caller.ask(method, target, headers)
            count += 1
            if (status != must if must else status in (401, 403)) or status == 500:
                wrong.append((credential, method, target, status, must))
            if must and (len(text) > 600 or method != "HEAD" and (f'"{scope}' in text.decode().replace("\\", "")) != (must == 403)):
                wrong.append((credential, method, target, "a refusal names the scope and nothing more", text[:700]))
    return count, wrong, caller.bodies


def test_every_route_with_every_credential():
    """All sets of scopes, no, malformed, unknown, expired, revoked and forgotten tokens: as the rule says, also where the answer
    is cached; afterwards no token is in any answer, in the log or in a file of the data folder."""
    table, count, wrong, bodies, stored = routes(), 0, [], [], []
    assert [row for row in table if scope_of(*row[:2]) != row[2]] == [], "routes whose scope departs from the rule"
    with Daemon(program.build, "--journal", "all") as daemon:
        known, secrets = credentials(daemon.data)
        admin = known["admin"][0]
        assert until(lambda: daemon.get("/v1/jobs", headers=known["expired"][0]).status == 401)
        values = populated(daemon, admin)
        for credential in known:
            asked, departing, answers = ask_all(daemon, table, values, known, credential)
            count, wrong, bodies = count + asked, wrong + departing, bodies + answers
        for place in (f"/v1/jobs?access_token={secrets[0]}", f"/v1/jobs?limit=1&token={secrets[0]}"):
            for headers in ({}, admin):
                reply = daemon.get(place, headers=headers)
                assert reply.status in (400, 401), (place, reply)
                bodies.append(reply.body)
        stored += contents(daemon.data)
        daemon.stop()
        stored += contents(daemon.data)
        output = (daemon.greeting + daemon.stderr()).encode()
    assert wrong == [], (len(wrong), wrong[:20])
    assert max(map(len, stored)) > 100000 and output.count(b" code=") >= count, count
    everything = b"\0".join([output, *stored, *bodies])
    for secret in secrets:
        assert not [one for one in spellings(secret) if one in everything], "a token is in a log, an answer or a file"
    print(f"      {count} requests, {len(table)} routes, {len(known)} credentials; {len(secrets)} tokens sought in {len(stored)} files, "
          f"{len(output)} bytes of log, {len(bodies)} answers")


def test_every_route_with_foreign_hosts():
    """DNS rebinding: a Host that is not the daemon's is refused with 421 on every route, though a good token comes with it."""
    hosts = ("evil.example.org", "localhost.evil.example", "127.0.0.1.evil.example", "evil.example:8080", "localhost:80:80", "localhost:x",
             "localhost@evil", "127.0.0.2", "127.1", "2130706433", "0x7f.0.0.1", "[::ffff:127.0.0.1]", "localhost.", "localhost,evil",
             "http://localhost", "localhost/evil", "localhost evil", "", "0.0.0.0")
    table, wrong = routes(), []
    with program.daemon() as daemon:
        admin = token(daemon.data, "chief", "admin")
        assert until(lambda: daemon.get("/v1/jobs").status == 401)
        caller = Caller(daemon)
        for (method, pattern, _), host in itertools.product(table, hosts):
            status, got, _ = caller.ask(method, filled(pattern, {}), {**bearer(admin), "Host": host})
            if status != 421 or "access-control-allow-origin" in got:
                wrong.append((method, pattern, host, status))
    assert wrong == [], (len(wrong), wrong[:20])
    print(f"      {len(table) * len(hosts)} requests")


def test_every_route_with_foreign_origins():
    """What a browser sends for a page of another site is refused with 403 by every method that changes something, while
    reading is answered as without Origin, and without a header that would show it to that page."""
    table, wrong = routes(), []
    with program.daemon() as daemon:
        own = f"http://127.0.0.1:{daemon.port}"
        origins = (None, own, f"{own}.evil.example", f"http://127.0.0.1:{daemon.port}0", "http://evil.example", "null")
        sites = (None, "none", "same-origin", "same-site", "cross-site")
        caller = Caller(daemon)
        for method, pattern, _ in table:
            target = filled(pattern, {})
            plain = None
            for origin, site in itertools.product(origins, sites):
                headers = {name: value for name, value in (("Origin", origin), ("Sec-Fetch-Site", site)) if value is not None}
                status, got, text = caller.ask(method, target, headers)
                plain = status if not headers else plain
                is_foreign = origin not in (None, own) or site not in (None, "none", "same-origin")
                must = 403 if is_foreign and method not in ("GET", "HEAD") else plain
                if status != must or [name for name in got if name.startswith("access-control")] or \
                        (status == 403 and b"another site" not in text):
                    wrong.append((method, target, headers, status, must))
    assert wrong == [], (len(wrong), wrong[:20])
    print(f"      {len(table) * len(origins) * len(sites)} requests")


def climbing(secret):
    """Path parameters that would leave a folder, if any were taken for a file's name."""
    climb = "../" * 12 + secret.lstrip("/")
    once = re.sub(r"[./]", lambda one: f"%{ord(one[0]):02x}", climb)
    yield from ("..", ".", "%2e%2e", ".%2e", "%252e%252e", "..%00", "%00", "x%00.json", "....", "...", "..;", "%5c", "..%5c..%5cx", "\\..\\x",
                "%c0%ae%c0%ae", "%e0%80%ae", "%uff0e%uff0e", "~", "~root", "%2f", "%2fetc%2fpasswd", "C:", "con", "-", "*", "$HOME", "%24HOME",
                "..%2fimpactd.db", "impactd.db", "%2e%2e%2fimpactd.lock", "file:%2f%2f%2fetc%2fpasswd", 600 * "a")
    yield from (climb, once, once.replace("%", "%25"), once.replace("%2f", "%5c"), once.replace("%2e", "%c0%ae"),
                secret.replace("/", "%2f"), secret.replace("/", "%252f"), once + "%00.json", once + "%2500.json")


def climb(daemon, secret):
    """Every route with a parameter, each parameter with each hostile name; then these names in queries and bodies."""
    count, wrong, caller = 0, [], Caller(daemon)
    for (method, pattern, _), payload in itertools.product(routes(), climbing(secret)):
        for name in re.findall(r"\{(\w+)\}", pattern):
            target = filled(pattern, {"format": "json", name: payload})
            status, _, text = caller.ask(method, target, {})
            count += 1
            if not 300 <= status < 500 or b"canary" in text or b"root:" in text or b"SQLite" in text:
                wrong.append((method, target, status, text[:100]))
    for payload in climbing(secret):
        if re.fullmatch(r"[a-z0-9._-]*[a-z0-9][a-z0-9._-]*", payload):
            continue  # a good name
        for path, body in ((f"/v1/records?interval=0.01&unit=g&name={payload}", {"samples": [1, 2, 3]}),
                           ("/v1/materials", {"slug": payload, "name": "x", "restitution": 0.5, "contact_time": 0.01}),
                           ("/v1/jobs", sponge(excitation={"kind": "record", "name": payload}))):
            reply = daemon.request("POST", path, json=body)
            count += 1
            wrong += [] if 400 <= reply.status < 500 else [(path, payload, reply)]
    return count, wrong


# What may be opened outside the data folder: before requests are taken, what programs and libraries are made of; then clock,
# locale, processor, random numbers, and what /metrics reports of the process.
SYSTEM = r"/(lib|usr|etc|proc|sys|dev)(/.*)?"
SERVING = (r"/(etc/localtime|usr/share/(zoneinfo|locale)/.*|usr/lib/(locale|[^/]+/gconv)/.*|sys/devices/system/cpu/online|proc/stat|dev/urandom|"
           r"proc/self/(statm|fd|stat))")
WRITES = r"\bO_(WRONLY|RDWR|CREAT|TRUNC)\b|^(unlink|rename|mkdir|rmdir|link|symlink|truncate|chmod|fchmodat|chown|mknod|creat|mount|set\w*xattr)"


def departures(trace, data):
    """Lines of a trace that are no business of a daemon with this data folder: (how many calls, lines)."""
    calls, wrong, is_serving, started = 0, [], False, 0
    for line in trace.splitlines():
        found = re.match(r"\d+ +((\w+)\(.*)", line)
        if not found:
            continue
        calls += 1
        call, name = found[1], found[2]
        if name in ("execve", "bind", "listen", "socket"):
            started += 1
        paths = [os.path.normpath(path) for path in re.findall(r'(?<!\[)"([^"]+)"', call)] if name not in ("execve", "bind") else []
        is_ours = all(path == data or path.startswith(data + "/") for path in paths) or call.endswith("EEXIST (File exists)")
        reads = SERVING if is_serving else SYSTEM
        is_known = all(re.fullmatch(reads, path) or (data + "/").startswith(path.rstrip("/") + "/") for path in paths
                       if not path.startswith(data))
        if name in ("connect", "fork", "vfork", "ptrace", "io_uring_setup", "memfd_create") or \
                (name.startswith("clone") and "CLONE_THREAD" not in call) or \
                (name == "socket" and not re.match(r"socket\(AF_INET6?, SOCK_STREAM", call)) or \
                (name == "bind" and "127.0.0.1" not in call) or \
                (paths and (re.search(WRITES, call) and not is_ours or not is_known)):
            wrong.append(line)
        is_serving |= name == "listen"
    return calls, wrong if started == 4 else [*wrong, f"{started} of execve, socket, bind, listen; must be one of each"]


def test_no_request_leads_out_of_the_data_folder():
    """Path parameters with dots, slashes and NULs, plain, encoded once, twice or overlong: 3xx or 4xx on every route. Under strace:
    no connection to anywhere, no other program, no file outside the data folder but those of the system."""
    with tempfile.TemporaryDirectory(prefix="impactd-") as folder:
        trace, wrapper, secret, data = (os.path.join(folder, name) for name in ("trace", "wrapper", "secret.json", "data"))
        with open(secret, "w", encoding="utf-8") as file:
            file.write('{"canary": 1}')
        traced = ["strace", "-D", "-f", "-q", "--seccomp-bpf", "-o", trace, "-e",
                  "trace=%file,%process,socket,connect,bind,listen,ptrace,io_uring_setup,memfd_create"]
        # The leak sanitizer does not work under strace.
        is_traced = not program.is_sanitized() and subprocess.run([*traced, "true"], capture_output=True, check=False).returncode == 0
        with open(wrapper, "w", encoding="utf-8") as file:
            file.write(f'#!/bin/sh\nexec {" ".join(traced)} {program.impactd()} "$@"\n')
        os.chmod(wrapper, 0o700)
        daemon = Daemon(program.build, data=data)
        daemon.program = wrapper if is_traced else daemon.program
        with daemon:
            count, wrong = climb(daemon, secret)
            known, _ = credentials(data)
            assert until(lambda: daemon.get("/v1/jobs").status == 401)
            asked, departing, _ = ask_all(daemon, routes(), populated(daemon, known["admin"][0]), known, "admin")
            assert daemon.stop(60)[0] == 0
        assert all(name.startswith("impactd.") for name in os.listdir(data)), os.listdir(data)
        assert wrong + departing == [], (len(wrong), wrong[:20], departing[:20])
        print(f"      {count} hostile paths and names, {asked} good requests")
        if not is_traced:
            raise program.Skipped("the paths are done; strace does not work here")
        assert until(lambda: "+++ exited with 0 +++" in read(trace)), "the trace has no end"
        calls, lines = departures(read(trace), data)
    assert lines == [], "\n".join(lines[:20])
    print(f"      {calls} system calls: 0 out of place")


if __name__ == "__main__":
    program.main(globals())
