"""Starts one renderer, waits for it, reports how it ended: `python -I -S launcher.py SPEC.json`.

A bare interpreter with the standard library only: Linux counts the starter's resident memory into the peak
(ru_maxrss) of what it starts, so the smaller this process, the lower the floor under that number. The renderer
gets a session of its own, so that a kill reaches what it started too. A descendant that outlives its parent (an
orphan) becomes a child of this process, where the system can do that: its time is counted, and it ends with the rest.

SPEC.json: command (list), folder, environment (dict), stdout, stderr (paths), timeout (s), limits (of limits.py: name
to number), places (folders in which `disk` counts what is written), confined (whether it is kept from other processes).
Prints {"pid", "spawned"} when it has started, {"exited", "timed_out", "stopped"} when it has ended; stopped: it was
stopped by a signal when its time was up. Then nothing is reaped, so that the measurer can read the times of the dead,
until a line comes on standard input; and the last line is {"code", "signal", "user_s", "system_s", "orphans",
"orphans_s", "wait4_peak_bytes", "wait4_floor_bytes", "over"}: the seconds with those of the orphans, null if the system
hands them to another; over: null, or [name of the limit that it was over, how much it was]. Or one line, {"failed":
reason}. Closing this process's standard input kills the renderer: the harness died or gave up.
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
LOOK = 0.1  # s between looks at the limits, of which one costs 0.1 to 0.3 ms;
SHARE = 0.05  # of the time that they may take, where there is much to look at
BLOCK = 4096  # bytes that a file takes at least, an empty one too
MEMORY = "/dev/shm"  # a file system in memory, which all may write to
RSS_UNIT = 1 if sys.platform == "darwin" else 1024
REALTIME_COARSE = 5  # clock_gettime(2)
PR_SET_CHILD_SUBREAPER, PR_SET_NO_NEW_PRIVS = 36, 38
LANDLOCK, REFER = 444, 1 << 13  # the first of three system calls, the same everywhere; a right of theirs


def adopt():
    """Become the parent of the orphans among the descendants (prctl(2)); False where the system cannot do that."""
    try:
        import ctypes  # 0.4 MB of the floor

        return ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) == 0
    except (ImportError, OSError, AttributeError):
        return False


def confine():
    """Keep this process and all that it starts from the memory and environment of other processes (landlock(7)); False
    where the system cannot do that.

    Files stay as they are for them. The system could keep some out of reach, but then also all that is made later
    beside the way to those, and files without a name: compilers in renderers make such, and read them.
    """
    try:
        import ctypes

        system = ctypes.CDLL(None, use_errno=True)
        handled = (ctypes.c_uint64 * 1)(REFER)  # who may do nothing else may move no file to another folder
        rules = system.syscall(LANDLOCK, handled, ctypes.c_size_t(8), ctypes.c_long(0))
        if rules < 0:
            return False
        root = os.open("/", os.O_PATH | os.O_CLOEXEC)
        rule = REFER.to_bytes(8, sys.byteorder) + root.to_bytes(4, sys.byteorder)
        allowed = system.syscall(LANDLOCK + 1, ctypes.c_long(rules), ctypes.c_long(1), rule, ctypes.c_long(0)) == 0
        os.close(root)
        system.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0)
        return allowed and system.syscall(LANDLOCK + 2, ctypes.c_long(rules), ctypes.c_long(0)) == 0
    except (ImportError, OSError, AttributeError):
        return False


def spawn(spec):
    null = os.open(os.devnull, os.O_RDONLY)
    out = os.open(spec["stdout"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    err = os.open(spec["stderr"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    os.chdir(spec["folder"])
    command = spec["command"]
    actions = [(os.POSIX_SPAWN_DUP2, fd, n) for n, fd in enumerate((null, out, err))]
    arguments = {"file_actions": actions, "setsigdef": [signal.SIGPIPE, signal.SIGCHLD, signal.SIGXFSZ]}
    spawned = time.monotonic()
    try:
        pid = os.posix_spawnp(command[0], command, spec["environment"], setsid=True, **arguments)
    except NotImplementedError:  # macOS
        pid = os.posix_spawnp(command[0], command, spec["environment"], setpgroup=0, **arguments)
    return pid, spawned, (out, err)


def inherit(limits):
    """Limits that the system holds the renderer to, as it inherits them: the size of a file, and no core dumps.

    Of 1, not 0, with which a program that collects them still gets one: core(5), "Piping core dumps to a program".
    """
    for kind, number in ((resource.RLIMIT_FSIZE, limits.get("disk")), (resource.RLIMIT_CORE, 1)):
        if number is not None:
            hard = resource.getrlimit(kind)[1]
            number = int(number) if hard == resource.RLIM_INFINITY else min(int(number), hard)
            resource.setrlimit(kind, (number, number))


class Limits:
    """Checks a renderer against its limits."""

    def __init__(self, limits, outputs, places, before, files):
        self.limits, self.outputs, self.places, self.files = limits, outputs, places, files
        self.before = before  # bytes that were in `places`
        self.due, self.pss_due = time.monotonic() + LOOK, 0.0
        self.seen = None  # processes and their CPU time when all was looked at, None if they cannot be told

    def look(self, now):
        """[limit, how much] of the first that it is over, or None. `due` is then when to look again.

        Processes that have used no CPU time since all was looked at have written nothing, and taken no memory.
        """
        began, pids = time.process_time(), family()
        seen = cpu_ticks(pids)
        if seen is not None and seen == self.seen:
            self.due = now + LOOK
            return None
        self.seen = seen
        amounts = [*self.written(), *self.living(pids, now)]
        cost = time.process_time() - began
        self.due = now + max(LOOK, cost / SHARE)
        return next(iter(self.over(amounts)), None)

    def over(self, amounts):
        return [[name, used] for name, used in amounts if used > self.limits.get(name, used)]

    def written(self):
        """[limit, how much] of what stays when all have ended."""
        yield "output", sum(os.fstat(fd).st_size for fd in self.outputs)
        if "disk" in self.limits:
            yield "disk", sum(size(place, self.before + self.limits["disk"]) for place in self.places) - self.before

    def living(self, pids, now):
        """[limit, how much] of what ends with them."""
        yield "processes", len(pids)
        files = self.files.size(pids)
        mapped = sum(sizes(pid, "status", "RssShmem:")[0] for pid in pids) if files else 0
        used = sum(map(rss, pids)) + max(0, files - mapped)
        if self.over([("memory", used)]) and len(pids) > 1:  # some of it may be shared
            if now < self.pss_due:
                self.seen = None
                return
            began = time.process_time()
            used = shared_once(pids, files)
            self.pss_due = now + (time.process_time() - began) / SHARE
        yield "memory", used


def size(folder, most):
    """Bytes that the files below a folder take, up to about `most`: what is more is not looked at."""
    total, folders = 0, [folder]
    while folders and total <= most:
        with contextlib.suppress(OSError), os.scandir(folders.pop()) as entries:
            for entry in entries:
                with contextlib.suppress(OSError):
                    total += max(BLOCK, entry.stat(follow_symlinks=False).st_blocks * 512)
                    if entry.is_dir(follow_symlinks=False):
                        folders.append(entry.path)
                    if total > most:
                        break
    return total


def cpu_ticks(pids):
    """{process: its CPU time in ticks}; None if the system does not tell that of each."""
    ticks = {}
    for pid in pids:
        try:
            with open(f"/proc/{pid}/stat", "rb") as file:
                fields = file.read().rpartition(b")")[2].split()
        except OSError:
            return None
        ticks[pid] = int(fields[11]) + int(fields[12])  # utime and stime, proc(5)
    return ticks


def rss(pid):
    """Resident memory of a process, bytes; 0 of a dead one, and where the system does not tell."""
    with contextlib.suppress(OSError, IndexError), open(f"/proc/{pid}/statm", "rb") as sizes:
        return int(sizes.read().split()[1]) * resource.getpagesize()
    return 0


def sizes(pid, name, *keys):
    """Sizes in a file of /proc/PID that gives them as "KEY 123 kB"; 0 of a dead process, and where there is no such."""
    values = dict.fromkeys(keys, 0)
    with contextlib.suppress(OSError), open(f"/proc/{pid}/{name}", encoding="ascii", errors="replace") as lines:
        for line in lines:
            key = line.split(maxsplit=1)[0]
            if key in values:
                values[key] = int(line.split()[1]) * 1024
    return list(values.values())


def shared_once(pids, files):
    """Memory of processes, each page divided by the number of those that share it; and of files in memory.

    It is of the moment when all are read, or a little less: who has ended by then, and pages that were given back, do
    not count. Others, read later, own a larger share of those pages, so they would count more than once.
    """
    readings = [(pid, rss(pid), *sizes(pid, "smaps_rollup", "Pss:", "Pss_Shmem:")) for pid in pids]
    total = mapped = 0
    for pid, before, pss, shared in readings:
        after = rss(pid)
        if after:
            total += max(0, pss - max(0, before - after))
            mapped += shared
    return total + max(0, files - mapped)


class MemoryFiles:
    """The files that a family keeps in memory: of memfd_create(2), and in MEMORY.

    Their pages are in the memory of no process, unless it maps them. Those in MEMORY stay when they are closed. A file
    there is the family's if one of it had it open when somebody looked, and it was made or changed since this began.
    """

    def __init__(self):
        self.began, self.paths = now_of_files(), {}

    def size(self, pids):
        """Bytes of the files of these processes."""
        amounts = {}
        for file, (path, status) in opened(pids).items():
            if path.startswith(MEMORY):
                if status.st_ctime_ns < self.began:
                    continue
                self.paths[file] = path
            amounts[file] = status.st_blocks * 512
        for file in self.paths.keys() - amounts.keys():
            with contextlib.suppress(OSError):
                status = os.stat(self.paths[file], follow_symlinks=False)
                if (status.st_dev, status.st_ino) == file:
                    amounts[file] = status.st_blocks * 512
        return sum(amounts.values())


def now_of_files():
    """The time that a file would have which changes now, ns: on Linux that of the last tick of the kernel."""
    return time.clock_gettime_ns(REALTIME_COARSE) if sys.platform == "linux" else time.time_ns()


def opened(pids):
    """{(device, inode): (path, stat)} of the files in memory that processes have open."""
    files = {}
    for pid in pids:
        for number in numbers(f"/proc/{pid}/fd"):
            name = f"/proc/{pid}/fd/{number}"
            with contextlib.suppress(OSError):
                path = os.readlink(name)
                if path.startswith(("/memfd:", f"{MEMORY}/")):
                    status = os.stat(name)
                    files[status.st_dev, status.st_ino] = path, status
    return files


def numbers(folder):
    """The entries of a folder that are numbers."""
    with contextlib.suppress(OSError):
        return [int(name) for name in os.listdir(folder) if name.isdecimal()]
    return []


def wait(pid, deadline, limits):
    """Wait for the end of `pid` without reaping it. True if the deadline came first or standard input closed; and the
    limit that it was over before that, as Limits.look has it, or None."""
    end = [os.pidfd_open(pid)] if hasattr(os, "pidfd_open") else []
    while (left := deadline - (now := time.monotonic())) > 0:
        over = limits.look(now) if now >= limits.due else None
        if over:
            return False, over
        pause = max(0.0, limits.due - time.monotonic()) if end else 0.002  # without a pidfd: look again soon
        ready = select.select([*end, sys.stdin], [], [], min(left, pause))[0]
        if has_ended(pid):
            return False, None
        if sys.stdin in ready and not os.read(sys.stdin.fileno(), 4096):
            return True, None
    return not has_ended(pid), None


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
    while left := set(children(os.getpid())) - ended:  # the end of one makes orphans of its own children
        ended |= left
        for number in set(family()) - ended | left:  # all before the first is waited for: they may be multiplying
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(number, signal.SIGKILL)
        for orphan in left:
            with contextlib.suppress(PermissionError):  # of another user: it is left alone
                os.kill(orphan, signal.SIGKILL)
                os.waitid(os.P_PID, orphan, os.WEXITED | os.WNOWAIT)


def family():
    """Numbers of all processes below this one, the dead that nobody has waited for included."""
    pids = children(os.getpid())
    for pid in pids:  # which grows meanwhile
        pids += children(pid)
    return pids


def children(pid):
    """Numbers of the children of a process's threads; none where the system does not list them."""
    pids = []
    with contextlib.suppress(OSError):
        for thread in os.listdir(f"/proc/{pid}/task"):
            with contextlib.suppress(OSError), open(f"/proc/{pid}/task/{thread}/children", "rb") as listed:
                pids += map(int, listed.read().split())
    return pids


def reap(pid):
    """Status of the renderer; and the usage of it and of each orphan."""
    _, status, usage = os.wait4(pid, 0)
    usages = [usage]
    with contextlib.suppress(ChildProcessError):
        while (orphan := os.wait4(-1, os.WNOHANG))[0]:
            usages.append(orphan[2])
    return status, usages


def say(message):
    """One line to the harness. If that is dead, standard input is closed too, which ends the renderer."""
    with contextlib.suppress(BrokenPipeError):
        os.write(1, json.dumps(message).encode() + b"\n")


def main(path):
    with open(path, encoding="utf-8") as file:
        spec = json.load(file)
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)  # ignored, as an unlucky caller may have it, it loses the dead
    adopts = adopt()
    limits, places = spec["limits"], spec["places"]
    before, files = sum(size(place, float("inf")) for place in places), MemoryFiles()
    inherit(limits)
    if spec["confined"]:
        confine()
    try:
        pid, spawned, outputs = spawn(spec)
    except (OSError, ValueError) as error:  # ValueError: a NUL in a word
        why = getattr(error, "strerror", None) or error
        say({"failed": f"could not start {spec['command'][0]}: {why}"})
        return
    floor = own_peak()  # afterwards: not below what the renderer was given
    say({"pid": pid, "spawned": spawned})
    watched = Limits(limits, outputs, places, before, files)
    timed_out, over = wait(pid, spawned + spec["timeout"], watched)
    stopped = timed_out and os.waitid(os.P_PID, pid, os.WSTOPPED | os.WNOWAIT | os.WNOHANG) is not None
    if timed_out:
        kill_group(pid, signal.SIGTERM)
        ended = time.monotonic() + GRACE
        while time.monotonic() < ended:
            if has_ended(pid):
                break
            time.sleep(0.01)
    exited = time.monotonic()
    end_all(pid)
    say({"exited": exited, "timed_out": timed_out, "stopped": stopped})
    if not (timed_out or over):  # what it did after the last look
        over = next(iter(watched.over(watched.written())), None)
    os.read(sys.stdin.fileno(), 4096)
    status, usages = reap(pid)
    peak = max(usage.ru_maxrss for usage in usages) * RSS_UNIT
    if not (timed_out or over):  # for a moment between two looks
        over = next(iter(watched.over([["memory", peak]])), None)
    say(
        {
            "code": os.WEXITSTATUS(status) if os.WIFEXITED(status) else None,
            "signal": os.WTERMSIG(status) if os.WIFSIGNALED(status) else None,
            "user_s": sum(usage.ru_utime for usage in usages),
            "system_s": sum(usage.ru_stime for usage in usages),
            "orphans": len(usages) - 1 if adopts else None,
            "orphans_s": sum(usage.ru_utime + usage.ru_stime for usage in usages[1:]) if adopts else None,
            "wait4_peak_bytes": peak,
            "wait4_floor_bytes": floor,
            "over": over,
        }
    )


if __name__ == "__main__":
    main(sys.argv[1])
