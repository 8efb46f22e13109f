"""Options that several commands share, each declared once."""

import inspect
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, TypeVar

import typer

from harness.renderer import methods

Command = TypeVar("Command", bound=Callable[..., None])


@contextmanager
def unnamed(name: str, option: str) -> Iterator[Path]:
    """Yields the file `name`, or NAME-2, NAME-3, .. if it exists: nobody asked for it to be overwritten.

    If the block writes another than `name`, it is said in the end. option: that which names a file.
    """
    first = path = Path(name)
    number = 1
    while os.path.lexists(path):
        number += 1
        path = first.with_stem(f"{first.stem}-{number}")
    try:
        yield path
    finally:
        if number > 1 and path.exists():
            print(f"note: {first} exists and was kept, so this is {path}; {option} names a file", file=sys.stderr)


def choosing(*names: str) -> Callable[[Command], Command]:
    """Adds an option for each of the named methods, or for all, to a command that takes them as `**chosen`.

    sampler: by default it follows from the samples, and is None then.
    """

    def add(command: Command) -> Command:
        *own, _ = inspect.signature(command).parameters.values()
        for method in methods.METHODS:
            if method.name in (names or methods.CHOICES):
                option = typer.Option(help=method.described(), metavar="NAME", rich_help_panel="Methods")
                own.append(
                    inspect.Parameter(
                        method.name,
                        inspect.Parameter.KEYWORD_ONLY,
                        annotation=Annotated[str | None, option],
                        default=None if method.name == "sampler" else method.default,
                    )
                )
        command.__signature__ = inspect.Signature(own)
        command.__annotations__ = {each.name: each.annotation for each in own}
        return command

    return add


def percent(text: str) -> float:
    """A number of per cent from 5, 5% or "5 %". typer.BadParameter if it is none, or below 0."""
    try:
        value = float(text.strip().removesuffix("%"))
    except ValueError:
        value = -1.0
    if not 0 <= value < float("inf"):
        raise typer.BadParameter(f'expected a number of per cent, such as 5 or 5%, found "{text}"')
    return value


SceneArgument = Annotated[Path, typer.Argument(help="Scene file, or the name of a bundled one.")]
RendererOption = Annotated[list[Path] | None, typer.Option("--renderer", help="Folder of a renderer, or of several.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON for a script.")]
VariantOption = Annotated[
    str, typer.Option("-r", "--variant", help="Who renders. Default: the first available of the fastest.")
]
SIDE = "Pixels. Default: the longer side has {0}, and the picture the shape of the screen."
ALONE = "Pixels. One side alone gives the other."
WidthOption = Annotated[int | None, typer.Option(min=1, max=65536, help=SIDE.format(512))]
HeightOption = Annotated[int | None, typer.Option(min=1, max=65536, help=ALONE)]
DepthOption = Annotated[int, typer.Option(min=0, help="Largest order of a ray.")]
ShadowsOption = Annotated[bool, typer.Option(help="Shadow feelers.")]
SamplesOption = Annotated[int, typer.Option(min=1, help="n: n x n samples a pixel, uniform if no sampler is given.")]
SppOption = Annotated[int, typer.Option(min=0, help="Samples a pixel, by sobol if no sampler is given.")]
AdaptiveDepthOption = Annotated[int, typer.Option(min=0, max=8, help="Halvings of a pixel.")]
AdaptiveThresholdOption = Annotated[float, typer.Option(help="Difference that halves.")]
LensRadiusOption = Annotated[float, typer.Option(min=0, help="0: a pinhole.")]
FocalDistanceOption = Annotated[float, typer.Option(min=0, help="From the eye to what is in focus.")]
FeelersOption = Annotated[int, typer.Option(min=0, help="To each light with a radius; 0: hard shadows.")]
GlossyRaysOption = Annotated[int, typer.Option(min=0, help="Reflected rays of a hit on a rough material; 0: mirrored.")]
SeedOption = Annotated[int, typer.Option(min=0, help="Of the random numbers.")]
PrecisionOption = Annotated[str, typer.Option(help="float64, float32, mp60.")]
CutoffOption = Annotated[str, typer.Option(help="Rays of so small a weight are not traced: 0.001, 2^-10.")]
