"""A Slurm of its own for a test: munged, slurmctld and three virtual nodes in a temporary folder, ended in any case.

    with Slurm() as slurm, program.daemon(*slurm.options(shared), environment=slurm.environment) as daemon: ...

No part of the system's Slurm is touched: the configuration, the key of munge and the ports are its own. The daemons run in
the foreground as children, as root or as an ordinary user."""

import contextlib
import getpass
import glob
import os
import shutil
import signal
import socket
import stat
import subprocess
import sys
import tempfile

import program

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "scancel", "sinfo", "scontrol")
PATH = os.environ.get("PATH", "") + ":/usr/sbin:/sbin"
SETTINGS = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.sock,cred_expire=10
CredType=cred/munge
SlurmctldPort={ports[0]}
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/%n.pid
SlurmdSpoolDir={folder}/%n
StateSaveLocation={folder}/state
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,sched_interval=1,bf_interval=1,default_queue_depth=1000
ReturnToService=2
SlurmctldTimeout=10
SlurmdTimeout=10
MessageTimeout=5
InactiveLimit=0
KillWait=2
MaxArraySize={array}
MaxJobCount=20000
JobRequeue=1
SlurmdParameters=config_overrides
PartitionName=main Nodes=n[0-2] Default=YES MaxTime=INFINITE State=UP OverSubscribe=NO
"""
WRAPPER = """#!{python}
import os, signal, sys, time
name, real, folder = {name!r}, {real!r}, {folder!r}
arguments = sys.argv[1:]
with open(os.path.join(folder, name + ".calls"), "a") as calls:
    calls.write(" ".join(arguments) + chr(10))
def go_on():
    os.execv(real, [real, *arguments])
def is_first():
    try:
        os.mkdir(os.path.join(folder, name + ".first"))
    except FileExistsError:
        return False
    return True
{code}
go_on()
"""


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


def parent(process):
    try:
        with open(f"/proc/{process}/stat", encoding="utf-8") as file:
            return int(file.read().rsplit(")", 1)[1].split()[1])
    except OSError:
        return None


def until(condition, what, seconds=90):
    """Waits for the condition; returns what it said."""
    said = program.until(condition, seconds)
    assert said, what() if callable(what) else what
    return said


class Slurm:
    nodes = ("n0", "n1", "n2")

    def __init__(self, array=1001, processors=1):
        missing = [name for name in PROGRAMS if shutil.which(name, path=PATH) is None]
        if missing:
            raise program.Skipped(f"Slurm is not installed: no {', '.join(missing)}")
        if not os.path.ismount("/sys/fs/cgroup"):
            raise program.Skipped("slurmd does not start where /sys/fs/cgroup is not mounted")
        self.folder = tempfile.mkdtemp(prefix="impactd-slurm-")
        os.chmod(self.folder, 0o755)  # munge's socket lies in it
        self.bin = os.path.join(self.folder, "bin")
        self.environment = {"SLURM_CONF": os.path.join(self.folder, "slurm.conf"), "PATH": f"{self.bin}:{PATH}"}
        self.gate_path = os.path.join(self.bin, "gate.impactd")
        self.gate = f"arguments[-3] = {self.gate_path!r}"  # for a wrapper of sbatch
        self.daemons = {}
        self.is_spoiled = False
        os.mkdir(self.bin)
        os.mkdir(os.path.join(self.folder, "state"))
        with open(os.open(self._path("munge.key"), os.O_WRONLY | os.O_CREAT, 0o600), "wb") as key:
            key.write(os.urandom(128))
        self.ports = free_ports(1 + len(self.nodes))
        host = socket.gethostname().split(".", maxsplit=1)[0]
        with open(self.environment["SLURM_CONF"], "w", encoding="utf-8") as file:
            file.write(SETTINGS.format(host=host, user=getpass.getuser(), folder=self.folder, ports=self.ports, array=array))
            for node, port in zip(self.nodes, self.ports[1:]):
                os.mkdir(self._path(node))
                file.write(f"NodeName={node} NodeHostname={host} NodeAddr=127.0.0.1 Port={port} CPUs={processors} RealMemory=1000\n")

    def _path(self, name):
        return os.path.join(self.folder, name)

    def __enter__(self):
        try:
            self._run("munge", "munged", "--foreground", "--force", f"--key-file={self._path('munge.key')}",
                      f"--socket={self._path('munge.sock')}", f"--pid-file={self._path('munge.pid')}",
                      f"--seed-file={self._path('munge.seed')}", f"--log-file={self._path('munge.log')}")
            until(lambda: os.path.exists(self._path("munge.sock")), "munged does not start")
            self.start_controller()
            for node in self.nodes:
                self.start_node(node)
            self.until_up()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        for name in reversed(list(self.daemons)):
            self.end(name)
        for process in self.processes():
            with contextlib.suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
        shutil.rmtree(self.folder, ignore_errors=True)

    def _run(self, name, *command):
        environment = {key: value for key, value in os.environ.items() if key != "SLURM_JWT"}
        with open(self._path(name + ".out"), "ab") as output:
            self.daemons[name] = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=output, stderr=output,
                                                  env={**environment, "PATH": PATH, "SLURM_CONF": self.environment["SLURM_CONF"]})

    def start_controller(self):
        self._run("slurmctld", "slurmctld", "-D", "-f", self.environment["SLURM_CONF"])

    def start_node(self, node):
        self._run(node, "slurmd", "-D", "-N", node, "-f", self.environment["SLURM_CONF"])

    def end(self, name, how=signal.SIGTERM):
        """Ends slurmctld, a node or munge."""
        # It forgets jobs then and gives their numbers again, which the nodes refuse.
        self.is_spoiled = self.is_spoiled or (name == "slurmctld" and how == signal.SIGKILL)
        process = self.daemons.pop(name)
        process.send_signal(how)
        try:
            process.wait(15)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def processes(self, *words, node=None):
        """The steps and tasks of this Slurm, those whose command line has these words, of a node or of all."""
        wanted, found = {f"SLURM_CONF={self.environment['SLURM_CONF']}", *([f"SLURMD_NODENAME={node}"] if node else [])}, []
        for path in glob.glob("/proc/[0-9]*"):
            try:
                with open(path + "/environ", encoding="utf-8", errors="replace") as file:
                    is_ours = wanted <= set(file.read().split("\0"))
                with open(path + "/cmdline", encoding="utf-8", errors="replace") as file:
                    command = file.read().replace("\0", " ")
            except OSError:
                continue
            if is_ours and ("impactd chunk" in command or "slurmstepd" in command) and all(word in command for word in words):
                found.append(int(path[6:]))
        return sorted(found)

    def kill_node(self, node):
        """As when its power fails: slurmd, the steps and their tasks are gone at once."""
        tasks = self.processes("impactd chunk", node=node)
        steps = set(self.processes("slurmstepd")) & {parent(process) for process in tasks}
        process = self.daemons.pop(node)
        for one in [process.pid, *steps, *tasks]:
            with contextlib.suppress(ProcessLookupError):
                os.kill(one, signal.SIGKILL)
        process.wait()

    def restore(self):
        """All that was disturbed is as at the start, and the queue is empty."""
        if "slurmctld" not in self.daemons:
            self.start_controller()
        for node in self.nodes:
            if node not in self.daemons:
                self.start_node(node)
        until(lambda: self.call("scancel", f"--user={getpass.getuser()}") == "" and not self.tasks(), self.tasks)
        self.resume()
        self.until_up()

    def call(self, *command):
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60,
                              env={**os.environ, **self.environment, "PATH": PATH})
        assert done.returncode == 0, (command, done.stderr)
        return done.stdout

    def until_up(self):
        def is_up():
            done = subprocess.run(["sinfo", "-h", "-N", "-o", "%N %t"], capture_output=True, text=True, check=False,
                                  env={**os.environ, **self.environment, "PATH": PATH})
            states = [line.split()[1] for line in done.stdout.splitlines()]
            return done.returncode == 0 and len(states) == 3 and set(states) <= {"idle", "mix", "alloc"}
        until(is_up, lambda: "the nodes are not up: " + "".join(self.said(name) for name in ("slurmctld", *self.nodes)))

    def said(self, name):
        with open(self._path(name + ".log"), encoding="utf-8", errors="replace") as file:
            return "".join(file.readlines()[-8:])

    def tasks(self, *options):
        """(job, task, state, reason) of all that squeue lists."""
        lines = self.call("squeue", "-h", "-r", *options, "-o", "%F|%K|%T|%r").splitlines()
        return [tuple(line.split("|")) for line in lines]

    def drain(self, reason="replaced disks"):
        self.call("scontrol", "update", "nodename=n[0-2]", "state=drain", f"reason={reason}")

    def resume(self):
        with contextlib.suppress(AssertionError):  # of nodes that are up
            self.call("scontrol", "update", "nodename=n[0-2]", "state=resume")

    def wrap(self, name, code):
        """Puts a program before a command of Slurm's: Python code with is_first, go_on, real, arguments; NAME.calls counts."""
        path = os.path.join(self.bin, name)
        with open(path + ".new", "w", encoding="utf-8") as file:
            file.write(WRAPPER.format(python=sys.executable, name=name, real=shutil.which(name, path=PATH), folder=self.bin, code=code))
        os.chmod(path + ".new", stat.S_IRWXU)
        os.rename(path + ".new", path)

    def close_gate(self):
        """Tasks of jobs submitted from now on wait, running, until open_gate."""
        with open(self.gate_path, "w", encoding="utf-8") as file:
            file.write(f'#!/bin/sh\nwhile [ -e {self.bin}/gate ]; do sleep 0.05; done\nexec {program.impactd()} "$@"\n')
        os.chmod(self.gate_path, stat.S_IRWXU)
        os.makedirs(os.path.join(self.bin, "gate"), exist_ok=True)
        self.wrap("sbatch", self.gate)

    def open_gate(self):
        os.rmdir(os.path.join(self.bin, "gate"))

    def unwrap(self):
        for name in os.listdir(self.bin):
            path = os.path.join(self.bin, name)
            if os.path.isdir(path):
                os.rmdir(path)
            else:
                os.remove(path)

    def calls(self, name):
        """The arguments of the calls of a wrapped command."""
        path = os.path.join(self.bin, name + ".calls")
        if not os.path.exists(path):
            return []
        with open(path, encoding="utf-8") as file:
            return file.read().splitlines()

    def options(self, shared, poll=0.3):
        return ["--executor", "slurm", "--shared", shared, "--cluster-seconds", "0", "--cluster-poll", str(poll)]
