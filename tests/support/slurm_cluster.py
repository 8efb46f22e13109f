"""A Slurm of one machine, with files, sockets and ports of its own: /etc, and a Slurm that runs here, are left alone.

    python tests/support/slurm_cluster.py [NODES]

runs one until Ctrl-C and prints what a shell is told to use it. It needs Debian's slurm-wlm and munge, no systemd and
no cgroups. Its daemons are those of a cluster, and so is what they do; what it cannot show is at the end of
docs/on-a-cluster.md.

Several nodes are several slurmd on this machine. Each believes that it has all of the machine, so two jobs run beside
each other as on two hosts; their names differ in Slurm alone, `hostname` says the same in both.
"""

import getpass
import os
import re
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROGRAMS = "slurmctld", "slurmd", "munged", "sbatch"
START = 60  # s, until a node is idle
STOP = 20  # s, until a daemon has ended
PATH = os.pathsep.join([os.environ.get("PATH", os.defpath), "/usr/sbin", "/sbin"])  # where the daemons are
KILL_WAIT = 8  # s, enough for a task on a busy machine to say what it heard; 30 unless told, too long for a test

# Each line is there for a reason, said above it.
CONF = """\
ClusterName=rayrace
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={port}

# Daemons and jobs are of whoever starts this.
SlurmUser={user}
SlurmdUser={user}

# Our own munged, by its socket.
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={folder}/munge.socket

# %n: name of a node.
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool/%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/%n.log

# Without cgroups, which containers seldom give: processes of a job are found by their parents. One whose parent has
# ended gets away; proctrack/cgroup, on clusters, loses none.
ProctrackType=proctrack/linuxproc
# A job is bound to the cores that it was given. One that did not ask for all would see fewer.
TaskPlugin=task/affinity
# Hosts are shared unless a job asks for one of its own, and memory unless it asks for all of it.
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
DefMemPerNode=100
# A job of the partition `urgent` ends one of `all`, which has some seconds after its SIGTERM.
PreemptType=preempt/partition_prio
PreemptMode=CANCEL

# Nobody runs MPI or keeps accounts.
MpiDefault=none
SwitchType=switch/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none

# A node that a slurmd reports is good, whatever was thought of it before.
ReturnToService=2
# Tests wait for this: the time between a scheduler's looks at its queue (s), between SIGTERM and SIGKILL (s), after the
# time limit (min), and for which an ended job is remembered (s).
SchedulerParameters=sched_interval=2,batch_sched_delay=1
KillWait={kill_wait}
OverTimeLimit=0
MinJobAge={remembered}

# An array has this many jobs at most; its last index is one less.
MaxArraySize={array}
{extra}
{nodes}
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE PriorityTier=1 PreemptMode=CANCEL GraceTime={kill_wait}
PartitionName=urgent Nodes=ALL MaxTime=INFINITE PriorityTier=2
"""


def lacking() -> str:
    """Why there can be none here; "" if there can."""
    absent = [program for program in PROGRAMS if shutil.which(program, path=PATH) is None]
    return f"no {', '.join(absent)}; Debian has them in slurm-wlm and munge" if absent else ""


class Cluster:
    """A Slurm, while its `with` block lasts. `environment` is for those who are to use it (SLURM_CONF).

    nodes: hosts. array: MaxArraySize. remembered: MinJobAge (s). extra: further lines of slurm.conf.
    """

    def __init__(self, nodes: int = 1, array: int = 1001, remembered: int = 300, extra: str = ""):
        self.nodes = [f"node{number}" for number in range(1, nodes + 1)]
        self.array, self.remembered, self.extra = array, remembered, extra
        self._daemons: list[subprocess.Popen] = []
        self._controller: subprocess.Popen | None = None

    def __enter__(self) -> "Cluster":
        self.folder = Path(tempfile.mkdtemp(prefix="slurm-"))  # short: a socket's path has 107 characters at most
        self.conf = self.folder / "slurm.conf"
        self.environment = {"SLURM_CONF": str(self.conf)}
        try:
            self._configure()
            self._start("munged", *self._munge())
            self._wait(lambda: (self.folder / "munge.socket").is_socket(), "munged")
            self._controller = self._start("slurmctld", "-D")
            for node in self.nodes:
                self._start("slurmd", "-D", "-N", node)
            self._wait(lambda: self._states() == ["idle"] * len(self.nodes), "the nodes")
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_) -> None:
        """End all jobs, then the daemons; whatever is left is killed."""
        if self._controller and self._controller.poll() is None:
            self.ask("scancel", "--user", getpass.getuser())
            _until(lambda: not self.ask("squeue", "--noheader"), KILL_WAIT + STOP)
        for daemon in reversed(self._daemons):
            daemon.terminate()
            try:
                daemon.wait(STOP)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()
        for process in self.processes():
            os.kill(process, signal.SIGKILL)
        _until(lambda: not self.processes(), STOP)
        shutil.rmtree(self.folder, ignore_errors=True)

    def ask(self, *command: str) -> str:
        """What a command of Slurm prints on either stream."""
        done = subprocess.run(
            command, env={**os.environ, **self.environment}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        return done.stdout.strip()

    def stop_controller(self) -> None:
        """End slurmctld, as a scheduler that is down."""
        self._controller.terminate()
        self._controller.wait(STOP)

    def processes(self) -> list[int]:
        """All that were started here or by a job, and have not ended: they have our SLURM_CONF."""
        mark, found = f"SLURM_CONF={self.conf}".encode(), []
        for place in Path("/proc").glob("[0-9]*"):
            try:
                if mark in (place / "environ").read_bytes().split(b"\0") and int(place.name) != os.getpid():
                    found.append(int(place.name))
            except OSError:  # it has ended, or is not ours
                continue
        return found

    def _configure(self) -> None:
        self.folder.chmod(0o755)
        (self.folder / "state").mkdir()
        (self.folder / "spool").mkdir()
        key = self.folder / "munge.key"
        key.write_bytes(secrets.token_bytes(1024))
        key.chmod(0o600)
        port, *ports = _free_ports(1 + len(self.nodes))
        host, machine = socket.gethostname().partition(".")[0], _machine()
        nodes = [
            f"NodeName={node} NodeHostname={host} NodeAddr=127.0.0.1 Port={own} {machine} State=UNKNOWN"
            for node, own in zip(self.nodes, ports, strict=True)
        ]
        told = {"host": host, "port": port, "user": getpass.getuser(), "folder": self.folder, "nodes": "\n".join(nodes)}
        told |= {"kill_wait": KILL_WAIT, "remembered": self.remembered, "array": self.array, "extra": self.extra}
        self.conf.write_text(CONF.format(**told))

    def _munge(self) -> list[str]:
        """Of munged. --force: it warns where others may write above its folder, as in /tmp, instead of refusing."""
        files = {"socket": "munge.socket", "key-file": "munge.key", "seed-file": "munge.seed"}
        files |= {"pid-file": "munged.pid", "log-file": "munged.log"}
        return ["--foreground", "--force", *(f"--{option}={self.folder / name}" for option, name in files.items())]

    def _start(self, program: str, *arguments: str) -> subprocess.Popen:
        """It ends with this process, however that ends, where setpriv can have it so."""
        leash = ["setpriv", "--pdeathsig", "TERM"] if shutil.which("setpriv") else []
        with open(self.folder / f"{program}.out", "ab") as out:
            daemon = subprocess.Popen(
                [*leash, shutil.which(program, path=PATH), *arguments],
                env={**os.environ, **self.environment},
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.STDOUT,
            )
        self._daemons.append(daemon)
        return daemon

    def _states(self) -> list[str]:
        """Of the nodes; none if nobody answers."""
        if not (self.folder / "slurmctld.log").exists():
            return []
        told = self.ask("sinfo", "--noheader", "--Node", "--partition=all", "--format=%t")
        return [] if "error" in told else told.split()

    def _wait(self, ready, what: str) -> None:
        if not _until(lambda: ready() or self._dead(), START) or self._dead():
            logs = [f"{path.name}:\n{path.read_text()[-2000:]}" for path in self.folder.glob("*.out")]
            raise RuntimeError(f"{what} did not start\n" + "\n".join(logs))

    def _dead(self) -> bool:
        return any(daemon.poll() is not None for daemon in self._daemons)


def _machine() -> str:
    """CPUs, sockets, cores and memory as slurmd finds them, for a line of slurm.conf."""
    told = subprocess.run([shutil.which("slurmd", path=PATH), "-C"], capture_output=True, text=True, check=True).stdout
    return " ".join(re.findall(r"\b(?:CPUs|Boards|\w+Per\w+|RealMemory)=\d+", told))


def _free_ports(count: int) -> list[int]:
    taken = [socket.create_server(("127.0.0.1", 0)) for _ in range(count)]
    ports = [each.getsockname()[1] for each in taken]
    for each in taken:
        each.close()
    return ports


def _until(told, seconds: float) -> bool:
    """Whether it came true in that time."""
    end = time.monotonic() + seconds
    while not told():
        if time.monotonic() > end:
            return False
        time.sleep(0.1)
    return True


if __name__ == "__main__":
    if lacking():
        sys.exit(lacking())
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    with Cluster(nodes=int(sys.argv[1]) if len(sys.argv) > 1 else 1) as cluster:
        print(f"export SLURM_CONF={cluster.conf}", flush=True)
        try:
            signal.pause()
        except KeyboardInterrupt:
            print("ending", file=sys.stderr)
