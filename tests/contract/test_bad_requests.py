#!/usr/bin/env python3
"""All bad input over loopback, with the daemon unharmed."""

import gzip
import http.client
import json
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from asking import problem, sponge  # noqa: E402

SANITIZED = True
JSON_TYPE = {"Content-Type": "application/json"}
JSON_FILES = os.path.join(program.SOURCE, "tests", "contract", "json")


def test_bad_bodies():
    """Every kind of bad scene is a 4xx problem that names its places, all faults at once."""
    sine = program.scene("paper_sine_sponge")
    random = program.scene("paper_random_sponge")
    damper = sponge()["dampers"][0]

    def damped(**changes):
        return sponge(dampers=[{**damper, **changes}])

    cases = [
        (sponge(structure={"stiffness": 865}), ["/structure/mass"]),
        (sponge(structure={"mass": 1, "stiffness": -1, "damping": 0}), ["/structure/stiffness"]),
        (sponge(structur=1), ["/structur"]),
        (damped(buffer={"restitution": 0, "contact_time": 0.01}), ["/dampers/0/buffer/restitution"]),
        (damped(buffer={"restitution": 1.1, "contact_time": 0.01}), ["/dampers/0/buffer/restitution"]),
        (damped(buffer={"restitution": 0.5, "contact_time": 0}), ["/dampers/0/buffer/contact_time"]),
        (damped(clearance=-0.001), ["/dampers/0/clearance"]),
        (damped(position=0.008), ["/dampers/0/position"]),
        (sponge(duration=0), ["/duration"]),
        (sponge(duration=1e9), ["/duration"]),
        (sponge(sample_rate=1e300, duration=1e300), None),
        ({**random, "excitation": {**random["excitation"], "band": [1, 501]}}, None),
        (damped(buffer="wood", mass=-1), ["/dampers/0/buffer", "/dampers/0/mass"]),
        ({**sine, "excitation": {"kind": "sine"}}, None),
        ([], [""]), ([sponge()], [""]), ("text", [""]), (17, [""]), (None, [""]),
        ({}, ["/structure", "/duration", "/sample_rate"]),
    ]
    with program.daemon() as daemon:
        for scene, pointers in cases:
            reply = daemon.request("POST", "/v1/jobs", body=json.dumps(scene), headers=JSON_TYPE)
            assert reply.status in (400, 422), (scene, reply)
            problem(reply, reply.status, *(pointers or ()))
        allowed = damped(buffer={"restitution": 0})
        allowed["contact"] = {"model": "impulse"}
        assert daemon.submit(allowed).json()["status"] == "successful"
        meant = problem(daemon.submit(sponge(duratoin=1)), 422)["errors"]
        assert meant[0]["did_you_mean"] == "duration", meant

        text = json.dumps(sponge())
        for body in ("", " ", "{", "nul", text + "x", text[:-1], text.replace("10", "NaN"), text.replace("10", "Infinity"),
                     text.replace("{", '{"duration": 1, "duration": 2, ', 1), "[" * 33 + "]" * 33, "[" * 100000,
                     b"\xff\xfe", b"\xef\xbb\xbf", 2 * b"\xef\xbb\xbf" + text.encode(), b'{"a\x00": 1}', b'{"title": "\xed\xa0\x80"}'):
            problem(daemon.request("POST", "/v1/jobs", body=body, headers=JSON_TYPE), 400)
        assert daemon.request("POST", "/v1/jobs", body=b"\xef\xbb\xbf" + text.encode(), headers=JSON_TYPE).status == 200
        assert daemon.request("POST", "/v1/jobs", body=text,
                              headers={"Content-Type": "Application/JSON; charset=utf-8"}).status == 200
        for kind in ("text/plain", "application/x-www-form-urlencoded", "application/jsonx", ""):
            reply = daemon.request("POST", "/v1/jobs", body=text, headers={"Content-Type": kind})
            assert "--json" in problem(reply, 415)["detail"], reply
        for encoding, sent, status in (("gzip", gzip.compress(text.encode()), 415), ("br", text, 415), ("identity, gzip", text, 415),
                                       ("Identity", text, 200), ("", text, 200)):
            reply = daemon.request("POST", "/v1/jobs", body=sent, headers={**JSON_TYPE, "Content-Encoding": encoding})
            assert reply.status == status, (encoding, reply)
            assert status == 200 or f"without Content-Encoding, is encoded as {encoding}" in problem(reply, 415)["detail"], reply
        assert daemon.submit(sponge()).json()["status"] == "successful"


def test_wrong_types_at_every_field():
    """Each member of the fullest example in turn gets a value of every other type: never a crash, 4xx or a job."""
    whole = program.scene("all_keys")

    def places(value, path=()):
        yield path
        items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
        for key, inner in items:
            yield from places(inner, path + (key,))

    with program.daemon() as daemon:
        refused = 0
        for path in places(whole):
            for wrong in (None, True, -1, 1e308, 0.5, "x", [], {}, [[]], {"x": 1}):
                scene = json.loads(json.dumps({"scene": whole}))
                inner = scene
                for key in ("scene",) + path[:-1]:
                    inner = inner[key] if path else inner
                inner[path[-1] if path else "scene"] = wrong
                reply = daemon.request("POST", "/v1/jobs?dry_run=1", body=json.dumps(scene["scene"]),
                                       headers=JSON_TYPE)
                assert reply.status in (200, 400, 422), (path, wrong, reply)
                if reply.status != 200:
                    document = problem(reply, reply.status)
                    refused += 1
                    if reply.status == 422:
                        assert document["errors"], (path, wrong, reply)
        assert refused > 200, refused


def test_bodies_over_the_limit():
    """A body of just the limit is read, one byte more is a 413 that is seen, also chunked and without Content-Length."""
    limit = 65536
    with program.daemon("--max-body", str(limit)) as daemon:
        text = json.dumps(sponge()).encode()
        assert daemon.request("POST", "/v1/jobs", body=text.ljust(limit), headers=JSON_TYPE).status == 200
        for size in (limit + 1, 2 * limit, 4 * limit, 4 * limit + 1):
            document = problem(daemon.request("POST", "/v1/jobs", body=text.ljust(size), headers=JSON_TYPE), 413)
            assert str(limit) in document["detail"], document
        for size in (limit + 1, 4 * limit - 100):
            chunks = (text.ljust(size)[i:i + 8000] for i in range(0, size, 8000))
            connection = http.client.HTTPConnection("127.0.0.1", daemon.port)
            connection.request("POST", "/v1/jobs", body=chunks, headers=JSON_TYPE, encode_chunked=True)
            assert connection.getresponse().status == 413
            connection.close()
        # What goes on beyond four times the limit is cut off.
        connection = http.client.HTTPConnection("127.0.0.1", daemon.port, timeout=20)
        endless = (8000 * b" " for _ in range(100000))
        try:
            connection.request("POST", "/v1/jobs", body=endless, headers=JSON_TYPE, encode_chunked=True)
        except ConnectionError:
            pass
        assert sum(1 for _ in endless) > 0, "all of it was read"
        connection.close()
        assert daemon.request("POST", "/v1/jobs", body=text.ljust(limit), headers=JSON_TYPE).status == 200


def test_a_refusal_is_seen_by_who_sends_much():
    """What is refused by its head alone is answered once the body is through, and the connection stays open."""
    with program.daemon() as daemon:
        body = b" " * 10_000_000
        connection = http.client.HTTPConnection("127.0.0.1", daemon.port)
        for method, target, expected in (("POST", "/v1/none", 404), ("PUT", "/v1/jobs", 405), ("POST", "/v1/jobs?q=%zz", 400)) * 3:
            connection.request(method, target, body=body, headers=JSON_TYPE)
            reply = connection.getresponse()
            assert reply.status == expected and json.loads(reply.read())["status"] == expected, (method, target, reply.status)
        connection.request("GET", "/version")
        assert connection.getresponse().status == 200
        connection.close()


def test_all_json_files_as_bodies():
    """The 318 files of the JSON parsing suite: refused as they should be, never a crash."""
    with program.daemon("--max-body", "200000") as daemon:
        names = sorted(name for name in os.listdir(JSON_FILES) if name.endswith(".json"))
        assert len(names) == 318, len(names)
        for name in names:
            with open(os.path.join(JSON_FILES, name), "rb") as file:
                reply = daemon.request("POST", "/v1/jobs", body=file.read(), headers=JSON_TYPE)
            expected = {"n": (400, 413), "y": (400, 422), "i": (400, 413, 422)}[name[0]]
            assert reply.status in expected, (name, reply)
            problem(reply, reply.status)
        assert daemon.submit(sponge()).status == 200


def test_what_takes_too_long_is_refused_at_the_door():
    """--max-cpu-seconds (60) and --max-run-bytes bound what a scene may be predicted to take: 422 with the cost."""
    with program.daemon() as daemon:
        slow = sponge(duration=1000, accuracy={"solver": "rk4", "step": 1e-7})
        for path in ("/v1/jobs", "/v1/jobs?dry_run=1"):
            reply = daemon.request("POST", path, json=slow)
            problem(reply, 422, "/accuracy")
            assert "at most 60 s are allowed" in reply.json()["errors"][0]["detail"], reply
        names = ["displacement", "velocity", "acceleration", "mean_acceleration", "damper_displacement",
                 "damper_velocity", "penetration", "contact_force", "base_acceleration"]
        for segment, overlap, says in ((8388593, 7549733, "prime factors"), (33554000, 0, "900 MB can be stored")):
            psd = {"channels": names, "segment": segment, "overlap": overlap}
            reply = daemon.submit(sponge(duration=33554, output={"channels": [], "psd": psd}))
            problem(reply, 422, "/output/psd")
            assert says in reply.json()["errors"][0]["detail"], reply
    with program.daemon("--max-cpu-seconds", "0.002", "--max-run-bytes", "2000000") as daemon:
        problem(daemon.submit(sponge(duration=1e4, output={"channels": []})), 422, "/output/psd")
        problem(daemon.submit(sponge(duration=1e4, output={"psd": None})), 422, "/duration")
        cost = daemon.request("POST", "/v1/jobs?dry_run=1", json=sponge()).json()["cost"]
        assert cost["cpu_seconds"] < 0.002 and 4e5 < cost["bytes"] < 1e6, cost
    with program.daemon("--max-run-bytes", "2000000") as daemon:
        problem(daemon.submit(sponge(duration=100)), 422, "/output/channels")
        # The history of an impact needs all states.
        job = daemon.submit(sponge(duration=60, output={"channels": [], "psd": None})).json()
        history = daemon.get(f"/v1/results/{job['result']}/impacts/1/force.json")
        assert history.status != 200 and "2 MB are allowed" in history.json()["detail"], history


if __name__ == "__main__":
    program.main(globals())
