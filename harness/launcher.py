"""Starts one renderer, waits for it, says how it ended: `python -I -S launcher.py SPEC.json`.

A bare interpreter with the standard library only: Linux counts the starter's resident memory into the peak
(ru_maxrss) of what it starts, so the smaller this process, the lower the floor under that number. The renderer
gets a session of its own, so that a kill reaches everything it started.

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
    if hasattr(os, "pidfd_open"):
        end = os.pidfd_open(pid)
        while True:
            left = deadline - time.monotonic()
            ready = select.select([end, sys.stdin], [], [], max(0, left))[0]
            if end in ready:
                os.close(end)
                return False
            if sys.stdin in ready and os.read(sys.stdin.fileno(), 4096):
                continue
            os.close(end)
            return True
    while time.monotonic() < deadline:
        if os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT | os.WNOHANG) is not None:
            return False
        if select.select([sys.stdin], [], [], 0.002)[0] and not os.read(sys.stdin.fileno(), 4096):
            return True
    return True


def kill_group(pid, number):
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(pid, number)


def main(path):
    with open(path, encoding="utf-8") as file:
        spec = json.load(file)
    try:
        pid, spawned = spawn(spec)
    except OSError as error:
        print(json.dumps({"failed": f"could not start {spec['command'][0]}: {error.strerror}"}), flush=True)
        return
    floor = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * RSS_UNIT
    print(json.dumps({"pid": pid, "spawned": spawned}), flush=True)
    timed_out = wait(pid, spawned + spec["timeout"])
    if timed_out:
        kill_group(pid, signal.SIGTERM)
        ended = time.monotonic() + GRACE
        while time.monotonic() < ended:
            if os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT | os.WNOHANG) is not None:
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
