#!/usr/bin/env python3
"""JSON, CSV and NPY read back by the usual readers to the very same doubles. Run as: test_encoders.py --build DIR"""
import argparse
import io
import json
import subprocess
import sys
from pathlib import Path

import numpy as np

RATE = 1000.0


def numbers(rows):
    """Columns of every kind of double: ordinary ones, whole ones, all exponents, the extremes."""
    random = np.random.default_rng(2)
    bits = random.integers(0, 2**64, rows, dtype=np.uint64).view(np.float64)
    bits[~np.isfinite(bits)] = 0.1
    edges = np.array([0.0, -0.0, 1.0, 0.05, 1 / 3, 5e-324, 2.2250738585072014e-308, 1.7976931348623157e308,
                      9007199254740993.0, 1e15, 1e16, 1e17, 1e21, 1e22, 1e23, 1e-5, 1e-6, 123456.789])
    return np.stack([random.standard_normal(rows), np.round(1e4 * random.standard_normal(rows)), bits,
                     np.resize(edges, rows), 1e-3 * random.standard_normal(rows)])


def same(a, b):
    a, b = np.ascontiguousarray(a, dtype=np.float64), np.ascontiguousarray(b, dtype=np.float64)
    return a.shape == b.shape and a.tobytes() == b.tobytes()


class Checks:
    def __init__(self, tool):
        self.tool, self.count, self.failures = tool, 0, 0

    def that(self, fact, text):
        self.count += 1
        if not fact:
            self.failures += 1
            print("FAILED", text)

    def encode(self, form, block, first, count, axis=None):
        extra = [axis] if axis else []
        return subprocess.run([self.tool, form, str(len(block)), repr(RATE), str(first), str(count), *extra],
                              input=block.tobytes(), stdout=subprocess.PIPE, check=True).stdout

    def table(self, block, first, count, axis=None):
        """One table in all formats."""
        what = f"rows {first} to {first + count} of {block.shape}, axis {axis}"
        columns = block[:, first:first + count]
        if axis:
            abscissa, columns, names, offset = columns[0], columns[1:], f"{axis} [Hz]", 1
        else:
            abscissa, names, offset = (first + np.arange(count)) / RATE, "time [s]", 0
        expected = np.vstack([abscissa[None, :], columns])

        read = np.load(io.BytesIO(self.encode("npy", block, first, count, axis)))
        self.that(same(read.T, expected), f"npy: numbers of {what}")
        self.that(read.dtype == np.dtype("<f8") and read.flags.f_contiguous, f"npy: layout of {what}")

        text = self.encode("csv", block, first, count, axis).decode()
        for i in range(offset, len(block)):
            names += f",channel_{i} [m/s^{i}]"
        header, _, body = text.partition("\n")
        self.that(header == names, f"csv: header of {what}")
        read = np.array([[float(x) for x in line.split(",")] for line in body.splitlines()])
        self.that(same(read.reshape(count, len(expected)).T, expected), f"csv: numbers of {what}")
        if count:
            read = np.loadtxt(io.StringIO(text), delimiter=",", skiprows=1, ndmin=2)
            self.that(same(read.T, expected), f"csv: numpy's reading of {what}")

        document = json.loads(self.encode("json", block, first, count, axis))
        self.that(document["count"] == count, f"json: count of {what}")
        if axis:
            self.that(same(document[axis]["values"], abscissa) and document[axis]["unit"] == "Hz",
                      f"json: axis of {what}")
        else:
            self.that(list(document) == ["sample_rate", "start", "count", "channels"]
                      and document["sample_rate"] == RATE and document["start"] == first / RATE,
                      f"json: frame of {what}")
        self.that(list(document["channels"]) == [f"channel_{i}" for i in range(offset, len(block))],
                  f"json: names of {what}")
        for i in range(offset, len(block)):
            channel = document["channels"][f"channel_{i}"]
            self.that(channel["unit"] == f"m/s^{i}" and same(channel["values"], block[i, first:first + count]),
                      f"json: channel {i} of {what}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--build", type=Path, default=Path("build"))
    checks = Checks(parser.parse_args().build / "tests" / "encode_tool")
    block = numbers(20001)
    checks.table(block, 0, 20001)
    checks.table(block, 137, 12345)
    checks.table(block, 20000, 1)
    checks.table(block, 5, 0)
    checks.table(block[:1], 0, 4097)
    checks.table(block[[4, 0, 2]], 3, 9000, axis="frequency")

    # What is not finite: null in JSON, as it is elsewhere.
    odd = np.array([[1.0, np.nan, np.inf, -np.inf, 2.0]])
    values = json.loads(checks.encode("json", odd, 0, 5))["channels"]["channel_0"]["values"]
    checks.that(values == [1.0, None, None, None, 2.0], "json: what is not finite is null")
    lines = checks.encode("csv", odd, 0, 5).decode().splitlines()[1:]
    checks.that([line.split(",")[1] for line in lines] == ["1", "nan", "inf", "-inf", "2"],
                "csv: what is not finite has its name")
    checks.that(same(np.load(io.BytesIO(checks.encode("npy", odd, 0, 5)))[:, 1], odd[0]),
                "npy: what is not finite stays")
    # Python's reader takes NaN where JSON has none.
    checks.that(b"NaN" not in checks.encode("json", odd, 0, 5), "json: no NaN")
    print(f"encoders: {checks.count} checks, {checks.failures} failed")
    return 1 if checks.failures else 0


if __name__ == "__main__":
    sys.exit(main())
