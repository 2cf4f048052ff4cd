#!/usr/bin/env python3
"""Some allocations and file calls of the canonical requests fail. All of them: tests/faults/inject.py."""
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "faults"))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import inject  # noqa: E402
import program  # noqa: E402

# Faults are declared for no operation: what is answered here is not judged by test_traffic.py.
os.environ.pop("IMPACTD_RECORD", None)


def tried(kind, stride, *names):
    """A campaign without a fault; returns how many calls failed."""
    campaign = inject.Campaign(kind, stride)
    campaign.run(names)
    assert not campaign.wrong, campaign.wrong[:3]
    return sum(campaign.outcomes.values())


def test_a_failed_allocation_is_answered_503():
    """One allocation of a request fails, or all from then on: 503, no crash, and the next request is answered."""
    assert tried("allocations", 13, "version", "material", "materials", "series csv", "derived", "export csv", "explain", "run", "material put") > 200


if __name__ == "__main__":
    program.main(globals())
