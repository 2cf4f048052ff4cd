#!/usr/bin/env python3
"""impactd materials: what a lab does with its materials, from a shell, and what it is told."""

import csv
import json
import math
import os
import sys
import tempfile
import threading

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from access import token  # noqa: E402
from client import client, fake, say  # noqa: E402
from program import until  # noqa: E402

SANITIZED = "nightly"
FOAM = {"slug": "foam", "name": "Foam, 12 mm", "kind": "foam", "restitution": 0.55, "contact_time": 0.02,
        "source": "drop test of 12 May", "tags": ["wet", "old"]}
DROPS = {"impactor": "steel ball", "impactor_mass": 0.11, "base": "fixed", "gravity": 0, "temperature": 21,
         "height_uncertainty": 0.0005,
         "drops": [{"drop_height": h, "rebound_height": r * h} for h, r in ((0.05, 0.36), (0.04, 0.357), (0.03, 0.361))]}


def materials(url, *arguments, **options):
    return client(url, "materials", *arguments, **options)


def good(url, *arguments, **options):
    """Standard output of what must end well."""
    code, out, errors = materials(url, *arguments, **options)
    assert code == 0, (arguments, code, out, errors)
    return out


def file_of(folder, name, content):
    path = os.path.join(folder, name)
    with open(path, "w", encoding="utf-8") as file:
        file.write(content if isinstance(content, str) else json.dumps(content))
    return path


def columns(line):
    """The cells of a table's row."""
    return [cell.strip() for cell in line.split("  ") if cell.strip()]


def pulse(speed=0.8, k=1700.0, c=4.0, mass=0.11, rate=5000):
    """A force trace of an isolated contact, in N, after 20 ms of rest."""
    w, z = math.sqrt(k / mass), c / 2 / math.sqrt(k * mass)
    wd = w * math.sqrt(1 - z * z)
    forces = []
    for i in range(400):
        t = i / rate - 0.02
        p = speed / wd * math.exp(-z * w * t) * math.sin(wd * t) if 0 <= t <= math.pi / wd else 0
        v = speed * math.exp(-z * w * t) * (math.cos(wd * t) - z * w / wd * math.sin(wd * t)) if 0 <= t <= math.pi / wd else 0
        forces.append(k * p + c * v + 0.01 * math.sin(7.7 * i))
    return forces, math.pi / wd


def test_the_list_is_a_table_that_filters_narrow():
    """list shows the paper's five with their numbers, --json what the daemon answers; filters are the daemon's."""
    with program.daemon() as daemon:
        lines = good(daemon.url, "list").splitlines()
        assert columns(lines[0]) == ["slug", "revision", "status", "restitution", "contact_time [s]", "kind", "name", "source"]
        assert [line.split()[0] for line in lines[1:]] == ["aluminium", "hard_acrylic", "hard_rubber", "soft_rubber", "sponge"]
        assert columns(lines[5])[:7] == ["sponge", "1", "approved", "0.61", "0.025", "foam", "Sponge"]
        assert json.loads(good(daemon.url, "list", "--json")) == daemon.get("/v1/materials").json()
        for arguments, slugs in ((("--e", "0.5..0.55"), ["hard_rubber"]), (("--T-c", "..0.001"), ["aluminium"]),
                                 (("--kind", "rubber", "--q", "soft"), ["soft_rubber"]), (("--status", "draft"), [])):
            code, out, errors = materials(daemon.url, "list", *arguments)
            assert code == 0 and [line.split()[0] for line in out.splitlines()[1:]] == slugs, (arguments, out)
            assert ("none found" in errors) == (not slugs)
        assert materials(daemon.url, "list", "--e", "x..y")[0] == 2
        assert materials(daemon.url, "list", "--status", "wet")[0] == 2


def test_a_material_goes_its_way():
    """Added, read back, revised by hand, compared, reverted, approved, deprecated: each step stands in its history."""
    with program.daemon() as daemon, tempfile.TemporaryDirectory() as folder:
        path = file_of(folder, "foam.json", FOAM)
        assert good(daemon.url, "add", path) == "foam@1 draft\n"
        shown = dict(columns(line) for line in good(daemon.url, "show", "foam").splitlines() if len(columns(line)) == 2)
        assert shown["contact_time"] == "0.02 s" and shown["tags"] == "wet, old" and shown["revision"] == "1", shown
        said = json.loads(good(daemon.url, "show", "foam@1", "--editable"))
        assert said == {name: value for name, value in FOAM.items() if name != "slug"}
        said["restitution"] = 0.56
        edited = file_of(folder, "edited.json", said)
        assert good(daemon.url, "revise", "foam", edited, "--from", "1", "--comment", 'it "was" wet') == "foam@2 draft\n"
        out = good(daemon.url, "diff", "foam", "1", "2")
        assert ["/restitution", "0.55", "0.56"] in [columns(line) for line in out.splitlines()], out
        assert good(daemon.url, "approve", "foam@2", "--reason", "checked") == "foam@2 approved, by its own author\n"
        assert good(daemon.url, "revert", "foam", "1", "--comment", "not wet") == "foam@3 draft\n"
        assert json.loads(good(daemon.url, "show", "foam@3", "--editable"))["restitution"] == 0.55
        assert good(daemon.url, "deprecate", "foam@3", "--reason", "wrong") == "foam@3 deprecated\n"
        assert json.loads(good(daemon.url, "show", "foam", "--json"))["revision"] == 2
        deeds = [columns(line) for line in good(daemon.url, "history", "foam").splitlines()[-6:]]
        assert [deed[2] for deed in deeds[1:]] == ["deprecate", "revert", "approve", "revise", "create"], deeds
        assert [deed[-1] for deed in deeds[1:]] == ["wrong", "not wet", "checked", 'it "was" wet', "new material"], deeds


def test_tables_and_everything_else_survive_the_way_by_hand():
    """show --editable is what revise takes: a table over speed, deviations and texts with quotes stay as they are."""
    with program.daemon() as daemon, tempfile.TemporaryDirectory() as folder:
        odd = {"name": 'Fo"am \\ é', "notes": "two\nlines", "source": "x", "base": "free", "base_mass": 1 / 3, "impactor_mass": 0.1,
               "separation": "zero_force", "tags": ["ü"],
               "table": [{"approach_speed": 0.1, "restitution": 0.6, "contact_time": 0.0123456789012345},
                         {"approach_speed": 0.5, "restitution": 0.5, "contact_time": 0.01, "restitution_deviation": 1e-3}]}
        assert good(daemon.url, "add", "-", text=json.dumps({"slug": "odd", **odd})) == "odd@1 draft\n"
        text = good(daemon.url, "show", "odd", "--editable")
        assert json.loads(text) == odd and text.count("\n") == len(odd) + 2, text
        good(daemon.url, "revise", "odd", file_of(folder, "odd.json", text), "--comment", "the same")
        assert good(daemon.url, "show", "odd@2", "--editable") == text
        assert columns(good(daemon.url, "diff", "odd", "1", "2").splitlines()[1]) == ["count", "0"]
        assert "\x1b" not in good(daemon.url, "show", "odd")


def test_faults_are_told_with_their_places():
    """What a file has wrong is exit code 3 with every pointer; what is not there 4; wrong words 2, before anything is sent."""
    with program.daemon() as daemon, tempfile.TemporaryDirectory() as folder:
        before = daemon.get("/v1/materials").body
        path = file_of(folder, "bad.json", {"slug": "Bad", "name": "", "restitution": 2, "sorce": "x"})
        code, out, errors = materials(daemon.url, "add", path)
        assert code == 3 and out == "", (code, out)
        for place in ("/slug: ", "/name: ", "/restitution: must be within [0, 1], is 2", "/sorce: ", "/source: "):
            assert f"{path}: {place}" in errors, (place, errors)
        assert 'did you mean "source"' in errors
        assert materials(daemon.url, "add", file_of(folder, "none.json", "{"))[0] == 3
        assert materials(daemon.url, "add", os.path.join(folder, "nothing"))[0] == 4
        assert materials(daemon.url, "add", "-", text=json.dumps({**FOAM, "slug": "sponge"}))[0] == 1
        for arguments in (("show", "foam"), ("show", "sponge@2"), ("history", "foam"), ("used-by", "foam@1"),
                          ("approve", "sponge@9", "--reason", "x"), ("revise", "foam", path, "--comment", "x")):
            assert materials(daemon.url, *arguments)[0] == 4, arguments
        for arguments, words in (((), "list, show"), (("shw",), "did you mean show"), (("show",), "SLUG"), (("show", "a", "b"), "is given 2"),
                                 (("show", "Sponge"), "lower-case"), (("show", "../jobs"), "lower-case"), (("show", "sponge@x"), "whole number"),
                                 (("history", "sponge@1"), "without a revision"), (("revert", "sponge", "x", "--comment", "y"), "whole number"),
                                 (("revert", "sponge", "1"), "--comment"), (("approve", "sponge", "--reason", "x"), "sponge@1"),
                                 (("approve", "sponge@1"), "--reason"), (("derived", "sponge"), "--damper-mass"),
                                 (("export", "x.xls"), ".csv"), (("import", "x"), ".json"), (("list", "--statu", "x"), "--status")):
            code, out, errors = materials("http://127.0.0.1:1", *arguments)
            assert code == 2 and out == "" and words in errors, (arguments, code, errors)
        assert daemon.get("/v1/materials").body == before


def test_who_comes_second_is_told():
    """Of writers at once on one head none is lost in silence; with --from a newer revision is never written over."""
    with program.daemon() as daemon, tempfile.TemporaryDirectory() as folder:
        path = file_of(folder, "foam.json", {name: value for name, value in FOAM.items() if name != "slug"})
        good(daemon.url, "add", file_of(folder, "new.json", FOAM))
        ends = []

        def write(number):
            ends.append(materials(daemon.url, "revise", "foam", path, "--comment", f"writer {number}", "--from", "1"))
        threads = [threading.Thread(target=write, args=(number,)) for number in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert sorted(end[0] for end in ends) == [0, 1, 1, 1], ends
        assert all("conflict, nothing was written" in end[2] and "materials history foam" in end[2]
                   for end in ends if end[0] == 1), ends
        assert json.loads(good(daemon.url, "show", "foam", "--json"))["latest"] == 2
        code, _, errors = materials(daemon.url, "revise", "foam", path, "--comment", "x", "--from", "1")
        assert code == 1 and "foam@2, not foam@1" in errors, (code, errors)
    # A write between the question and the write, as a server tells it.
    history = say(body=b'{"history": []}', ETag='"foam@2-5"')
    stale = say(412, json.dumps({"detail": "foam has version 6"}).encode(), "application/problem+json")
    with fake(history, stale) as (url, seen):
        code, out, errors = materials(url, "revert", "foam", "1", "--comment", "x")
        assert code == 1 and out == "" and "conflict, nothing was written" in errors and "version 6" in errors, (code, errors)
        assert seen[1][2]["If-Match"] == '"foam@2-5"' and seen[1][:2] == ("POST", "/v1/materials/foam/revert"), seen
    # What was proposed is of the state that it was shown of, whatever has become of it since.
    proposal = say(body=b'{"revision": {"name": "Foam"}}', ETag='"foam@2-5"')
    with fake(proposal, stale) as (url, seen):
        code, _, errors = materials(url, "propose", "foam", "--confirm")
        assert code == 1 and "conflict, nothing was written" in errors and "version 6" in errors, (code, errors)
        assert seen[1][2]["If-Match"] == '"foam@2-5"' and seen[1][:2] == ("POST", "/v1/materials/foam/revisions"), seen
    for answers in ((say(body=b'{"history": []}'),), (history, say(201, b"[]")), (history, say(201, b'{"slug": "x"}'))):
        with fake(*answers) as (url, _):
            code, out, errors = materials(url, "revert", "foam", "1", "--comment", "x")
            assert code == 7 and out == "" and "really impactd" in errors, (code, errors)
    with fake(say(body=b"[]")) as (url, _):
        assert materials(url, "list")[0] == 7
    with fake(say(body=json.dumps({"name": "\x1b[31m", "x": {"\x9b": "a\nb"}}).encode())) as (url, _):
        out = good(url, "show", "x")
        assert "\x1b" not in out and "\x9b" not in out and "a?b" in out, out


def test_tokens_decide_who_may():
    """With tokens a writer needs the scope, and nobody approves their own: exit code 5 with the reason."""
    with tempfile.TemporaryDirectory() as folder, program.daemon() as daemon:
        path = file_of(folder, "foam.json", FOAM)
        ada, bob, eve = (token(daemon.data, name, scopes) for name, scopes in
                         (("ada", "read,materials"), ("bob", "read,materials"), ("eve", "read")))
        assert until(lambda: daemon.get("/v1/materials").status == 401)
        assert materials(daemon.url, "add", path)[0] == 5
        assert materials(daemon.url, "add", path, environment={"IMPACTD_TOKEN": eve})[0] == 5
        good(daemon.url, "add", path, environment={"IMPACTD_TOKEN": ada})
        code, _, errors = materials(daemon.url, "approve", "foam@1", "--reason", "x", environment={"IMPACTD_TOKEN": ada})
        assert code == 5 and "ada" in errors, (code, errors)
        assert good(daemon.url, "approve", "foam@1", "--reason", "x", environment={"IMPACTD_TOKEN": bob}) == "foam@1 approved\n"
        assert "ada" in good(daemon.url, "history", "foam", environment={"IMPACTD_TOKEN": eve})


def test_uses_are_told():
    """used-by counts results by revision, and lists those of one."""
    with program.daemon() as daemon:
        result = program.finished(daemon, program.scene("paper_free_sponge"))["result"]
        assert columns(good(daemon.url, "used-by", "sponge").splitlines()[-1]) == ["1", "approved", "1"]
        assert result in good(daemon.url, "used-by", "sponge@1")


def test_measurements_become_a_revision():
    """Drops and a force trace go in, their evaluation is shown, and the proposal that was shown is what --confirm writes."""
    with program.daemon() as daemon, tempfile.TemporaryDirectory() as folder:
        good(daemon.url, "add", file_of(folder, "foam.json", FOAM))
        test = file_of(folder, "test.json", DROPS)
        forces, duration = pulse()
        timed = file_of(folder, "timed.csv", "time [s],force [N]\n" + "".join(f"{i / 5000:.4f},{f:.7g}\n" for i, f in enumerate(forces)))
        bare = file_of(folder, "bare.txt", "".join(f"{f:.7g}\n" for f in forces))
        out = good(daemon.url, "measure", "foam", test, "--dry-run")
        assert "drop 3" in out and daemon.get("/v1/materials/foam/measurements").json()["measurements"] == []
        good(daemon.url, "measure", "foam", test, "--trace", timed, "--comment", "two ways")
        kept = daemon.get("/v1/materials/foam/measurements/1").json()
        assert kept["comment"] == "two ways"
        trace = kept["test"]["traces"][0]
        assert trace["interval"] == 0.0002 and trace["note"] == "timed.csv" and len(trace["force"]) == 400, trace
        assert all(abs(a - float(f"{b:.7g}")) == 0 for a, b in zip(trace["force"], forces))
        good(daemon.url, "measure", "foam", test, "--trace", bare, "--interval", "2e-4", "--trace", timed)
        assert [t["force"] for t in daemon.get("/v1/materials/foam/measurements/2").json()["test"]["traces"]] == 2 * [trace["force"]]
        listed = [columns(line) for line in good(daemon.url, "measurements", "foam").splitlines()]
        assert ["count", "2"] in listed and [row[0] for row in listed[-2:]] == ["2", "1"], listed
        assert "two ways" in listed[-1], listed
        for arguments, expected, words in (((bare,), 3, "--interval"), ((timed, "--interval", "1"), 3, "states an interval"), ((test,), 3, "no line of numbers"),
                                           ((os.path.join(folder, "no.csv"),), 4, "no.csv")):
            code, out, errors = materials(daemon.url, "measure", "foam", test, "--trace", *arguments)
            assert code == expected and words in errors and out == "", (arguments, code, errors)
        bad = file_of(folder, "bad.json", {"drops": [{"drop_height": 1, "rebound_height": 2}]})
        code, _, errors = materials(daemon.url, "measure", "foam", bad)
        assert code == 3 and "/drops/0/rebound_height" in errors, (code, errors)
        shown = good(daemon.url, "propose", "foam", "--measurements", "1")
        assert json.loads(good(daemon.url, "show", "foam", "--json"))["latest"] == 1
        written = good(daemon.url, "propose", "foam", "--measurements", "1", "--confirm", "--comment", "as shown")
        assert written == shown + "\nfoam@2 draft\n"
        revision = json.loads(good(daemon.url, "show", "foam@2", "--json"))
        assert revision["comment"] == "as shown" and revision["measurements"] == [1]
        assert abs(revision["restitution"] - 0.6) < 0.01 and abs(revision["contact_time"] / duration - 1) < 0.02, revision
        row = [columns(line) for line in shown.splitlines() if line.startswith("contact_time ")][0]
        assert row[1].endswith(" s") and abs(float(row[1][:-2]) / revision["contact_time"] - 1) < 1e-5, row
        assert materials(daemon.url, "propose", "foam", "--measurements", "9")[0] != 0
        assert materials(daemon.url, "propose", "sponge")[0] != 0


def test_derived_figures_stand_side_by_side():
    """derived shows k_b and c_b of a pair under both rules, as the daemon has them."""
    with program.daemon() as daemon:
        out = good(daemon.url, "derived", "sponge@1", "--damper-mass", "0.1107", "--structure-mass", "1.35")
        heads = [columns(line) for line in out.splitlines() if columns(line)[:1] == ["value"]]
        values = [columns(line) for line in out.splitlines() if line.startswith("stiffness [N/m] ")]
        assert len(heads) == len(values) == 2, out
        assert abs(float(values[0][1]) / 1655.6191 - 1) < 1e-5, (heads, values)
        one = good(daemon.url, "derived", "sponge", "--damper-mass", "0.1107", "--separation", "zero_force", "--json")
        assert json.loads(one) == daemon.get("/v1/materials/sponge/derived?damper_mass=0.1107&separation=zero_force").json()
        assert materials(daemon.url, "derived", "sponge", "--damper-mass", "-1")[0] == 2


def test_the_database_goes_out_and_in():
    """export and import by both formats change nothing the second time; faults are told with row and column."""
    with tempfile.TemporaryDirectory() as folder:
        with program.daemon() as daemon:
            good(daemon.url, "add", file_of(folder, "foam.json", FOAM))
            good(daemon.url, "approve", "foam@1", "--reason", "fine")
            for name in ("lab.json", "lab.csv"):
                path = os.path.join(folder, name)
                assert good(daemon.url, "export", path) == ""
                with open(path, "rb") as file:
                    assert file.read() == daemon.get(f"/v1/materials.{name[4:]}").body
                code, _, errors = materials(daemon.url, "export", path)
                assert code == 1 and "--force" in errors
                good(daemon.url, "export", path, "--force")
            head = daemon.get("/v1/materials/foam").json()
        for name in ("lab.json", "lab.csv"):
            with program.daemon() as daemon:
                before = daemon.get("/v1/materials.json").body
                good(daemon.url, "import", os.path.join(folder, name), "--dry-run")
                assert daemon.get("/v1/materials.json").body == before
                good(daemon.url, "import", os.path.join(folder, name))
                again = daemon.get("/v1/materials/foam").json()
                assert all(again[member] == head[member] for member in head if member not in ("links", "version")), again
        rows = list(csv.reader(["slug,name,restitution,contact_time,source", "a,A,0.5,0.01,x", "b,B,1.5,0.01,x", "c,C,0.5,zero,x"]))
        with program.daemon() as daemon:
            path = file_of(folder, "bad.csv", "".join(",".join(row) + "\n" for row in rows))
            code, out, errors = materials(daemon.url, "import", path)
            assert code == 3 and out == "", (code, out, errors)
            for place in ("row 3, column restitution: ", "row 4, column contact_time: "):
                assert f"{path}: {place}" in errors, errors
            assert daemon.get("/v1/materials/a").status == 404


if __name__ == "__main__":
    program.main(globals())
