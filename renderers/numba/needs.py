"""The needs of this job, as constants: Numba removes the branches of the kernel that they rule out.

`take` is called before any module of the kernel is imported, as each of them imports its constants by name.
"""

# Features of the contract (README.md in the folder above).
SPHERE = BOX = POLYGON = ELLIPSOID = MESH = CSG = False
AMBIENT = DIFFUSE = PHONG = SHADOWS = SOFT = False
REFLECTION = TRANSMISSION = GLOSSY = ATTENUATION = MEDIA = CONTACT = False
SUPERSAMPLING = SOBOL = ADAPTIVE = LENS = CUTOFF = False
FEATURES = tuple(name for name in list(globals()) if name.isupper())

# Carried, though this job may not use it (`kernel` of the contract): the kernel asks the scene.
ASK_SHADOWS = ASK_LENS = ASK_SAMPLER = ASK_NUMBERS = False

# Where the kernel runs.
TARGET = "cpu"  # or "cuda"
SIMULATED = False  # by Numba's simulator of a GPU
SINGLE = False  # precision float32
THREADS = 1  # of a block of the GPU
STRIDED = False  # each thread has several pixels
MEMORY = "global"  # of the GPU, in which the scene is
STREAMED = False  # through shared memory, being too large for it: the threads of a block go in step (gpu/tiles.py)
FAULT = ""  # of the exhibits: "index" or "barrier" (gpu/assemble.py)

# Methods.
WALK = "chain"  # of WLK-1
TREE = False  # a bounding-volume hierarchy (HIT-6)
SPHERE_METHOD = "robust"  # of SPH-3 and ELL-3
OFFSET = "bounded"  # of OFF-1
TRIANGLE = "watertight"  # of TRI-3
SLAB = "branch"  # of BOX-3
MERGE = "tolerant"  # of CSG-4
FRESNEL = "clamped"  # of REF-2
PHONG_METHOD = "clamped"  # of LOC-4
RENORMALISE = "on"  # of NUM-4
VECTOR = False  # rays in lanes (VEC-1)
FLOATING_POINT = "strict"  # of NUM-3
JITTERED = False  # the places of samples are drawn (SAM-2, SAM-7)
STUDY_WEIGHT = False  # GLO-1
LIMITED = False  # a mesh in a CSG solid may be crossed more often than the work memory of a GPU has room for (CSG-6)

# The features that use a method; to a kernel without any of them it does not matter.
MATTERS = {
    "SPHERE_METHOD": ("SPHERE", "ELLIPSOID", "CSG"),
    "OFFSET": ("REFLECTION", "TRANSMISSION", "SHADOWS"),
    "TRIANGLE": ("POLYGON", "MESH"),
    "SLAB": ("BOX", "CSG"),
    "MERGE": ("CSG", "CONTACT"),
    "FRESNEL": ("REFLECTION", "TRANSMISSION"),
    "PHONG_METHOD": ("PHONG",),
    "RENORMALISE": ("SPHERE", "CSG", "REFLECTION", "TRANSMISSION"),
    "STUDY_WEIGHT": ("GLOSSY",),
}
USUAL = {name: globals()[name] for name in MATTERS}

# What follows from them.
TOUCHING = False  # surfaces may be in one place (MED-6)
LIT = False  # lights are asked at all
SCATTERED = False  # rays draw random numbers of their own, by their path (RND-4)
RANDOM = False  # so do they or the samples
FAST = False  # fast-math
FAR = float("inf")  # distance of a miss; of fast-math, which knows no inf, a number near the largest float32


# Of every GPU: bytes of constant memory, of shared memory for a block (more must be asked for in another way), of local
# memory for a thread; registers of a block; rows of blocks in a grid (CUDA C++ Programming Guide, table "Technical
# Specifications per Compute Capability").
CONSTANT_BYTES, SHARED_BYTES, LOCAL_BYTES = 65536, 49152, 524288
BLOCK_REGISTERS, GRID_ROWS = 65536, 65535

CROSSINGS = 64  # of a line with one mesh, on a GPU (CSG-6)
LEAST_SIDE = 8  # pixels of a picture's width and height from which on rays in lanes take less time (VEC-4)
MANY_FOR_LANES = {"float64": 112, "float32": 224}  # spheres from which on the tree takes less time than lanes (VEC-4)
MANY = 64  # spheres from which on, or half as many of the other shapes, the tree is surely the faster way


def take(features, carried, **methods):
    """Sets the constants. features: those of the kernel; carried: those that the job may not use. methods: as above.

    Methods that do not matter to the kernel get their usual values, so that equal kernels share their machine code.
    """
    chosen = {name: name.lower() in features for name in FEATURES}
    chosen |= {f"ASK_{name}": name.lower() in carried for name in ("SHADOWS", "LENS")}
    chosen["ASK_SAMPLER"] = not {"supersampling", "sobol", "adaptive"}.isdisjoint(carried)
    chosen["ASK_NUMBERS"] = chosen["ASK_LENS"] or chosen["ASK_SAMPLER"]
    chosen |= {name.upper(): value for name, value in methods.items()}
    chosen["LIT"] = chosen["DIFFUSE"] or chosen["PHONG"] or chosen["SHADOWS"]
    chosen["SCATTERED"] = chosen["SOFT"] or chosen["GLOSSY"]
    chosen["RANDOM"] = chosen["SCATTERED"] or chosen["JITTERED"] or chosen["LENS"]
    chosen["FAST"] = chosen["FLOATING_POINT"] == "fast"
    chosen["FAR"] = 3e38 if chosen["FAST"] else float("inf")
    chosen["TOUCHING"] = chosen["CONTACT"] and chosen["MEDIA"] and chosen.get("MERGE", MERGE) == "tolerant"
    chosen["TOUCHING"] = chosen["TOUCHING"] and not (chosen.get("STREAMED") or chosen["VECTOR"])
    idle = [name for name, users in MATTERS.items() if not any(chosen[user] for user in users)]
    chosen |= {name: USUAL[name] for name in idle}
    globals().update(chosen)


def methods(job):
    """The entries of `used.methods` that matter for the job."""
    used = {
        "precision": job.precision,
        "floating_point": FLOATING_POINT,
        "walk": "streams" if VECTOR and job.walk == "least" else WALK,
        "accel": "bvh" if TREE else "none",
        "vector": "on" if VECTOR else "off",
    }
    dependent = {
        "sphere": (SPHERE or ELLIPSOID, SPHERE_METHOD),
        "offset": (REFLECTION or TRANSMISSION or SHADOWS, OFFSET),
        "triangle": (POLYGON or MESH, TRIANGLE),
        "slab": (BOX, SLAB),
        "merge": (CSG or CONTACT, MERGE),
        "fresnel": (REFLECTION or TRANSMISSION, FRESNEL),
        "phong": (PHONG, PHONG_METHOD),
        "renormalise": (REFLECTION and job.kind == "image", RENORMALISE),
    }
    used |= {name: method for name, (depends, method) in dependent.items() if depends}
    if CUTOFF and job.cutoff > 0:
        used["cutoff"] = job.cutoff
    if GLOSSY and job.glossy_rays > 0:
        used["glossy_weight"] = job.glossy_weight
    return used


def constants():
    """All of them, by name."""
    return {name: value for name, value in globals().items() if name.isupper()}
