#!/usr/bin/env python3
"""Power spectral densities against scipy.signal.welch: within 1e-12 of the maximum, for every window and
trend, odd and even segments, overlaps, short data and long. Run as: test_welch.py --build DIR"""
import argparse
import itertools
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
from scipy import signal

WINDOWS = ["hann", "boxcar", "hamming", "blackman"]
TRENDS = {"constant": "constant", "linear": "linear", "none": False}
SHAPES = [  # samples, segment, overlap
    (10001, 4096, 2048),  # the default
    (10001, 10001, 0),    # one odd segment
    (9999, 1000, 999),    # the most overlap
    (5000, 777, 100),     # odd, with a rest that is dropped
    (4096, 256, 0),
    (300, 97, 48),        # a prime
    (12, 5, 2),
    (7, 2, 1),
    (7, 3, 0),
    (5, 1, 0),
    (1, 1, 0),
    (200003, 65536, 32768),
]
RATE = 997.0


def signals(count):
    random = np.random.default_rng(1)
    t = np.arange(count) / RATE
    noise = random.standard_normal(count)
    return {
        "noise": noise,
        "a sine upon an offset": 50 + np.sin(2 * np.pi * 60.5 * t) + 1e-3 * noise,
        "a drift": noise + 4 * np.linspace(0, 1, count) + 5,  # a steeper one costs scipy's least squares the digits asked for
    }


def ours(tool, x, window, trend, segment, overlap):
    run = subprocess.run([tool, window, trend, str(segment), str(overlap), repr(RATE)],
                         input=x.tobytes(), stdout=subprocess.PIPE, check=True)
    return np.frombuffer(run.stdout).reshape(2, -1)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--build", type=Path, default=Path("build"))
    tool = parser.parse_args().build / "tests" / "welch_tool"
    worst, failures, cases = 0.0, 0, 0
    # A Latin square: every window and trend of every shape, and each pair of window and trend with every signal.
    for row, (count, segment, overlap) in enumerate(SHAPES):
        drawn = list(signals(count).items())
        for column, (window, (trend, scipy_trend)) in enumerate(itertools.product(WINDOWS, TRENDS.items())):
            name, x = drawn[(row + column) % len(drawn)]
            with warnings.catch_warnings():
                warnings.simplefilter("error")  # scipy must not bend the segment
                f, expected = signal.welch(x, RATE, window, segment, overlap, detrend=scipy_trend)
            frequency, density = ours(tool, x, window, trend, segment, overlap)
            # What a trend leaves of nothing is rounding; measure it by what was there.
            scale = max(expected.max(), 1e-17 * np.mean(x * x) * segment / RATE)
            error = np.abs(density - expected).max() / scale
            same_axis = np.allclose(frequency, f, rtol=1e-15, atol=0)
            cases += 1
            worst = max(worst, error)
            if not (error < 1e-12 and same_axis):
                failures += 1
                print(f"FAILED {name}, {count} samples, {segment}/{overlap}, {window}, {trend}: "
                      f"{error:.2g} of the maximum, axis {same_axis}")

    # The density of one boxcar segment adds up to the mean square.
    for count in (1000, 10001, 1000000):
        for name, x in signals(count).items():
            frequency, density = ours(tool, x, "boxcar", "none", count, 0)
            error = abs(density.sum() * RATE / count / np.mean(np.square(x, dtype=np.longdouble)) - 1)
            cases += 1
            if not error < 1e-12:
                failures += 1
                print(f"FAILED {name}, {count} samples: integral off by {error:.2g} of the mean square")
    print(f"welch: {cases} cases, {failures} failed, worst {worst:.2g} of the maximum")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
