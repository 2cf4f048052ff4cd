#!/usr/bin/env python3
"""Very many requests of all sorts and cancels at random times. The long runs are tests/storm/mixed.py and cancel_storm.py.

What runs depends on the build: requests where addresses are watched or nothing is, cancels where threads are."""
import os
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "storm"))
import cancel_storm  # noqa: E402
import mixed  # noqa: E402
import program  # noqa: E402

NIGHTLY = True
SANITIZED = "nightly"
THREADED = True
REQUESTS = 30000
CANCELS = 300


def test_memory_and_descriptors_stay_flat_under_requests_of_all_sorts():
    """Of 30,000 requests none is answered wrongly, also over a restart; memory and descriptors are flat after warming up."""
    if program.sanitizer() == "thread":
        raise program.Skipped("asked where addresses are watched")
    # What is freed is held back by the address sanitizer; a little of it is enough to meet most uses after that.
    options = os.environ.get("ASAN_OPTIONS", "") + ":quarantine_size_mb=8"
    with tempfile.TemporaryDirectory(prefix="impactd-") as folder:
        with program.daemon("--cache-bytes", str(mixed.CACHE), data=folder, environment={"ASAN_OPTIONS": options}) as daemon:
            storm = mixed.Storm(daemon, REQUESTS, 8, restarts=1)
            storm.run()
        assert storm.lost() == (0, 0), storm.lost()
    assert storm.is_flat(), (storm.memory, storm.files)
    assert sum(storm.codes.values()) >= REQUESTS - 8 * 2 * mixed.ROUNDS, storm.codes
    assert not storm.unmet(), storm.codes


def test_a_cancelled_job_has_one_end():
    """Of 300 cancels at random times, under the thread sanitizer, each has one end, and most meet a running job."""
    if program.sanitizer() != "thread":
        raise program.Skipped("asked where threads are watched")
    cancels, hits, ends = cancel_storm.storm(CANCELS)
    assert cancels == CANCELS and sum(ends.values()) == CANCELS, (cancels, ends)
    assert hits * 2 >= CANCELS, (hits, ends)


if __name__ == "__main__":
    program.main(globals())
