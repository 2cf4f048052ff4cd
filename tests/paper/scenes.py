"""Li and Darby's scenes and what `impactd run` answers to them.

Judges nothing: measure.py measures, rows.py compares."""

import functools
import json
import os
import sys
import tempfile

import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402

# Section 3; the ball of 30 mm weighs 0.1107 kg in steel of 7830 kg/m^3, which Table I was computed with.
M, K, C, BALL, CLEARANCE, RELEASE = 1.35, 865.0, 1.092, 0.1107, 0.015, 0.015

# Table I: restitution, contact time [s], printed k_b [N/m] and c_b [N s/m].
TABLE = {
    "sponge": (0.61, 0.025, 1650, 4.05),
    "soft_rubber": (0.44, 0.019, 2990, 8.80),
    "hard_rubber": (0.53, 0.004, 65700, 32.5),
    "hard_acrylic": (0.49, 0.003, 118000, 48.7),
    "aluminium": (0.46, 0.0003, 11.9e6, 530),
}

FREE = {"kind": "free", "displacement": RELEASE}


def random(rms=1.0, seed=1, band=(0, 15)):
    """Section 3.3: "band-limited random base excitation (between 0 and 15 Hz)"."""
    return {"kind": "random", "band": list(band), "rms": rms, "seed": seed}


def sine(amplitude=1.0):
    """Section 4: "constant amplitude 1 Hz sinusoidal base excitation"; amplitude in m/s^2."""
    return {"kind": "sine", "frequency": 1, "amplitude": amplitude}


class Run:
    """What a run found: its job, its impacts (resting contacts left out), series and spectrum."""

    def __init__(self, whole):
        self.summary = whole["job"]["summary"]
        self.derived = whole["job"]["plan"]["derived"]
        self.impacts = [one for one in whole["impacts"]["impacts"] if one["kind"] == "impact"]
        self.series = {name: numpy.array(one["values"]) for name, one in whole["series"]["channels"].items()}
        if whole["psd"]:
            self.frequency = numpy.array(whole["psd"]["frequency"]["values"])
            self.psd = numpy.array(next(iter(whole["psd"]["channels"].values()))["values"])

    def each(self, key):
        """One member of every impact that is over by the end of the run."""
        return numpy.array([one[key] for one in self.impacts if one["end"] is not None])


def scene(buffer, excitation=None, model="spring_damper", duration=10.0, rate=1000, channels=(), segment=4096,
          of="mean_acceleration", damper=None, structure=None, contact=None):
    """One scene of the paper; `buffer` is a name of Table I or (restitution, contact time)."""
    if not isinstance(buffer, str):
        buffer = {"restitution": buffer[0], "contact_time": buffer[1]}
    return {
        "structure": {"mass": M, "stiffness": K, "damping": C, **(structure or {})},
        "dampers": [{"mass": BALL, "clearance": CLEARANCE, "buffer": buffer, **(damper or {})}],
        "contact": {"model": model, **(contact or {})},
        "excitation": excitation or FREE,
        "duration": duration,
        "sample_rate": rate,
        "output": {"channels": list(channels),
                   "psd": {"channels": [of], "segment": segment} if segment else None},
    }


@functools.lru_cache(maxsize=None)
def _asked(text):
    with tempfile.TemporaryDirectory() as folder:
        target = os.path.join(folder, "out.json")
        code, out, errors = program.run("run", "-", "-o", target, text=text)
        assert code == 0, (code, out, errors, text)
        with open(target, encoding="utf-8") as file:
            return Run(json.load(file))


def ask(*arguments, **options):
    """The Run of scene(...); each scene is run once."""
    return _asked(json.dumps(scene(*arguments, **options)))


def both(buffer, *arguments, **options):
    """The Runs of the paper's two models of impact: spring-damper, impulse-momentum."""
    return tuple(ask(buffer, *arguments, model=model, **options) for model in ("spring_damper", "impulse"))
