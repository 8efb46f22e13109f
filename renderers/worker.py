"""The shell a Python renderer runs in: flags in, JSON Lines out (README.md in this folder).

Standard library only, so that a renderer's memory and start-up are its own technology's. Import this module
first: the clock of the `import` phase starts here.
"""

import time

START = _phase_start = time.monotonic()  # of the process, nearly

import json  # noqa: E402
import os  # noqa: E402
import sys  # noqa: E402
from contextlib import contextmanager  # noqa: E402

UNSUPPORTED = 3
APART = 4
COLD = 10  # times as long as a later frame is the first at most
MOST_RENDERS, MOST_BYTES = 4096, 64 << 20  # of a frame whose pictures have checksums (FRM-1)
STEPS = 3242174889, 2447445413  # of FRM-1


class Job:
    """The parameters of one job, read from `--key=value` flags. Unknown keys are ignored."""

    def __init__(self, arguments):
        flags = dict(a[2:].split("=", 1) for a in arguments if a.startswith("--") and "=" in a)
        self.folder = flags["job"]
        self.out = flags["out"]
        self.variant = flags.get("variant", "")
        self.kind = flags.get("kind", "image")
        self.width = int(flags.get("width", 0))
        self.height = int(flags.get("height", 0))
        region = flags.get("region") or f"0,0,{self.width},{self.height}"
        self.region = tuple(int(edge) for edge in region.split(","))
        self.depth = int(flags.get("depth", 0))
        self.shadows = flags.get("shadows", "0") == "1"
        self.sampler = flags.get("sampler", "one")
        self.samples = int(flags.get("samples", 1))
        self.spp = int(flags.get("spp", 1))
        self.adaptive_depth = int(flags.get("adaptive_depth", 0))
        self.adaptive_threshold = float(flags.get("adaptive_threshold", 0))
        self.lens_radius = float(flags.get("lens_radius", 0))
        self.focal_distance = float(flags.get("focal_distance", 1))
        self.feelers = int(flags.get("feelers", 0))
        self.glossy_rays = int(flags.get("glossy_rays", 0))
        self.glossy_weight = flags.get("glossy_weight", "plain")
        self.seed = int(flags.get("seed", 0))
        self.walk = flags.get("walk", "least")
        self.accel = flags.get("accel", "auto")
        self.sphere = flags.get("sphere", "robust")
        self.triangle = flags.get("triangle", "watertight")
        self.slab = flags.get("slab", "branch")
        self.csg = flags.get("csg", "intervals")
        self.merge = flags.get("merge", "tolerant")
        self.offset = flags.get("offset", "bounded")
        self.fresnel = flags.get("fresnel", "clamped")
        self.phong = flags.get("phong", "clamped")
        self.renormalise = flags.get("renormalise", "on")
        self.vector = flags.get("vector", "off")
        self.floating_point = flags.get("floating_point", "strict")
        self.cutoff = float(flags.get("cutoff", 0))
        self.sample = float(flags.get("sample_x", 0.5)), float(flags.get("sample_y", 0.5))
        self.epsilon = float(flags.get("epsilon", 2.0**-48))
        self.precision = flags.get("precision", "float64")
        self.sliver = float(flags.get("sliver", 0)) or None  # None: that of the precision (CSG-4)
        self.threads = int(flags.get("threads", 1))
        self.frames = int(flags.get("frames", 0))
        self.least_frame = float(flags.get("least_frame", 0))
        self.dialog = flags.get("dialog", "")
        self.device = flags.get("device", "")
        self.scene_memory = flags.get("scene_memory", "auto")
        self.block_width = int(flags.get("block_width", 16))
        self.block_height = int(flags.get("block_height", 16))
        self.total_threads = int(flags.get("total_threads", 0))
        self.gpu_wait = flags.get("gpu_wait", "auto")
        self.max_registers = int(flags.get("max_registers", 0))
        self.needs = tuple(name for name in flags.get("needs", "").split(",") if name)
        kernel = flags.get("kernel", "needed")
        # Of the needs, those that the job may not use.
        self.carried = self.needs if kernel == "general" else tuple(kernel.split("+")[1:])
        self.cache = flags.get("cache", "")
        self.seconds = float(flags.get("seconds", "inf"))

    def array(self, name):
        """Path of the job's array `name`, such as "spheres"."""
        return os.path.join(self.folder, name + ".npy")

    def output(self, name):
        return os.path.join(self.out, name)


class Apart(Exception):
    """This process cannot do a job of a list, as it is made for another one; a fresh process may."""


def serve(main, arguments):
    """Call `main(flags)` for the job of the command line or, with `--jobs=FILE`, for each job of a list.

    arguments: the words of the command line. A job that fails, or is refused, leaves the rest of a list as it is.
    """
    listed = [word.partition("=")[2] for word in arguments if word.startswith("--jobs=")]
    if not listed:
        return main(arguments)
    with open(listed[-1], encoding="utf-8") as lines:
        for flags in _jobs(lines):
            say("end", status=_status_of(main, flags))


def _jobs(lines):
    """The flags of one job after the other. A job is read when it is asked for: `lines` may come from a pipe."""
    global _phase_start
    flags = []
    for line in lines:
        if line != "\n":
            flags.append(line.rstrip("\n"))
        elif flags:
            _phase_start = time.monotonic()
            yield flags
            flags = []


def _status_of(main, flags):
    """The exit status that a process with this job alone would have; or APART."""
    try:
        main(flags)
    except SystemExit as refusal:
        return refusal.code or 0
    except Apart as reason:
        say("error", reason=str(reason))
        return APART
    except Exception as error:
        import traceback

        traceback.print_exc()
        say("error", reason=f"{type(error).__name__}: {error}")
        return 1
    return 0


def say(event, **values):
    """Print one event. Flushed at once: what was said before a crash is not lost."""
    sys.stdout.write(json.dumps({"event": event, **values}) + "\n")
    sys.stdout.flush()


@contextmanager
def phase(name):
    """Announce the enclosed work as one phase.

    Phases follow each other without a gap: one begins where the one before it ended, the first when this module did.
    """
    global _phase_start
    yield
    end = time.monotonic()
    say("phase", name=name, start=_phase_start, end=end)
    _phase_start = end


def importing():
    """The `import` phase: what the block imports."""
    return phase("import")


def refuse(reason):
    """This renderer cannot do the job."""
    say("error", reason=reason)
    sys.exit(UNSUPPORTED)


def require(job, features):
    """Refuse a job that needs a feature outside `features`."""
    missing = [name for name in job.needs if name not in features]
    if missing:
        refuse("does not support " + ", ".join(missing))


def render(job, frame, parts=None):
    """The `render` phase: call `frame()` once and then `job.frames` times more; return the last answer.

    After the first, a frame that would be shorter than `job.least_frame` (s) is made of several calls. Says each frame
    and, at the end, the memory peaks. parts: called after each frame, its time being over; the seconds by name that
    parts of all calls of `frame()` took since it was last called. A renderer of contract 2 calls `render_checked`.
    """

    def batch(renders):
        start = time.monotonic()
        for _ in range(renders):
            answer = frame()
        end = time.monotonic()
        spent = {name: seconds / renders for name, seconds in parts().items()} if parts else None
        return start, end, spent, answer

    with phase("render"):
        before = _status("VmHWM")
        reset = _reset_peak()
        renders = 1
        for index in range(job.frames + 1):
            start, end, spent, answer = batch(renders)
            say("frame", index=index, start=start, end=end, renders=renders, **({"parts": spent} if parts else {}))
            if index == 0 and job.frames > 0 and end - start < COLD * job.least_frame:
                renders = _how_many(lambda renders: batch(renders)[:2], job.least_frame, end - start)
        _say_memory(before, reset)
    return answer


def render_checked(job, frame, pixels, keep=None):
    """`render` by contract 2: call `frame(number)` likewise; return the answer of frame 0.

    number: of the render in its frame, from 0: its answer must last until those of the frame have their checksums.
    pixels(answer): the picture of an answer, a buffer. keep(answer): the answer of frame 0, kept from what later calls
    overwrite. Before each render of a later frame, `job.sample` is set to the place of its sample (FRM-1).
    """
    if not job.dialog:  # of a list of jobs, or of one without later frames
        return render(job, lambda: frame(0))
    from zlib import crc32

    def checksums(answers):
        return "".join(f"{crc32(pixels(answer)):08x}" for answer in answers)

    def batch(samples):
        answers = [None] * len(samples)
        start = time.monotonic()
        for number, job.sample in enumerate(samples):
            answers[number] = frame(number)
        return start, time.monotonic(), answers

    with phase("render"):
        before = _status("VmHWM")
        reset = _reset_peak()
        own, renders = job.sample, 1
        start, end, (first,) = batch([own])
        say("frame", index=0, start=start, end=end, renders=1, checksums=checksums([first]))
        most = min(MOST_RENDERS, MOST_BYTES // max(1, memoryview(pixels(first)).nbytes))
        first = keep(first) if keep else first
        if end - start < COLD * job.least_frame:
            renders = _how_many(lambda renders: batch([own] * renders)[:2], job.least_frame, end - start, most)
        key = _key_of_places(job)
        for index in range(1, job.frames + 1):
            start, end, answers = batch([place(key, index, number, own) for number in range(renders)])
            say("frame", index=index, start=start, end=end, renders=renders, checksums=checksums(answers))
        job.sample = own
        _say_memory(before, reset)
    return first


def _key_of_places(job):
    """Ask for the key of the places of later frames; call it once frame 0 was said."""
    with open(os.path.join(job.dialog, "question"), "w", encoding="ascii") as question:
        question.write("places\n")
    with open(os.path.join(job.dialog, "answer"), encoding="ascii") as answer:
        return tuple(map(int, answer.readline().split()))


def place(key, frame, number, sample):
    """The place of the sample of a render of a later frame (FRM-1). sample: the job's own."""
    count = MOST_RENDERS * frame + number
    return tuple(
        (15 * own + ((first + count * step) % 2**32 >> 8) * 2.0**-24) / 16
        for own, first, step in zip(sample, key, STEPS, strict=True)
    )


def _how_many(batch, least, first, most=None):
    """How many renders last `least` seconds, a power of two, if the first took `first` seconds; `most` at most.

    A batch that something interrupts is long for once: so two must be long enough.
    """

    def seconds():
        start, end = batch(renders)
        return end - start

    renders, took = 1, first
    while (took < least or seconds() < least) and (most is None or 2 * renders <= most):
        renders *= 2
        took = seconds()
    return renders


def say_rays(primary, reflected, shadow, non_finite, transmitted=0):
    """Say the ray counts of one frame (CNT-1, CNT-2)."""
    counts = {"primary": primary, "reflected": reflected, "transmitted": transmitted, "shadow": shadow}
    say("rays", **{name: int(n) for name, n in counts.items()}, non_finite=int(non_finite))


def say_device(name, simulated, **facts):
    """Say what a renderer for a GPU runs on; `facts` by the names of README.md, those that are not known left out."""
    say("device", name=name, simulated=simulated, **facts)


def say_python_versions(**more):
    import platform  # which no frame needs

    say("versions", python=platform.python_version(), implementation=platform.python_implementation(), **more)


def _status(key):
    """A memory line of /proc/self/status in bytes; None where there is none."""
    try:
        with open("/proc/self/status", encoding="ascii", errors="replace") as status:
            for line in status:
                if line.startswith(key + ":"):
                    return int(line.split()[1]) * 1024
    except OSError:
        pass
    return None


def _reset_peak():
    """Set VmHWM back to what is resident now; tell whether the system allowed it (proc(5), clear_refs 5)."""
    try:
        with open("/proc/self/clear_refs", "w", encoding="ascii") as clear:
            clear.write("5")
        return True
    except OSError:
        return False


def _say_memory(before, reset):
    after = _status("VmHWM")
    say(
        "memory",
        peak_bytes=None if after is None else max(before, after),
        render_peak_bytes=after if reset else None,
        peak_virtual_bytes=_status("VmPeak"),
        method="VmHWM" if after is not None else None,
    )
