"""The factors of the covering arrays of conformance, from the manifests, and the combinations that are refused."""

import functools
import tempfile
from dataclasses import dataclass
from pathlib import Path

from covering import Case, Space
from feature_scenes import features

from harness.renderer import registry
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.model import Scene
from harness.scene.needs import needs
from harness.system import cuda
from renderers.numba.needs import MATTERS

DEPTH = 3
THREADS = 3  # of a variant with threads
USUAL = ("sphere", "offset", "fresnel", "phong", "renormalise")  # of these, rays in lanes have only the default
MANY = 64  # shapes from which Numba uses a tree if accel is auto
THREADED = {"cpp": "cpp-threads", "numba": "numba-parallel"}
RENDERERS = ("cpp", "numba", "python", "numpy", "opencl", "numba-cuda")
# Renderers of devices that can be tried here, where an OpenCL driver of a processor is enough; a GPU has three.
ON_DEVICES = ("opencl", *(("numba-cuda", "cuda-cpp") if cuda.devices() and not cuda.simulated() else ()))
# The methods of Numba's constants.
METHOD_OF = {name: name.lower().removesuffix("_method") for name in MATTERS} | {"STUDY_WEIGHT": "glossy_weight"}
# Scenes that equal others here, since samplers and weights are factors of their own.
SAME = {"jittered", "adaptive", "glossy, the study's weight", "mix: adaptive glass"}
METHODS = (
    *("precision", "walk", "accel", "kernel", "vector", "floating_point", "sphere", "triangle", "slab", "csg"),
    *("merge", "offset", "fresnel", "phong", "renormalise", "glossy_weight"),
)


@dataclass(frozen=True)
class Feature:
    """A scene of feature_scenes.py, the parameters that its feature needs, and facts about its rays."""

    scene: Scene
    job: dict
    single: bool  # no ray has two children
    clear: bool  # some rays are transmitted
    broken: bool  # some exponent of Phong is not a whole number
    many: bool  # MANY shapes or more
    solid: bool  # it has CSG solids


@functools.cache
def scenes() -> dict[str, Feature]:
    with tempfile.TemporaryDirectory() as folder:
        found = {name: value for name, value in features(Path(folder)).items() if name not in SAME}
        return {name: _feature(text.read(source, name), job) for name, (source, job) in found.items()}


def _feature(scene: Scene, job: dict) -> Feature:
    job = {key: value for key, value in job.items() if key not in ("depth", "shadows", "sampler", "samples")}
    job.pop("adaptive_depth", None)
    needed = set(needs(scene, Parameters(**job, depth=DEPTH, shadows=True)))
    exponents = [thing.material.exponent for thing in scene.objects if thing.material.k_s > 0]
    count = len(scene.objects) + sum(len(getattr(thing, "triangles", ())) for thing in scene.objects)
    return Feature(
        scene,
        job,
        single="transmission" not in needed and ("glossy" not in needed or job["glossy_rays"] < 2),
        clear="transmission" in needed,
        broken=any(exponent != int(exponent) for exponent in exponents),
        many=count >= MANY,
        solid="csg" in needed,
    )


def parameters(case: Case, size: tuple[int, int]) -> Parameters:
    """The parameters of the job of a case."""
    values = {name: value for name, value in case.items() if name != "scene"}
    job = {"adaptive_depth": 2, "samples": 2, "spp": 5, **scenes()[case["scene"]].job}
    return Parameters(width=size[0], height=size[1], **job, **values)


@functools.cache
def needed(scene: str, sampler: str, depth: int, shadows: bool) -> tuple[str, ...]:
    """What a kernel of `needed` has."""
    case = {"scene": scene, "sampler": sampler, "depth": depth, "shadows": shadows}
    return needs(scenes()[scene].scene, parameters(case, (1, 1)))


def variant(renderer: str, case: Case) -> str:
    """The variant that renders a case."""
    return THREADED[renderer] if case.get("threads", 1) > 1 else renderer


def default(name: str):
    return getattr(Parameters, name)


def refusal(case: Case) -> str | None:
    """None, or why renderers refuse a case, or why its right picture is not defined."""
    found = scenes()[case["scene"]]
    if case.get("walk") == "chain" and not found.single:
        return "a chain follows one child of each ray (WLK-1)"
    if case["offset"] == "none" and (case["depth"] or case["shadows"]):
        return "rounding decides whether a ray hits the surface that it leaves (OFF-1): tests/stability/test_acne.py"
    if case["offset"] == "none" and case["csg"] == "stepping" and found.solid:
        return "rounding decides whether a ray crosses the face again that it has stepped through (CSG-7)"
    if case["renormalise"] == "off" and (case["depth"] or case["shadows"]):
        return "a hit is not moved onto its sphere (HIT-4), so rays may meet it again: tests/stability/test_drift.py"
    critical = case["fresnel"] == "unclamped" and found.clear and case["depth"]
    if critical or (case["phong"] == "unclamped" and found.broken):  # then some pixels are not finite
        if case["floating_point"] == "fast":
            return "fast-math does not define what becomes of a NaN (NUM-3): tests/stability/test_nan.py"
        if case["sampler"] == "adaptive":
            return "SAM-4 does not define whether a square with a NaN is quartered"
    return None


def of_cpp(case: Case) -> str | None:
    """None, or why C++ refuses a case."""
    usual = all(case[name] == default(name) for name in (*USUAL, "triangle", "slab", "csg", "merge"))
    single = scenes()[case["scene"]].single
    in_lanes = usual and (case["walk"] == "least" or (case["walk"] == "chain" and single))
    if case["vector"] == "on" and case["accel"] == "none" and not in_lanes:
        return "not in lanes but in a hierarchy (VEC-1, VEC-3)"
    return refusal(case)


def of_numba(case: Case) -> str | None:
    """None, or why Numba refuses a case."""
    usual = all(case[name] == default(name) for name in (*USUAL, "triangle", "slab", "merge", "floating_point"))
    in_lanes = case["walk"] in ("least", "chain") and case["kernel"] == "needed"
    if case["vector"] == "on" and not (usual and in_lanes):
        return "not in lanes (VEC-1)"
    return refusal(case)


def chosen_by_numba(case: Case) -> Case:
    """What Numba compiles in place of `auto` and `least`, and of methods that do not matter to the kernel."""
    found = scenes()[case["scene"]]
    tree = {"auto": "bvh" if found.many else "none"}.get(case["accel"], case["accel"])
    if case["kernel"] == "general":  # which has no lanes
        return {"walk": case["walk"].replace("least", "stack"), "accel": tree, "vector": "off"}
    features = {*needed(case["scene"], case["sampler"], case["depth"], case["shadows"])}
    lanes = of_numba(case | {"vector": "on"}) is None and tree == "none"
    several = not found.single and features & {"transmission", "glossy"}
    idle = [name for name, users in MATTERS.items() if not features & {user.lower() for user in users}]
    return {
        "walk": case["walk"].replace("least", "stack" if several else "chain"),
        "accel": tree,
        "vector": case["vector"].replace("auto", "on" if lanes else "off"),
        **{METHOD_OF[name]: default(METHOD_OF[name]) for name in idle},
    }


REFUSALS = {"cpp": of_cpp, "numba": of_numba}  # of others: `refusal`


def factors(renderer: str) -> dict[str, tuple]:
    """Factors and their values, the default first: the methods of the manifest, and parameters of a job."""
    entry, threaded = registry.entries()[renderer], renderer in THREADED
    methods = {name: (default(name), *entry.methods.get(name, ())) for name in METHODS}
    without = left_out(renderer)
    methods = {
        name: tuple(value for value in dict.fromkeys(values) if (name, value) not in without)
        for name, values in methods.items()
    }
    return {
        **methods,
        "scene": tuple(scenes()),
        "sampler": ("one", "uniform", "jittered", "adaptive", "sobol"),
        "depth": (0, 1, DEPTH),
        "shadows": (False, True),
        "threads": (1, THREADS) if threaded else (1,),
    }


def left_out(renderer: str) -> set[tuple[str, str]]:
    """Methods and values of a manifest that no case has.

    mp60 takes minutes for a picture; the oracle has tests of its own. The simulator of a GPU is strict and compiles
    nothing; the memory of a GPU, and waiting for it, have tests of their own (test_cuda.py, test_opencl.py).
    """
    compiled = [("floating_point", "contract"), ("floating_point", "fast"), ("kernel", "general")]
    memories = [("scene_memory", value) for value in ("auto", "global", "constant", "shared")]
    waits = [("gpu_wait", value) for value in ("auto", "spin", "yield", "block")]
    left = {
        "python": [("precision", "mp60")],
        "numba-cuda": memories + waits + (compiled if cuda.simulated() or not cuda.devices() else []),
        "cuda-cpp": memories + waits,
        "opencl": memories,
    }
    return set(left.get(renderer, ()))


OF_A_REFERENCE = ("offset", "fresnel", "phong")  # of a picture; C++, which makes its reference, is built for them


@functools.cache
def space(renderer: str) -> Space:
    """The space of the cases of a renderer and its threaded variant."""
    told = factors(renderer)
    why = REFUSALS.get(renderer, refusal)
    at_run_time = {"cpp": ("walk", "accel", "glossy_weight", "threads")}.get(renderer, ())
    compiled = [name for name in (*METHODS, "threads") if name not in at_run_time]

    def allowed(case: Case) -> bool:
        return why(case) is None

    def of_reference(case: Case) -> tuple:
        return tuple(case[name] for name in OF_A_REFERENCE)

    def kernel_of_cpp(case: Case) -> tuple:
        job = needed(case["scene"], case["sampler"], case["depth"], case["shadows"])
        return *(case[name] for name in compiled), job if case["kernel"] == "needed" else ()

    def kernel_of_numba(case: Case) -> tuple:
        drawn = case["kernel"] == "needed" and case["sampler"] in ("jittered", "sobol")
        return *kernel_of_cpp(case | chosen_by_numba(case)), drawn

    if renderer not in THREADED:
        begin = {name: told[name] for name in OF_A_REFERENCE if len(told[name]) > 1}
        return Space(told, allowed, of_reference, lambda _: 60, begin if len(begin) > 1 else {})
    begin = {name: told[name] for name in compiled} | {"kernel": ("general",), "vector": ("off",)}
    if renderer == "cpp":
        return Space(told, allowed, kernel_of_cpp, price_of_cpp, begin)
    begin |= {"accel": ("none", "bvh"), "walk": tuple(value for value in told["walk"] if value != "least")}
    alike = {"walk": {"stack": ("least",)}, "accel": {"none": ("auto",), "bvh": ("auto",)}}
    return Space(told, allowed, kernel_of_numba, price_of_numba, begin, 1, alike)


def price_of_cpp(case: Case) -> int:
    """Returns the price of a kernel: with rays in lanes it takes three times as long to compile."""
    return 60 if case["vector"] == "off" else 180


def price_of_numba(case: Case) -> int:
    """Returns the price of a kernel: a general one takes five times as long to compile, one of threads three times."""
    return 300 if case["kernel"] == "general" else 200 if case["threads"] > 1 else 60
