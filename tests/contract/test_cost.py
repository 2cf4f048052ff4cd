"""CPU time that a client's bodies may take: see ../storm/cost.py, of which the second test is the light version."""
import argparse
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "storm"))
import cost  # noqa: E402
import program  # noqa: E402

# A stiff structure whose mass chatters through many small contacts in each sample interval, more than are predicted.
ENDLESS = {"structure": {"mass": 1.9, "stiffness": 7.5e6, "damping": 1.2},
           "dampers": [{"mass": 0.011, "clearance": 1e-6, "buffer": {"restitution": 0.95, "contact_time": 7.6e-6}}],
           "excitation": {"kind": "sine", "amplitude": 1.4, "frequency": 0.23}, "duration": 2, "sample_rate": 50,
           "output": {"channels": [], "psd": None, "reduction": False, "impacts": False}}
AXIS = {"pointer": "/dampers/0/clearance", "from": 0.9e-6, "to": 1.1e-6}
STUDIES = [{"kind": "ensemble", "runs": 20, "inputs": [{**AXIS, "distribution": "uniform"}]},
           {"kind": "sweep", "axes": [{**AXIS, "count": 20}]}]


def test_study_is_stopped():
    """A study whose prediction was too low is stopped at three times its limit"""
    for study in STUDIES:
        body = {**ENDLESS, "study": study}
        with program.daemon("--workers", "2") as daemon:
            predicted = daemon.request("POST", "/v1/jobs?dry_run=1", json=body).json()["cost"]["cpu_seconds"]
        with program.daemon("--workers", "2", "--max-study-seconds", str(1.05 * predicted)) as daemon:
            before = program.cpu_of_threads(daemon.process.pid)
            reply = daemon.request("POST", "/v1/jobs", json=body, headers={"Prefer": "wait=60"})
            used = program.cpu_of_threads(daemon.process.pid) - before
            problem = reply.json()["problem"]
            assert problem["type"] == "/problems/limit" and "3 times" in problem["detail"], reply
            print(f"{study['kind']}: {used / predicted:.2f} times what was predicted")
            # The daemon does other things too, but not as much as a study that goes on: 20 times.
            assert used < 3 * 1.05 * predicted + cost.OVERSHOOT, used
        with program.daemon("--workers", "2", "--max-study-seconds", str(0.95 * predicted)) as daemon:
            reply = daemon.request("POST", "/v1/jobs", json=body)
            assert reply.status == 422 and b"--max-study-seconds" in reply.body, reply


def test_expensive_bodies():
    """No expensive body takes more than three times its limit, and those that are predicted to are refused"""
    arguments = argparse.Namespace(count=8, seed=2, first=0, kind="", list=False)
    with cost.small_daemon() as daemon:
        assert cost.campaign(cost.Meter(daemon), arguments) == 0


if __name__ == "__main__":
    program.main(globals())
