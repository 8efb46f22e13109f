"""The command `profile`: where the time of a frame goes, by the functions of a renderer's source."""

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from rayrace.options import (
    SIDE,
    DepthOption,
    FeelersOption,
    GlossyRaysOption,
    HeightOption,
    JsonOption,
    PrecisionOption,
    RendererOption,
    SamplesOption,
    SceneArgument,
    ShadowsOption,
    SppOption,
    VariantOption,
    choosing,
)

ROWS = 20
PICTURES = ".png", ".svg", ".pdf"
PROFILED = 256  # pixels of the longer side


@choosing("sampler", "vector", "floating_point")
def profile(
    scene: SceneArgument,
    variant: VariantOption = "",
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="Flame graph: .json for speedscope, or a picture, .png, .svg, .pdf."),
    ] = None,
    width: Annotated[int | None, typer.Option(min=1, max=65536, help=SIDE.format(PROFILED))] = None,
    height: HeightOption = None,
    depth: DepthOption = 10,
    shadows: ShadowsOption = True,
    samples: SamplesOption = 1,
    spp: SppOption = 0,
    feelers: FeelersOption = 0,
    glossy_rays: GlossyRaysOption = 0,
    precision: PrecisionOption = "float64",
    timeout: Annotated[float, typer.Option(min=0.01, help="Seconds, of each process.")] = 1800.0,
    renderer: RendererOption = None,
    as_json: JsonOption = False,
    **chosen: str | None,
) -> None:
    """Profile a frame of a renderer, and it alone: instructions by callgrind, of a Python program seconds by py-spy."""
    from harness.errors import UserError
    from harness.picture import picture
    from harness.renderer import registry
    from harness.scene import load
    from harness.scene.flatten import flatten
    from harness.scene.needs import needs as needs_of
    from harness.single import profile as profiles
    from harness.single import single
    from harness.system import output
    from rayrace import bundled

    if out:
        if out.suffix not in (".json", *PICTURES):
            raise UserError(f"-o {out}: expected .json, {', '.join(PICTURES)}")
        picture.check_folder(out)
    read = load(bundled.scene(scene))
    image = single.image(
        "", **single.size(read, width, height, PROFILED), depth=depth, shadows=shadows, samples=samples,
        spp=spp or None, feelers=feelers, glossy_rays=glossy_rays, precision=precision, **chosen,
    )  # fmt: skip
    job = image.parameters(1, 1)
    needs = needs_of(read, job)
    entry = single.pick(variant, registry.entries(tuple(renderer or ())), job, needs)
    job = replace(job, threads=entry.threads())
    cost_profile = profiles.take(entry, flatten(read, job.arithmetic), job, needs, timeout)
    if isinstance(cost_profile, str):
        raise UserError(f"{entry.name} was not profiled: {cost_profile}")
    title = f"{entry.name}, {Path(scene).name}: a frame, {cost_profile.unit} by {cost_profile.tool}"
    if cost_profile.size:
        title += f", of {cost_profile.size[0]} x {cost_profile.size[1]} pixels, as Valgrind is slow"
    if out and out.suffix == ".json":
        output.text(out, json.dumps(speedscope(cost_profile, title)) + "\n", own=False)
    elif out:
        from reports.paper import flame_figure, style

        with style.styled():
            style.save_as(flame_figure.draw(cost_profile.stacks, title), out)
    if as_json:
        functions = [{"name": name, "own": own, "whole": whole} for name, own, whole in cost_profile.functions()]
        about = {
            "renderer": entry.name,
            "tool": cost_profile.tool,
            "unit": cost_profile.unit,
            "size": cost_profile.size,
        }
        print(json.dumps({**about, "total": cost_profile.total, "functions": functions}, indent=1))
        return
    print(title)
    print(f"{'own':>8} {'whole':>8}  function")
    rows = cost_profile.functions()
    for name, own, whole in rows[:ROWS]:
        print(f"{100 * own / cost_profile.total:6.1f} % {100 * whole / cost_profile.total:6.1f} %  {name}")
    if len(rows) > ROWS:
        print(f"and {len(rows) - ROWS} more", file=sys.stderr)


def speedscope(cost_profile, title: str) -> dict:
    """A profile in the format of speedscope (its file-format-schema.json): a weight for each stack."""
    names = list(dict.fromkeys(name for stack in cost_profile.stacks for name in stack))
    place = {name: number for number, name in enumerate(names)}
    unit = "seconds" if cost_profile.unit == "seconds" else "none"
    return {
        "$schema": "https://www.speedscope.app/file-format-schema.json",
        "exporter": "rayrace",
        "name": title,
        "shared": {"frames": [{"name": name} for name in names]},
        "profiles": [
            {
                "type": "sampled", "name": title, "unit": unit, "startValue": 0, "endValue": cost_profile.total,
                "samples": [[place[name] for name in stack] for stack in cost_profile.stacks],
                "weights": list(cost_profile.stacks.values()),
            }
        ],
    }  # fmt: skip
