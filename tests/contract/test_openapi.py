#!/usr/bin/env python3
"""schema/openapi.json tells what routes.c has, no more and no less, and real answers have the shapes it promises."""

import functools
import json
import os
import re
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from asking import endless  # noqa: E402

with open(os.path.join(program.SOURCE, "schema", "openapi.json"), encoding="utf-8") as openapi:
    DOCUMENT = json.load(openapi)
# Answers that many operations share are defined once.
for ITEM in DOCUMENT["paths"].values():
    for OPERATION in ITEM.values():
        OPERATION["responses"] = {
            status: DOCUMENT["components"]["responses"][answer["$ref"].rsplit("/", 1)[1]] if "$ref" in answer else answer
            for status, answer in OPERATION["responses"].items()}

TYPES = {"object": dict, "array": list, "string": str, "boolean": bool, "null": type(None)}


def operations():
    """Every (method, path) of the document, with its operation."""
    return {(method.upper(), path): operation
            for path, item in DOCUMENT["paths"].items() for method, operation in item.items()}


def routes():
    """Every (method, pattern) of routes.c, with the names its query may hold."""
    with open(os.path.join(program.SOURCE, "server", "api", "routes.c"), encoding="utf-8") as file:
        text = file.read()
    names = {array: set(re.findall(r'"(\w+)"', list_)) for array, list_
             in re.findall(r"static const char \*const (\w+)\[\] = \{([^}]*)\}", text)}
    rows = re.findall(r'^\s*\{"([A-Z]+)",\s*"([^"]+)",\s*"(?:open|read|submit|materials|admin)",\s*(\w+),', text, re.M)
    return {(method, pattern): names.get(queries, set()) for method, pattern, queries in rows}


def is_type(value, name):
    if name == "integer":
        return isinstance(value, int) and not isinstance(value, bool)
    if name == "number":
        return isinstance(value, (int, float)) and not isinstance(value, bool)
    return isinstance(value, TYPES[name])


@functools.lru_cache
def printed(name):
    with open(os.path.join(program.SOURCE, "schema", f"{name}.schema.json"), encoding="utf-8") as file:
        return json.load(file)


def faults(schema, value, place=""):
    """Where `value` is not as `schema` says; knows the keywords this document uses."""
    if schema.get("$ref", "").startswith("#/components/schemas/"):
        return faults(DOCUMENT["components"]["schemas"][schema["$ref"].rsplit("/", 1)[1]], value, place)
    if schema.get("$ref", "").startswith("/schemas/") and place == "":
        return faults(printed(schema["$ref"].rsplit("/", 1)[1]), value, place)
    found = []
    if "anyOf" in schema and all(faults(choice, value) for choice in schema["anyOf"]):
        found.append(f"{place}: is none of the choices: {min((faults(choice, value, place) for choice in schema['anyOf']), key=len)}")
    if "oneOf" in schema:
        if sum(not faults(choice, value) for choice in schema["oneOf"]) != 1:
            tried = min((faults(choice, value, place) for choice in schema["oneOf"]), key=len)
            found.append(f"{place}: is not exactly one of the choices: {tried}")
    types = schema.get("type", [])
    types = [types] if isinstance(types, str) else types
    if types and not any(is_type(value, name) for name in types):
        return [f"{place}: is no {types}: {str(value)[:80]}"]
    if "enum" in schema and value not in schema["enum"] or "const" in schema and value != schema["const"]:
        found.append(f"{place}: {value!r} is not allowed")
    if isinstance(value, dict):
        properties = schema.get("properties", {})
        found += [f"{place}/{name}: is missing" for name in schema.get("required", []) if name not in value]
        for name, inner in value.items():
            if name in properties:
                found += faults(properties[name], inner, f"{place}/{name}")
            elif schema.get("additionalProperties") is False:
                found.append(f"{place}/{name}: is not in the document")
            elif isinstance(schema.get("additionalProperties"), dict):
                found += faults(schema["additionalProperties"], inner, f"{place}/{name}")
    if isinstance(value, list) and "items" in schema:
        for i, inner in enumerate(value[:50]):
            found += faults(schema["items"], inner, f"{place}/{i}")
    return found


def test_paths_methods_and_queries_are_those_of_the_routes():
    """Every route with its query names stands in the document, and nothing else."""
    described = {key: {p["name"] for p in operation.get("parameters", []) if p["in"] == "query"}
                 for key, operation in operations().items()}
    assert len(routes()) > 20, "routes.c is not read as it is written"
    assert described == routes(), {key: (described.get(key), routes().get(key))
                                   for key in set(described) ^ set(routes())
                                   or {k for k in described if described[k] != routes()[k]}}


def test_every_operation_tells_how_it_refuses():
    """421 for a foreign Host everywhere; 401 and 403 wherever routes.c asks for a scope, and no token where it does not."""
    with open(os.path.join(program.SOURCE, "server", "api", "routes.c"), encoding="utf-8") as file:
        scopes = re.findall(r'^\s*\{"([A-Z]+)",\s*"([^"]+)",\s*"(\w+)",', file.read(), re.M)
    for method, pattern, scope in scopes:
        operation = operations()[method, pattern]
        wanted = {"421"} if scope == "open" else {"401", "403", "421"}
        assert {code for code in operation["responses"] if code in ("401", "403", "421")} == wanted, (method, pattern)
        assert operation.get("security") == ([] if scope == "open" else None), (method, pattern)


def test_the_document_is_whole():
    """Unique operation ids, path parameters declared, references that lead somewhere, no schema without use."""
    ids = [operation["operationId"] for operation in operations().values()]
    assert len(ids) == len(set(ids)), ids
    for (_, path), operation in operations().items():
        declared = {p["name"] for p in operation.get("parameters", []) if p["in"] == "path"}
        assert declared == set(re.findall(r"\{(\w+)\}", path)), path
        assert operation["tags"][0] in {tag["name"] for tag in DOCUMENT["tags"]}, path
    used = set(re.findall(r'"#/components/schemas/(\w+)"', json.dumps(DOCUMENT)))
    assert used == set(DOCUMENT["components"]["schemas"]), used ^ set(DOCUMENT["components"]["schemas"])


def test_real_answers_have_the_promised_shapes():
    """Every operation is called, good and bad, and each answer has a status, type and shape of the document."""
    called, statuses = set(), set()
    with program.daemon() as daemon:
        job = program.finished(daemon, program.scene("paper_free_sponge"))
        study = program.finished(daemon, {**program.scene("paper_free_sponge"), "study": {"kind": "tradeoff", "solvers": ["exact", "rk4"]}})
        tradeoff = {"id": study["result"]}
        many = program.finished(daemon, program.scene("ensemble_random_sponge"))
        ensemble = {"id": many["result"]}
        swept = program.finished(daemon, program.scene("sweep_frequency"))
        sweep = {"id": swept["result"], "index": "7"}
        studies = {}
        for name, kind in (("compare_aluminium", "compare"), ("sensitivity_sponge", "sensitivity"), ("response_sponge", "response"),
                           ("calibrate_free_sponge", "calibration")):
            studies[kind] = {"id": program.finished(daemon, program.scene(name))["result"]}
        best = {**program.scene("paper_free_sponge"), "duration": 1, "study": {
            "kind": "optimize", "variables": [{"pointer": "/dampers/0/mass", "from": 0.05, "to": 0.2}],
            "objectives": [{"metric": "rms_displacement"}], "max_candidates": 8}}
        studies["optimum"] = {"id": program.finished(daemon, best)["result"]}
        values = {"/v1/results/{id}/optimum/scene": studies["optimum"], "/v1/results/{id}/calibration/scene": studies["calibration"], "/v1/results/{id}/table.{format}": sweep, "/v1/results/{id}/table": sweep,
                  "/v1/results/{id}/points/{index}": sweep, "/v1/results/{id}/points/{index}/scene": sweep,
                  "/v1/jobs/{id}/table.{format}": {"id": swept["id"]}, "/v1/jobs/{id}/table": {"id": swept["id"]},
                  **{f"/v1/results/{{id}}/{kind}{ending}": value for kind, value in studies.items()
                     for ending in ("", ".{format}")}, "/v1/results/{id}/tradeoff.{format}": tradeoff, "/v1/results/{id}/tradeoff": tradeoff,
                  "/v1/results/{id}/ensemble.{format}": ensemble, "/v1/results/{id}/ensemble": ensemble,
                  "/v1/results/{id}/impacts/{number}/force.{format}": {"number": "1"},
                  "/v1/results/{id}/impacts/{number}/force": {"number": "22"},
                  "/v1/jobs/{id}": {"id": job["id"]}, "/v1/jobs/{id}/events": {"id": job["id"]}, "/v1/jobs/{id}/scene": {"id": job["id"]},
                  **{f"/v1/records/{{name}}{rest}": {"name": "shake"} for rest in ("", "/samples", "/samples.{format}", "/spectrum", "/spectrum.{format}")},
                  **{f"/v1/materials/{{slug}}{rest}": {"slug": "sponge"} for rest in ("", "/revisions", "/history", "/diff", "/used-by")},
                  **{f"/v1/materials/{{slug}}@{{revision}}{rest}": {"slug": "sponge", "revision": "1"} for rest in ("", "/used-by")},
                  "/v1/examples/{name}": {"name": "paper_free_sponge"}, "/schemas/{name}": {"name": "scene"},
                  "/client/{file}": {"file": "impactd.py"}, "/web/{file}": {"file": "style.css"}, "/web/{folder}/{file}": {"folder": "js", "file": "main.js"},
                  "/guide/{file}": {"file": "problems.html"}, "/problems/{name}": {"name": "not-found"},
                  "/web/{folder}/{part}/{file}": {"folder": "vendor", "part": "htm", "file": "standalone.module.js"}}

        def call(method, path, target, **options):
            reply = daemon.request(method, target, **options)
            responses = operations()[method, path]["responses"]
            assert str(reply.status) in responses, (method, target, reply)
            called.add((method, path))
            statuses.add(reply.status)
            content = responses[str(reply.status)].get("content", {})
            kind = reply.headers.get("content-type", "").split(";")[0]
            assert kind in content if content else reply.body == b"", (method, target, reply)
            if kind.endswith("json"):
                found = faults(content[kind]["schema"], reply.json())
                assert not found, (method, target, found)
            promised = responses[str(reply.status)].get("headers", {})
            return {name for name in promised if name.lower() in reply.headers}

        shake = {"name": "shake", "interval": 0.02, "samples": [0, 1, -2, 1, 0]}
        assert call("POST", "/v1/records", "/v1/records", json=shake) == {"Location"}
        fragile = {**program.scene("no_damper"), "duration": 1, "study": {
            "kind": "fragility", "records": ["shake"], "levels": [1, 2], "limits": [{"metric": "peak_displacement", "value": 1}]}}
        del fragile["excitation"]  # the records take its place
        studies["fragility"] = {"id": program.finished(daemon, fragile)["result"]}
        values.update({f"/v1/results/{{id}}/fragility{ending}": studies["fragility"] for ending in ("", ".{format}")})

        drops = {"drops": [{"drop_height": 0.1, "rebound_height": 0.04, "contact_time": 0.001}]}
        measurements = "/v1/materials/{slug}/measurements"
        for body in (drops, {}):
            call("POST", measurements, "/v1/materials/sponge/measurements", json=body)
            call("POST", measurements, "/v1/materials/sponge/measurements?dry_run=1", json=body)
        call("POST", measurements, "/v1/materials/none/measurements", json=drops)
        call("POST", measurements, "/v1/materials/sponge/measurements", json=drops, headers={"If-Match": '"x"'})
        call("POST", measurements, "/v1/materials/sponge/measurements", body="{}")

        for (method, path), operation in operations().items():
            if method != "GET":
                continue
            formats = [p["schema"]["enum"] for p in operation.get("parameters", []) if p["name"] == "format"]
            for extension in formats[0] if formats else [None]:
                target = path.format(**{"id": job["result"], "format": extension, "slug": "sponge", "revision": "1",
                                           "number": "1", **values.get(path, {})})
                target += f"?a={job['result']}&b={studies['compare']['id']}" if path == "/v1/compare" else ""
                target += "?damper_mass=1" if path.endswith("/derived") else ""
                call(method, path, target)
                if "400" in operation["responses"]:
                    call(method, path, target.split("?")[0] + "?unknown=1")
            if "404" in operation["responses"] and "{" in path:
                call(method, path, re.sub(r"\{\w+\}", "0", path).replace(".0", ".json"))
            if "406" in operation["responses"]:
                call(method, path, target, headers={"Accept": "image/png"})
            if "304" in operation["responses"]:
                call(method, path, target, headers={"If-None-Match": "*"})
            if "206" in operation["responses"]:
                part, kind = ((target.rsplit(".", 1)[0] + ".npy", {}) if formats else
                              (target, {"Accept": "application/x-npy"}))
                call(method, path, part, headers={**kind, "Range": "bytes=0-9"})
                call(method, path, part, headers={**kind, "Range": "bytes=99999999-"})

        proposal, calibration = "/v1/results/{id}/calibration/proposal", studies["calibration"]["id"]
        for result, query in ((calibration, "?material=sponge"), (calibration, ""), (calibration, "?material=none"),
                              (job["result"], "?material=sponge"), (calibration, "?material=sponge&damper=2")):
            call("POST", proposal, f"/v1/results/{result}/calibration/proposal{query}")

        felt = {"slug": "felt", "name": "Felt", "restitution": 0.3, "contact_time": 0.02, "source": "here"}
        assert call("POST", "/v1/materials", "/v1/materials", json=felt) == {"Location", "ETag"}
        call("POST", "/v1/materials", "/v1/materials", json=felt)
        assert call("GET", "/v1/materials", "/v1/materials?limit=1") == {"Link"}
        revised = {**{name: value for name, value in felt.items() if name != "slug"}, "comment": "anew"}
        for path, body, good in (("", felt, None), ("/{slug}/revisions", revised, {"Location", "ETag"}),
                                 ("/{slug}/revert", {"to": 1, "comment": "back"}, {"Location", "ETag"}),
                                 ("/{slug}@{revision}/review", {"status": "approved", "reason": "fine"}, {"ETag"})):
            path, anyhow = "/v1/materials" + path, {"If-Match": "*"}
            target = path.format(slug="felt", revision="1")
            if good is not None:
                call("POST", path, target, json=body)
                call("POST", path, target, json=body, headers={"If-Match": '"felt@1-99"'})
                assert call("POST", path, target, json=body, headers=anyhow) == good, path
                call("POST", path, path.format(slug="none", revision="1"), json=body, headers=anyhow)
            if "review" in path:
                call("POST", path, target, json=body, headers=anyhow)
            call("POST", path, target, json={}, headers=anyhow)
            call("POST", path, target, body="{", headers={**anyhow, "Content-Type": "application/json"})
            call("POST", path, target, body="{}", headers=anyhow)
            call("POST", path, target, body=b" " * (1 << 24) + b"x", headers={**anyhow, "Content-Type": "application/json"})
        for rest in ("revisions", "history"):
            assert call("GET", f"/v1/materials/{{slug}}/{rest}", f"/v1/materials/felt/{rest}?limit=1") == {"ETag", "Link"}
        call("GET", "/v1/materials/{slug}/diff", "/v1/materials/felt/diff?from=1&to=2")
        for clearance in (0.013, 0.014):
            used = program.scene("paper_free_sponge")
            used["dampers"][0]["clearance"] = clearance
            program.finished(daemon, used)
        call("GET", "/v1/materials/{slug}/used-by", "/v1/materials/sponge/used-by?revision=1&limit=1")
        call("GET", "/v1/materials/{slug}@{revision}/used-by", "/v1/materials/sponge@1/used-by?limit=1")

        text = {"Content-Type": "text/plain"}
        assert call("POST", "/v1/records", "/v1/records", json=shake) == {"Location"}
        call("POST", "/v1/records", "/v1/records", json={**shake, "unit": "g"})
        call("POST", "/v1/records", "/v1/records", json={"name": "."})
        call("POST", "/v1/records", "/v1/records?name=file&interval=0.01&unit=g", body="0.1\n-0.2\n", headers=text)
        call("POST", "/v1/records", "/v1/records?name=file&interval=0.01&unit=g", body="0.1\nx\n", headers=text)
        call("POST", "/v1/records", "/v1/records?name=file", body="0.1\n", headers={"Content-Type": "image/png"})
        call("POST", "/v1/records", "/v1/records", body=b" " * (1 << 24) + b"x", headers=text)
        assert call("GET", "/v1/records", "/v1/records?limit=1") == {"Link"}
        for _ in range(2):
            call("DELETE", "/v1/records/{name}", "/v1/records/file")
        program.finished(daemon, {**program.scene("paper_free_sponge"), "excitation": {"kind": "record", "name": "shake"}})
        call("DELETE", "/v1/records/{name}", "/v1/records/shake")

        table, bring = {"Content-Type": "text/csv"}, "/v1/materials/import"
        for target in (bring + "?dry_run=1", bring):
            call("POST", bring, target, body="slug,name,source,restitution\nfelt,Felt,s,0.5\n", headers=table)
        call("POST", bring, bring, json=daemon.get("/v1/materials.json").json())
        call("POST", bring, bring, body="slug,restitution\nfelt,5\n", headers=table)
        call("POST", bring, bring, json=[])
        call("POST", bring, bring, body="{", headers={"Content-Type": "application/json"})
        call("POST", bring, bring, body="x", headers=text)
        call("POST", bring, bring, body=b" " * (1 << 24) + b"x", headers=table)

        call("GET", "/v1/results/{id}", f"/v1/results/{study['result']}")
        call("GET", "/v1/results/{id}", f"/v1/results/{many['result']}")
        call("GET", "/v1/results/{id}", f"/v1/results/{swept['result']}")
        failing = program.scene("paper_free_sponge")
        failing.update(accuracy={"solver": "rk4", "step": 1e-3},
                       study={"kind": "sweep", "axes": [{"pointer": "/dampers/0/buffer", "values": ["aluminium"]}]})
        failed = program.finished(daemon, failing)
        call("POST", "/v1/jobs/{id}/retry", f"/v1/jobs/{failed['id']}/retry")
        call("POST", "/v1/jobs/{id}/retry", f"/v1/jobs/{swept['id']}/retry")
        call("POST", "/v1/jobs/{id}/retry", "/v1/jobs/0/retry")
        call("POST", "/v1/jobs/{id}/retry", f"/v1/jobs/{failed['id']}/retry", headers={"Idempotency-Key": "\t"})
        many_points = program.scene("paper_random_sponge")
        many_points["study"] = {"kind": "sweep", "axes": [{"pointer": "/excitation/seed", "from": 1, "to": 3000,
                                                           "count": 3000}]}
        running = daemon.submit(many_points, headers={"Prefer": "respond-async"}).json()["id"]
        for _ in range(20):
            call("GET", "/v1/jobs/{id}", f"/v1/jobs/{running}?wait=0.05")
            call("GET", "/v1/jobs/{id}/table.{format}", f"/v1/jobs/{running}/table.json")
        call("GET", "/v1/jobs", "/v1/jobs")
        daemon.request("DELETE", f"/v1/jobs/{running}")
        for value in studies.values():
            call("GET", "/v1/results/{id}", f"/v1/results/{value['id']}")
        call("GET", "/v1/compare", "/v1/compare?a=r-0&b=r-0")
        measured = {"a": job["id"], "measured": {"samples": [0.1 * i for i in range(40)], "interval": 0.01}}
        call("POST", "/v1/compare", "/v1/compare", json=measured)
        call("POST", "/v1/compare", "/v1/compare", json={**measured, "a": "j-0"})
        call("POST", "/v1/compare", "/v1/compare", json={"a": job["id"]})
        call("POST", "/v1/compare", "/v1/compare", body="{", headers={"Content-Type": "application/json"})
        call("POST", "/v1/compare", "/v1/compare", body="{}")
        scene = program.scene("paper_random_sponge")
        slow = endless()
        call("POST", "/v1/jobs", "/v1/jobs", json=scene)
        call("POST", "/v1/jobs", "/v1/jobs?dry_run=1", json=scene)
        call("POST", "/v1/jobs", "/v1/jobs", json={})
        call("POST", "/v1/jobs", "/v1/jobs", body="{", headers={"Content-Type": "application/json"})
        call("POST", "/v1/jobs", "/v1/jobs", body="{}")
        call("POST", "/v1/jobs", "/v1/jobs", body=b" " * (1 << 24) + b"x", headers={"Content-Type": "application/json"})
        assert call("POST", "/v1/jobs", "/v1/jobs", json=slow, headers={"Prefer": "respond-async"}) == {
            "Location", "Retry-After", "Preference-Applied"}
        call("POST", "/v1/results/{id}/again", f"/v1/results/{job['result']}/again")
        call("POST", "/v1/results/{id}/again", "/v1/results/r-0/again")
        call("POST", "/v1/preview", "/v1/preview?points=10", json=scene)
        call("POST", "/v1/preview", "/v1/preview", json={})
        call("POST", "/v1/cache/explain", "/v1/cache/explain", json=scene)
        call("POST", "/v1/cache/explain", "/v1/cache/explain", json={**scene, "duration": 61})
        call("POST", "/v1/cache/explain", "/v1/cache/explain", json={})
        call("POST", "/v1/cache/explain", "/v1/cache/explain", body="{", headers={"Content-Type": "application/json"})
        call("POST", "/v1/cache/explain", "/v1/cache/explain", body="{}")
        call("POST", "/v1/cache/explain", "/v1/cache/explain", body=b" " * (1 << 24) + b"x",
             headers={"Content-Type": "application/json"})
        running = next(one["id"] for one in daemon.get("/v1/jobs").json()["jobs"] if one["status"] in ("accepted", "running"))
        call("GET", "/v1/jobs/{id}", f"/v1/jobs/{running}")
        call("GET", "/v1/compare", f"/v1/compare?a={running}&b={job['id']}")
        call("POST", "/v1/compare", "/v1/compare", json={**measured, "a": running})
        gone_early = program.finished(daemon, {**scene, "title": "gone"})
        call("DELETE", "/v1/jobs/{id}", f"/v1/jobs/{running}")
        call("DELETE", "/v1/jobs/{id}", f"/v1/jobs/{running}")
        call("DELETE", "/v1/jobs/{id}", "/v1/jobs/none")
        for body in ({"title": "x", "labels": {"a": "b"}}, {"title": 1}):
            call("PATCH", "/v1/jobs/{id}", f"/v1/jobs/{running}", json=body)
        call("DELETE", "/v1/jobs/{id}", f"/v1/jobs/{gone_early['id']}?purge=1")
        keyed = {"Idempotency-Key": '"one"'}
        call("POST", "/v1/jobs", "/v1/jobs", json=scene, headers=keyed)
        assert "Idempotency-Replayed" in call("POST", "/v1/jobs", "/v1/jobs", json=scene, headers=keyed)
        call("POST", "/v1/jobs", "/v1/jobs", json={**scene, "title": "T"}, headers=keyed)
        call("POST", "/v1/jobs", "/v1/jobs", json={**scene, "title": "T", "labels": {"a": "b"}})
        call("GET", "/v1/jobs/{id}/events", f"/v1/jobs/{job['id']}/events", headers={"Last-Event-ID": "20000"})
        gone = program.finished(daemon, program.scene("paper_free_aluminium"))
        for _ in range(2):
            call("DELETE", "/v1/results/{id}", f"/v1/results/{gone['result']}")
        call("GET", "/v1/jobs/{id}", f"/v1/jobs/{gone['id']}")
        assert call("GET", "/v1/jobs", "/v1/jobs?limit=1") == {"Link"}
        ids = [one["id"] for one in daemon.get("/v1/jobs?limit=100").json()["jobs"]]
        alike = next(one[:10] for one in ids if sum(other[:10] == one[:10] for other in ids) > 1)
        for method, path in operations():
            if method == "GET" and path.startswith(("/v1/jobs/{id}", "/v1/results/{id}")):
                short = job["id"][:31] if "jobs" in path else job["result"][:20]
                target = path.format(id="{}", number=1, index=1, format="json")
                assert call(method, path, target.format(short)) == {"Location"}, path
                if "jobs" in path:
                    call(method, path, target.format(alike))
    assert called == set(operations()), set(operations()) - called
    assert statuses >= {200, 201, 202, 206, 304, 307, 400, 404, 406, 409, 413, 415, 416, 422}, statuses


if __name__ == "__main__":
    program.main(globals())
