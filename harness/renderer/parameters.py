"""The parameters of a job, and the defaults of `rayrace render`. Imports the standard library alone."""

import dataclasses
from dataclasses import dataclass

from harness.renderer import methods


def roundoff(precision: str) -> float:
    """u (NUM-2) of a precision: float64, float32, or mpmath's with so many digits, such as mp60."""
    if precision.startswith("mp") and precision[2:].isdigit():
        return 10.0 ** (1 - int(precision[2:])) / 2
    return {"float32": 2.0**-24}.get(precision, 2.0**-53)


def default_epsilon(precision: str) -> float:
    """32 u (OFF-1) of a precision."""
    return 32 * roundoff(precision)


def default_sliver(precision: str) -> float:
    """16 u (CSG-4) of a precision."""
    return 16 * roundoff(precision)


FIXED_EPSILON = 1e-4  # OFF-1: the length that is so often seen in code


NOT_IN_THE_PICTURE = (
    *("threads", "frames", "least_frame", "kernel", *methods.changing(methods.TIME)),
    *("block_width", "block_height", "total_threads", "max_registers", "device"),
)


# What a job may need (renderers/README.md).
NEEDS = (
    *("sphere", "box", "polygon", "ellipsoid", "mesh", "csg", "ambient", "diffuse", "phong", "shadows", "soft"),
    *("reflection", "transmission", "glossy", "attenuation", "media", "contact"),
    *("supersampling", "sobol", "adaptive", "lens", "cutoff"),
)


Methods = dataclasses.make_dataclass("Methods", [(m.name, str, m.default) for m in methods.METHODS], frozen=True)


@dataclass(frozen=True)
class Parameters(Methods):
    """The parameters of a job, with the names and units of the contract; the methods that are chosen by name among them
    (methods.py)."""

    kind: str = "image"
    width: int = 512
    height: int = 512
    region: tuple[int, int, int, int] | None = None  # None: the whole picture
    depth: int = 10
    shadows: bool = False
    samples: int = 1  # n of the n x n of the samplers uniform and jittered
    spp: int = 1  # samples a pixel, of the sampler sobol
    adaptive_depth: int = 3
    adaptive_threshold: float = 0.1
    lens_radius: float = 0.0
    focal_distance: float = 1.0
    feelers: int = 0
    glossy_rays: int = 0
    seed: int = 0
    kernel: str = "needed"  # or "general", or what it carries unneeded: "needed+shadows+lens"
    cutoff: float = 0.0
    sample_x: float = 0.5
    sample_y: float = 0.5
    precision: str = "float64"
    epsilon: float | None = None  # None: 32 u of the precision, for a fixed offset FIXED_EPSILON (OFF-1)
    sliver: float | None = None  # of CSG-4; None: 16 u of the precision, and the job does not say so
    threads: int = 1
    frames: int = 0
    least_frame: float = 0.0  # s; frames that would be shorter consist of several renders
    block_width: int = 16  # of a GPU, as what follows
    block_height: int = 16
    total_threads: int = 0  # 0: one for each pixel
    max_registers: int = 0  # of a thread; 0: as many as the compiler likes
    device: str = ""  # of a GPU: its number, or a part of its name; "": the renderer chooses

    def bounds(self) -> tuple[int, int, int, int]:
        return self.region or (0, 0, self.width, self.height)

    def per_pixel(self) -> int:
        """Returns how many samples a pixel has; of adaptive ones, whose number differs, the largest."""
        other = {"one": 1, "sobol": self.spp, "adaptive": 4**self.adaptive_depth}
        return other.get(self.sampler, self.samples**2)

    def shape(self) -> tuple[int, int, int]:
        """Shape of the picture."""
        x0, y0, x1, y1 = self.bounds()
        return y1 - y0, x1 - x0, 3

    def values(self) -> dict[str, str | int | float]:
        """Returns the parameters as the contract spells them."""
        values = dataclasses.asdict(self)
        values["region"] = ",".join(map(str, self.bounds()))
        values["shadows"] = int(self.shadows)
        usual = FIXED_EPSILON if self.offset == "fixed" else default_epsilon(self.precision)
        values["epsilon"] = usual if self.epsilon is None else self.epsilon
        if self.sliver is None:
            del values["sliver"]
        return values

    def picture(self) -> "Parameters":
        """These parameters without those that may not change the picture."""
        default = Parameters()
        return dataclasses.replace(self, **{name: getattr(default, name) for name in NOT_IN_THE_PICTURE})

    def carried(self, features: tuple[str, ...]) -> tuple[str, ...]:
        """Returns the features that a renderer's kernel carries whether the job needs them or not."""
        if self.kernel == "general":
            return tuple(name for name in NEEDS if name in features)
        return tuple(self.kernel.split("+")[1:])

    def defines(self, needs: tuple[str, ...]) -> tuple[str, ...]:
        """Returns the compiler flags -D.. for this job (the contract's {defines})."""
        names = [*(f"NEED_{name}" for name in sorted(needs)), f"KIND_{self.kind}", f"PRECISION_{self.precision}"]
        return tuple("-D" + name.upper().replace("-", "_") for name in names)


def side(sampler: str, n: int) -> dict[str, int]:
    """Returns the parameter by which a sampler takes n x n samples a pixel."""
    return {"spp": n * n} if sampler == "sobol" else {"samples": n}


NAMES = tuple(field.name for field in dataclasses.fields(Parameters))

# Values of the options of `rayrace render` that are not given, by parameter, spelt as on the command line: shadows are
# on, and what is empty or 0 there is left to the scene, the method or the variant.
OPTIONS = {
    **{field.name: field.default for field in dataclasses.fields(Parameters)},
    **{"shadows": True, "region": "", "epsilon": "", "sampler": "", "cutoff": "0"},
    **{"focal_distance": 0.0, "threads": 0, "spp": 0},
}
