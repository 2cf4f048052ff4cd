#!/usr/bin/env python3
"""The study calibrate as users meet it: its formats, the proposal for a material, faults, equal bytes."""

import json
import os
import sys
import xml.etree.ElementTree

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

SANITIZED = "nightly"


def test_a_calibration_becomes_a_revision_of_a_material():
    """Parameters as JSON and CSV, a chart; the proposal is confirmed with its ETag, and is the material's newest revision."""
    scene = program.scene("calibrate_free_sponge")
    with program.daemon() as daemon:
        result = program.finished(daemon, scene)["result"]
        answer = daemon.get(f"/v1/results/{result}/calibration.json").json()
        assert answer["verdict"] == "explained" and answer["failed"] == 0 and answer["runs"] > 100
        for parameter, truth in zip(answer["parameters"], (0.61, 0.025)):
            low, high = parameter["interval_95"]
            assert parameter["identifiable"] and low < truth < high, parameter
        rows = daemon.get(f"/v1/results/{result}/calibration.csv").body.decode().splitlines()
        assert len(rows) == 3 and rows[1].startswith("/dampers/0/buffer/restitution,1,0.6"), rows
        chart = daemon.get(f"/v1/results/{result}/calibration.svg").body
        assert xml.etree.ElementTree.fromstring(chart).tag.endswith("svg") and b"measured" in chart
        fitted = daemon.get(f"/v1/results/{result}/calibration/scene").json()
        assert fitted["dampers"][0]["buffer"] == {"restitution": answer["parameters"][0]["value"],
                                                  "contact_time": answer["parameters"][1]["value"]}, fitted
        assert program.finished(daemon, fitted)["status"] == "successful"
        asked = daemon.request("POST", f"/v1/results/{result}/calibration/proposal?material=sponge")
        proposal = asked.json()
        assert proposal["why"] is None and proposal["revision"]["restitution"] == answer["parameters"][0]["value"]
        assert proposal["warnings"] == [], proposal
        # What the old revision says of its own test does not hold for the numbers of the scene.
        assert proposal["revision"].get("impactor_mass") is None and proposal["revision"].get("base") is None
        assert "/dampers/0/buffer/restitution 0.6" in proposal["revision"]["comment"], proposal
        other = daemon.request("POST", f"/v1/results/{result}/calibration/proposal?material=aluminium").json()
        assert [warning["pointer"] for warning in other["warnings"]] == ["/revision/restitution",
                                                                         "/revision/contact_time"], other
        confirmed = daemon.request("POST", proposal["links"]["confirm"], json=proposal["revision"],
                                   headers={"If-Match": asked.headers["etag"]})
        assert confirmed.status == 201, confirmed
        # Both numbers of a proposal are of one buffer, also where an earlier one has but one of them.
        sides = json.loads(json.dumps(scene))
        ranges = [{key: value for key, value in one.items() if key != "pointer"} for one in scene["study"]["parameters"]]
        sides["study"]["parameters"] = [{"pointer": f"/dampers/0/{name}", **ranges[at]} for name, at in
                                        (("left_buffer/restitution", 0), ("right_buffer/contact_time", 1),
                                         ("right_buffer/restitution", 0))]
        result = program.finished(daemon, sides)["result"]
        proposal = daemon.request("POST", f"/v1/results/{result}/calibration/proposal?material=sponge").json()
        assert "/dampers/0/right_buffer/restitution" in proposal["revision"]["comment"], proposal
        assert "/dampers/0/right_buffer/contact_time" in proposal["revision"]["comment"], proposal
        for query, status, words in (
                ("material=sponge&damper=3", 409, "the restitution of a buffer of damper 3, it fitted /dampers/0/left_buffer/"),
                ("material=sponge&damper=0", 400, "within [1, "), ("material=sponge&damper=1.5", 400, "whole number"),
                ("material=sponge@1", 400, "a slug without a revision"), ("damper=1", 400, "is required")):
            refused = daemon.request("POST", f"/v1/results/{result}/calibration/proposal?{query}")
            assert refused.status == status and words in refused.json()["detail"], (query, refused)
        # Of two dampers the first one is taken, and the other one named.
        two = json.loads(json.dumps(scene))
        two["dampers"].append({**two["dampers"][0], "mass": 1e-6})
        two["study"]["measured"][0]["channel"] = "displacement_1"
        two["study"] = {**two["study"], "starts": 1, "parameters": [
            {**one, "pointer": one["pointer"].replace("/0/", f"/{at}/")} for at in (0, 1) for one in scene["study"]["parameters"]]}
        both = program.finished(daemon, two)["result"]
        warnings = [[warning["detail"] for warning in daemon.request(
            "POST", f"/v1/results/{both}/calibration/proposal?material=sponge{query}").json()["warnings"]]
                    for query in ("", "&damper=2")]
        assert warnings[0][0] == ("is of /dampers/0/buffer/restitution; /dampers/1/buffer/restitution was fitted too: "
                                  "choose it with damper=2"), warnings
        assert not any("was fitted too" in detail for detail in warnings[1]), warnings
        other = daemon.get(f"/v1/results/{result}/optimum.json")
        assert other.status == 404 and 'for the study "calibrate", not for "optimize": its answer is calibration.json' in other.json()["detail"], other
        newest = daemon.get("/v1/materials/sponge@2").json()
        assert newest["contact_time_deviation"] == answer["parameters"][1]["standard_error"]


def test_a_motion_that_cannot_be_trusted_at_all_ends():
    """Steps so long that their error is as large as the motion from its beginning: the search ends, and determines nothing."""
    scene = {"structure": {"mass": 1.35, "stiffness": 865, "damping_ratio": 0.01}, "duration": 0.0216853, "sample_rate": 66.65,
             "dampers": [{"mass": 0.1, "clearance": 0.001, "buffer": {"restitution": 0.5, "contact_time": 0.005}}],
             "excitation": {"kind": "sine", "amplitude": 30, "frequency": 742.9}, "accuracy": {"solver": "rk4"},
             "output": {"channels": [], "psd": None},
             "study": {"kind": "calibrate", "starts": 1,
                       "parameters": [{"pointer": "/dampers/0/clearance", "from": 1e-4, "to": 0.06}],
                       "measured": [{"channel": "displacement", "interval": 0.0004252,
                                     "samples": [0.02 * (-1) ** i * (i % 7) / 7 for i in range(50)]}]}}
    with program.daemon() as daemon:
        job = daemon.request("POST", "/v1/jobs", json=scene, headers={"Prefer": "wait=20"}).json()
        assert job["status"] == "successful", job
        answer = daemon.get(f"/v1/results/{job['result']}/calibration.json").json()
        assert not answer["parameters"][0]["identifiable"] and answer["runs"] < 3000, answer


def test_the_bytes_are_those_of_one_thread():
    """The command, on one thread, gives the document of a daemon with three workers."""
    scene = program.scene("calibrate_free_sponge")
    code, out, errors = program.run("study", "-", text=json.dumps(scene))
    assert code == 0, errors
    with program.daemon("--workers", "3") as daemon:
        result = program.finished(daemon, scene)["result"]
        assert daemon.get(f"/v1/results/{result}/calibration.json").json() == json.loads(out)


if __name__ == "__main__":
    program.main(globals())
