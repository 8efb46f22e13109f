"""A rayrace that meets a fault at an instant of its own choosing, and what must be true of what is left.

`python faulty.py` imports all that a run needs and then forks for each line of its standard input, a JSON object:
{"words": of the command line, "said": file for its output, "at": number of the instant or null, "what": "kill" or the
name of an errno, "lasting": the error comes again at all later instants, "within": only instants of a path with this in
it count}. It answers with two lines: {"pid"}, and {"status", "instants"} when that has ended.

An instant is a moment just before the interpreter opens a file to write it, renames or removes one, makes a folder, or
starts a process (the audit events of PEP 578). "kill" is a SIGKILL of the harness just then; an errno, the failure of
what it was about to do.
"""

import contextlib
import errno
import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from compilers import compiler

PROGRAM = Path(sys.executable).with_name("rayrace")
WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT
ALWAYS = "os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.truncate", "subprocess.Popen", "shutil.copyfile"
TINY = """title = "t"
scenes = ["scene.txt"]
renderers = ["flat", "flat-again"]
processes = 2
frames = 1
timeout = "30 s"
[image]
width = 8
height = 7
depth = 0
[measure]
interval = "20 ms"
"""
SCENE = """CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,3)
BACKGROUND (0.2,0.5,0.7)
LIGHT (4,5,6) (1,1,1) 0
SPHERE (0,0,-1) 0.8 (0.7,0.5,0.3) 0 20 (0,0,0) 1e6 1
"""
FLAT = Path(__file__).parents[1] / "harness" / "c_renderer"


def tiny(place, more="", processes=2):
    """An experiment of two variants that take no time: its file, and the words that name their renderer."""
    compiler("c")
    place.mkdir(parents=True, exist_ok=True)
    (place / "scene.txt").write_text(SCENE)
    folder = place / "flat"
    folder.mkdir(exist_ok=True)
    (folder / "flat.c").write_text((FLAT / "flat.c").read_text())
    manifest = (FLAT / "renderer.toml").read_text()
    again = manifest[manifest.index("[[variant]]") :].replace('"flat"', '"flat-again"')
    (folder / "renderer.toml").write_text(f"{manifest}\n{again}")
    file = place / "tiny.toml"
    file.write_text(TINY.replace("processes = 2", f"processes = {processes}") + more)
    return file, ["--renderer", str(folder)]


def wrong_clock(place, seconds=0):
    """The environment of a process whose wall clock is wrong by what is written in the file at WRONG_CLOCK."""
    library = place / "wrong_clock.so"
    source = Path(__file__).with_name("wrong_clock.c")
    subprocess.run([compiler("c"), "-shared", "-fPIC", "-O1", "-w", source, "-o", library, "-ldl"], check=True)
    (place / "wrong").write_text(f"{seconds}\n")
    return {"LD_PRELOAD": str(library), "WRONG_CLOCK": str(place / "wrong")}


class Faulty:
    """Runs of rayrace that are told where to meet a fault."""

    def __init__(self, environment):
        self.process = subprocess.Popen(
            [sys.executable, __file__], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def start(self, words, said, at=None, what="kill", lasting=False, within=None):
        """Begin one; its number. within: instants are counted of files in this folder alone."""
        told = {"words": list(map(str, words)), "said": str(said), "at": at, "what": what, "lasting": lasting}
        self.process.stdin.write(json.dumps({**told, "within": str(within or "")}) + "\n")
        self.process.stdin.flush()
        return json.loads(self.process.stdout.readline())["pid"]

    def wait(self):
        """Exit status, negative of a signal; and how many instants there were."""
        told = json.loads(self.process.stdout.readline())
        return told["status"], told["instants"]

    def run(self, words, said, **how):
        self.start(words, said, **how)
        return self.wait()

    def close(self):
        self.process.stdin.close()
        self.process.wait()
        self.process.stdout.close()


def processes_of(*places):
    """Numbers of the processes that have one of these folders in their command, their environment or as their own."""
    found, wanted = [], [str(place).encode() for place in places]
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            told = (entry / "cmdline").read_bytes() + (entry / "environ").read_bytes()
            told += os.fsencode(os.readlink(entry / "cwd"))
        except OSError:
            continue
        if any(place in told for place in wanted) and int(entry.name) != os.getpid():
            found.append(int(entry.name))
    return found


def wait_until(is_true, seconds=60):
    until = time.monotonic() + seconds
    while not is_true():
        assert time.monotonic() < until, "it never came true"
        time.sleep(0.02)


def store_key(record):
    return record["cell"], record["repetition"], record["pass"]


def timeless(record, folder):
    """What two runs of the same must agree in: not in their times, nor in which of two equal maps a row names."""
    names = "cell", "repetition", "pass", "variant", "scene", "parameters", "needs", "status", "reason", "rays"
    found = {**{name: record[name] for name in names}, "frames": len(record["frames_s"] or [])}
    for name in ("picture", "agreement", "error"):
        found[name] = {
            key: hashlib.sha256((folder / value).read_bytes()).hexdigest() if "file" in key and value else value
            for key, value in (record[name] or {}).items()
        }
    return found


def main():
    import rayrace.main
    import rayrace.terminal  # noqa: F401

    for line in sys.stdin:
        told = json.loads(line)
        reader, writer = os.pipe()
        pid = os.fork()
        if pid == 0:
            os.close(reader)
            _child(told, writer)
        os.close(writer)
        print(json.dumps({"pid": pid}), flush=True)
        _, status = os.waitpid(pid, 0)
        with os.fdopen(reader) as counted:
            instants = len(counted.read())
        print(json.dumps({"status": os.waitstatus_to_exitcode(status), "instants": instants}), flush=True)


def _child(told, writer):
    os.setsid()
    said = os.open(told["said"], os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
    null = os.open(os.devnull, os.O_RDONLY)
    for number, target in enumerate((null, said, said)):
        os.dup2(target, number)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.argv = ["rayrace", *told["words"]]
    count = 0

    def hook(event, arguments):
        nonlocal count
        if event == "open":
            path, _, flags = arguments
            if not (isinstance(path, str) and isinstance(flags, int) and flags & WRITING) or path.startswith("/dev/"):
                return
        elif event not in ALWAYS:
            return
        if told["within"] and told["within"] not in str(arguments[:2]):
            return
        if told["at"] is not None and (count == told["at"] or (told["lasting"] and count > told["at"])):
            if told["what"] == "kill":
                os.kill(os.getpid(), signal.SIGKILL)
            count += 1
            number = getattr(errno, told["what"])
            raise OSError(number, os.strerror(number), str(arguments[0]))
        count += 1
        os.write(writer, b".")

    sys.addaudithook(hook)
    from rayrace.main import main as rayrace

    try:
        rayrace()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        import traceback

        traceback.print_exc()
        code = 99
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError):
            stream.flush()
    os._exit(code)


if __name__ == "__main__":
    main()
