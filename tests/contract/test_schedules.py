#!/usr/bin/env python3
"""Some random schedules of the daemon's threads. All of them: tests/threads/schedules.py.

What runs depends on the build: schedules that a seed decides where nothing is watched, threads that run as they will where
threads are."""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "threads"))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
import schedules  # noqa: E402

THREADED = True

# Answers to cuts and faults are declared for no operation: they are not judged by test_traffic.py.
os.environ.pop("IMPACTD_RECORD", None)


def ran(count, **options):
    """A campaign without a fault."""
    campaign = schedules.Campaign(**options)
    campaign.run(count)
    assert campaign.is_good(), (campaign.outcomes, campaign.wrong[:3])
    return campaign


def test_jobs_end_as_acknowledged_under_random_schedules():
    """40 random schedules of the threads, 2 of them with an end and a new start: nothing is lost, wrong or hangs."""
    if program.is_sanitized():
        raise program.Skipped("schedules are for the release build")
    campaign = ran(40)
    assert len(campaign.orders) == 40, len(campaign.orders)
    assert campaign.outcomes["ended"] + campaign.outcomes["killed"] == 2, campaign.outcomes


def test_threads_have_no_race_amid_faults_ends_and_reloads():
    """Under the thread sanitizer: 60 times jobs, cancels, SIGHUP, evictions and ends at once, and as often with faults."""
    if program.sanitizer() != "thread":
        raise program.Skipped("asked where threads are watched")
    ran(60, is_free=True)
    ran(60, has_faults=True)


if __name__ == "__main__":
    program.main(globals())
