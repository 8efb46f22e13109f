"""What this renderer has, what it refuses, and how it chooses where the job leaves the choice to it."""

from dataclasses import dataclass

from renderers import worker

FEATURES = (
    *("sphere", "box", "polygon", "ellipsoid", "mesh", "csg"),
    *("ambient", "diffuse", "phong", "shadows", "soft"),
    *("reflection", "transmission", "glossy", "attenuation", "media", "contact"),
    *("supersampling", "sobol", "adaptive", "lens", "cutoff", "region", "rays"),
)
METHODS = {
    "precision": ("float64", "float32"),
    "walk": ("least", "table", "stack", "chain"),
    "accel": ("auto", "none", "bvh"),
    "sphere": ("robust", "textbook", "stable", "wide"),
    "offset": ("bounded", "relative", "fixed", "none"),
    "triangle": ("watertight", "moller-trumbore", "watertight-kahan"),
    "slab": ("branch", "plain"),
    "csg": ("intervals",),
    "merge": ("tolerant", "none"),
    "fresnel": ("clamped", "unclamped"),
    "phong": ("clamped", "unclamped"),
    "renormalise": ("on", "off"),
    "vector": ("off",),
    "floating_point": ("strict", "contract", "fast"),
    "glossy_weight": ("plain", "study"),
    "scene_memory": ("auto", "global", "constant", "shared"),
    "gpu_wait": ("auto", "spin", "yield", "block"),  # of CUDA
}
FAULTS = {"index-fault": "FAULT_INDEX", "barrier-fault": "FAULT_BARRIER"}  # of exhibits, by the end of their names
LEAST_ROW = 64  # bytes of a row of any kernel
TABLE_LIMIT = 2**31  # bytes of a pixel in work (WLK-2)
MANY = 64  # spheres from which on `auto` takes the hierarchy, or a quarter as many of other shapes
CONSTANT_LIMIT = 2**16  # bytes of constant memory that every device has
TILE = 4096  # bytes of a tile of a streamed scene (kernel/search.h)


@dataclass(frozen=True)
class Walk:
    """name: of WLK-1. rows: of its table or stack. base: children of a row of the table."""

    name: str
    rows: int
    base: int


def check(job):
    """Refuses a job with a feature or method that is not here."""
    worker.require(job, FEATURES)
    for name, known in METHODS.items():
        if getattr(job, name) not in known:
            worker.refuse(f"does not support {name} {getattr(job, name)}")
    if "cutoff" in job.needs and job.cutoff > 0 and job.walk == "table":
        worker.refuse("cutoff: with the walks chain and stack, not with table")


def glossy_rays(job, materials):
    """G of GLO-1. materials: materials.npy."""
    rough = ((materials[:, 3] > 0) & (materials[:, 10] > 0)).any()
    return job.glossy_rays if "glossy" in job.needs and rough else 0


def walk_of(job, materials):
    """Returns the Walk (WLK-1). materials: materials.npy."""
    clear = bool((materials[:, 5:8].any(axis=1) & (materials[:, 3] > 0)).any())
    children = max(job.glossy_rays, 1) + int("transmission" in job.needs and clear)
    name = job.walk
    if job.kind == "rays":
        name = "chain"
    elif name == "least":
        name = "chain" if children == 1 else "stack"
    elif name == "chain" and children > 1:
        worker.refuse(f"walk chain: a ray of this scene can have {children} children")
    base = max(children, 2)
    rows = {"chain": 0, "stack": 1 + job.depth * (children - 1)}
    rows = rows[name] if name in rows else sum(base**order for order in range(job.depth + 1))
    if rows * LEAST_ROW > TABLE_LIMIT:
        worker.refuse(f"walk {name}: a pixel takes {rows} rows of {LEAST_ROW} bytes or more, {TABLE_LIMIT} at most")
    return Walk(name, rows, base)


def fault_of(job):
    """The name of the fault that an exhibit is compiled with; None of any other variant."""
    return next((fault for ending, fault in FAULTS.items() if job.variant.endswith(ending)), None)


def takes_tree(job, work):
    """Whether rays search in the hierarchy (HIT-6). work: of trying all shapes, in spheres."""
    return job.accel == "bvh" or (job.accel == "auto" and work >= MANY and not in_shared(job))


def in_shared(job):
    """Whether the job asks for the scene in local memory (shared memory of CUDA)."""
    return job.scene_memory == "shared" or fault_of(job) is not None


def memory_of(job, walk, scene, tree, room):
    """Where the kernel reads the scene: a value of scene_memory, or "tiles", in which it goes through local memory.

    Refuses a scene that is too large for local memory and cannot go through it in tiles. room: bytes of local memory.
    """
    if not in_shared(job):
        if job.scene_memory != "auto":
            return job.scene_memory
        return "constant" if not tree and scene.size() <= CONSTANT_LIMIT else "global"
    if fault_of(job) or tree or scene.size() <= room:
        return "shared"
    large = "scene_memory shared: the scene is too large for it at once, and"
    if scene.layout["touching"]:
        worker.refuse(f"{large} clear solids that touch cannot be streamed; use global")
    if walk.name == "table":
        worker.refuse(f"{large} walk table cannot be streamed; use global")
    if job.sampler == "adaptive":
        worker.refuse(f"{large} adaptive samples cannot be streamed; use global")
    if scene.layout["shapes"] == scene.layout["solids"]:
        worker.refuse(f"{large} CSG solids cannot be streamed; use global")
    most = scene.corners_in(TILE)
    if scene.corners > most:
        worker.refuse(
            f"scene_memory shared: a polygon has {scene.corners} vertices, and a tile holds {most}; use global"
        )
    return "tiles"


def used(job, walk, tree):
    """The entries of `used.methods` that matter for the job and hold on any device."""
    needs = {*job.needs}
    bounces, round_shapes = "reflection" in needs, {"sphere", "ellipsoid"} & needs
    matters = {
        "precision": True,
        "floating_point": True,
        "sphere": round_shapes,
        "offset": bounces or "shadows" in needs,
        "triangle": {"polygon", "mesh"} & needs,
        "slab": "box" in needs,
        "merge": {"csg", "contact"} & needs,
        "fresnel": bounces,
        "phong": "phong" in needs,
        "renormalise": bounces,
    }
    found = {name: getattr(job, name) for name, it_does in matters.items() if it_does}
    found |= {"walk": walk.name, "accel": "bvh" if tree else "none", "vector": "off"}
    if "cutoff" in needs and job.cutoff > 0:
        found["cutoff"] = job.cutoff
    if job.glossy_rays > 0:
        found["glossy_weight"] = job.glossy_weight
    return found
