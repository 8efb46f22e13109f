"""The methods of a job that are chosen by name, each once. Imports the standard library alone.

The parameters of a job, the keys of [image] with their schema, the options of commands, what a reference has by
default, and what reports call a method follow from this table.
"""

from typing import NamedTuple

# What a choice changes.
TIME = "time"  # nothing in the picture
ROUNDING = "rounding"  # the last digits, but where the catalogue of failures says otherwise
FAILURES = "failures"  # nothing where the first choice is not needed
PICTURE = "picture"  # what is seen


class Method(NamedTuple):
    """A method, the first of its choices by default.

    word: it follows a choice in the names of methods; "" for a method with names of its own (reports/run/method.py).
    naive: choices that are wrong somewhere (docs/where-methods-fail.md). listed: whether the manifest of a renderer
    lists its choices. help: of its option, {} for the choices.
    """

    name: str
    choices: tuple[str, ...]
    changes: str
    word: str = ""
    naive: tuple[str, ...] = ()
    listed: bool = True
    help: str = "{}."

    @property
    def default(self) -> str:
        return self.choices[0]

    def described(self) -> str:
        """Returns the help of its option: "robust, textbook, stable or wide."."""
        *most, last = self.choices
        return self.help.format(f"{', '.join(most)} or {last}")


METHODS = (
    Method("sampler", ("one", "uniform", "jittered", "adaptive", "sobol"), PICTURE, listed=False),
    Method("glossy_weight", ("plain", "study"), PICTURE),
    Method("walk", ("least", "recursion", "table", "stack", "chain"), TIME, "walk", ("table", "recursion")),
    Method("accel", ("auto", "none", "bvh"), TIME),
    Method("floating_point", ("strict", "contract", "fast"), ROUNDING, "floating point", ("contract", "fast")),
    Method("sphere", ("robust", "textbook", "stable", "wide"), ROUNDING, "spheres", ("textbook", "stable")),
    Method(
        "triangle", ("watertight", "moller-trumbore", "watertight-kahan"), ROUNDING, "triangles", ("moller-trumbore",)
    ),
    Method("slab", ("branch", "plain"), ROUNDING, "slabs", ("plain",)),
    Method("csg", ("intervals", "stepping"), FAILURES, "CSG", ("stepping",)),
    Method("merge", ("tolerant", "none"), FAILURES, "merging", ("none",)),
    Method("offset", ("bounded", "relative", "fixed", "none"), PICTURE, "offset", ("fixed", "none")),
    Method("fresnel", ("clamped", "unclamped"), FAILURES, "Fresnel", ("unclamped",)),
    Method("phong", ("clamped", "unclamped"), FAILURES, "Phong", ("unclamped",)),
    Method("renormalise", ("on", "off"), FAILURES, "renormalising", ("off",)),
    Method(
        "vector", ("off", "on", "auto"), ROUNDING, help="Many rays, or many shapes, at once: {}, where it is faster."
    ),
    Method(
        "arithmetic",
        ("linear", "srgb"),
        PICTURE,
        naive=("srgb",),
        listed=False,
        help="How light adds up: {}, which is wrong.",
    ),
    Method("scene_memory", ("auto", "global", "constant", "shared"), TIME, help="Of a GPU: {}."),
    Method("gpu_wait", ("auto", "spin", "yield", "block"), TIME, help="Until a GPU is done: {}."),
)
CHOICES = {method.name: method.choices for method in METHODS}


def changing(*what: str) -> tuple[str, ...]:
    """Returns the names of the methods that change one of these: TIME, ROUNDING, FAILURES, PICTURE."""
    return tuple(method.name for method in METHODS if method.changes in what)
