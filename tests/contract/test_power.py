#!/usr/bin/env python3
"""Power failures: what was acknowledged is on the disk. The long run is tests/power/power.py."""

import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "power"))
import disk_states  # noqa: E402
import power  # noqa: E402
import program  # noqa: E402

# The same requests to many daemons, which other tests send too.
os.environ.pop("IMPACTD_RECORD", None)


def test_nothing_acknowledged_is_lost_at_a_power_failure():
    """Unsynced writes are dropped, reordered or torn in 15 states: the database is whole and has what was acknowledged."""
    if program.is_sanitized():
        raise program.Skipped("the recorder is loaded before the sanitizers")
    faults, counts = power.run(15, 5, 2, 1)
    assert not faults, faults[0]
    assert counts["rows"] > 0 and counts["served"] > 0 and counts["restoring"] > 0, counts
    print(f"      15 states, {counts['rows']} acknowledgements compared, {counts['served']} over HTTP")


def test_a_disk_that_never_syncs_loses_what_was_acknowledged():
    """The same, where syncs do nothing: the check finds the loss."""
    if program.is_sanitized():
        raise program.Skipped("the recorder is loaded before the sanitizers")
    sync, disk_states.File.sync = disk_states.File.sync, lambda self: None
    try:
        faults, _ = power.run(20, 2, 0, 1, quietly=True)
    finally:
        disk_states.File.sync = sync
    assert faults


if __name__ == "__main__":
    program.main(globals())
