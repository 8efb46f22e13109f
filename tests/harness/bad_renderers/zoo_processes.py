"""Leaves processes behind, multiplies, and kills those around it."""

import contextlib
import glob
import os
import resource
import signal
import time

from main import flags, good, hang


def leave(*steps, count=1):
    """Children that take these steps and stay, deaf to all that can be ignored."""
    for _ in range(count):
        if os.fork() == 0:
            for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
                signal.signal(number, signal.SIG_IGN)
            for step in steps:
                step()
            hang()


def fork_again():
    if os.fork():
        os._exit(0)


def daemonise():
    fork_again()
    os.setsid()
    fork_again()
    os.chdir("/")
    for fd in range(3):
        os.close(fd)


def stop():
    os.kill(os.getpid(), signal.SIGSTOP)


def left(*steps, count=1):
    def misdeed():
        leave(*steps, count=count)
        time.sleep(0.1)
        good()

    return misdeed


def bomb(escape, doublings=8):
    """At most 2^8 processes."""
    for _ in range(doublings):
        if os.fork() == 0 and escape:
            os.setsid()
    hang()


def roll(generations=400):
    """One process at a time, which starts the next and ends."""
    if os.fork():
        hang()
    for _ in range(generations):
        os.setsid() if os.getsid(0) != os.getpid() else None
        fork_again()
        time.sleep(0.002)
    hang()


def kill_parent(number=signal.SIGKILL):
    leave(os.setsid)
    leave(daemonise)
    time.sleep(0.1)
    os.kill(os.getppid(), number)
    hang()


def kill_measurer():
    """A sibling of the launcher."""
    time.sleep(0.2)
    with open(f"/proc/{os.getppid()}/stat") as file:
        harness = file.read().rpartition(")")[2].split()[1]
    for place in glob.glob(f"/proc/{harness}/task/*/children"):
        with open(place) as file:
            for pid in file.read().split():
                with open(f"/proc/{pid}/cmdline") as command:
                    if "harness.process.measurer" in command.read():
                        os.kill(int(pid), signal.SIGKILL)
    good()


def speak_for_the_launcher():
    with open(f"/proc/{os.getppid()}/fd/1", "w") as pipe:
        pipe.write("all is well\n")
    hang()


def lower_itself():
    os.nice(19)
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    os.umask(0o777)
    for kind in (resource.RLIMIT_NOFILE, resource.RLIMIT_NPROC):
        resource.setrlimit(kind, (50, 50))
    os.umask(0o22)
    good()


def dump_core():
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CORE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    os.chdir(flags["cache"])
    os.abort()


MISDEEDS = {
    "zoo-child": left(),
    "zoo-child-orphan": left(fork_again),
    "zoo-child-session": left(os.setsid),
    "zoo-child-daemon": left(daemonise),
    "zoo-child-stopped": left(os.setsid, stop),
    "zoo-child-many": left(os.setsid, count=30),
    "zoo-fork-exit": lambda: hang() if os.fork() == 0 else os._exit(0),
    "zoo-bomb": lambda: bomb(escape=False),
    "zoo-bomb-sessions": lambda: bomb(escape=True),
    "zoo-bomb-rolling": roll,
    "zoo-kill-launcher": kill_parent,
    "zoo-kill-group": lambda: leave() or os.kill(0, signal.SIGKILL),
    "zoo-kill-measurer": kill_measurer,
    "zoo-stop-launcher": lambda: kill_parent(signal.SIGSTOP),
    "zoo-false-launcher": speak_for_the_launcher,
    "zoo-core": dump_core,
    "zoo-lowered": lower_itself,
}
