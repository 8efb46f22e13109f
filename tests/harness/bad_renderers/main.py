"""Paints the background of a scene, and does one thing wrong: the variant says what. Standard library only."""

import json
import os
import signal
import struct
import sys
import time

STARTED = time.monotonic()
flags = dict(word[2:].split("=", 1) for word in sys.argv[1:])
x0, y0, x1, y1 = map(int, flags["region"].split(","))
HEIGHT, WIDTH = y1 - y0, x1 - x0
FRAMES = int(flags["frames"]) + 1
BATCHES = float(flags["least_frame"]) > 0
GOOD_RAYS = {"primary": WIDTH * HEIGHT, "reflected": 0, "transmitted": 0, "shadow": 0, "non_finite": 0}


def say(event, **values):
    print(json.dumps({"event": event, **values}), flush=True)


def npy(values, shape, descr="<f8", code="d"):
    header = f"{{'descr': {descr!r}, 'fortran_order': False, 'shape': {shape!r}, }}".ljust(117) + "\n"
    return (
        b"\x93NUMPY\x01\x00"
        + struct.pack("<H", len(header))
        + header.encode()
        + struct.pack(f"<{len(values)}{code}", *values)
    )


def background():
    with open(f"{flags['job']}/background.npy", "rb") as file:
        colour = struct.unpack("<3d", file.read()[-24:])
    return list(colour) * (WIDTH * HEIGHT)


def save(data, name="image.npy"):
    with open(f"{flags['out']}/{name}", "wb") as file:
        file.write(data)


def good(frames=None, data=None, file="image.npy", rays=GOOD_RAYS, life=None, extra=(), parts=None, renders=None):
    """Everything right, but for what is given."""
    start, end = life or (STARTED, None)
    now = time.monotonic()
    for index in range(FRAMES) if frames is None else frames:
        more = {} if renders is None else {"renders": renders(index)}
        now, before = time.monotonic() + 1e-6, now
        while time.monotonic() < now:
            pass
        say("frame", index=index, start=before, end=now, parts=parts, **more)
    say("phase", name="render", start=start, end=time.monotonic() if end is None else end)
    if data is not None:
        save(data)
    elif file == "image.npy":
        save(npy(background(), (HEIGHT, WIDTH, 3)))
    if rays:
        say("rays", **rays)
    for line in extra:
        print(line)
    if file is not None:
        say("output", file=file)


def changed(place, value, **more):
    values = background()
    values[place] = value(values[place])
    good(data=npy(values, (HEIGHT, WIDTH, 3)), **more)


def on_device(change=0.0, **more):
    """Right but for `change` in one value, and says what a renderer for a GPU says, its flags among it."""
    names = ("scene_memory", "block_width", "block_height", "total_threads", "max_registers")
    say("used", features=[], methods={name: flags[name] for name in names})
    simulated = os.environ.get("RAYRACE_CUDASIM") == "1"
    say("device", name="a device", simulated=simulated, compute_capability=[9, 0], clock_mhz=1980.5)
    changed(7, lambda value: value + change, parts={"kernel": 0, "download": 1e-6}, **more)


def batches(first=1, later=64, count=1):
    """Says that frames are batches where that is asked for; count: of how many renders it counts the rays."""
    if not BATCHES:
        return good()
    rays = {kind: count * number for kind, number in GOOD_RAYS.items()}
    good(rays=rays, renders=lambda index: later if index else first)


def outside():
    other = os.path.join(os.path.dirname(flags["out"]), "image.npy")
    with open(other, "wb") as file:
        file.write(npy(background(), (HEIGHT, WIDTH, 3)))
    good(file="../image.npy")


def link():
    outside_file = os.path.join(os.path.dirname(flags["out"]), "image.npy")
    with open(outside_file, "wb") as file:
        file.write(npy(background(), (HEIGHT, WIDTH, 3)))
    os.symlink(outside_file, f"{flags['out']}/linked.npy")
    good(file="linked.npy")


def no_folder():
    good()
    os.remove(f"{flags['out']}/image.npy")
    os.rmdir(flags["out"])


def hang():
    time.sleep(600)


def stubborn():
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    hang()


def children():
    """Leaves a child behind that ignores everything it can; both must be gone afterwards. Its id is in `cache`."""
    child = os.fork()
    if child == 0:
        stubborn()
    with open(f"{flags['cache']}/child", "w") as file:
        file.write(str(child))


def hang_with_child():
    children()
    stubborn()


def good_with_child():
    children()
    good()


def garbage():
    print("Rendering... 100 %", flush=True)
    sys.stdout.buffer.write(bytes(range(256)) + b"\n")
    good()


def huge():
    line = "x" * 99 + "\n"
    for _ in range(300):
        sys.stdout.write(line * 1000)  # 30 MB in all
    good()


def huge_line():
    sys.stdout.write("y" * (70 << 20))
    good()


def chatter():
    sys.stderr.write("a word to people\n" * 10**6)
    sys.stderr.write("the last word\n")
    sys.exit(1)


def panic():
    sys.stderr.write("thread 'main' panicked at src/main.rs:3:5:\nno scene today\nnote: run with `RUST_BACKTRACE=1`\n")
    sys.exit(101)


def pickled():
    good(data=npy([], (1,), "|O") + b"cos\nsystem\n(S'true'\ntR.")


def fail(status, say_why=True):
    if say_why:
        say("error", reason="no scene today")
    else:
        print("first line\nIt broke here", file=sys.stderr)
    sys.exit(status)


def end_by(number):
    os.kill(os.getpid(), number)
    time.sleep(10)


def gap():
    say("phase", name="load", start=STARTED, end=time.monotonic())
    time.sleep(0.5)
    good(life=(time.monotonic(), None))


def overlap():
    time.sleep(0.05)
    say("phase", name="load", start=STARTED, end=time.monotonic())
    good()


def whole():
    good(
        data=npy(
            background()[:3] * int(flags["width"]) * int(flags["height"]),
            (int(flags["height"]), int(flags["width"]), 3),
        )
    )


MISDEEDS = {
    "bad-nothing": good,
    "bad-obedient": good,
    "bad-blind": good,
    "bad-random": lambda: changed(7, lambda value: value + os.getpid() * 1e-16),
    "bad-threads": lambda: changed(7, lambda value: value + int(flags["threads"]) * 1e-12),
    "bad-gap": gap,
    "bad-region": whole,
    "bad-exit": lambda: fail(1),
    "bad-exit-silent": lambda: os._exit(7),
    "bad-exit-stderr": lambda: fail(2, say_why=False),
    "bad-panic": panic,
    "bad-chatter": chatter,
    "bad-refuse": lambda: fail(3),
    "bad-segv": lambda: end_by(signal.SIGSEGV),
    "bad-sigkill": lambda: end_by(signal.SIGKILL),
    "bad-rt-signal": lambda: end_by(40),
    "bad-hang": hang,
    "bad-stubborn": stubborn,
    "bad-hang-child": hang_with_child,
    "bad-child": good_with_child,
    "bad-garbage": garbage,
    "bad-huge": huge,
    "bad-huge-line": huge_line,
    "bad-no-event": lambda: None,
    "bad-no-frames": lambda: good(frames=()),
    "bad-few-frames": lambda: good(frames=range(FRAMES - 1)),
    "bad-many-frames": lambda: good(frames=range(FRAMES + 1)),
    "bad-stamps-order": lambda: good(life=(time.monotonic(), STARTED)),
    "bad-stamps-past": lambda: good(life=(STARTED - 1000, None)),
    "bad-stamps-future": lambda: good(life=(STARTED, time.monotonic() + 1000)),
    "bad-stamps-overlap": overlap,
    "bad-stamps-nan": lambda: good(life=(float("nan"), None)),
    "bad-index": lambda: good(extra=('{"event": "frame", "index": Infinity, "start": 0, "end": 0}',)),
    "bad-number": lambda: good(extra=(f'{{"event": "frame", "index": 0, "start": 1{"0" * 400}, "end": 0}}',)),
    "bad-memory": lambda: good(extra=('{"event": "memory", "peak_bytes": "much"}',)),
    "bad-versions": lambda: good(extra=('{"event": "versions", "numbers": [1, 1e999]}',)),
    "bad-device": lambda: good(extra=('{"event": "device", "name": "x", "simulated": "no"}',)),
    "bad-parts": lambda: good(parts={"kernel": 0.1}),
    "bad-renders": lambda: good(renders=lambda index: 0),
    "bad-batch": batches,
    "bad-batch-unasked": lambda: good(renders=lambda index: 1 + index),
    "bad-batch-first": lambda: batches(first=64),
    "bad-batch-rays": lambda: batches(later=1, count=64),
    "bad-reason": lambda: print('{"event": "error", "reason": "' + "half \\ud800 of it " * 10**5 + '"}') or sys.exit(1),
    "bad-pixel": lambda: changed(7, lambda value: value + 1e-6),
    "bad-nan": lambda: changed(7, lambda value: float("nan")),
    "bad-inf": lambda: changed(7, lambda value: float("inf")),
    "bad-rays": lambda: good(rays={**GOOD_RAYS, "primary": WIDTH * HEIGHT + 1}),
    "bad-shape": lambda: good(data=npy(background(), (HEIGHT * WIDTH, 3))),
    "bad-turned": lambda: good(data=npy(background(), (WIDTH, HEIGHT, 3))),
    "bad-dtype": lambda: good(data=npy([1] * (WIDTH * HEIGHT * 3), (HEIGHT, WIDTH, 3), "<i8", "q")),
    "bad-endian": lambda: good(data=npy(background(), (HEIGHT, WIDTH, 3), ">f8")),
    "bad-pickle": pickled,
    "bad-zip": lambda: good(data=b"PK\x03\x04 and no more"),
    "bad-header": lambda: good(data=b"\x93NUMPY\x01\x00\x10\x00{'descr': ((((((("),
    "bad-length": lambda: good(data=npy(background()[:-5], (HEIGHT, WIDTH, 3))),
    "bad-size": lambda: good(data=npy([], (10**9, 10**6, 3))),
    "bad-empty-file": lambda: good(data=b""),
    "bad-no-file": lambda: good(file="other.npy"),
    "bad-no-folder": no_folder,
    "bad-no-output": lambda: good(file=None),
    "bad-folder": lambda: good(file="."),
    "bad-outside": outside,
    "bad-link": link,
    "bad-long-name": lambda: good(file="x" * 5000),
    # For test_device.py
    "device": on_device,
    "device-exhibit": lambda: on_device(1e-3),
    "device-wrong": lambda: on_device(1e-3),
    "device-broken": lambda: fail(1),
    "device-block": lambda: on_device(int(flags["block_width"]) * 1e-12),
    "device-memory": lambda: on_device(1e-12 * (flags["scene_memory"] == "shared")),
}

if __name__ == "__main__":
    if flags["needs"] and flags["variant"] != "bad-obedient":
        fail(3)
    if flags["variant"] != "bad-blind":
        open(f"{flags['job']}/camera.npy").close()
    MISDEEDS[flags["variant"]]()
