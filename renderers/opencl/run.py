"""Renders a job on an OpenCL device: loads and uploads the scene, builds the kernel, renders, saves the picture."""

import time
from collections import Counter

import numpy as np
import pyopencl as cl

from renderers import worker

from . import device as devices
from . import method, program
from .load import Scene
from .session import COUNTS, Launch, Session

sessions = {}  # of this process, by the device that a job asks for
REAL, COUNT = {"float64": np.float64, "float32": np.float32}, np.uint64


def run(job):
    real = REAL[job.precision]
    with worker.phase("load"):
        if job.device not in sessions:
            sessions[job.device] = Session(devices.find(job.device))
        session = sessions[job.device]
        devices.check(session.device, job)
        walk = method.walk_of(job, np.load(job.array("materials")))
        scene = Scene(job, real)
        tree = method.takes_tree(job, max(scene.work(), scene.part_work()))
    if tree:
        with worker.phase("build"):
            scene.build()
    with worker.phase("upload"):
        worker.say_device(**devices.describe(session.device))
        numbers, integers = scene.numbers.joined(), scene.integers.joined()
        size = numbers.nbytes + integers.nbytes
        memory = method.memory_of(job, tree, size)
        check_memory(session.device, job, memory, size)
        given = session.upload(numbers), session.upload(integers)
    with worker.phase("compile"):
        defined = program.names(
            job,
            **{f"MEMORY_{memory.upper()}": 1, f"WALK_{walk.name.upper()}": 1, "TREE": int(tree)},
            **{"CROSSINGS": next_power_of_two(scene.crossings), "PARTS": next_power_of_two(scene.parts)},
            **({method.FAULTS[job.variant]: 1} if job.variant in method.FAULTS else {}),
            **({"NUMBERS": numbers.size, "INTEGERS": integers.size} if memory == "shared" else {}),
        )
        built = session.program(program.source(defined), job)
        scene.layout |= {"rows": walk.rows, "table_base": walk.base}
        layout = scene.packed_layout()
        thread_bytes, row_bytes = sizes(session, built, job, layout)
        if row_bytes > method.TABLE_LIMIT:
            worker.refuse(f"walk {walk.name}: one pixel takes {row_bytes} bytes, more than {method.TABLE_LIMIT}")
        shared = [COUNT(0).nbytes * job.block_width * job.block_height]
        shared += [numbers.nbytes, integers.nbytes] if memory == "shared" else []
        make = Rays if job.kind == "rays" else Picture
        work = make(session, job, built, given, layout, thread_bytes, shared)

    spent = Counter()

    def frame():
        spent["kernel"] += work.render()
        before = time.monotonic()
        frame.answer = session.download(work.made, work.shape, real)
        spent["download"] += time.monotonic() - before

    def parts():
        taken = dict(spent)
        spent.clear()
        return taken

    worker.render(job, frame, parts)

    with worker.phase("download"):
        counts, dropped = work.counts(), work.dropped()
    with worker.phase("save"):
        name = "hits.npy" if job.kind == "rays" else "image.npy"
        np.save(job.output(name), frame.answer.astype(np.float64) if job.kind == "rays" else frame.answer)
        cut = {}
        if dropped is not None:
            cut["dropped"] = "dropped.npy"
            np.save(job.output(cut["dropped"]), dropped)
        worker.say("output", file=name, **cut)
        if counts is not None:
            primary, reflected, transmitted, shadow, non_finite = counts
            worker.say_rays(primary, reflected, shadow, non_finite, transmitted)
    rows = {"walk_rows": walk.rows, "walk_bytes": row_bytes} if walk.rows else {}
    methods = {
        **method.used(job, walk, tree),
        **({"threads": job.threads} if devices.is_processor(session.device) else {}),
        **rows,
        "scene_memory": memory,
        "constant_bytes": size if memory == "constant" else 0,
        **work.launches[-1].resources(),
    }
    worker.say("used", features=job.needs, methods=methods)
    worker.say_python_versions(pyopencl=cl.VERSION_TEXT, numpy=np.__version__, opencl=session.device.version.strip())


def check_memory(device, job, memory, size):
    """Refuses a scene that a memory has no room for. size: of the scene, in bytes."""
    scratch = COUNT(0).nbytes * job.block_width * job.block_height
    limits = {"constant": device.max_constant_buffer_size, "shared": device.local_mem_size - scratch}
    if size > limits.get(memory, size):
        worker.refuse(f"scene_memory {memory}: the scene takes {size} bytes, more than {limits[memory]}; use global")


def next_power_of_two(count):
    """At least 8: so that kernels of small scenes are the same."""
    return 1 << max(3, (count - 1).bit_length())


def sizes(session, built, job, layout):
    """Bytes of memory that a thread needs, and of them the rows of its walk."""
    room, group = session.room(2 * COUNT(0).nbytes), (job.block_width, job.block_height)
    kernel = built.sizes
    kernel.set_arg(0, layout.tobytes())
    kernel.set_arg(1, room)
    cl.enqueue_nd_range_kernel(session.queue, kernel, group, group)
    return map(int, session.download(room, 2, COUNT))


class Picture:
    """The kernels of a picture and what they make: the corners of pixels, if asked for (SAM-5), and the pixels."""

    def __init__(self, session, job, built, given, layout, memory, shared):
        self.session, self.job, real = session, job, REAL[job.precision]
        x0, y0, x1, y1 = job.region
        self.shape = y1 - y0, x1 - x0, 3
        pixels, corners = (y1 - y0, x1 - x0), (y1 - y0 + 1, x1 - x0 + 1)
        of_corners = int(np.prod(corners)) * 3 if job.sampler == "adaptive" else 0
        self.made = session.room(int(np.prod(self.shape)) * real(0).nbytes)
        self.left_out = session.room(int(np.prod(pixels)) * real(0).nbytes if "cutoff" in job.needs else 0)
        self.corners = session.room(of_corners * real(0).nbytes)
        asked = [(built.render_pixels, pixels, (self.corners, self.made, self.left_out))]
        if of_corners:
            asked.insert(0, (built.render_corners, corners, (self.corners,)))
        self.launches, self.totals = [], []
        nothing = layout.copy()
        nothing[4:6] = nothing[2:4]  # an empty region
        for kernel, shape, more in asked:
            launch = Launch(session, job, kernel, shape, memory, shared)
            total = session.room(launch.groups * COUNTS * COUNT(0).nbytes)
            launch.check_group()
            # Some devices compile a kernel when it is first launched.
            launch.take(*given, nothing, launch.memory, *more, total)
            launch.start((1, 1)).wait()
            launch.take(*given, layout, launch.memory, *more, total)
            self.launches.append(launch)
            self.totals.append(total)

    def render(self):
        """Returns the seconds that it took by the device's clock."""
        return seconds([launch.start() for launch in self.launches])

    def counts(self):
        """Primary, reflected, transmitted, shadow and non-finite (CNT-1, CNT-2)."""
        of_groups = [
            self.session.download(total, (launch.groups, COUNTS), COUNT)
            for launch, total in zip(self.launches, self.totals, strict=True)
        ]
        return np.concatenate(of_groups).sum(axis=0)

    def dropped(self):
        """CUT-2; None without a cut-off."""
        if "cutoff" not in self.job.needs or self.job.cutoff == 0:
            return None
        return self.session.download(self.left_out, self.shape[:2], REAL[self.job.precision])


class Rays:
    """The kernel of a list of rays and the hits that it makes."""

    def __init__(self, session, job, built, given, layout, memory, shared):
        rays = given_rays(job)
        self.shape = len(rays), 8
        self.made = session.room(max(1, rays.size) * 8 // 6 * rays.itemsize + 8 * rays.itemsize)
        columns = -(-len(rays) // job.block_height)
        launch = Launch(session, job, built.trace_rays, (job.block_height, columns), memory, shared)
        launch.check_group()
        uploaded = session.upload(np.append(rays, rays.dtype.type(0)))  # never empty
        launch.take(*given, layout, launch.memory, uploaded, np.int32(0), self.made)
        launch.start((1, 1)).wait()
        launch.take(*given, layout, launch.memory, uploaded, np.int32(len(rays)), self.made)
        self.launches = [launch]

    def render(self):
        return seconds([launch.start() for launch in self.launches])

    def counts(self):
        return None

    def dropped(self):
        return None


def seconds(events):
    cl.wait_for_events(events)
    return sum(event.profile.end - event.profile.start for event in events) / 1e9


def given_rays(job):
    """Origin and direction (R, 6) of the job's rays; one that has unit length to rounding stays as it is (NUM-4)."""
    real = REAL[job.precision]
    rays = np.load(job.array("rays"))
    rounded = rays.astype(real)
    d = rounded[:, 3:]
    right = np.abs((d * d).sum(axis=1) - 1) <= 2 * np.finfo(real).eps  # 4 u
    unit = rays[:, 3:] / np.linalg.norm(rays[:, 3:], axis=1, keepdims=True)
    rounded[:, 3:] = np.where(right[:, None], d, unit.astype(real))
    return rounded
