"""Scenes and parameters for the contract test (check.py) that use each feature a renderer claims."""

from dataclasses import replace
from pathlib import Path

from harness.renderer.parameters import Parameters

# What `full_scene_text` and `full_parameters` add to `scene_text`.
FURTHER = {
    *(
        "transmission",
        "attenuation",
        "media",
        "contact",
        "csg",
        "mesh",
        "supersampling",
        "adaptive",
        "lens",
        "soft",
        "glossy",
    ),
}


def scene_text(features: tuple[str, ...]) -> str:
    """A scene in general position that uses what the renderer claims, and nothing else."""
    k_s = 0.6 if {"phong", "reflection"} <= set(features) else 0
    material = f"(0.7,0.5,0.3) {k_s} 20 (0,0,0) 1e6 1"
    lines = ["CAMERA (0.13,0.07,0) (1.5,0,-0.2) (0,1.5,0) (0.8,0.31,6)"]
    shapes = {
        "sphere": "SPHERE (-0.71,0.53,0.11) 0.62\nSPHERE (0.67,0.59,-0.83) 0.55".replace("\n", f" {material}\n"),
        "box": "BOX (0.21,-1.13,-0.37) (0.71,0.13,0.05) (-0.11,0.83,0.17) (0.07,-0.21,0.77)",
        "polygon": "POLYGON 3 (-3.1,-1.4,-3.3) (3.3,-1.5,2.9) (0.2,-1.6,-3.4)",  # of three, so in one plane exactly
        "ellipsoid": "ELLIPSOID (-0.83,-0.71,0.43) (0.51,0.07,0.03) (-0.05,0.37,0.02) (-0.02,-0.03,0.64)",
    }
    lines += [f"{line} {material}" for name, line in shapes.items() if name in features]
    if "ambient" in features:
        lines.append("AMBIENT (0.21,0.23,0.19)")
    if "diffuse" in features:
        lines += ["LIGHT (4.1,5.3,6.2) (0.7,0.8,0.6) 0", "LIGHT (-3.7,2.9,4.4) (0.4,0.3,0.5) 0"]
    return "\n".join(lines) + "\n"


def full_scene_text(features: tuple[str, ...], folder: Path) -> str:
    """`scene_text` with the media, solids, lights of some size and rough mirrors that the renderer claims; a mesh goes
    to `folder`.

    Some mirrors are rough and some perfect.
    """
    lines, rough = [], " 0.3" if "glossy" in features else ""
    if "transmission" in features:
        tint = "(0.8,0.9,0.7)" if "attenuation" in features else "(1,1,1)"
        lines.append(f"SPHERE (0.43,0.31,1.27) 0.51 (0.05,0.03,0.02) 0.9 30 {tint} 2.25 1.1{rough}")
        if "media" in features:
            axes = "(0.6,0.1,0) (-0.1,0.4,0.1) (0,-0.1,0.5)"
            lines.append(f"ELLIPSOID (0.62,0.25,1.13) {axes} (0,0,0) 1 30 {tint} 1.77 1")
        if "contact" in features:  # a glass in two pieces
            edges = "(0.3,0.05,0) (0,0.3,0.05) (0.02,0,0.25)"
            lines += [f"BOX ({x}) {edges} (0,0,0) 0.9 30 {tint} 2.25 1" for x in ("-1.5,0.9,1.2", "-1.2,0.95,1.2")]
    material = f"(0.3,0.6,0.7) {0.5 if 'reflection' in features else 0} 20 (0,0,0) 9 1{rough}"
    if "csg" in features:
        bite = "NOT BOX (-1.2,-0.1,1.3) (1,0.1,0) (0,1,0.2) (0,0.1,1) END"
        lines.append(f"AND SPHERE (-1.1,-0.2,1.4) 0.6 {bite} END {material}")
    if "mesh" in features:
        corners = [(0.1, 0.2, 0.9), (0.9, -0.1, 1.1), (0.4, 0.8, 1.3), (0.5, 0.3, 0.2)]
        obj = [*("v {} {} {}".format(*corner) for corner in corners), "f 1 2 3", "f 1 4 2", "f 2 4 3", "f 3 4 1"]
        (folder / "tetrahedron.obj").write_text("\n".join(obj) + "\n", encoding="utf-8")
        lines.append(f'MESH "{folder / "tetrahedron.obj"}" (-0.3,0.7,0.2) (20,-30,40) 0.9 {material}')
    plain = scene_text(features)
    if "soft" in features:
        plain = plain.replace("(0.7,0.8,0.6) 0", "(0.7,0.8,0.6) 0.7")  # a light with a radius
    if "glossy" in features:
        lines.append(f"SPHERE (-1.3,-0.9,0.9) 0.3 (0.2,0.3,0.4) 0.6 20 (0,0,0) 1e6 1{rough}")
    return plain + "".join(line + "\n" for line in lines)


def full_parameters(features: tuple[str, ...], parameters: Parameters) -> Parameters:
    """`parameters` with the samples, lens, feelers and glossy rays that the renderer claims."""
    claimed = {
        "supersampling": {"sampler": "jittered", "samples": 2, "seed": 3},
        "lens": {"lens_radius": 0.1, "focal_distance": 6.0},
        "soft": {"feelers": 2},
        "glossy": {"glossy_rays": 2},
    }
    return replace(parameters, **{k: v for name, more in claimed.items() if name in features for k, v in more.items()})
