#!/usr/bin/env python3
"""What goes wrong on clusters, made to happen: killed daemons, dead nodes, full disks, a Slurm that refuses, errs or is away.
After each nothing is lost, twice or wrong: the answer is to the byte that of threads, no task is queued, no file is left."""

import contextlib
import getpass
import hashlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import program  # noqa: E402
from daemon import Daemon  # noqa: E402
from disk import fill, small_disk  # noqa: E402
from site_of_slurm import all_are_sent, ensemble, main, site, slow_sweep, sweep, tasks_of, wanted  # noqa: E402
from slurm import until  # noqa: E402

NIGHTLY = True
KILLS_DAEMON = "os.kill(os.getppid(), signal.SIGKILL)\n"
IN_QUEUE = "subprocess.run(['squeue', '-h', '-r'], capture_output=True, text=True).stdout.count(chr(10))"


def until_dead(at):
    until(lambda: not at.daemon.is_alive(), "the daemon was not killed")
    at.kill()


def test_a_daemon_that_is_killed_before_sbatch():
    """kill -9 when sbatch is called and before it submits anything: the next daemon submits."""
    for scene in (sweep(), ensemble()):
        with site() as at:
            at.slurm.wrap("sbatch", f"if is_first():\n    {KILLS_DAEMON}    sys.exit(1)")
            at.begin(scene)
            until_dead(at)
            at.start()
            at.ends_well()
            assert len(at.slurm.calls("sbatch")) == 2


def test_a_daemon_that_is_killed_after_sbatch():
    """kill -9 when sbatch has submitted and before it is known: the next daemon adopts the tasks and submits none."""
    for scene in (sweep(), ensemble()):
        with site() as at:
            at.slurm.close_gate()
            at.slurm.wrap("sbatch", "import subprocess\n" + at.slurm.gate + "\nsubprocess.run([real, *arguments])\n" + KILLS_DAEMON + "sys.exit(0)")
            at.begin(scene)
            until_dead(at)
            at.start()
            at.until(all_are_sent)
            at.slurm.open_gate()
            at.ends_well()
            assert len(at.slurm.calls("sbatch")) == 1


def test_a_daemon_that_is_killed_while_it_takes_files():
    """kill -9 again and again when chunks come: no row lost, none twice, and no chunk is made again without need."""
    for scene in (sweep(1200), ensemble(240)):
        with site() as at:
            at.begin(scene)
            for chunks in (1, 4, 8):
                at.until(lambda cluster: cluster["done"] >= chunks or at.document()["status"] == "successful")
                at.kill()
                at.start()
            at.ends_well()


def test_a_daemon_that_ends_in_order():
    """SIGTERM leaves the tasks to Slurm; the next daemon takes their files, also when Slurm has forgotten the tasks."""
    with site() as at:
        at.queue(ensemble())
        at.daemon.stop(60)
        at.daemon = None
        assert len(at.slurm.tasks()) == 12
        at.slurm.open_gate()
        until(lambda: not at.slurm.tasks(), "tasks that do not end")
        at.slurm.wrap("squeue", "sys.exit(0)")
        at.start()
        at.finished()
        assert len(at.slurm.calls("sbatch")) == 1
        at.slurm.unwrap()
        at.ends_well()


def test_a_daemon_that_ends_while_a_study_begins():
    """SIGTERM while a worker waits for sinfo: the daemon ends in order, and the next one makes the study."""
    with site() as at:
        at.slurm.wrap("sinfo", "time.sleep(3)")
        at.begin(sweep())
        until(lambda: at.slurm.calls("sinfo"), "a call of sinfo")
        at.daemon.stop(60)
        assert "Sanitizer" not in at.daemon.stderr(), at.daemon.stderr()
        at.slurm.unwrap()
        at.start()
        at.ends_well()


def test_a_restart_while_the_cluster_has_fewer_slots():
    """The chunks of a study that was begun stay as they were cut, whatever the cluster has by now."""
    with site() as at:
        at.queue(ensemble())
        at.kill()
        at.slurm.open_gate()
        until(lambda: not at.slurm.tasks(), "tasks that do not end")
        at.slurm.drain()
        at.start()
        at.finished()
        assert len(at.slurm.calls("sbatch")) == 1
        at.ends_well()


def test_a_node_that_dies():
    """slurmd, steps and tasks of a node are gone at once: Slurm requeues or reports, and the chunks are made elsewhere."""
    with site() as at:
        at.slurm.close_gate()
        at.begin(sweep())
        at.until(lambda cluster: cluster["running"] == 3)
        at.slurm.kill_node("n1")
        time.sleep(1)
        at.slurm.open_gate()
        at.ends_well()


def test_tasks_that_are_requeued():
    """scontrol requeue of a running task: it runs again."""
    with site() as at:
        at.slurm.close_gate()
        at.begin(sweep())
        at.until(lambda cluster: cluster["running"] == 3)
        for job, task, _, _ in at.slurm.tasks("--states=running"):
            at.slurm.call("scontrol", "requeue", f"{job}_{task}")
        at.slurm.open_gate()
        at.ends_well()
        assert len(at.slurm.calls("sbatch")) == 1


def test_two_copies_of_each_task():
    """Every chunk is made twice at once: it counts once."""
    for scene in (sweep(), ensemble()):
        with site() as at:
            at.slurm.wrap("sbatch", "import subprocess\nsubprocess.run([real, *arguments])")
            at.begin(scene)
            at.ends_well()


def test_a_full_disk_that_later_has_room():
    """Nothing fits into the shared folder: the study waits, says so, and goes on when there is room; no attempt is lost."""
    with small_disk() as shared, site(shared) as at:
        at.queue(sweep())
        ballast = fill(shared)
        at.slurm.open_gate()
        at.until_reason("full", "No space")
        time.sleep(8)
        assert at.document()["status"] == "running"
        os.remove(ballast)
        at.ends_well()


def test_a_disk_that_is_full_at_the_beginning():
    """A study that cannot be written down waits until it can."""
    with small_disk() as shared, site(shared) as at:
        ballast = fill(shared)
        with open(ballast, "ab", buffering=0) as file:
            try:
                while True:
                    file.write(b"0")
            except OSError:
                pass
        at.begin(sweep())
        time.sleep(3)
        assert at.document()["status"] in ("accepted", "running"), at.document()
        os.remove(ballast)
        at.ends_well()


def test_a_controller_that_is_away():
    """slurmctld ends and comes back: nothing is submitted twice."""
    for how in (signal.SIGTERM, signal.SIGKILL):
        with site() as at:
            at.slurm.close_gate()
            at.begin(sweep())
            at.until(lambda cluster: cluster["running"] == 3)
            time.sleep(0 if how == signal.SIGKILL else 1)
            at.slurm.end("slurmctld", how)
            at.until_reason("contact", "answer", "connect")
            at.slurm.open_gate()
            at.slurm.start_controller()
            # After kill -9 Slurm finds "Duplicate jobid" and drains nodes, which is for administrators to mend.
            until(lambda: at.document()["status"] == "successful" or at.slurm.resume() or time.sleep(1), at.cluster)
            if how == signal.SIGKILL:  # Slurm may also forget that a task was cancelled
                until(lambda: not at.slurm.tasks() or at.slurm.call("scancel", f"--user={getpass.getuser()}"), at.slurm.tasks)
            at.ends_well()


def test_a_controller_that_is_away_at_the_start_and_at_the_end():
    """A daemon that starts without slurmctld waits for it; a study that is cancelled meanwhile is cleaned up later."""
    with site() as at:
        at.queue(sweep())
        at.kill()
        at.slurm.end("slurmctld")
        at.start()
        at.until_reason("contact", "answer", "connect")
        at.daemon.request("DELETE", f"/v1/jobs/{at.job}")
        time.sleep(1)
        at.slurm.start_controller()
        at.slurm.until_up()
        at.is_clean()


def test_squeue_that_fails_or_hangs():
    """While nothing is known nothing is submitted, though files come and tasks are lost; then all goes on."""
    for code, said in (("sys.exit('squeue: error: out of order')", "out of order"), ("time.sleep(100)", "did not answer")):
        with site() as at:
            at.queue(sweep())
            at.slurm.wrap("squeue", code)
            at.slurm.call("scancel", "--state=pending", *{job for job, _, _, _ in at.slurm.tasks()})
            at.until_reason(said)
            at.slurm.open_gate()
            until(lambda: not at.slurm.tasks(), "tasks that do not end")
            made = len(at.slurm.tasks(f"--name={at.name()}", "--states=completed"))
            at.until(lambda cluster: cluster["done"] == made)
            time.sleep(2)
            assert made < 12 and len(at.slurm.calls("sbatch")) == 1
            os.remove(os.path.join(at.slurm.bin, "squeue"))
            at.ends_well()


def test_sbatch_that_hangs():
    """sbatch that submits and does not end: what it submitted is found and not submitted again."""
    with site() as at:
        at.slurm.close_gate()
        at.slurm.wrap("sbatch", at.slurm.gate + "\nimport subprocess\nif is_first():\n    subprocess.run([real, *arguments])\n    time.sleep(100)")
        at.begin(sweep())
        at.until(all_are_sent)
        at.slurm.open_gate()
        at.ends_well()
        assert len(at.slurm.calls("sbatch")) == 1


def test_sbatch_that_refuses():
    """The reason is shown, that of Slurm itself and any other; once it takes jobs all goes on."""
    with site() as at:
        at.further = ["--partition", "nowhere"]
        at.begin(sweep())
        at.until_reason("invalid partition")
        at.daemon.stop(60)
        at.further = []
        at.slurm.wrap("sbatch", "sys.exit('sbatch: error: the account has no hours left')")
        at.start()
        at.until_reason("no hours left")
        at.slurm.unwrap()
        at.ends_well()


def test_all_nodes_are_drained():
    """Slurm's own reason is shown, that of the administrator; the study goes on after resume."""
    with site() as at:
        at.slurm.drain("replaced disks")
        at.begin(sweep())
        at.until_reason("replaced disks")
        at.slurm.resume()
        at.ends_well()


def test_small_arrays():
    """Where Slurm takes few tasks in one array, more arrays are submitted."""
    with site(array=6) as at:
        at.begin(sweep())
        at.ends_well()
        at.begin(ensemble())
        at.ends_well()


def test_a_shared_folder_that_is_away():
    """Not mounted, or another folder in its place: nothing is judged, sent or made there until it is back."""
    for is_replaced in (True, False):
        with site() as at:
            at.queue(sweep())
            os.rename(at.shared, at.shared + ".away")
            if is_replaced:
                os.mkdir(at.shared, 0o700)
            at.until_reason("not the folder")
            at.slurm.call("scancel", "--state=pending", *{job for job, _, _, _ in at.slurm.tasks()})
            time.sleep(3)
            assert len(at.slurm.calls("sbatch")) == 1
            if is_replaced:
                os.rmdir(at.shared)  # it is empty
            os.rename(at.shared + ".away", at.shared)
            at.slurm.open_gate()
            at.ends_well()


def test_digits_of_another_machine():
    """A chunk whose runs differ in one bit, its digest right: the server's own run tells, and the chunk is made again."""
    for scene in (sweep(), ensemble()):
        with site() as at:
            at.queue(scene)
            at.kill()
            at.slurm.open_gate()
            until(lambda: not at.slurm.tasks(), "tasks that do not end")
            with open(os.path.join(at.shared, at.name(), "chunks", "0"), "r+b") as file:
                body = bytearray(file.read()[:-32])
                place = 56  # behind the head: each part is a length and its bytes, of which the steps begin at 24
                while place < len(body):
                    body[place + 8 + 24] ^= 1
                    place += 8 + int.from_bytes(body[place:place + 8], "little")
                file.seek(0)
                file.write(bytes(body) + hashlib.sha256(body).digest())
            at.start()
            at.ends_well()
            assert "other digits" in at.daemon.stderr(), at.daemon.stderr()
            assert [list(tasks_of(call)) for call in at.slurm.calls("sbatch")[1:]] == [[0]], at.slurm.calls("sbatch")


def test_two_servers_with_one_folder():
    """Each makes the same study: a cancel at the one, and its tidying up, leave the other's tasks and files alone."""
    with site() as at, Daemon(program.build, *at.options, environment=at.slurm.environment) as other:
        at.queue(sweep())
        job = other.submit(sweep(), headers={"Prefer": "respond-async"}).json()["id"]
        until(lambda: len(at.slurm.tasks()) == 24, at.slurm.tasks)
        assert len(os.listdir(at.shared)) == 2
        assert other.request("DELETE", f"/v1/jobs/{job}").status in (200, 204)
        until(lambda: len(at.slurm.tasks()) == 12 and len(os.listdir(at.shared)) == 1, at.slurm.tasks)
        at.slurm.open_gate()
        at.ends_well()
        assert len(at.slurm.calls("sbatch")) == 2, at.slurm.calls("sbatch")


def test_options_that_would_hide_the_tasks():
    """Options of the administrator are for accounts and nodes: the names and numbers by which tasks are found stay."""
    with site() as at:
        at.further = [f"--sbatch-option=--{option}" for option in (
            "comment=lab", "job-name=lab", "array=99", "output=/dev/null", "chdir=/nowhere", "ntasks=2", "nice=5")]
        at.begin(ensemble())
        at.ends_well()


def test_few_tasks_at_once():
    """Where Slurm takes few tasks at once, others follow as these end; refusals are no failures."""
    with site() as at:
        at.slurm.wrap("sbatch", "import subprocess\nof = [a for a in arguments if a.startswith('--array=')][0][8:].split(',')\n"
                      f"if len(of) + {IN_QUEUE} > 4:\n    sys.exit('sbatch: error: QOSMaxSubmitJobPerUserLimit')")
        at.begin(sweep())
        at.until_reason("QOSMaxSubmit")
        at.ends_well()


def test_a_scene_that_crashes_the_program():
    """SIGSEGV amid a run: one failed row with the reason, all others those of threads."""
    with site() as at:
        at.begin(slow_sweep())
        until(lambda: crash(at), "no run was caught")
        at.finished()
        base = f"/v1/results/{at.document()['result']}/table.csv"
        rows = at.daemon.get(base).body.decode().splitlines()
        others = wanted(at.scene)[1].decode().splitlines()
        differ = [i for i, (row, other) in enumerate(zip(rows, others)) if row != other]
        assert len(rows) == len(others) and len(differ) == 1, (differ, rows)
        assert "crashed" in at.daemon.get(base.replace("csv", "json")).body.decode(), rows[differ[0]]
        at.is_clean()


def crash(at):
    """SIGSEGV for the child of a worker; whether there was one."""
    workers = at.slurm.processes("impactd chunk")
    for process in workers:
        try:
            with open(f"/proc/{process}/stat", encoding="utf-8") as file:
                is_child = int(file.read().rsplit(")", 1)[1].split()[1]) in workers
            if is_child:
                os.kill(process, signal.SIGSEGV)
                return True
        except OSError:
            continue
    return False


def test_tasks_that_are_told_to_end():
    """SIGTERM, as before a time limit: the task ends with 75 and is made again; nothing is failed."""
    with site() as at:
        # Tasks of some seconds: scancel takes that long to reach one.
        at.begin({**slow_sweep(48), "accuracy": {"solver": "rk4", "step": 2e-6}})
        told = 0
        while told < 2 and at.document()["status"] in ("accepted", "running"):
            for job, task, _, _ in at.slurm.tasks("--states=running")[:1]:
                with contextlib.suppress(AssertionError):  # it ended meanwhile
                    at.slurm.call("scancel", "--batch", "--signal=TERM", f"{job}_{task}")
                    told += 1
            time.sleep(0.5)
        assert told > 0, "the study was faster"
        at.ends_well()


def test_tasks_that_are_held():
    """Held by an administrator: the reason is shown and it waits; held behind a failure: made anew."""
    with site() as at:
        at.slurm.close_gate()
        at.slurm.drain()
        at.begin(sweep())
        at.until(all_are_sent)
        ids = {job for job, _, _, _ in at.slurm.tasks()}
        at.slurm.call("scontrol", "hold", *ids)
        at.slurm.resume()
        at.until_reason("JobHeld")
        at.slurm.call("scontrol", "release", *ids)
        at.until(lambda cluster: cluster["running"] == 3)
        job, task, _, _ = at.slurm.tasks("--states=running")[0]
        at.slurm.call("scontrol", "requeuehold", f"{job}_{task}")
        at.slurm.open_gate()
        at.ends_well()


def test_a_study_that_is_cancelled_and_wanted_again():
    """Wanted again while its tasks are still being cancelled: they are adopted, and not cancelled any more."""
    with site() as at:
        at.queue(sweep())
        at.slurm.wrap("scancel", "sys.exit('scancel: error: out of order')")
        at.daemon.request("DELETE", f"/v1/jobs/{at.job}")
        until(lambda: at.slurm.calls("scancel"), "the study is not tidied up")
        at.begin(sweep())
        at.until(all_are_sent)
        os.remove(os.path.join(at.slurm.bin, "scancel"))
        at.slurm.open_gate()
        at.ends_well()
        assert len(at.slurm.calls("sbatch")) == 1, (at.slurm.calls("sbatch"), at.daemon.stderr())


def test_a_folder_that_is_deleted():
    """rm -r of a study's folder, or of a part of it, while tasks run and wait: it is made again, and so is what was lost."""
    for scene, part in ((sweep(), ""), (ensemble(), ""), (sweep(), "chunks"), (sweep(), "study"), (sweep(), "start")):
        with site() as at:
            at.queue(scene)
            path = os.path.join(at.shared, at.name(), part)
            shutil.rmtree(path) if os.path.isdir(path) else os.remove(path)
            at.slurm.open_gate()
            at.ends_well()


def test_a_folder_that_is_a_link():
    """A study's folder that was moved and linked: it is used, and what is deleted in the end is the link alone."""
    with site() as at, tempfile.TemporaryDirectory() as other:
        at.queue(sweep())
        path, moved = os.path.join(at.shared, at.name()), os.path.join(other, "moved")
        shutil.move(path, moved)
        os.symlink(moved, path)
        at.slurm.open_gate()
        at.ends_well()
        assert os.path.exists(os.path.join(moved, "study"))


def test_commands_that_misbehave():
    """sbatch that prints 80 MB before it refuses, and one that closes its output and hangs: neither stops the daemon."""
    for code, said in (("sys.stderr.write('too much\\n' * 9000000)\n    sys.exit(1)", "sbatch"),
                       ("os.closerange(0, 3)\n    time.sleep(100)", "did not answer")):
        with site() as at:
            at.slurm.wrap("sbatch", f"if is_first():\n    {code}")
            at.begin(sweep())
            at.until_reason(said)
            at.ends_well()


def test_a_restart_without_the_cluster():
    """Threads finish what the cluster began; what it left is tidied up when there is a cluster again."""
    for scene in (sweep(), ensemble()):
        with site() as at:
            at.queue(scene)
            at.kill()
            options, at.options = at.options, []
            at.start()
            assert at.finished() == wanted(scene)
            at.daemon.stop(60)
            at.options = options
            at.start()
            at.is_clean()


def test_the_check_of_the_set_up():
    """impactd check --executor slurm: what works, and for each fault a sentence; nothing is left in the folder."""
    with site() as at:
        def check(*options, shared=at.shared):
            done = subprocess.run([program.impactd(), "check", "--executor", "slurm", "--shared", shared, *options], capture_output=True,
                                  text=True, check=False, timeout=150, env={**os.environ, **at.slurm.environment})
            assert os.listdir(at.shared) == [], os.listdir(at.shared)
            return done.returncode, done.stdout + done.stderr
        code, text = check()
        assert code == 0 and "was made by a node" in text, text
        for options, said in ((["--partition", "nowhere"], "no such partition"), (["--sbatch-option=--no-such-option"], "no-such-option")):
            code, text = check(*options)
            assert code != 0 and said in text, (code, text)
        assert "absolute" in check(shared="relative")[1]
        assert "No such file" in check(shared="/nowhere")[1]
        os.chmod(at.shared, 0o770)
        assert "chmod 700" in check()[1]
        os.chmod(at.shared, 0o700)
        at.slurm.wrap("sbatch", "arguments[-3] = '/nowhere/impactd'")
        code, text = check()
        assert code != 0 and "a node did not make a study" in text and "nowhere" in text, text


if __name__ == "__main__":
    main(globals())
