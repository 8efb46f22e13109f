"""POV-Ray, which shares no code with our renderers, makes the same pictures. `pytest -rP` shows how far it is off."""

import os
import time
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from tessellate import ball, obj

from harness.judge import reference
from harness.process import repetition
from harness.renderer.parameters import Parameters
from harness.scene import text
from harness.scene.flatten import flatten
from harness.scene.needs import needs
from renderers.povray import exr, main

SCENES = Path(__file__).parents[2] / "experiments" / "scenes"
OFF = 2 / 255  # of linear light; 8-bit pictures that differ by less look the same
HALF = 2.0**-11  # the 16-bit floats that POV-Ray writes are so exact, relative to their value

CAMERA = "CAMERA (0.1,-0.2,0) (2.1,0,-0.2) (0,2.1,0) (0.4,0.9,6.1)\n"
LIGHTS = "LIGHT (4.1,5.3,6.2) (0.9,0.8,0.7) 0\nLIGHT (-3.7,2.9,4.4) (0.5,0.4,0.6) 0\n"
AMBIENT = "AMBIENT (0.4,0.5,0.3)\nBACKGROUND (0.5,0.6,0.8)\n"
FLOOR = "POLYGON 5 (-3,-1.3,3) (3,-1.3,3.2) (3.6,-1.3,0) (3,-1.3,-4) (-3,-1.3,-4) (0.6,0.7,0.4) 0 1 (0,0,0) 1 1\n"
MATTE = "(0.7,0.5,0.3) 0 20 (0,0,0) 9 1"
SHINY = "(0.7,0.5,0.3) 0.6 20 (0,0,0) 9 1"
GLASS = "(0,0,0) 1 40 (1,1,1) 2.25 1"
TINTED = "(0.3,0.2,0.3) 0.9 12 (0.6,0.8,0.9) 2.89 1"
STAGE = CAMERA + AMBIENT + LIGHTS + FLOOR


def crowd(material):
    return (
        f"SPHERE (-0.9,0.5,0.3) 0.62 {material}\nSPHERE (1.1,0.9,-1.3) 0.75 {SHINY}\n"
        f"BOX (0.3,-1.2,0.2) (0.8,0.1,0.3) (-0.1,0.9,0.2) (-0.2,-0.1,0.9) {material}\n"
        f"ELLIPSOID (-0.7,-0.7,1.3) (0.5,0.1,0) (0,0.35,0.1) (0.1,0,0.6) {material}\n"
    )


def solid(material):
    return (
        "AND OR SPHERE (0.1,0.2,0.3) 1.1 ELLIPSOID (0.9,0.1,-0.4) (0.9,0.2,0) (-0.1,0.5,0.2) (0.1,-0.1,0.8) END\n"
        "NOT OR BOX (-0.3,-0.1,0.2) (1.1,0.2,0.1) (-0.1,0.9,0.1) (0.2,-0.1,1.3) SPHERE (-0.6,0.4,1.1) 0.4 END END END\n"
        f"{material}\n"
    )


CASES = {
    "ambient": (CAMERA + AMBIENT + FLOOR + crowd(MATTE), {"depth": 0}),
    "diffuse": (STAGE + crowd(MATTE), {"depth": 0}),
    "phong": (STAGE + crowd(SHINY), {"depth": 0}),
    "mirror": (STAGE + crowd(SHINY), {"depth": 6}),
    "shadows": (STAGE + crowd(SHINY), {"depth": 3, "shadows": True}),
    "glass": (CAMERA + AMBIENT + FLOOR + crowd(GLASS), {"depth": 8}),
    "glass, lights, shadows": (STAGE + crowd(GLASS), {"depth": 6, "shadows": True}),
    "tinted glass": (STAGE + crowd(TINTED), {"depth": 6, "shadows": True}),
    "AIR attenuates": (
        CAMERA + LIGHTS + "AIR 1.21 1 (0.9,0.95,0.8)\n" + FLOOR + crowd(TINTED),
        {"depth": 5, "shadows": True},
    ),
    "index of AIR": (CAMERA + AMBIENT + FLOOR + crowd("(0,0,0) 0.8 5 (1,1,1) 1 1"), {"depth": 2}),
    "the eye in glass": (CAMERA + AMBIENT + FLOOR + f"SPHERE (0.4,0.7,6) 1.1 {TINTED}\n" + crowd(SHINY), {"depth": 6}),
    "csg": (STAGE + solid(SHINY), {"depth": 4, "shadows": True}),
    "csg of glass": (STAGE + solid(TINTED), {"depth": 6, "shadows": True}),
    "uniform samples": (STAGE + crowd(SHINY), {"depth": 2, "sampler": "uniform", "samples": 2}),
    "a moved sample": (STAGE + crowd(SHINY), {"depth": 2, "sample_x": 0.1, "sample_y": 0.8}),
    "comparison.txt": ((SCENES / "comparison.txt").read_text(), {"depth": 10}),
    "comparison.txt, shadows": ((SCENES / "comparison.txt").read_text(), {"depth": 10, "shadows": True}),
    "local.txt": ((SCENES / "local.txt").read_text(), {"depth": 0, "shadows": True}),
}


def off(bench, known, source, judges=("numpy", "cpp", "python"), **parameters):
    """Fraction of pixels off by more than OFF from the first of `judges` that can do it, and the largest difference."""
    picture = bench.picture("povray", source, **parameters)
    wanted = Parameters(**parameters)
    scene = text.read(source, "scene of the test")
    maker = reference.choose(known["povray"], known, wanted, needs(scene, wanted), judges)
    if maker is None:
        pytest.skip("no renderer of ours makes this picture")
    difference = np.abs(picture - bench.picture(maker.name, source, **parameters)).max(axis=-1)
    fraction = float(np.mean(difference > OFF))
    print(f"povray against {maker.name}: {fraction:.5f} off by more than 2/255, the worst by {difference.max():.1e}")
    return fraction, float(difference.max())


@pytest.mark.parametrize("name", CASES)
def test_povray_agrees(bench, known, name):
    source, parameters = CASES[name]
    fraction, worst = off(bench, known, source, width=64, height=56, **parameters)
    assert fraction == 0
    assert worst < 4 * HALF, "more than the picture's 16-bit floats explain"


def test_povray_sees_whole_what_ours_has_in_two_pieces(bench, known):
    """The judge of MED-6 to MED-8: POV-Ray gets a body in one piece."""
    (maker,) = [name for name in ("numpy", "cpp", "python") if not known[name].unavailable][:1]
    body, half = "SPHERE (0.2,0.1,0.3) 1.1", "BOX (0.3,-4,-4) (4,0.4,0.7) (-0.8,8,0) (-1.4,0,8)"
    parts = f"AND {body} {half} END {TINTED}\nAND {body} NOT {half} END END {TINTED}\n"
    size = {"width": 64, "height": 56, "depth": 6, "shadows": True}
    picture = bench.picture("povray", STAGE + f"{body} {TINTED}\n", **size)
    difference = np.abs(bench.picture(maker, STAGE + parts, **size) - picture).max(axis=-1)
    assert (difference > OFF).mean() <= 0.002


@pytest.mark.slow
@pytest.mark.parametrize("material", [SHINY, GLASS])
def test_povray_agrees_on_a_mesh(bench, known, material, tmp_path):
    (tmp_path / "ball.obj").write_text(obj(*ball(2)))
    part = f'MESH "{tmp_path / "ball"}.obj" (0.3,0.2,0.1) (20,30,40) 1.1'
    for source in (f"{part} {material}\n", f"AND {part} NOT SPHERE (0.9,0.8,0.9) 0.8 END END {material}\n"):
        assert off(bench, known, STAGE + source, width=64, height=56, depth=4, shadows=True)[0] == 0


@pytest.mark.slow
@pytest.mark.parametrize("shadows", [False, True])
@pytest.mark.parametrize("name", ["comparison.txt", "local.txt"])
def test_povray_agrees_in_every_pixel(bench, known, name, shadows):
    source = (SCENES / name).read_text()
    assert off(bench, known, source, ("cpp",), width=512, height=512, depth=10, shadows=shadows)[0] == 0


def test_a_region_and_threads(bench):
    source, jobs = CASES["shadows"]
    whole = bench.result("povray", source, width=37, height=29, **jobs)
    assert whole.said.rays is None and whole.said.memory["peak_bytes"] > 2**20
    assert whole.said.versions["povray"].startswith("3.")
    for frame in whole.said.frames:  # a process, which starts and reads the scene
        assert 0 <= frame["parts"]["trace"] < frame["end"] - frame["start"]
    for x0, y0, x1, y1 in ((0, 0, 1, 1), (36, 28, 37, 29), (5, 3, 30, 28)):
        part = bench.picture("povray", source, width=37, height=29, region=(x0, y0, x1, y1), **jobs)
        assert part.tobytes() == whole.array[y0:y1, x0:x1].tobytes()
    for threads in (1, 2, 3):
        assert np.array_equal(
            bench.picture("povray-threads", source, width=37, height=29, threads=threads, **jobs), whole.array
        )


@pytest.mark.parametrize(
    "slow, message, starts",
    [(0, "", 1), (2, main.TOO_SLOW, 3), (99, main.TOO_SLOW, main.STARTS), (99, "Parse Error: no such word", 1)],
)
def test_a_start_that_was_too_slow_is_tried_again(tmp_path, monkeypatch, slow, message, starts):
    """A povray whose first `slow` starts fail with the message. The time of a failed start is in no frame."""
    fake = tmp_path / "povray"
    fake.write_text(
        "#!/bin/sh\necho >>starts\nsleep 0.1\n"
        f"[ $(wc -l <starts) -gt {slow} ] && echo done >&2 && exit\necho '{message}' >&2; exit 7\n"
    )
    fake.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{os.environ['PATH']}")
    told = []
    monkeypatch.setattr(main.worker, "say", lambda event, **fields: told.append((event, fields)))
    before = time.monotonic()
    if slow == 99:
        with pytest.raises(SystemExit):
            main.run([], tmp_path, [])
        ((event, fields),) = told
        assert event == "error" and message in fields["reason"]
    else:
        start, said = main.run([], tmp_path, [])
        assert said == "done\n" and start - before >= 0.1 * slow
    assert (tmp_path / "starts").read_text().count("\n") == starts


def test_units_do_not_matter(bench):
    """POV-Ray's own tolerances are lengths; the translation keeps them small."""

    def picture(unit):
        source = (
            f"CAMERA (0,0,0) ({2 * unit},0,0) (0,{2 * unit},0) ({0.4 * unit},{0.9 * unit},{6 * unit})\n"
            f"AMBIENT (0.3,0.3,0.3)\nLIGHT ({4 * unit},{5 * unit},{6 * unit}) (0.9,0.8,0.7) 0\n"
            f"SPHERE ({-0.7 * unit},0,0) {unit} {GLASS}\nSPHERE ({1.1 * unit},{0.9 * unit},0) {0.5 * unit} {SHINY}\n"
        )
        return bench.picture("povray", source, width=32, height=32, depth=5, shadows=True)

    for unit in (1e-9, 1e9):
        assert np.abs(picture(unit) - picture(1)).max() < 2 * HALF


REFUSED = {
    "mu_r": (STAGE + crowd("(0,0,0) 0.5 1 (0,0,0) 9 1.5"), {"depth": 1}),
    "clear polygon": (STAGE + f"POLYGON 3 (0,0,0) (1,0,0) (0,1,0) {GLASS}\n", {"depth": 1, "shadows": True}),
    "without shadows": (STAGE + crowd(GLASS), {"depth": 1}),
    "a light in a clear thing": (STAGE + f"SPHERE (4,5,6) 1 {GLASS}\n", {"depth": 1, "shadows": True}),
    "the eye is in an opaque thing": (STAGE + f"SPHERE (0.4,0.7,6) 1.1 {SHINY}\n", {"depth": 1}),
    "may overlap": (
        CAMERA + AMBIENT + f"SPHERE (0,0,0) 1 {GLASS}\nSPHERE (0.1,0,0) 0.5 {TINTED}\n",
        {"depth": 1},
    ),
    "contact": (
        CAMERA + AMBIENT + f"SPHERE (0,0,0) 1 {GLASS}\nSPHERE (2,0,0) 1 {MATTE}\n",
        {"depth": 1},
    ),
    "REF-6": (STAGE + "AIR 1 1 (0.9,0.9,0.9)\n", {"depth": 1}),
    "nothing of a colour": (CAMERA + LIGHTS + "AIR 1 1 (0.9,0,0.9)\n" + crowd(SHINY), {"depth": 1}),
    "sampler jittered": (STAGE, {"depth": 1, "sampler": "jittered", "samples": 2}),
    "254 orders at most": (STAGE + crowd(SHINY), {"depth": 300}),
}


@pytest.mark.parametrize("reason", REFUSED)
def test_what_povray_does_otherwise_is_refused(known, reason):
    source, parameters = REFUSED[reason]
    entry, wanted = known["povray"], Parameters(width=8, height=8, **parameters)
    if entry.renderer.unavailable:
        pytest.skip(entry.renderer.unavailable)
    scene = text.read(source, "scene of the test")
    result = repetition.run(entry, flatten(scene), wanted, needs(scene, wanted))
    assert result.status == "unsupported" and reason in result.reason


@pytest.mark.parametrize("compression", [OpenEXR.NO_COMPRESSION, OpenEXR.ZIPS_COMPRESSION, OpenEXR.ZIP_COMPRESSION])
@pytest.mark.parametrize("smooth", [False, True])  # noise grows when it is compressed, and is stored as it is
def test_exr(tmp_path, compression, smooth):
    rng = np.random.default_rng(3)
    picture = rng.uniform(-1, 9, (37, 23, 3)) if not smooth else np.linspace(0, 3, 37 * 23 * 3).reshape(37, 23, 3)
    picture = picture.astype(np.float16)
    with OpenEXR.File({"compression": compression, "type": OpenEXR.scanlineimage}, {"RGB": picture}) as file:
        file.write(str(tmp_path / "a.exr"))
    assert np.array_equal(exr.read(tmp_path / "a.exr"), picture.astype(np.float32))
