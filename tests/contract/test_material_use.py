#!/usr/bin/env python3
"""Materials in scenes: what a name becomes, what a result keeps of it whatever is said later, and what it warns of."""

import json
import os
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from asking import problem, sponge  # noqa: E402

FELT = {"name": "Felt", "source": "notebook 7, page 12", "restitution": 0.5, "restitution_deviation": 0.05, "contact_time": 0.02,
        "contact_time_deviation": 0.001, "least_speed": 0.1, "most_speed": 0.3, "impactor_mass": 0.11, "base": "fixed"}
TABLE = [{"approach_speed": 0.1, "restitution": 0.7, "contact_time": 0.02}, {"approach_speed": 0.3, "restitution": 0.5, "contact_time": 0.03}]


def add(daemon, slug, status="approved", **changes):
    said = {name: value for name, value in {**FELT, **changes}.items() if value is not None}
    reply = daemon.request("POST", "/v1/materials", json={"slug": slug, **said})
    assert reply.status == 201, reply
    if status == "approved":
        review(daemon, f"{slug}@1")


def revise(daemon, slug, **changes):
    reply = daemon.request("POST", f"/v1/materials/{slug}/revisions", json={**FELT, "comment": "measured anew", **changes},
                           headers={"If-Match": "*"})
    assert reply.status == 201, reply


def review(daemon, name, status="approved"):
    reply = daemon.request("POST", f"/v1/materials/{name}/review", json={"status": status, "reason": "the base was loose"},
                           headers={"If-Match": "*"})
    assert reply.status == 200, reply


def scene(buffer, **changes):
    made = sponge(**changes)
    made["dampers"][0]["buffer"] = buffer
    return made


def dry(daemon, asked, status=200):
    reply = daemon.request("POST", "/v1/jobs?dry_run=1", json=asked)
    assert reply.status == status, reply
    return reply.json()


def warned(document, pointer):
    return [line["detail"] for line in document["warnings"] if line["pointer"] == pointer]


def used(daemon, name):
    reply = daemon.get(f"/v1/materials/{name}/used-by")
    assert reply.status == 200, reply
    return {line["result"] if "result" in line else line["id"] for line in reply.json()["results"]}


def test_a_result_shows_what_it_used_whatever_is_said_later():
    """After 100 revisions and deprecation its summary, scene, plan, numbers and comparison are the same bytes; its links lead to the revision."""
    with program.daemon() as daemon:
        add(daemon, "felt")
        job = program.finished(daemon, scene("felt"))
        other = program.finished(daemon, scene("sponge"))
        assert {line["material"] for line in job["plan"]["derived"]} == {"felt@1"}, job["plan"]
        paths = [f"/v1/results/{job['result']}{part}" for part in ("", "/series.csv", "/impacts.csv", "/psd.json", "/energy.json")]
        paths.append(f"/v1/compare?a={job['result']}&b={other['result']}")
        before = {path: daemon.get(path).body for path in paths}
        manifest = daemon.get(f"/v1/results/{job['result']}/manifest").json()
        result = json.loads(before[paths[0]])
        assert result["scene"]["dampers"][0]["buffer"] == {"material": "felt@1", "restitution": 0.5, "contact_time": 0.02}, result["scene"]
        [kept] = result["materials"]
        assert (kept["slug"], kept["revision"]) == ("felt", 1), kept
        for target in kept["links"].values():
            assert daemon.get(target).status == 200, target
        said = daemon.get(kept["links"]["revision"]).json()
        differing = {line["pointer"] for line in json.loads(before[paths[-1]])["inputs"]}
        assert {"/dampers/0/buffer/material", "/dampers/0/buffer/restitution", "/dampers/0/buffer/contact_time"} <= differing, differing

        for i in range(100):
            revise(daemon, "felt", restitution=0.2 + i / 1000, contact_time=0.03)
        review(daemon, "felt@101")
        review(daemon, "felt@1", "deprecated")
        for path, body in before.items():
            assert daemon.get(path).body == body, path
        now = daemon.get(f"/v1/results/{job['result']}/manifest").json()
        assert now["scene"] == manifest["scene"], now
        for name in FELT:
            assert now["materials"][0][name] == manifest["materials"][0][name] == said[name], name
        assert now["materials"][0]["status"] == "deprecated", now["materials"]

        # The revision by its number is that result still; the name alone is another scene by now.
        again = program.finished(daemon, scene("felt@1"))
        assert again["cached"] and again["result"] == job["result"], again
        assert warned(again, "/dampers/0/buffer")[0] == "felt@1 is deprecated: the base was loose", again["warnings"]
        body = program.finished(daemon, manifest["scene"])
        assert body["cached"] and body["result"] == job["result"], body
        newer = program.finished(daemon, scene("felt"))
        assert newer["result"] != job["result"] and newer["plan"]["derived"][0]["material"] == "felt@101", newer
        assert used(daemon, "felt@1") == {job["result"]} and used(daemon, "felt@101") == {newer["result"]}


def test_warnings_of_drafts_follow_what_is_thought_now():
    """A job on a draft is warned, and so is its result for ever; once it is approved the same body is answered without the warning."""
    with program.daemon() as daemon:
        add(daemon, "felt", "draft")
        draft = "felt@1 is a draft that has not been approved"
        for _ in range(3):  # computed, cached, known by its bytes
            job = program.finished(daemon, scene("felt"))
            assert draft in warned(job, "/dampers/0/buffer"), job["warnings"]
        review(daemon, "felt@1")
        for _ in range(2):
            after = program.finished(daemon, scene("felt"))
            assert after["cached"] and after["result"] == job["result"] and draft not in warned(after, "/dampers/0/buffer"), after["warnings"]
        review(daemon, "felt@1", "deprecated")
        for _ in range(2):
            after = program.finished(daemon, scene("felt@1"))
            assert warned(after, "/dampers/0/buffer")[0].startswith("felt@1 is deprecated"), after["warnings"]
        fault = problem(daemon.request("POST", "/v1/jobs", json=scene("felt")), 422, "/dampers/0/buffer")["errors"][0]
        assert fault["did_you_mean"] == "felt@1" and "every revision" in fault["detail"], fault
        assert draft in warned(daemon.get(f"/v1/results/{job['result']}").json(), "/dampers/0/buffer")


def test_impacts_outside_the_measured_speeds_are_told():
    """Count, speeds and range are those of the ledger; the same when asked again, after a restart, of tables, and by `impactd run`."""
    with tempfile.TemporaryDirectory() as data:
        with program.daemon(data=data) as daemon:
            add(daemon, "felt")
            asked = scene("felt")
            job = program.finished(daemon, asked)
            speeds = [row["approach_speed"] for row in daemon.get(f"/v1/results/{job['result']}/impacts.json").json()["impacts"]]
            slow, fast = sum(v < 0.1 for v in speeds), sum(v > 0.3 for v in speeds)
            assert slow > 0 and fast > 0
            wanted = (f"{slow + fast} of {len(speeds)} impacts at the stops of damper 1 were outside the speeds of felt@1, 0.1 to 0.3 m/s: "
                      f"all had {min(speeds):.3g} to {max(speeds):.3g} m/s; its numbers are used there without a measurement")
            assert warned(job, "/dampers/0/buffer") == [wanted], job["warnings"]
            assert program.finished(daemon, asked)["warnings"] == job["warnings"]
            assert daemon.get(f"/v1/results/{job['result']}").json()["warnings"] == job["warnings"]
            assert dry(daemon, asked)["warnings"] == [], "what only a run can tell"

            # A table's nearest row holds, whether it is a material's or the scene's own.
            add(daemon, "rubber", restitution=None, restitution_deviation=None, contact_time=None, contact_time_deviation=None,
                least_speed=None, most_speed=None, table=TABLE)
            named = program.finished(daemon, scene("rubber"))
            own = program.finished(daemon, scene({"table": TABLE}))
            assert named["summary"] == own["summary"] and named["result"] != own["result"]
            [first] = warned(named, "/dampers/0/buffer")
            [second] = warned(own, "/dampers/0/buffer/table")
            assert first.endswith("the nearest row is used there") and first.replace("rubber@1", "the table") == second

            # Within the range nothing is said, and one warning stands for each buffer.
            add(daemon, "cork", least_speed=0, most_speed=9)
            sides = scene("cork")
            assert program.finished(daemon, sides)["warnings"] == []
            del sides["dampers"][0]["buffer"]
            sides["dampers"][0].update(left_buffer="felt", right_buffer="cork")
            told = program.finished(daemon, sides)["warnings"]
            assert [line["pointer"] for line in told] == ["/dampers/0/left_buffer"] and "left stop of damper 1" in told[0]["detail"], told
        with program.daemon(data=data) as daemon:
            assert daemon.get(f"/v1/results/{job['result']}").json()["warnings"] == job["warnings"]
            assert daemon.get(f"/v1/results/{job['result']}/series.csv").status == 200  # computed again
            again = program.finished(daemon, asked)
            assert again["cached"] and again["warnings"] == job["warnings"], again
    code, out, errors = program.run("run", os.path.join(program.EXAMPLES, "paper_free_sponge.json"))
    assert code == 0 and warned(json.loads(out), "/dampers/0/buffer")[0] in errors, errors


def test_a_rig_is_the_revisions():
    """identified_for "rig" takes the masses that the revision tells; what it does not tell is a fault that says so; a given one wins."""
    with program.daemon() as daemon:
        def rig(buffer, **members):
            asked = scene(buffer)
            asked["dampers"][0].update(identified_for="rig", **members)
            return asked

        add(daemon, "felt")
        add(daemon, "loose", base="free", base_mass=0.5)
        answer = dry(daemon, rig("felt"))
        assert answer["scene"]["dampers"][0]["rig"] == {"impactor_mass": 0.11}, answer["scene"]
        assert answer["plan"]["derived"][0]["identified_mass"] == 0.11, answer["plan"]
        assert dry(daemon, rig("loose"))["scene"]["dampers"][0]["rig"] == {"impactor_mass": 0.11, "base_mass": 0.5}
        assert dry(daemon, rig("loose", rig={"impactor_mass": 3}))["scene"]["dampers"][0]["rig"] == {"impactor_mass": 3}
        fault = problem(daemon.request("POST", "/v1/jobs", json=rig("sponge")), 422, "/dampers/0/rig")["errors"][0]
        assert "sponge@1 does not state the base that it lay on" in fault["detail"], fault
        given, taken = program.finished(daemon, rig("felt", rig={"impactor_mass": 0.11})), program.finished(daemon, rig("felt"))
        assert taken["cached"] and taken["result"] == given["result"], taken


def test_a_pair_far_from_the_tests_is_told():
    """A dry run and a run both say that e and T_c belong to another pair; with "rig", or without known masses, nothing is said."""
    with program.daemon() as daemon:
        add(daemon, "felt", impactor_mass=0.5, least_speed=0, most_speed=9)
        asked = scene("felt")
        wanted = ("felt@1 was measured with an effective mass of 0.5 kg, that of this pair is 0.102 kg: restitution and contact time belong "
                  "to a pair of masses; \"rig\" carries over the stiffness and damping instead")
        for answer in (dry(daemon, asked), program.finished(daemon, asked), program.finished(daemon, asked)):
            assert warned(answer, "/dampers/0/identified_for") == [wanted], answer["warnings"]
        asked["dampers"][0]["identified_for"] = "rig"
        assert program.finished(daemon, asked)["warnings"] == []
        assert warned(dry(daemon, scene("sponge")), "/dampers/0/identified_for") == []


def test_uses_of_studies_and_sweeps_are_kept():
    """Each result stands under every revision that its scene, its study or an axis named, and says so itself."""
    with program.daemon() as daemon:
        for slug in ("felt", "cork", "rubber"):
            add(daemon, slug)
        ensemble = scene("felt", excitation={"kind": "random", "band": [0, 15], "rms": 1, "seed": 1}, duration=1,
                         study={"kind": "ensemble", "runs": 3})
        sweep = scene("felt", duration=1, study={"kind": "sweep", "axes": [{"pointer": "/dampers/0/buffer", "values": ["cork", "rubber@1"]}]})
        results = {}
        for name, asked, wanted in (("ensemble", ensemble, ["felt"]), ("sweep", sweep, ["felt", "cork", "rubber"])):
            job = program.finished(daemon, asked)
            results[name] = job["result"]
            document = daemon.get(f"/v1/results/{job['result']}").json()
            assert [line["slug"] for line in document["materials"]] == wanted, document["materials"]
            manifest = daemon.get(f"/v1/results/{job['result']}/manifest").json()
            assert [line["slug"] for line in manifest["materials"]] == wanted, manifest["materials"]
            assert len(document["warnings"]) <= 1, document["warnings"]  # of the scene's own run alone
        assert used(daemon, "felt@1") == set(results.values())
        assert used(daemon, "cork@1") == used(daemon, "rubber@1") == {results["sweep"]}
        plain = program.finished(daemon, scene({"restitution": 0.5}))
        assert daemon.get(f"/v1/results/{plain['result']}").json()["materials"] == []


def test_sensitivity_takes_the_recorded_spread():
    """Draws and deviations are those of each buffer's revision and say whose; what the study says itself wins; later revisions change nothing."""
    with program.daemon() as daemon:
        add(daemon, "felt")
        asked = scene("felt", duration=2, output={"channels": [], "psd": None},
                      study={"kind": "sensitivity", "parameters": ["restitution"], "runs": 60})
        job = program.finished(daemon, asked)
        path = f"/v1/results/{job['result']}/sensitivity.json"
        answer = daemon.get(path).json()
        assert answer["spread"] == [{"damper": 1, "buffer": "buffer", "source": "felt@1", "restitution": 0.1, "contact_time": 0.05}], answer["spread"]
        assert answer["restitution_deviation"] is None and answer["contact_time_deviation"] is None and "of spread" in answer["distribution"]
        stop = answer["contact"][0]
        assert abs(stop["stiffness_deviation"] - ((0.1 * stop["stiffness_by_restitution"])**2 + (0.05 * stop["stiffness_by_contact_time"])**2)**0.5) < 1e-12

        # The same numbers said by hand draw the same.
        stated = program.finished(daemon, {**asked, "study": {**asked["study"], "restitution_deviation": 0.1, "contact_time_deviation": 0.05}})
        by_hand = daemon.get(f"/v1/results/{stated['result']}/sensitivity.json").json()
        assert stated["result"] != job["result"] and by_hand["table"] == answer["table"] and by_hand["statistics"] == answer["statistics"]
        assert by_hand["spread"] == [] and by_hand["restitution_deviation"] == 0.1

        # Without anything recorded there are no draws, as ever.
        assert dry(daemon, scene("sponge", study={"kind": "sensitivity"}))["scene"]["study"]["runs"] == 0
        assert dry(daemon, scene("felt", study={"kind": "sensitivity"}))["scene"]["study"]["runs"] == 200

        kept = daemon.get(f"/v1/results/{job['result']}").json()["scene"]
        revise(daemon, "felt", restitution_deviation=0.2)
        review(daemon, "felt@2")
        assert program.finished(daemon, kept)["cached"] and daemon.get(path).json() == answer
        assert dry(daemon, asked)["scene"]["study"]["spread"][0] == {"damper": 1, "buffer": "buffer", "source": "felt@2", "restitution": 0.4,
                                                                      "contact_time": 0.05}


def test_a_dry_run_names_the_revision():
    """Scene and plan name material and revision, with the numbers or the table that they stand for."""
    with program.daemon() as daemon:
        add(daemon, "rubber", restitution=None, restitution_deviation=None, contact_time=None, contact_time_deviation=None, table=TABLE)
        answer = dry(daemon, scene("rubber"))
        assert answer["scene"]["dampers"][0]["buffer"] == {"material": "rubber@1", "table": TABLE}, answer["scene"]
        assert [line["material"] for line in answer["plan"]["derived"]] == ["rubber@1", "rubber@1"], answer["plan"]
        assert program.finished(daemon, scene("rubber"))["result"] == answer["result"]


if __name__ == "__main__":
    program.main(globals())
