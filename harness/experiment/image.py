"""The keys of [image] of an experiment; all but `rays` and `scale` are also options of `rayrace render`."""

import math
import re
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema, create_model, model_validator

from harness.errors import UserError
from harness.renderer.methods import CHOICES
from harness.renderer.parameters import NEEDS, Parameters
from harness.toml import Strict

BLOCK = 1024  # threads that a block of a GPU can have

Count = Annotated[int, Field(ge=0, le=10**6)]
SIDE = 2**16  # pixels at most
Size = Annotated[int, Field(ge=1, le=SIDE)]
Precision = Annotated[str, Field(pattern=r"^[a-z]+[0-9]+$")]
Region = Literal["all", "one pixel"] | tuple[Count, Count, Count, Count]
Real = Annotated[float, Field(ge=0, allow_inf_nan=False)]


def number(value: Any) -> Any:
    """A number from "2^-10", "1/255" or "0.001", or a plain number."""
    if not isinstance(value, str):
        return value
    if match := re.fullmatch(r"\s*2\^(-?[0-9]{1,3})\s*", value):
        return 2.0 ** int(match[1])
    try:
        above, _, below = value.partition("/")
        return float(above) / float(below or 1)
    except (ValueError, ZeroDivisionError):
        raise ValueError(f'expected a number such as 0.001, "1/255" or "2^-10", found "{value}"') from None


Fraction = Annotated[float, BeforeValidator(number), Field(ge=0, lt=1, allow_inf_nan=False)]


KERNEL = rf"needed(\+({'|'.join(NEEDS)}))*|general"


def kernel(value: str) -> str:
    if re.fullmatch(KERNEL, value):
        return value
    raise ValueError(
        f'expected "needed", "general", or "needed+NAME+.." with what to carry unneeded, found "{value}"; '
        f"names: {', '.join(NEEDS)}"
    )


Kernel = Annotated[str, AfterValidator(kernel), WithJsonSchema({"type": "string", "pattern": f"^({KERNEL})$"})]


Methods = create_model("Methods", __base__=Strict, **{
    name: (Literal[choices], choices[0]) for name, choices in CHOICES.items()
})  # fmt: skip


class Image(Methods):
    """What is rendered. Every key may also be swept."""

    width: Size = 512
    height: Size = 512
    region: Region = "all"
    scale: Annotated[float, BeforeValidator(number), Field(gt=0, le=16)] = (
        1.0  # times sides and region, for a quick look
    )
    depth: Count = 10
    shadows: bool = False
    sampler: Literal[CHOICES["sampler"]] | None = None  # None: sobol with spp, uniform if samples > 1, else one
    samples: Annotated[int, Field(ge=1, le=1024)] = 1  # n of n x n a pixel
    spp: Annotated[int, Field(ge=1, le=2**20)] | None = None  # samples a pixel; in place of `samples`
    adaptive_depth: Annotated[int, Field(ge=0, le=8)] = 3
    adaptive_threshold: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 0.1
    lens_radius: Real = 0.0
    focal_distance: Annotated[float, Field(gt=0, allow_inf_nan=False)] | None = None
    feelers: Annotated[int, Field(ge=0, le=10**5)] = 0
    glossy_rays: Annotated[int, Field(ge=0, le=10**4)] = 0
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 0
    epsilon: Annotated[float, BeforeValidator(number), Field(gt=0, lt=1)] | None = None  # of the offset
    kernel: Kernel = "needed"
    cutoff: Fraction = 0.0  # weight up to which rays are not traced
    sample_x: Annotated[float, Field(ge=0, lt=1)] = 0.5
    sample_y: Annotated[float, Field(ge=0, lt=1)] = 0.5
    precision: Precision = "float64"
    threads: Annotated[int, Field(ge=1)] | Literal["default"] = "default"
    rays: Annotated[int, Field(ge=0, le=10**7)] = 0  # first hits of so many rays, in place of a picture
    # Of a GPU.
    block_width: Annotated[int, Field(ge=1, le=BLOCK)] = 16
    block_height: Annotated[int, Field(ge=1, le=BLOCK)] = 16
    total_threads: Annotated[int, Field(ge=0, lt=2**31)] = 0  # 0: one for each pixel
    max_registers: Annotated[int, Field(ge=0, le=255)] = 0  # of a thread; 0: no cap
    device: str = ""  # of OpenCL: its number, or a part of its name

    @model_validator(mode="after")
    def _sides_fit(self):
        if isinstance(self.region, tuple):
            x0, y0, x1, y1 = self.region
            if not (x0 < x1 <= self.width and y0 < y1 <= self.height):
                raise ValueError(f"region {list(self.region)}: expected x0 < x1 <= width and y0 < y1 <= height")
        if self.cutoff and self.sampler == "adaptive":
            raise ValueError("cutoff: not with adaptive samples, for which no bound of its error holds")
        threads = self.block_width * self.block_height
        if threads > BLOCK:
            sides = f"{self.block_width} x {self.block_height}"
            raise ValueError(f"block_width x block_height: {sides} is {threads} threads, expected {BLOCK} at most")
        return self

    @model_validator(mode="after")
    def _samples_fit(self):
        if self.spp is None:
            return self
        if self.samples != 1:
            raise ValueError("samples and spp: both say how many samples a pixel has; leave one out")
        sampler, root = self.chosen_sampler(), math.isqrt(self.spp)
        if sampler in ("one", "adaptive"):
            raise ValueError(f"spp: not with the sampler {sampler}, which has a number of its own")
        if sampler != "sobol" and root**2 != self.spp:
            grids = f"{root**2} or {(root + 1) ** 2}"
            raise ValueError(f"spp {self.spp}: {sampler} samples are n x n: {grids}; sobol takes any number")
        return self

    def scaled(self) -> "Image":
        """The same with `scale` in its sides and region, each a pixel at least."""
        if self.scale == 1:
            return self
        sides = {side: max(1, round(getattr(self, side) * self.scale)) for side in ("width", "height")}
        region = self.region
        if isinstance(region, tuple):
            x0, y0, x1, y1 = (round(edge * self.scale) for edge in region)
            x0, y0 = min(x0, sides["width"] - 1), min(y0, sides["height"] - 1)
            region = x0, y0, max(x1, x0 + 1), max(y1, y0 + 1)
        return Image.model_validate({**self.model_dump(), **sides, "region": region, "scale": 1.0})

    def bounds(self) -> tuple[int, int, int, int] | None:
        """The region in pixels; None for the whole picture. One pixel is the one in the middle."""
        if self.region == "one pixel":
            i, j = self.width // 2, self.height // 2
            return i, j, i + 1, j + 1
        return None if self.region == "all" else self.region

    def parameters(self, threads: int, frames: int, least_frame: float = 0.0) -> Parameters:
        if self.lens_radius and self.focal_distance is None:
            raise UserError("lens_radius: also needs focal_distance, from the eye to what is in focus")
        others = {"rays", "scale", "region", "threads", "sampler", "samples", "spp"}
        values = self.model_dump(exclude=others, exclude_none=True)
        timing = {"threads": threads, "frames": frames, "least_frame": least_frame}
        sampler, count = self.chosen_sampler(), self.spp or self.samples**2
        samples = {"spp": count} if sampler == "sobol" else {"samples": math.isqrt(count)}
        return Parameters(**values, **timing, **samples, region=self.bounds(), sampler=sampler)

    def chosen_sampler(self) -> str:
        return self.sampler or ("sobol" if self.spp else "uniform" if self.samples > 1 else "one")
