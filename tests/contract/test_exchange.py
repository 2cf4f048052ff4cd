#!/usr/bin/env python3
"""All materials out and in: what is exported comes back to the byte, and nothing is brought in by halves."""

import concurrent.futures
import json
import os
import random
import shutil
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from access import bearer, token  # noqa: E402
from asking import problem  # noqa: E402
from materials import bring, export, laboratory, records, table_of  # noqa: E402

PAPER = {"aluminium", "hard_acrylic", "hard_rubber", "soft_rubber", "sponge"}


def counts(reply):
    assert reply.status == 200, reply
    told = reply.json()
    return {kind: (told[kind]["added"], told[kind]["same"]) for kind in ("revisions", "measurements", "reviews")}


def said(document):
    """{slug: material} of a document."""
    return {one["slug"]: one for one in document["materials"]}


def test_own_export_changes_nothing():
    """Importing a database's own export, as either kind, adds nothing and leaves every version as it was."""
    with program.daemon() as daemon:
        before = daemon.get("/v1/materials/sponge").headers["etag"]
        for kind in ("json", "csv"):
            assert counts(bring(daemon, export(daemon, kind))) == {"revisions": (0, 5), "measurements": (0, 0), "reviews": (0, 5)}
        assert daemon.get("/v1/materials/sponge").headers["etag"] == before
        assert {one["slug"] for one in json.loads(export(daemon))["materials"]} == PAPER


def test_round_trips_are_the_same_bytes():
    """Odd texts, tables, drop tests, traces, reverts and reviews come back from a fresh database byte for byte, both ways."""
    document = laboratory(1, 40)
    with program.daemon() as daemon:
        first = counts(bring(daemon, document))
        assert first["revisions"][0] == sum(len(one["revisions"]) for one in document["materials"])
        sponge = daemon.get("/v1/materials/sponge")
        made = daemon.request("POST", "/v1/materials/sponge/revisions", headers={"If-Match": sponge.headers["etag"]},
                              json={"name": "Sponge", "restitution": 0.6, "source": "again", "comment": "measured anew"})
        assert made.status == 201, made
        made = daemon.request("POST", "/v1/materials/sponge/measurements", json={
            "comment": "by hand", "impactor": "ball, \"30 mm\"", "drops": [{"drop_height": 0.05, "rebound_height": 0.018}]})
        assert made.status == 201, made
        text, table = export(daemon), export(daemon, "csv")
    back = said(json.loads(text))
    assert back["sponge"]["revisions"][1]["comment"] == "measured anew"
    assert back["sponge"]["measurements"][0]["test"]["impactor"] == 'ball, "30 mm"'
    for one in document["materials"]:
        there = back[one["slug"]]
        assert len(there["revisions"]) == len(one["revisions"])
        for a, b in zip(one["revisions"], there["revisions"]):
            assert b == a, (a, b)
        for a, b in zip(one["measurements"], there.get("measurements", [])):
            assert b == a, (a, b)
    for body in (text, table):
        with program.daemon() as daemon:
            bring(daemon, body)
            assert export(daemon) == text
            assert export(daemon, "csv") == table
            assert counts(bring(daemon, text))["revisions"][0] == counts(bring(daemon, table))["revisions"][0] == 0


def test_a_lab_brings_its_spreadsheet():
    """A few columns in any order, either end of line, a byte order mark, units or none: read, and read again without effect."""
    rows = [["source", "contact_time [s]", "slug", "name", "restitution", "tags"],
            ["own test, 2026", "0.02", "felt", "Felt, grey", ".5", '["a"]'], [], ["=1+1", " 3e-3 ", "cork", "Cork", "+0.4", ""]]
    for number, body in enumerate([table_of(rows), table_of(rows, "\n"), b"\xef\xbb\xbf" + table_of(rows), table_of(rows).rstrip()]):
        with program.daemon() as daemon:
            assert counts(bring(daemon, body, dry=True))["revisions"] == (2, 0)
            assert counts(bring(daemon, body))["revisions"] == (2, 0)
            assert counts(bring(daemon, body))["revisions"] == (0, 2), number
            felt = daemon.get("/v1/materials/felt").json()
            assert (felt["name"], felt["restitution"], felt["contact_time"], felt["tags"]) == ("Felt, grey", 0.5, 0.02, ["a"])
            assert (felt["status"], felt["author"], felt["comment"]) == ("draft", None, "imported")
            assert daemon.get("/v1/materials/cork").json()["source"] == "=1+1"
            changed = body.replace(b"0.02", b"0.03")
            assert counts(bring(daemon, changed))["revisions"] == (1, 1)
            assert [one["revision"] for one in said(json.loads(export(daemon)))["felt"]["revisions"]] == [1, 2]
            trail = daemon.get("/v1/materials/felt/history").json()["history"]
            assert [one["action"] for one in trail] == ["import", "import"], trail


def test_a_file_may_come_again():
    """A test without a number that is there, by hand or from a file, is not taken twice; once more in the file is a fault."""
    test = {"impactor_mass": 0.11, "base": "fixed", "drops": [{"approach_speed": 0.5, "rebound_speed": 0.2, "contact_time": 0.01}]}
    other = {**test, "date": "2026-11-20"}

    def document(*measurements):
        return {"format": "impactd-materials", "version": 1, "materials": [{"slug": "sponge", "measurements": list(measurements)}]}

    with program.daemon() as daemon:
        made = daemon.request("POST", "/v1/materials/sponge/measurements", json={"comment": "by hand", **test})
        assert made.status == 201, made
        for done in ((1, 1), (0, 2), (0, 2)):
            assert counts(bring(daemon, document({"test": test}, {"test": other}), dry=True))["measurements"] == done
            assert counts(bring(daemon, document({"test": test}, {"test": other})))["measurements"] == done
        problem(bring(daemon, document({"measurement": 1, "test": test}, {"test": test})), 422, "/materials/0/measurements/1/test")
        # Who did it twice says so by its number, and is reminded of it.
        assert "once more" not in daemon.get("/v1/materials/sponge/proposal").body.decode()
        assert counts(bring(daemon, document({"measurement": 3, "test": test})))["measurements"] == (1, 0)
        told = [one for one in daemon.get("/v1/materials/sponge/proposal").json()["warnings"] if "once more" in one["detail"]]
        assert len(told) == 1 and told[0]["pointer"] == "/measurements/3" and "measurement 1 " in told[0]["detail"], told


def test_what_is_stored_never_changes():
    """A numbered row that differs from the stored one in its test, time, comment, reverts or reviews is refused at that place."""
    test = {"impactor_mass": 0.11, "base": "fixed", "drops": [{"approach_speed": 0.5, "rebound_speed": 0.2, "contact_time": 0.01}]}
    first = {"revision": 1, "name": "Felt", "source": "us", "restitution": 0.5, "created": "2026-01-01T00:00:00Z", "comment": "new",
             "reviews": [{"status": "approved", "reason": "ok", "reviewer": "ana", "created": "2026-01-03T00:00:00Z"}]}
    second = {**first, "revision": 2, "restitution": 0.6, "created": "2026-01-02T00:00:00Z", "reviews": []}
    third = {**first, "revision": 3, "created": "2026-01-04T00:00:00Z", "reviews": [], "reverts": 1}
    measured = {"measurement": 1, "test": test, "created": "2026-01-01T00:00:00Z"}

    def document(*revisions, measurement=measured):
        one = {"slug": "felt", "measurements": [measurement], "revisions": list(revisions)}
        return {"format": "impactd-materials", "version": 1, "materials": [one]}

    with program.daemon() as daemon:
        assert counts(bring(daemon, document(first, second)))["revisions"] == (2, 0)
        # What it reverts to is stored; here it has other contents.
        place = "/materials/0/revisions/0/reverts"
        problem(bring(daemon, document({**third, "reverts": 2})), 422, place)
        problem(bring(daemon, document(third, {**third, "revision": 4, "reverts": 2})), 422, "/materials/0/revisions/1/reverts")
        # And here it is in the file, and cannot be read.
        faults = problem(bring(daemon, document({**third, "restitution": 7}, {**third, "revision": 4, "reverts": 3})), 422)["errors"]
        assert [fault["pointer"] for fault in faults] == ["/materials/0/revisions/0/restitution"], faults
        assert counts(bring(daemon, document(third)))["revisions"] == (1, 0)
        before = export(daemon)
        review = first["reviews"][0]
        for at, changed in (("created", {**first, "created": "2026-01-01T00:00:01Z"}), ("comment", {**first, "comment": "old"}),
                            ("author", {**first, "author": "bob"}), ("reverts", {**third, "reverts": 2}), ("restitution", {**first, "restitution": 0.4}),
                            ("reviews/0", {**first, "reviews": [{**review, "reviewer": "bob"}]}),
                            ("reviews/0", {**first, "reviews": [{**review, "reason": "fine"}]}),
                            ("reviews/0", {**first, "reviews": [{**review, "created": "2026-01-03T00:00:01Z"}]})):
            (fault,) = problem(bring(daemon, document(changed)), 422, "/materials/0/revisions/0/" + at)["errors"]
            assert "never change" in fault["detail"], fault
        for at, changed in (("test", {**measured, "test": {**test, "impactor_mass": 0.12}}), ("created", {**measured, "created": "2026-01-05T00:00:00Z"})):
            (fault,) = problem(bring(daemon, document(measurement=changed)), 422, "/materials/0/measurements/0/" + at)["errors"]
            assert "never changes" in fault["detail"], fault
        assert export(daemon) == before


# Faults, each in a row or material of its own: (what, where it is told).

def table_faults(draw, rows, k):
    """Puts k faults into the table; the (row, column) of each."""
    header = rows[0]
    at = {name.split(" ")[0]: i for i, name in enumerate(header)}
    free = list(range(1, len(rows)))
    draw.shuffle(free)
    places, extra = set(), []

    def pick(fits):
        for one in free:
            if fits({name: rows[one][i] for name, i in at.items()}):
                free.remove(one)
                return one
        raise AssertionError("no row fits")

    def own(row):
        return row["slug"] not in PAPER and row["row"] == "revision"

    def put(fits, column, value):
        one = pick(fits)
        rows[one][at[column]] = value
        places.add((one + 1, column))

    def again():
        one = pick(own)
        extra.append(list(rows[one]))
        places.add((len(rows) + len(extra), "number"))

    def colour():
        name = "colour%d" % len(rows[0])
        for i, row in enumerate(rows):
            row.append(name if i == 0 else "blue")
        for row in extra:
            row.append("blue")
        places.add((1, name))

    def plain(row):
        return own(row) and row["restitution"] != ""

    ways = [lambda: put(plain, "restitution", "1.5"), lambda: put(plain, "contact_time", "-1"), lambda: put(own, "thickness", "0"),
            lambda: put(plain, "contact_time", "soon"), lambda: put(own, "impactor_mass", "0,11"), lambda: put(own, "name", ""),
            lambda: put(own, "source", "   "), lambda: put(own, "created", "2026-13-01"), lambda: put(own, "base", "glued"),
            lambda: put(own, "tags", '["a"'), lambda: put(own, "tags", "[1]"), lambda: put(own, "measurements", "[99]"),
            lambda: put(lambda row: own(row) and row["number"] == "2", "number", "7"), lambda: put(own, "number", "first"),
            lambda: put(lambda row: row["slug"].startswith("lone"), "slug", "Foam X"), lambda: put(own, "row", "revisoin"),
            lambda: put(lambda row: row["slug"] in PAPER, "restitution", "0.99"), lambda: put(own, "reviews", '[{"status": "good", "reason": "x"}]'),
            lambda: put(lambda row: row["slug"] in PAPER, "notes", "said later"), lambda: put(own, "reverts", "9"),
            lambda: put(lambda row: row["row"] == "measurement", "test", '{"drops": [{"drop_height": 1, "rebound_height": 2}]}'),
            lambda: put(lambda row: row["row"] == "measurement", "restitution", "0.5"), lambda: put(own, "test", "{}"), again, colour]
    for way in draw.sample(ways, k):
        way()
    return rows + extra, places


def base_rows(daemon_table, document_table):
    """The paper's five, a laboratory with two revisions each, and materials of one revision alone."""
    rows = records(daemon_table)
    own = records(document_table)
    return rows + [row for row in own[1:] if row[1] not in PAPER]


def laboratory_of_faults():
    document = laboratory(5, 25, revisions=2)
    lone = laboratory(6, 6, revisions=1)["materials"]
    for i, one in enumerate(lone):
        one.update(slug="lone_%d" % i, measurements=[])
        one["revisions"][0].pop("measurements", None)
    for one in document["materials"]:
        one["measurements"] = one["measurements"] or laboratory(7, 1)["materials"][0]["measurements"][:0]
    document["materials"] += lone
    return document


def test_every_fault_of_a_table_is_told():
    """k = 1 to 10 faults of 25 kinds in a table, 20 seeds each: all k with row and column, no other, and nothing is changed."""
    with program.daemon() as maker:
        counts(bring(maker, laboratory_of_faults()))
        table = export(maker, "csv")
    with program.daemon() as daemon:
        before = export(daemon)
        for k in range(1, 11):
            for seed in range(20 if not program.is_sanitized() else 4):
                rows, places = table_faults(random.Random(100 * k + seed), records(table), k)
                told = problem(bring(daemon, table_of(rows), dry=seed % 2 == 0), 422)
                found = {(fault["row"], fault["column"]) for fault in told["errors"]}
                assert found == places and len(told["errors"]) == k, (k, seed, sorted(found ^ places), told["errors"])
        assert export(daemon) == before


def document_faults(draw, document, k):
    """Puts k faults into the document; the pointer of each."""
    materials = document["materials"]
    free = list(range(len(materials)))
    draw.shuffle(free)
    places = []

    def pick(fits):
        for one in free:
            if fits(materials[one]):
                free.remove(one)
                return one
        raise AssertionError("no material fits")

    def own(one):
        return one["slug"] not in PAPER

    def said_by(fits, name, value, place=None, number=0):
        one = pick(fits)
        materials[one]["revisions"][number][name] = value
        places.append(f"/materials/{one}/revisions/{number}/{place or name}")

    def plain(one):
        return own(one) and "restitution" in one["revisions"][0]

    def tested(one):
        return own(one) and len(one.get("measurements", [])) > 0

    def test(name, value, place):
        one = pick(tested)
        materials[one]["measurements"][0][name] = value
        places.append(f"/materials/{one}/measurements/0/{place}")

    def slug(value):
        one = pick(own)
        materials[one]["slug"] = value
        places.append(f"/materials/{one}/slug")

    def again():
        one = pick(own)
        materials.append(json.loads(json.dumps({**materials[one], "revisions": materials[one]["revisions"][:1], "measurements": []})))
        places.append(f"/materials/{len(materials) - 1}/revisions/0/revision")

    def missing(name):
        one = pick(own)
        del materials[one]["revisions"][0][name]
        places.append(f"/materials/{one}/revisions/0/{name}")

    def version():
        document["version"] = 2
        places.append("/version")

    ways = [lambda: said_by(plain, "restitution", -0.1), lambda: said_by(plain, "contact_time", 0), lambda: said_by(plain, "contact_time", "1"),
            lambda: said_by(own, "name", 5), lambda: said_by(own, "colour", "blue"), lambda: missing("name"), lambda: missing("source"),
            lambda: said_by(own, "created", "yesterday"), lambda: said_by(own, "base", "glued"), lambda: said_by(own, "tags", ["a", 1], "tags/1"),
            lambda: said_by(own, "measurements", [99], "measurements/0"), lambda: said_by(lambda one: own(one) and len(one["revisions"]) == 2, "revision", 9, None, 1),
            lambda: said_by(own, "revision", 0), lambda: slug("Foam X"), lambda: slug(""), lambda: slug("import"), again, version,
            lambda: said_by(lambda one: one["slug"] in PAPER, "restitution", 0.99), lambda: said_by(lambda one: one["slug"] in PAPER, "comment", "other"),
            lambda: said_by(own, "reviews", [{"status": "approved", "reason": "x", "reviewer": 1}], "reviews/0/reviewer"),
            lambda: said_by(own, "reviews", [{"status": "approved", "reason": "x"}] * 2, "reviews/1/status"),
            lambda: said_by(lambda one: one["slug"] in PAPER, "reviews", [{"status": "approved", "reason": "better"}], "reviews/0"),
            lambda: test("test", {"drops": [{"drop_height": 1, "rebound_height": 2}]}, "test/drops/0/rebound_height"),
            lambda: test("measurement", 1.5, "measurement"), lambda: test("weather", "fine", "weather")]
    for way in draw.sample(ways, k):
        way()
    return places


def test_every_fault_of_a_document_is_told():
    """The same for documents: every fault at its JSON Pointer."""
    with program.daemon() as maker:
        counts(bring(maker, laboratory_of_faults()))
        text = export(maker)
    with program.daemon() as daemon:
        before = export(daemon)
        for k in range(1, 11):
            for seed in range(20 if not program.is_sanitized() else 4):
                document = json.loads(text)
                places = document_faults(random.Random(100 * k + seed), document, k)
                told = problem(bring(daemon, document, dry=seed % 2 == 0), 422)
                found = [fault["pointer"] for fault in told["errors"]]
                assert sorted(found) == sorted(places), (k, seed, sorted(set(found) ^ set(places)), told["errors"])
        assert export(daemon) == before


def test_faults_beyond_a_hundred_are_counted():
    """150 faulty rows: a hundred are told with their places, the others counted; a file cut in two is told where."""
    rows = [["slug", "name", "source", "restitution"]] + [["m%d" % i, "M", "s", "2"] for i in range(150)]
    with program.daemon() as daemon:
        told = problem(bring(daemon, table_of(rows)), 422)
        assert len(told["errors"]) == 100 and told["more"] == 50 and told["title"] == "The file has 150 faults", told["title"]
        assert told["type"] == "/problems/bad-request", told["type"]
        assert told["detail"].startswith("row 2, column restitution: "), told["detail"]
        text = export(daemon)
        told = problem(bring(daemon, text[:-40]), 400)
        assert told["errors"][0]["pointer"].startswith("/materials/4/"), told
        table = export(daemon, "csv")
        told = problem(bring(daemon, table[:table.rindex(b'"')]), 422)
        assert (6, "reviews") in {(fault["row"], fault["column"]) for fault in told["errors"]}, told


def test_two_faults_of_a_row_are_both_told():
    """Faults in one row are each told, what cannot be read beside what is otherwise in the database."""
    with program.daemon() as daemon:
        rows = records(export(daemon, "csv"))
        at = {name.split(" ")[0]: i for i, name in enumerate(rows[0])}
        rows[5][at["restitution"]] = "much"
        rows[5][at["name"]] = "Schwamm"
        rows[5][at["created"]] = "2026"
        rows[5][at["tags"]] = '["soft"]'
        told = problem(bring(daemon, table_of(rows)), 422)
        assert {(fault["row"], fault["column"]) for fault in told["errors"]} == \
            {(6, name) for name in ("restitution", "name", "created", "tags")}, told


def test_what_is_no_file_of_materials_is_refused():
    """Other formats, types, separators, encodings and sizes are refused with what would be right."""
    with program.daemon() as daemon:
        assert problem(daemon.get("/v1/materials.xlsx"), 404)["detail"].count("materials.csv") == 1
        assert problem(daemon.request("POST", "/v1/materials/import", body="x", headers={"Content-Type": "text/plain"}), 415)
        problem(daemon.request("POST", "/v1/materials/import", headers={"Content-Type": "text/csv"}), 400)
        problem(daemon.request("POST", "/v1/materials/import?dry_run=maybe", body="slug", headers={"Content-Type": "text/csv"}), 400)
        assert "commas" in problem(bring(daemon, b"slug;name;restitution\nx;X;0,5\n"), 422)["detail"]
        told = problem(bring(daemon, "slug,name,restitution,source\nx,Wei\u00df,0.5,s\n".encode("latin-1")), 422)
        assert [(fault["row"], fault["column"]) for fault in told["errors"]] == [(2, "name")] and "UTF-8" in told["detail"], told
        assert [fault["column"] for fault in problem(bring(daemon, b"name,restitution\nX,0.5\n"), 422)["errors"]] == ["slug"]
        assert problem(bring(daemon, b"slug,contact_time [ms]\nx,5\n"), 422)["errors"][0]["unit"] == "s"
        problem(bring(daemon, {"materials": []}), 422, "/format", "/version")
        problem(bring(daemon, {"format": "impactd-materials", "version": 1}), 422, "/materials")
        problem(bring(daemon, {"format": "impactd-materials", "version": 1, "materials": [5, {"slug": "x"}]}), 422, "/materials/0", "/materials/1")
        problem(bring(daemon, b'{"format": "impactd-materials", "version": 1, "materials": [{"slug": "x"},]}'), 400)
        problem(bring(daemon, b"{" * 40), 400)
        assert len(json.loads(export(daemon))["materials"]) == 5
    with program.daemon("--max-body", "1024") as daemon:
        assert "--max-body" in problem(bring(daemon, b"x" * 1025), 413)["detail"]
        assert "--max-body" in problem(bring(daemon, b"x" * 100000), 413)["detail"]


def test_who_may_bring_what():
    """With tokens, what is by others and reviews are an admin's to bring; what has no author is the importer's; the trail says who."""
    folder = tempfile.mkdtemp(prefix="impactd-")
    anna, boss, reader = (bearer(token(folder, name, scopes)) for name, scopes in
                          (("anna", "read,materials"), ("boss", "admin"), ("eve", "read")))
    plain = b"slug,name,restitution,source\nfelt,Felt,0.5,own\n"
    with program.daemon(data=folder) as daemon:
        problem(bring(daemon, plain, headers=reader), 403)
        assert bring(daemon, plain, headers=anna).status == 200
        felt = daemon.get("/v1/materials/felt", headers=anna).json()
        assert felt["author"] == "anna" and felt["status"] == "draft", felt
        assert daemon.get("/v1/materials/felt/history", headers=anna).json()["history"][0]["who"] == "anna"
        before = export(daemon, headers=anna)
        by_others = b"slug,name,restitution,source,author\ncork,Cork,0.5,own,bert\n"
        told = problem(bring(daemon, by_others, headers=anna), 403)
        assert told["errors"][0]["row"] == 2 and told["errors"][0]["column"] == "author", told
        reviewed = plain.replace(b"source", b"source,reviews").replace(b"own", b'own,"[{""status"": ""approved"", ""reason"": ""good"", ""reviewer"": ""%s""}]"')
        problem(bring(daemon, reviewed % b"anna", headers=anna), 422)
        problem(bring(daemon, reviewed % b"boss", headers=anna), 403)
        problem(bring(daemon, reviewed % b"boss", headers=anna, dry=True), 403)
        assert export(daemon, headers=anna) == before
        # Its own export has the authors that are there.
        assert counts(bring(daemon, before, headers=anna))["revisions"] == (0, 6)
        assert counts(bring(daemon, reviewed % b"boss", headers=boss))["reviews"] == (1, 0)
        felt = daemon.get("/v1/materials/felt", headers=anna).json()
        assert felt["status"] == "approved" and felt["review"]["reviewer"] == "boss", felt
        assert counts(bring(daemon, by_others, headers=boss))["revisions"] == (1, 0)
        assert daemon.get("/v1/materials/cork", headers=anna).json()["author"] == "bert"
        # Not even an admin brings somebody's approval of their own.
        own = by_others.replace(b"author", b"author,reviews").replace(
            b"bert", b'bert,"[{""status"": ""approved"", ""reason"": ""good"", ""reviewer"": ""bert""}]"').replace(b"cork", b"cork2")
        told = problem(bring(daemon, own, headers=boss), 422)
        assert told["errors"][0]["column"] == "reviews" and "their own" in told["detail"], told
        # Nor their own by nobody's name: boss wrote it, and nobody is known to have read it.
        for name in ("boss", None):
            by_nobody = {"slug": "own", "revisions": [{"name": "Own", "restitution": 0.5, "source": "s", "reviews": [
                {"status": "approved", "reason": "good", "reviewer": None}], **({"author": name} if name else {})}]}
            told = problem(bring(daemon, {"format": "impactd-materials", "version": 1, "materials": [by_nobody]}, headers=boss), 422)
            assert told["errors"][0]["pointer"] == "/materials/0/revisions/0/reviews/0/reviewer", told
        # Times are an admin's to bring, too, and none lies ahead or before what was reviewed.
        dated = b"slug,name,restitution,source,created\nlint,Lint,0.5,own,%s\n"
        told = problem(bring(daemon, dated % b"1999-01-01", headers=anna), 403)
        assert told["errors"][0]["column"] == "created", told
        assert problem(bring(daemon, dated % b"2999-01-01", headers=boss), 422)["errors"][0]["column"] == "created"
        early = dated.replace(b"created\n", b"created,reviews\n").replace(
            b"%s", b'%s,"[{""status"": ""deprecated"", ""reason"": ""x"", ""created"": ""1998-01-01""}]"')
        assert problem(bring(daemon, early % b"1999-01-01", headers=boss), 422)["errors"][0]["column"] == "reviews"
        assert counts(bring(daemon, dated % b"1999-01-01", headers=boss))["revisions"] == (1, 0)
        assert daemon.get("/v1/materials/lint", headers=anna).json()["created"] == "1999-01-01T00:00:00.000Z"
        whole = export(daemon, headers=anna)
    with program.daemon() as other:
        assert bring(other, whole).status == 200
        assert export(other) == whole
    shutil.rmtree(folder)


def test_dry_run_tells_what_would_be():
    """A dry run counts what an import adds and what is there, and leaves export, versions and tags alone."""
    document = laboratory(9, 10)
    with program.daemon() as daemon:
        before, tag = export(daemon), daemon.get("/v1/materials/sponge").headers["etag"]
        dry = bring(daemon, document, dry=True).json()
        assert dry["dry_run"] is True and export(daemon) == before
        assert daemon.get("/v1/materials/sponge").headers["etag"] == tag
        assert daemon.get("/v1/materials/lab_000").status == 404
        real = bring(daemon, document).json()
        assert {**real, "dry_run": True} == dry, (real, dry)
        assert counts(bring(daemon, document, dry=True))["revisions"] == (0, dry["revisions"]["added"])


def test_imports_beside_revisions():
    """Imports and revisions of one material at a time: each number is had once, nothing is lost, who came late is told."""
    with program.daemon() as daemon:
        assert bring(daemon, b"slug,name,restitution,source\nfelt,Felt,0.5,s\n").status == 200

        def revise(number):
            tag = daemon.get("/v1/materials/felt@1").headers["etag"]
            return daemon.request("POST", "/v1/materials/felt/revisions", headers={"If-Match": tag},
                                  json={"name": "Felt", "restitution": 0.3, "source": "r%d" % number, "comment": "c"}).status

        def add(number):
            latest = daemon.get("/v1/materials/felt").json()["latest"]
            row = "slug,number,name,restitution,source\nfelt,%d,Felt,0.4,i%d\n" % (latest + 1, number)
            return bring(daemon, row.encode()).status

        with concurrent.futures.ThreadPoolExecutor(8) as pool:
            revised = list(pool.map(revise, range(100)))
            works = [pool.submit(add if i % 2 else revise, i) for i in range(100, 300)]
            # An export amid them is of one moment: nothing in it is new, and no number is missing.
            for kind in ("json", "csv") * 4:
                whole = bring(daemon, export(daemon, kind), dry=True).json()
                assert whole["revisions"]["added"] == 0, whole
            told = [work.result() for work in works]
        assert set(revised) <= {201, 412} and set(told) <= {200, 201, 412, 422}, (set(revised), set(told))
        done = sum(code in (200, 201) for code in revised + told)
        numbers = [one["revision"] for one in said(json.loads(export(daemon)))["felt"]["revisions"]]
        # An import of what just came to be there is none: it differs, and is refused.
        assert numbers == list(range(1, done + 2)), (done, len(numbers))
        assert done > 10


def test_long_exports_are_sent_as_they_are_made():
    """Force traces of a million samples: exported whole in pieces, and read back by parts."""
    force = [round(0.001 * ((7919 * i) % 1000), 3) for i in range(100000)]
    with program.daemon("--max-body", "67108864") as daemon:
        document = laboratory(3, 3, revisions=1)
        one = document["materials"][1]
        one["revisions"][0].pop("measurements", None)
        one["measurements"] = [{"measurement": i + 1, "comment": "long", "test": {"traces": [{"interval": 1e-5, "force": force}], "source": str(i)}}
                               for i in range(10)]
        assert counts(bring(daemon, document))["measurements"][0] >= 10
        text, table = export(daemon), export(daemon, "csv")
        assert len(text) > 5 << 20
        back = said(json.loads(text))[one["slug"]]["measurements"]
        assert len(back) == 10 and all(m["test"]["traces"][0]["force"] == force for m in back)
        assert counts(bring(daemon, text))["measurements"][0] == 0
        assert counts(bring(daemon, table))["measurements"][0] == 0


if __name__ == "__main__":
    program.main(globals())
