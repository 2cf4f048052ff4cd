#!/usr/bin/env python3
"""Pulses on frames: the same motion as other kinds make of it."""

import json
import os
import sys
import tempfile

import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402


def displacement(name, excitation):
    scene = program.scene(name)
    scene.update(excitation=excitation, duration=0.5, sample_rate=1000,
                 output={"channels": ["displacement_1"], "psd": None})
    with tempfile.TemporaryDirectory() as folder:
        target = os.path.join(folder, "out.npy")
        code, _, errors = program.run("run", "-", "-o", target, text=json.dumps(scene))
        assert code == 0, errors
        return numpy.load(target)[:, 1]


def test_pulses_on_frames():
    """Half a sine is a sine to its end, a triangle is a record of three samples, on any structure."""
    for name in ("frame_two_dampers", "matrices"):
        for one, other in [
                ({"kind": "half_sine", "amplitude": 3, "length": 0.5},
                 {"kind": "sine", "frequency": 1, "amplitude": 3}),
                ({"kind": "triangular", "amplitude": 3, "length": 0.25},
                 {"kind": "record", "samples": [0, 3, 0], "interval": 0.125})]:
            ours, theirs = displacement(name, one), displacement(name, other)
            assert abs(ours - theirs).max() < 1e-12 * abs(theirs).max() > 0, (name, one)


if __name__ == "__main__":
    program.main(globals())
