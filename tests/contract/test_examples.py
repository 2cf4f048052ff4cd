#!/usr/bin/env python3
"""Every file in schema/examples is accepted; every one in schema/examples/bad is refused where its name says.

"structure.mass+duration--words.json" has exactly the faults /structure/mass and /duration; "document--words.json" is
no scene at all."""

import json
import os
import re
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

BAD = os.path.join(program.EXAMPLES, "bad")


def bad_names():
    return sorted(name for name in os.listdir(BAD) if name.endswith(".json"))


def pointers_of(name):
    """The pointers in a bad example's name; None for a document that cannot be read."""
    where = name.split("--")[0]
    if where == "document":
        return None
    return sorted("/" + part.replace(".", "/") for part in where.split("+"))


def test_good_examples_are_accepted():
    """Each example passes `impactd check`, without a warning."""
    names = program.examples()
    assert len(names) >= 15, names
    for name in names:
        code, out, errors = program.run("check", "--json", os.path.join(program.EXAMPLES, name + ".json"))
        assert code == 0, (name, code, errors)
        plan = json.loads(out)
        assert plan["dry_run"] is True and plan["warnings"] == [], (name, plan["warnings"])
        assert "title" in program.scene(name), f"{name} has no title"


def test_good_examples_run():
    """Each example runs, and its energy balances."""
    for name in program.examples():
        study = program.scene(name).get("study")
        code, out, errors = program.run("study" if study else "run", os.path.join(program.EXAMPLES, name + ".json"))
        assert code == 0, (name, code, errors)
        if study:
            assert json.loads(out)["kind"] == study["kind"], name
            continue  # an answer, not a job
        job = json.loads(out)
        # Steps are wrong, and contacts that need not be right; the balance says so.
        is_exact = job["plan"]["solver"] == "exact" and job["plan"]["target"] is None
        most = 1e-9 if is_exact else 1e-3
        assert job["status"] == "successful" and job["summary"]["energy_residual"] < most, (name, job)


def test_bad_examples_are_refused_where_their_names_say():
    """Each bad example has exactly the faults of its name, and exit code 3."""
    names = bad_names()
    assert len(names) >= 30, names
    for name in names:
        path = os.path.join(BAD, name)
        code, out, errors = program.run("check", path)
        assert code == 3, (name, code, out, errors)
        assert out == "", (name, out)
        lines = errors.splitlines()
        assert lines and all(line.startswith(path + ": ") for line in lines), (name, errors)
        expected = pointers_of(name)
        found = sorted(match.group(1) for line in lines
                       if (match := re.match(r"(/\S*): .", line[len(path) + 2:])))
        if expected is None:
            assert len(lines) == 1, (name, errors)
        else:
            assert found == expected and len(lines) == len(found), (name, errors)


def test_bad_examples_are_refused_by_the_daemon():
    """The daemon answers each bad example with a problem document that has the same faults."""
    with program.daemon() as daemon:
        for name in bad_names():
            with open(os.path.join(BAD, name), encoding="utf-8") as file:
                reply = daemon.request("POST", "/v1/jobs", body=file.read(),
                                       headers={"Content-Type": "application/json"})
            expected = pointers_of(name)
            problem = reply.json()
            assert reply.headers["content-type"] == "application/problem+json", (name, reply)
            assert problem["status"] == reply.status and problem["title"] and problem["detail"], (name, reply)
            if expected is None:
                assert reply.status in (400, 422), (name, reply)
                continue
            assert reply.status == 422, (name, reply)
            assert sorted(one["pointer"] for one in problem["errors"]) == expected, (name, reply)
            assert all(one["detail"] for one in problem["errors"]), (name, reply)


SANITIZED = "nightly"

if __name__ == "__main__":
    program.main(globals())
