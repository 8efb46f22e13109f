"""The commands `render` and `trace`: one picture, or the hits of a list of rays."""

import json
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated

import typer

from rayrace.options import (
    AdaptiveDepthOption,
    AdaptiveThresholdOption,
    CutoffOption,
    DepthOption,
    FeelersOption,
    FocalDistanceOption,
    GlossyRaysOption,
    HeightOption,
    JsonOption,
    LensRadiusOption,
    PrecisionOption,
    RendererOption,
    SamplesOption,
    SceneArgument,
    SeedOption,
    ShadowsOption,
    SppOption,
    VariantOption,
    WidthOption,
    choosing,
    unnamed,
)


@choosing()
def render(
    context: typer.Context,
    scene: SceneArgument,
    variant: VariantOption = "",
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            help="Picture: .png, .exr, .npy or .tif; or scene: .pov. Default: picture.png, or a new name if it exists.",
        ),
    ] = None,
    width: WidthOption = None,
    height: HeightOption = None,
    depth: DepthOption = 10,
    shadows: ShadowsOption = True,
    samples: SamplesOption = 1,
    spp: SppOption = 0,
    adaptive_depth: AdaptiveDepthOption = 3,
    adaptive_threshold: AdaptiveThresholdOption = 0.1,
    lens_radius: LensRadiusOption = 0.0,
    focal_distance: FocalDistanceOption = 0.0,
    feelers: FeelersOption = 0,
    glossy_rays: GlossyRaysOption = 0,
    seed: SeedOption = 0,
    epsilon: Annotated[str, typer.Option(help="Of the offset: 1e-4, 2^-20. Default: by method and precision.")] = "",
    kernel: Annotated[
        str, typer.Option(help="needed: what the scene needs, +lens: that too; general: all.", metavar="NAME")
    ] = "needed",
    cutoff: CutoffOption = "0",
    sample_x: Annotated[float, typer.Option(min=0, max=1, help="Place of the sample in a pixel.")] = 0.5,
    sample_y: Annotated[float, typer.Option(min=0, max=1)] = 0.5,
    region: Annotated[str, typer.Option(help="Only the pixels x0,y0,x1,y1.")] = "",
    precision: PrecisionOption = "float64",
    threads: Annotated[int, typer.Option(min=0, help="0: as many as the variant runs by default.")] = 0,
    block_width: Annotated[int, typer.Option(min=1, max=1024, help="Threads of a GPU's block.")] = 16,
    block_height: Annotated[int, typer.Option(min=1, max=1024)] = 16,
    total_threads: Annotated[int, typer.Option(min=0, help="Of a GPU; 0: one for each pixel.")] = 0,
    max_registers: Annotated[int, typer.Option(min=0, max=255, help="Of a GPU's thread; 0: no cap.")] = 0,
    device: Annotated[str, typer.Option(help="Of a GPU: its number, or a part of its name.")] = "",
    max_error: Annotated[
        str,
        typer.Option(
            help="Find the quickest method with an RMSE (linear RGB, all pixels) of at most 1/255, 0.001, ..",
            metavar="ERROR",
        ),
    ] = "",
    against: Annotated[
        str,
        typer.Option(help="With --max-error: scene, or centres, the error at the centres of pixels.", metavar="NAME"),
    ] = "scene",
    max_seconds: Annotated[
        float, typer.Option(min=0, help="With --max-error: seconds for all of it. 0: until nothing better is known.")
    ] = 0.0,
    frames: Annotated[int, typer.Option(min=0, help="Frames after the first, to time.")] = 0,
    timeout: Annotated[float, typer.Option(min=0.01, help="Seconds.")] = 3600.0,
    renderer: RendererOption = None,
    as_json: JsonOption = False,
    **chosen: str | None,
) -> None:
    """Render a scene to a picture."""
    from harness.errors import UserError
    from harness.scene import load
    from harness.single import single
    from harness.store import record
    from rayrace import bundled, facts

    read = load(bundled.scene(scene))
    image = single.image(
        **single.size(read, width, height), depth=depth, shadows=shadows, samples=samples, spp=spp or None,
        adaptive_depth=adaptive_depth, adaptive_threshold=adaptive_threshold, lens_radius=lens_radius,
        focal_distance=focal_distance or None,
        feelers=feelers, glossy_rays=glossy_rays, seed=seed, epsilon=epsilon or None, kernel=kernel, cutoff=cutoff,
        sample_x=sample_x, sample_y=sample_y, region=region, precision=precision, threads=threads or "default",
        block_width=block_width, block_height=block_height, total_threads=total_threads, max_registers=max_registers,
        device=device, **chosen,
    )  # fmt: skip
    with nullcontext(out) if out else unnamed("picture.png", "-o") as path:
        if max_error:
            from rayrace import choice

            given = {name for name in context.params if context.get_parameter_source(name).name != "DEFAULT"}
            arguments = max_error, against, max_seconds, given, frames, timeout, tuple(renderer or ()), as_json
            choice.render(read, variant, path, image, *arguments)
            return
        if against != "scene" or max_seconds:
            raise UserError("--against and --max-seconds: only with --max-error")
        made = single.render(read, variant, path, image, frames, timeout, tuple(renderer or ()))
    facts.warn(made["warnings"])
    if as_json:
        print(json.dumps(made))
    elif "scene" in made:
        print(f"{made['scene']}: scene for {made['exporter']}")
    else:
        facts.show(made, image.precision)
        unknown = made["error"].get("unavailable") == single.NOT_MEASURED
        print("accuracy not measured (add --max-error)" if unknown else record.error_of(made["error"]))
        print(record.agreement_of(made["agreement"]))


@choosing("sphere", "triangle", "slab", "csg", "merge", "vector", "floating_point", "scene_memory")
def trace(
    scene: SceneArgument,
    rays: Annotated[Path, typer.Argument(help="CSV with the header ox,oy,oz,dx,dy,dz.", metavar="RAYS.csv")],
    variant: Annotated[
        str, typer.Option("-r", "--variant", help="Who traces. Default: the first available of the fastest.")
    ] = "",
    out: Annotated[Path | None, typer.Option("-o", "--out", help="HITS.csv. Default: standard output.")] = None,
    precision: PrecisionOption = "float64",
    timeout: Annotated[float, typer.Option(min=0.01, help="Seconds.")] = 3600.0,
    renderer: RendererOption = None,
    **chosen: str | None,
) -> None:
    """First hits of a list of rays: hit,t,px,py,pz,nx,ny,nz,object."""
    from harness.picture import picture
    from harness.single import single
    from harness.system import output
    from rayrace import bundled

    if out is not None:
        picture.check_folder(out)
    methods = {"precision": precision, **chosen}
    hits = single.trace(bundled.scene(scene), rays, variant, methods, timeout, tuple(renderer or ()))
    if out is None:
        print(hits, end="")
    else:
        output.text(out, hits, own=False)
