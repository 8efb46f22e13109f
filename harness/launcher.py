"""Starts one renderer, waits for it, says how it ended: `python -I -S launcher.py SPEC.json`.

A bare interpreter with the standard library only: Linux counts the starter's resident memory into the peak
(ru_maxrss) of what it starts, so the smaller this process, the lower the floor under that number. The renderer
gets a session of its own, so that a kill reaches what it started too, unless that began a session of its own.

SPEC.json: command (list), folder, environment (dict), stdout, stderr (paths), timeout (s).
Prints two JSON lines: {"pid", "spawned"} when it has started, {"exited", "code", "signal", "timed_out", "user_s",
"system_s", "wait4_peak_bytes", "wait4_floor_bytes"} when it has ended; or {"failed": reason}. Closing this process's
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


def spawn(spec):
    null = os.open(os.devnull, os.O_RDONLY)
    out = os.open(spec["stdout"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    err = os.open(spec["stderr"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    os.chdir(spec["folder"])
    command = spec["command"]
    actions = [(os.POSIX_SPAWN_DUP2, fd, n) for n, fd in enumerate((null, out, err))]
    arguments = {"file_actions": actions, "setsigdef": [signal.SIGPIPE]}
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


def main(path):
    with open(path, encoding="utf-8") as file:
        spec = json.load(file)
    floor = own_peak()
    try:
        pid, spawned = spawn(spec)
    except (OSError, ValueError) as error:  # ValueError: a NUL in a word
        why = getattr(error, "strerror", None) or error
        print(json.dumps({"failed": f"could not start {spec['command'][0]}: {why}"}), flush=True)
        return
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
    # What it left behind in its group must not disturb the next cell. Not reaped yet, so the number is still its own.
    kill_group(pid, signal.SIGKILL)
    _, status, usage = os.wait4(pid, 0)
    print(
        json.dumps(
            {
                "exited": exited,
                "code": os.WEXITSTATUS(status) if os.WIFEXITED(status) else None,
                "signal": os.WTERMSIG(status) if os.WIFSIGNALED(status) else None,
                "timed_out": timed_out,
                "user_s": usage.ru_utime,
                "system_s": usage.ru_stime,
                "wait4_peak_bytes": usage.ru_maxrss * RSS_UNIT,
                "wait4_floor_bytes": floor,
            }
        ),
        flush=True,
    )


if __name__ == "__main__":
    main(sys.argv[1])
