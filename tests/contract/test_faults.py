#!/usr/bin/env python3
"""Some allocations and file calls of the canonical requests and of commands fail. All of them: tests/faults/inject.py, commands.py."""
import os
import re
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "faults"))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import commands  # noqa: E402
import inject  # noqa: E402
import program  # noqa: E402

# Faults are declared for no operation: what is answered here is not judged by test_traffic.py.
os.environ.pop("IMPACTD_RECORD", None)


def tried(kind, stride, *names, first=1, last=None):
    """A campaign without a fault; returns how many calls failed."""
    campaign = inject.Campaign(kind, stride, first, last)
    for name in names:
        campaign.run(name)
    return judged(campaign)


def judged(campaign):
    assert campaign.is_good(), (campaign.outcomes, campaign.wrong[:3])
    return campaign.tried


def test_a_row_that_borrows_is_not_freed():
    """A drop test is stored by rows that borrow its texts: without memory for what is read of it, these are not freed."""
    assert tried("allocations", 4, "drop test", first=2) > 100


def test_a_failed_allocation_is_answered_503():
    """One allocation of a request fails, or all from then on: 503, no crash, and the next request is answered."""
    assert tried("allocations", 13, "version", "material", "materials", "series csv", "derived", "export csv", "explain", "run", "material put") > 200


def test_an_answer_is_indented_or_refused():
    """Without memory to indent it the answer that was asked for so is 503: under its tag are no other bytes."""
    assert tried("allocations", 2, "pretty") > 40


def test_a_list_of_faults_has_its_detail_or_is_refused():
    """Without memory for the faults of a scene the answer is 503, and it too says why."""
    assert tried("allocations", 1, "faulty", first=90) > 50


def test_a_page_has_its_link_or_is_refused():
    """Without memory for the link to the next page a list is 503: without the link it would be the last page."""
    assert tried("allocations", 2, "page") > 80


def test_a_failed_job_has_a_problem():
    """Without memory for the document that says why a job failed, the job has another one: 503, to be submitted again."""
    assert tried("allocations", 50, "sweep", first=500) > 15


def test_a_disk_that_does_not_answer_is_not_called_damaged():
    """check-db where a read fails, once or from then on: it says that reading failed, and not that the database is damaged."""
    campaign = commands.Campaign("EIO", 25)
    campaign.run("check")
    assert judged(campaign) > 15


def test_a_backup_names_the_file_that_cannot_be_read():
    """The database where reading it fails, the copy where that cannot be read back: not the other one."""
    campaign = commands.Campaign("EIO", 25)
    campaign.run("backup")
    assert judged(campaign) > 20
    for path in ("data/impactd.db could not be read (Input", "new.db: the database could not be read (Input"):
        assert path in campaign.said, (path, campaign.said)
    assert "data/impactd.db: the database could not be read" not in campaign.said, campaign.said
    assert not re.search("copying the database failed: disk I/O error.*impactd.db", campaign.said), campaign.said


def test_a_full_disk_is_called_so_from_the_first_file_on():
    """A server with a new database where a call that takes room fails, from the first file on."""
    campaign = commands.Campaign("ENOSPC", 4, first=3)
    campaign.run("new")
    assert judged(campaign) > 60
    assert "there is no room left for" in campaign.said, campaign.said
    assert "No space" not in campaign.said, campaign.said


def test_a_certificate_without_memory_is_not_called_faulty():
    """A start with TLS where one of its first 200 allocations fails, or all from then on: it says that, or it serves."""
    campaign = commands.Campaign("allocations", 5, last=200)
    campaign.run("start with TLS")
    assert judged(campaign) == 80
    assert "no memory for the certificate" in campaign.said, campaign.said[-2000:]


def test_a_record_without_memory_is_not_called_damaged():
    """A run on a ground motion where an allocation fails while it is read: 503, or the job is submitted again."""
    assert tried("allocations", 2, "run record", first=101, last=170) == 70


def test_a_command_without_memory_says_so():
    """A command where an allocation fails, the first one too: exit code 1 with the reason, and no file; or its work is done."""
    for name, stride, least in (("import", 1, 18), ("backup", 250, 18), ("start", 500, 10)):
        campaign = commands.Campaign("stacks", stride)
        campaign.run(name)
        assert judged(campaign) >= least, (name, campaign.tried)
        assert campaign.outcomes["not reached"] <= 1, campaign.outcomes


if __name__ == "__main__":
    program.main(globals())
