#!/usr/bin/env python3
"""Recorded traffic is what schema/openapi.json says, and all that it says was seen.

Reads the record that IMPACTD_RECORD names; without one it makes its own by running the tests that ask the most."""

import base64
import collections
import functools
import json
import os
import re
import subprocess
import sys
import tempfile
import urllib.parse

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

HERE = os.path.dirname(os.path.abspath(__file__))
with open(os.path.join(program.SOURCE, "schema", "openapi.json"), encoding="utf-8") as openapi:
    DOCUMENT = json.load(openapi)
# Answers that many operations share stand in one place.
for ITEM in DOCUMENT["paths"].values():
    for OPERATION in ITEM.values():
        OPERATION["responses"] = {
            status: DOCUMENT["components"]["responses"][answer["$ref"].rsplit("/", 1)[1]] if "$ref" in answer else answer
            for status, answer in OPERATION["responses"].items()}

# Tests that together see every operation.
SOURCES = ("test_openapi.py", "test_access.py", "test_auth.py", "test_bad_requests.py", "test_cache.py", "test_compare.py", "test_crowds.py",
           "test_exchange.py", "test_formats.py", "test_full_disk.py", "test_further_calls.py", "test_guide.py", "test_http.py", "test_jobs.py", "test_material_use.py",
           "test_materials.py", "test_measurements.py", "test_metrics.py", "test_records.py", "test_sensitivity.py",
           "test_serving.py", "test_sweep.py")

# The base paths that tests give their daemons; paths are taken with and without them.
BASES = ("/impactd", "/a/v1/b")

# On every answer, so that no operation names them.
EVERYWHERE = {"content-type", "content-length", "date", "connection", "cache-control", "vary", "accept-ranges",
              "transfer-encoding", "content-encoding", "keep-alive", "x-request-id", "x-content-type-options",
              "content-security-policy", "referrer-policy", "cross-origin-resource-policy", "x-frame-options",
              "cross-origin-opener-policy", "permissions-policy", "strict-transport-security", "www-authenticate",
              "access-control-allow-origin", "access-control-expose-headers"}

# What the document promises and no test can bring about at will: (method or None for any, patterns of paths and statuses) -> why.
READING = r"/v1/(compare|results/\{id\}/(series|psd|impacts|bundle).*)"
UNSEEN = {
    ("GET", r"/v1/results/\{id\}.*", "409"): "ids of two results that begin with the same 8 digits",
    (None, READING, "503"): "series that are still being computed anew after a minute, or too many impacts looked at at once",
    ("POST", r"/v1/preview", "503"): "more runs of almost 50 ms at once than there are threads for",
    ("GET", r"/v1/records/\{name\}/spectrum.*", "503"): "more spectra of long records at once than there are threads for",
    (None, r"/v1/materials/\{slug\}/(measurements.*|proposal.*)", "503"): "more long force traces at once than are evaluated",
    ("POST", r"/v1/results/\{id\}/again", "202|422|429|503|507"): "it submits as POST /v1/jobs does, where they are seen",
    ("POST", r"/v1/jobs/\{id\}/retry", "410|429|503|507"): "the same; 410: a sweep with failed points of another engine",
    (None, r"/v1/results/\{id\}/(series.*|bundle.zip)", "422"): "files of 2 or 4 GiB; unit/server/formats/test_encoders.c",
    (None, r"/v1/results/\{id\}/impacts/\{number\}/force.*", "422"): "states of more than 1 GB, or an impact of 1e-9 s",
}


def fits(entry, method, path, status):
    kind, pattern, codes = entry
    return kind in (None, method) and bool(re.fullmatch(codes, status) and re.fullmatch(pattern, path))


LARGE = 20000  # [B]

# Answered before any handler, in the same way everywhere: seen anywhere is seen.
CENTRAL = {"307", "401", "403", "421"}


def exchanges():
    """Every line of the record, once."""
    if not hasattr(exchanges, "kept"):
        given = os.environ.get("IMPACTD_RECORD")
        with tempfile.TemporaryDirectory() as folder:
            path = given if given and os.path.exists(given) else os.path.join(folder, "record")
            for name in SOURCES if path != given else ():
                done = subprocess.run([sys.executable, os.path.join(HERE, name), "--build", program.build],
                                      capture_output=True, text=True, check=False,
                                      env={**os.environ, "IMPACTD_RECORD": path})
                assert done.returncode == 0, done.stdout[-3000:]
            with open(path, encoding="utf-8") as file:
                exchanges.kept = [json.loads(line) for line in file]
    return exchanges.kept


TYPES = {"number": (int, float), "integer": int, "string": str, "boolean": bool, "object": dict, "array": list, "null": type(None)}
NOT_ASKING = {"type", "title", "description", "default", "examples", "x-unit"}


def is_plainly(schema, value):
    """Whether a schema asks for a type alone and the value is of it."""
    if not isinstance(schema, dict) or "type" not in schema or not schema.keys() <= NOT_ASKING:
        return False
    kinds = schema["type"] if isinstance(schema["type"], list) else [schema["type"]]
    return any(isinstance(value, TYPES[kind]) and (kind == "boolean" or not isinstance(value, bool)) for kind in kinds)


def patient(jsonschema):
    """The library's validator, which takes long over each value: those that are plainly right it is not asked about."""
    own = jsonschema.Draft202012Validator.VALIDATORS

    def items(validator, asked, value, schema):
        if "prefixItems" in schema or not isinstance(value, list) or not all(is_plainly(asked, one) for one in value):
            yield from own["items"](validator, asked, value, schema)

    def properties(validator, asked, value, schema):
        if isinstance(value, dict):
            asked = {name: one for name, one in asked.items() if name in value and not is_plainly(one, value[name])}
        yield from own["properties"](validator, asked, value, schema)
    return jsonschema.validators.extend(jsonschema.Draft202012Validator, {"items": items, "properties": properties})


def validator():
    """Judges a value by a schema of the document: a function that returns the faults."""
    try:
        import jsonschema
    except ImportError as error:
        raise program.Skipped(f"python3-jsonschema is not here: {error}") from None
    store = {}
    for name in os.listdir(os.path.join(program.SOURCE, "schema")):
        if name.endswith(".schema.json"):
            with open(os.path.join(program.SOURCE, "schema", name), encoding="utf-8") as file:
                schema = json.load(file)
            jsonschema.Draft202012Validator.check_schema(schema)
            store[schema["$id"]] = store["/schemas/" + name.split(".")[0]] = schema
    resolver = jsonschema.RefResolver("", DOCUMENT, store=store)
    Validator = patient(jsonschema)

    def judge(schema, value):
        found = Validator(schema, resolver=resolver).iter_errors(value)
        return [f"/{'/'.join(map(str, fault.path))}: {fault.message[:300]}" for fault in list(found)[:3]]
    return judge


def pattern_of(template, item):
    """(letters that must be so, pattern) of a path template."""
    parts = re.split(r"(\{\w+\})", template)
    names = {p["name"]: p["schema"].get("enum") for one in item.values() for p in one.get("parameters", []) if p["in"] == "path"}
    pattern = "".join(
        (f"(?:{'|'.join(map(re.escape, names[part[1:-1]]))})" if names.get(part[1:-1]) else "[^/]+?")
        if part.startswith("{") else re.escape(part) for part in parts)
    return sum(len(part) for part in parts if not part.startswith("{")), re.compile(pattern)


PATTERNS = [(template, *pattern_of(template, item)) for template, item in DOCUMENT["paths"].items()]


@functools.lru_cache(maxsize=None)
def template_of(path):
    """The path template that fits; of two the more literal one. None if there is none."""
    fitting = [(literal, template) for template, literal, pattern in PATTERNS if pattern.fullmatch(path)]
    return max(fitting)[1] if fitting else None


def operation_of(method, path):
    """(path template, operation) that answers. None if there is none."""
    path = urllib.parse.unquote(re.split("[?#]", path)[0])
    for base in BASES:
        path = path.removeprefix(base)
    template = template_of(path or "/")
    operation = DOCUMENT["paths"][template].get({"HEAD": "get"}.get(method, method.lower())) if template else None
    return (template, operation) if operation else None


def media(headers, name="content-type"):
    return headers.get(name, "").split(";")[0].strip().lower()


def tell(found):
    assert not found, f"{len(found)} faults\n" + "\n".join(sorted(set(found))[:40])


def test_every_answer_is_declared():
    """Status, content type and headers of every recorded answer stand in the document."""
    found = []
    assert len(exchanges()) > 100, len(exchanges())
    for one in exchanges():
        name = f"{one['method']} {one['path'][:100]} -> {one['status']}"
        match = operation_of(one["method"], one["path"])
        kind = media(one["answer_headers"])
        if match is None:
            # A slash too many at the end of a path, and the preflights of CORS: of all paths.
            if one["status"] == 308 or (one["method"], one["status"]) == ("OPTIONS", 204):
                continue
            if one["status"] < 400 or kind not in ("application/problem+json", "") or one["status"] >= 500 and \
                    one["status"] not in (501, 505):
                found.append(f"{name}: answered, and not in the document")
            continue
        answer = match[1]["responses"].get(str(one["status"]))
        if answer is None and one["status"] == 400 and "pretty=" in one["path"]:
            continue  # no 0 or 1: of all paths
        if answer is None:
            found.append(f"{name}: the status is not declared for {match[0]}")
            continue
        content = answer.get("content", {})
        if (kind not in content if content else one["size"] > 0):
            found.append(f"{name}: {kind or 'no type'} is not declared for {match[0]}")
        # A 304 and a 206 have what their 200 would have had (RFC 9110, 15.3.7 and 15.4.5).
        kin = match[1]["responses"].get("200", {}) if one["status"] in (206, 304) else {}
        declared = {header.lower() for header in [*answer.get("headers", {}), *kin.get("headers", {})]}
        found += [f"{name}: the header {header} is not declared for {match[0]}"
                  for header in one["answer_headers"] if header not in declared | EVERYWHERE]
    tell(found)


def test_every_json_body_fits_its_schema():
    """Every recorded answer of JSON is valid by the schema of its status, as JSON Schema 2020-12."""
    judge, found, count = validator(), [], 0
    judged, large = set(), collections.Counter()
    for one in exchanges():
        match = operation_of(one["method"], one["path"])
        kind = media(one["answer_headers"])
        if match is None or "json" not in kind or one["method"] == "HEAD" or one["answer"] is None:
            continue
        content = match[1]["responses"].get(str(one["status"]), {}).get("content", {})
        if kind in content:
            count += 1
            key = (one["method"], match[0], one["status"])
            large[key] += one["size"] > LARGE
            # Each answer once, and of each kind of large ones some.
            if (key, one["answer"]) in judged or one["size"] > LARGE and large[key] > 20:
                continue
            judged.add((key, one["answer"]))
            value = json.loads(base64.b64decode(one["answer"]))
            found += [f"{one['method']} {one['path'][:100]} -> {one['status']}: {fault}"
                      for fault in judge(content[kind]["schema"], value)]
    assert count > 100, count
    tell(found)


def test_bodies_that_were_taken_fit_their_schema():
    """Every recorded request that was taken is of a type that is declared and valid by that type's schema."""
    judge, found, count, judged = validator(), [], 0, set()
    for one in exchanges():
        match = operation_of(one["method"], one["path"])
        if match is None or one["body"] is None or one["status"] not in (200, 201, 202):
            continue
        content = match[1].get("requestBody", {}).get("content", {})
        kind = media(one["headers"])
        if kind not in content:
            found.append(f"{one['method']} {one['path'][:100]}: a body of {kind} was taken")
            continue
        if "json" not in kind:
            continue
        count += 1
        key = (one["method"], match[0], kind, one["body"])
        if key in judged:
            continue
        judged.add(key)
        found += [f"{one['method']} {one['path'][:100]}: {fault}"
                  for fault in judge(content[kind]["schema"], json.loads(base64.b64decode(one["body"])))]
    assert count > 10, count
    tell(found)


def test_parameters_that_were_taken_are_declared():
    """Every query of a request that was answered well is declared, and valid where it has a schema."""
    found = []
    for one in exchanges():
        match = operation_of(one["method"], one["path"])
        if match is None or one["status"] >= 400 or re.match(r"/$|/(web|guide|client|favicon\.ico)\b", match[0]):
            continue  # pages for people ignore queries
        declared = {p["name"] for p in match[1].get("parameters", []) if p["in"] == "query"}
        given = urllib.parse.parse_qs(urllib.parse.urlsplit(one["path"]).query, keep_blank_values=True)
        found += [f"{one['method']} {one['path'][:100]}: the query {name} is not declared" for name in given
                  if name not in declared | {"pretty"}]
    tell(found)


def test_all_that_is_declared_was_seen():
    """Each operation was asked, and each status it declares seen, but for the few that have a reason not to be."""
    seen = set()
    for one in exchanges():
        match = operation_of(one["method"], one["path"])
        if match is not None:
            seen.add(({"HEAD": "GET"}.get(one["method"], one["method"]), match[0], str(one["status"])))
    everywhere = {status for _, _, status in seen} & CENTRAL
    missing = []
    for path, item in DOCUMENT["paths"].items():
        for method, operation in item.items():
            missing += [f"{method.upper()} {path} {status}" for status in operation["responses"]
                        if (method.upper(), path, status) not in seen and status not in everywhere
                        and not any(fits(entry, method.upper(), path, status) for entry in UNSEEN)]
    tell(missing)
    declared = {(method.upper(), path, status) for path, item in DOCUMENT["paths"].items()
                for method, operation in item.items() for status in operation["responses"]}
    tell([f"nothing declares {entry}" for entry in UNSEEN if not any(fits(entry, *one) for one in declared)])


if __name__ == "__main__":
    program.main(globals())
