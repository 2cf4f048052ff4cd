#!/usr/bin/env python3
"""Studies made by a real Slurm of three virtual nodes: the answers of threads, to the byte; cancel; kill -9; wrong files."""

import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
from site_of_slurm import ensemble, fragility, main, site, sweep, tasks_of  # noqa: E402
from slurm import until  # noqa: E402

WAITS = True
SANITIZED = "nightly"


def test_a_sweep_has_the_rows_of_threads():
    """A sweep made by Slurm is to the byte that of threads; progress is shown; no task and no file is left."""
    with site() as at:
        at.begin(sweep())
        at.until(lambda cluster: cluster["chunks"] == 12)
        at.ends_well()
        assert at.document()["progress"] == 100


def test_an_ensemble_is_that_of_threads():
    """An ensemble made by Slurm is to the byte that of threads."""
    with site() as at:
        at.begin(ensemble())
        at.ends_well()


def test_an_ensemble_with_a_target_stops_early():
    """The same number of runs is counted as by threads, and no more are waited for."""
    with site() as at:
        at.begin(ensemble(200, target=0.5, metric="impacts"))
        at.ends_well()
        runs = at.daemon.get(f"/v1/results/{at.document()['result']}/ensemble.json").json()["runs"]
        assert runs < 200, runs


def test_fragility_is_that_of_threads():
    """The records go with the study: fragility made by Slurm is to the byte that of threads."""
    with site() as at:
        at.begin(fragility())
        at.ends_well()


def test_a_cancelled_study_leaves_nothing():
    """DELETE takes its tasks out of the queue and off the nodes, and its folder away."""
    with site() as at:
        at.slurm.close_gate()
        at.begin(sweep())
        at.until(lambda cluster: cluster["running"] > 0 and cluster["queued"] > 0)
        assert at.daemon.request("DELETE", f"/v1/jobs/{at.job}").status in (200, 204)
        at.is_clean()
        assert at.document()["status"] == "dismissed"


def test_a_killed_daemon_takes_up_what_it_submitted():
    """kill -9 behind sbatch: the next daemon adopts the tasks, submits none again, and has the answer of threads."""
    with site() as at:
        at.slurm.close_gate()
        at.begin(sweep())
        at.until(lambda cluster: cluster["running"] + cluster["queued"] == 12)
        at.kill()
        at.start()
        at.until(lambda cluster: cluster["running"] + cluster["queued"] == 12)
        at.slurm.open_gate()
        at.ends_well()
        assert len(at.slurm.calls("sbatch")) == 1, at.slurm.calls("sbatch")


def test_wrong_files_are_made_again():
    """Torn, damaged and foreign chunks are refused and made anew; strays are passed over."""
    with site() as at:
        at.slurm.close_gate()
        at.begin(ensemble())
        at.until(lambda cluster: cluster["running"] + cluster["queued"] == 12)
        at.kill()
        at.slurm.open_gate()
        until(lambda: not at.slurm.tasks(), "tasks that do not end")
        at.spoil()
        at.start()
        at.ends_well()
        again = {task for call in at.slurm.calls("sbatch")[1:] for task in tasks_of(call)}
        assert again == set(range(5)), at.slurm.calls("sbatch")


if __name__ == "__main__":
    main(globals())
