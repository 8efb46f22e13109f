"""Renders a job on a device: loads and uploads the scene, builds the kernel, renders, saves the picture."""

import time
from collections import Counter

import numpy as np

from renderers import worker

from . import method, program
from .launch import Launch
from .load import Scene

sessions = {}  # of this process, by their type and the device that a job asks for
REAL, COUNT = {"float64": np.float64, "float32": np.float32}, np.uint64
COUNTS = 5  # numbers that a kernel of a picture counts, for each group


def run(job, Session):
    """Session: of session.py or cuda/session.py."""
    real = REAL[job.precision]
    with worker.phase("load"):
        if (Session, job.device) not in sessions:
            sessions[Session, job.device] = Session(job.device)
        session = sessions[Session, job.device]
        session.check(job)
        walk, scene, tree = read(job)
    if tree:
        with worker.phase("build"):
            scene.build()
    with worker.phase("upload"):
        worker.say_device(**session.describe())
        numbers, integers = scene.numbers.joined(), scene.integers.joined()
        room = session.room_of_memories()
        room["shared"] -= scratch_bytes(job)
        memory = method.memory_of(job, walk, scene, tree, room["shared"])
        if scene.size() > room.get(memory, scene.size()):
            worker.refuse(
                f"scene_memory {memory}: the scene takes {scene.size()} bytes, more than {room[memory]}; use global"
            )
        given = session.upload(numbers), session.upload(integers)
    with worker.phase("compile"):
        built = session.program(program.source(names(job, walk, scene, tree, memory, session.SIZED)), job)
        given = session.place(built, memory, given)
        scene.layout |= {"rows": walk.rows, "table_base": walk.base}
        layout = scene.packed_layout()
        thread_bytes, row_bytes = sizes(session, built, job, layout)
        if row_bytes > method.TABLE_LIMIT:
            worker.refuse(f"walk {walk.name}: one pixel takes {row_bytes} bytes, more than {method.TABLE_LIMIT}")
        in_shared = {"shared": [numbers.nbytes, integers.nbytes], "tiles": [method.TILE]}
        shared = [scratch_bytes(job), *in_shared.get(memory, ())]
        make = Rays if job.kind == "rays" else Picture
        work = make(session, job, built, given, layout, thread_bytes, shared)
        answer = session.host(work.shape, real)

    spent = Counter()

    def frame():
        spent["kernel"] += work.render()
        before = time.monotonic()
        session.download(work.made, answer)
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
        np.save(job.output(name), answer.astype(np.float64) if job.kind == "rays" else answer)
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
        **session.methods(job),
        **rows,
        "scene_memory": "shared" if memory == "tiles" else memory,
        "streamed": memory == "tiles",
        "constant_bytes": scene.size() if memory == "constant" else 0,
        **work.launches[-1].resources(),
    }
    worker.say("used", features=job.needs, methods=methods)
    worker.say_python_versions(numpy=np.__version__, **session.versions())


def read(job):
    """Returns the Walk of a job, its Scene, and whether rays search in a hierarchy."""
    materials = np.load(job.array("materials"))
    job.glossy_rays = method.glossy_rays(job, materials)
    walk = method.walk_of(job, materials)
    scene = Scene(job, REAL[job.precision])
    return walk, scene, method.takes_tree(job, max(scene.work(), scene.part_work()))


def names(job, walk, scene, tree, memory, sized):
    """Returns what is defined before the kernel's source. sized: memories for which the sizes of the tables are."""
    found = {f"MEMORY_{memory.upper()}": 1, f"WALK_{walk.name.upper()}": 1, "TREE": int(tree)}
    found |= {"CROSSINGS": next_power_of_two(scene.crossings), "PARTS": next_power_of_two(scene.parts)}
    found["STREAMED"] = int(memory == "tiles")
    if memory == "tiles":  # adaptive samples, which no such job has, are not even compiled
        found |= {"TILE_NUMBERS": method.TILE // REAL[job.precision](0).nbytes, "NEED_ADAPTIVE": 0}
    if method.fault_of(job):
        found[method.fault_of(job)] = 1
    if memory in sized:
        found |= {"NUMBERS": scene.numbers.joined().size, "INTEGERS": scene.integers.joined().size}
    return program.names(job, **found)


def scratch_bytes(job):
    """Bytes of local memory in which a group adds up its counts."""
    return COUNT(0).nbytes * job.block_width * job.block_height


def next_power_of_two(count):
    """At least 8: so that kernels of small scenes are the same."""
    return 1 << max(3, (count - 1).bit_length())


def sizes(session, built, job, layout):
    """Bytes of memory that a thread needs, and of them the rows of its walk."""
    room, kernel = session.room(2 * COUNT(0).nbytes), session.kernel(built, "sizes")
    kept = session.take(kernel, (layout, room), ())
    session.start(kernel, kept, (1, 1), (job.block_width, job.block_height))
    return map(int, session.download(room, np.zeros(2, COUNT)))


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
        asked = [("render_pixels", pixels, (self.corners, self.made, self.left_out))]
        if of_corners:
            asked.insert(0, ("render_corners", corners, (self.corners,)))
        self.launches, self.totals = [], []
        nothing = layout.copy()
        nothing[4:6] = nothing[2:4]  # an empty region
        for name, shape, more in asked:
            launch = Launch(session, job, session.kernel(built, name), shape, memory, shared)
            total = session.room(launch.groups * COUNTS * COUNT(0).nbytes)
            # Some devices compile a kernel when it is first launched.
            launch.take(*given, nothing, launch.memory, *more, total)
            session.seconds([launch.start((1, 1))])
            launch.take(*given, layout, launch.memory, *more, total)
            self.launches.append(launch)
            self.totals.append(total)

    def render(self):
        """Returns the seconds that it took by the device's clock."""
        return self.session.seconds([launch.start() for launch in self.launches])

    def counts(self):
        """Primary, reflected, transmitted, shadow and non-finite (CNT-1, CNT-2)."""
        of_groups = [
            self.session.download(total, np.zeros((launch.groups, COUNTS), COUNT))
            for launch, total in zip(self.launches, self.totals, strict=True)
        ]
        return np.concatenate(of_groups).sum(axis=0)

    def dropped(self):
        """CUT-2; None without a cut-off."""
        if "cutoff" not in self.job.needs or self.job.cutoff == 0:
            return None
        return self.session.download(self.left_out, np.zeros(self.shape[:2], REAL[self.job.precision]))


class Rays:
    """The kernel of a list of rays and the hits that it makes."""

    def __init__(self, session, job, built, given, layout, memory, shared):
        self.session, rays = session, given_rays(job)
        self.shape = len(rays), 8
        self.made = session.room(max(1, rays.size) * 8 // 6 * rays.itemsize + 8 * rays.itemsize)
        columns = -(-len(rays) // job.block_height)
        launch = Launch(session, job, session.kernel(built, "trace_rays"), (job.block_height, columns), memory, shared)
        uploaded = session.upload(np.append(rays, rays.dtype.type(0)))  # never empty
        launch.take(*given, layout, launch.memory, uploaded, np.int32(0), self.made)
        session.seconds([launch.start((1, 1))])
        launch.take(*given, layout, launch.memory, uploaded, np.int32(len(rays)), self.made)
        self.launches = [launch]

    def render(self):
        return self.session.seconds([launch.start() for launch in self.launches])

    def counts(self):
        return None

    def dropped(self):
        return None


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
