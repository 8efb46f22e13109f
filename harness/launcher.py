"""Starts one renderer, waits for it, says how it ended: `python -I -S launcher.py SPEC.json`.

A bare interpreter with the standard library only: Linux counts the starter's resident memory into the peak
(ru_maxrss) of what it starts, so the smaller this process, the lower the floor under that number. The renderer
gets a session of its own, so that a kill reaches what it started too. A descendant that outlives its parent (an
orphan) becomes a child of this process, where the system can do that: its time is counted, and it ends with the rest.

SPEC.json: command (list), folder, environment (dict), stdout, stderr (paths), timeout (s).
Prints {"pid", "spawned"} when it has started, {"exited", "timed_out"} when it has ended. Then nothing is reaped, so
that the measurer can read the times of the dead, until a line comes on standard input; and the last line is {"code",
"signal", "user_s", "system_s", "orphans", "orphans_s", "wait4_peak_bytes", "wait4_floor_bytes"}: the seconds with those
of the orphans, null if the system hands them to another. Or one line, {"failed": reason}. Closing this process's
standard input kills the renderer: the harness died or gave up.
"""

import contextlib
import json
import os
import resource
import select
import signal
import sys
import time

GRACE = 1.0  # s between the polite and the certain kill
RSS_UNIT = 1 if sys.platform == "darwin" else 1024
PR_SET_CHILD_SUBREAPER = 36


def adopt():
    """Become the parent of the orphans among the descendants (prctl(2)); False where the system cannot do that."""
    try:
        import ctypes  # 0.4 MB of the floor

        return ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) == 0
    except (ImportError, OSError, AttributeError):
        return False


def spawn(spec):
    null = os.open(os.devnull, os.O_RDONLY)
    out = os.open(spec["stdout"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    err = os.open(spec["stderr"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    os.chdir(spec["folder"])
    command = spec["command"]
    actions = [(os.POSIX_SPAWN_DUP2, fd, n) for n, fd in enumerate((null, out, err))]
    arguments = {"file_actions": actions, "setsigdef": [signal.SIGPIPE, signal.SIGCHLD]}
    spawned = time.monotonic()
    try:
        pid = os.posix_spawnp(command[0], command, spec["environment"], setsid=True, **arguments)
    except NotImplementedError:  # macOS
        pid = os.posix_spawnp(command[0], command, spec["environment"], setpgroup=0, **arguments)
    return pid, spawned


def wait(pid, deadline):
    """Wait for the end of `pid` without reaping it; True if the deadline came first or standard input closed."""
    end = [os.pidfd_open(pid)] if hasattr(os, "pidfd_open") else []
    pause = 60 if end else 0.002  # without a pidfd: look again soon
    while (left := deadline - time.monotonic()) > 0:
        ready = select.select([*end, sys.stdin], [], [], min(left, pause))[0]
        if has_ended(pid):
            return False
        if sys.stdin in ready and not os.read(sys.stdin.fileno(), 4096):
            return True
    return not has_ended(pid)


def has_ended(pid):
    return os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT | os.WNOHANG) is not None


def own_peak():
    """Peak resident memory of this process. Its ru_maxrss would be that of the harness, which started it."""
    with contextlib.suppress(OSError), open("/proc/self/status", encoding="ascii", errors="replace") as status:
        for line in status:
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) * 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * RSS_UNIT


def kill_group(pid, number):
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(pid, number)


def end_all(pid):
    """End what the renderer left behind, which must not disturb the next cell; nothing is reaped."""
    kill_group(pid, signal.SIGKILL)
    os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
    ended = {pid}
    while left := children() - ended:  # the end of one makes orphans of its own children
        ended |= left
        for orphan in left:
            with contextlib.suppress(PermissionError):  # of another user: it is left alone
                os.kill(orphan, signal.SIGKILL)
                os.waitid(os.P_PID, orphan, os.WEXITED | os.WNOWAIT)


def children():
    """Numbers of this process's children, the dead included; none where the system does not list them."""
    own = os.getpid()
    with contextlib.suppress(OSError), open(f"/proc/{own}/task/{own}/children", encoding="ascii") as listed:
        return set(map(int, listed.read().split()))
    return set()


def reap(pid):
    """Status of the renderer; and the usage of it and of each orphan."""
    _, status, usage = os.wait4(pid, 0)
    usages = [usage]
    with contextlib.suppress(ChildProcessError):
        while (found := os.wait4(-1, os.WNOHANG))[0]:
            usages.append(found[2])
    return status, usages


def main(path):
    with open(path, encoding="utf-8") as file:
        spec = json.load(file)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)  # ignored, as an unlucky caller may have it, it loses the dead
    adopts = adopt()
    try:
        pid, spawned = spawn(spec)
    except (OSError, ValueError) as error:  # ValueError: a NUL in a word
        why = getattr(error, "strerror", None) or error
        print(json.dumps({"failed": f"could not start {spec['command'][0]}: {why}"}), flush=True)
        return
    floor = own_peak()  # afterwards: not below what the renderer was given
    print(json.dumps({"pid": pid, "spawned": spawned}), flush=True)
    timed_out = wait(pid, spawned + spec["timeout"])
    if timed_out:
        kill_group(pid, signal.SIGTERM)
        ended = time.monotonic() + GRACE
        while time.monotonic() < ended:
            if has_ended(pid):
                break
            time.sleep(0.01)
    exited = time.monotonic()
    end_all(pid)
    print(json.dumps({"exited": exited, "timed_out": timed_out}), flush=True)
    os.read(sys.stdin.fileno(), 4096)
    status, usages = reap(pid)
    print(
        json.dumps(
            {
                "code": os.WEXITSTATUS(status) if os.WIFEXITED(status) else None,
                "signal": os.WTERMSIG(status) if os.WIFSIGNALED(status) else None,
                "user_s": sum(usage.ru_utime for usage in usages),
                "system_s": sum(usage.ru_stime for usage in usages),
                "orphans": len(usages) - 1 if adopts else None,
                "orphans_s": sum(usage.ru_utime + usage.ru_stime for usage in usages[1:]) if adopts else None,
                "wait4_peak_bytes": max(usage.ru_maxrss for usage in usages) * RSS_UNIT,
                "wait4_floor_bytes": floor,
            }
        ),
        flush=True,
    )


if __name__ == "__main__":
    main(sys.argv[1])
