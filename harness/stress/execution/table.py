"""S21: the memory for the tree of a pixel's rays, by depth and by the method `walk`."""

import numpy as np

from harness.scene.model import Material, Scene, Sphere
from harness.stress.exact import triple
from harness.stress.row import Finding, Row, Trial, in_general_position, rounded
from harness.stress.view import BLACK, OPAQUE, WHITE, camera, glass

COLUMNS = 16  # numbers in a row of the table, about
BYTES = {"float32": 4, "float64": 8}
MIRROR = Material(BLACK, 1.0, 1.0, OPAQUE, 1e6, 1.0)


def ball(material, depth, precision, rng):
    """One pixel of a ball before a white background."""
    turn, centre = in_general_position(rng), rounded(rng.uniform(-1, 1, 3), precision)
    seen = camera(centre + turn @ [0.3, 0.2, 4], centre, turn[:, 0] / 9, turn[:, 1] / 9, precision)
    scene = Scene(seen, (Sphere(material, triple(centre), 1.0),), background=WHITE)

    def judge(result):
        walk_bytes = result.said.used["methods"].get("walk_bytes")  # a chain has no rows
        bad = not np.isfinite(result.array).all()
        return Finding(1, int(bad), np.zeros(0) if walk_bytes is None else np.array([float(walk_bytes)]))

    return Trial(scene, judge, parameters={"width": 1, "height": 1, "depth": depth})


def rows_of(walk, depth, children):
    """Rows of the table for a pixel (WLK-1). children: rays that one hit creates, 1 or 2."""
    walk = {"least": "chain" if children == 1 else "stack"}.get(walk, walk)
    table = sum(max(2, children) ** order for order in range(depth + 1))
    return {"table": table, "stack": 1 + depth * (children - 1), "chain": 1, "recursion": depth + 1}[walk]


def row(name, title, material, children):
    return Row(
        name=name,
        code="S21",
        title=title,
        stress="depth",
        failure="pixels that are NaN",
        error="bytes a pixel in work",
        levels=(1.0, 2.0, 3.0, 5.0, 8.0, 10.0, 12.0, 15.0, 18.0, 20.0),
        logarithmic=False,
        method="walk",
        source="study, 2.7.4",
        make=lambda level, precision, rng: ball(material, int(level), precision, rng),
        expected=lambda level, u, methods: float(
            rows_of(methods["walk"], int(level), children) * COLUMNS * BYTES.get(methods["precision"], 8)
        ),
        # The depth at which the table is refused (WLK-2).
        limit=lambda u, methods: 23.0 if methods["walk"] == "table" else None,
    )


ROWS = (
    row("table", "Memory of the rays of glass", glass(), 2),
    row("table-mirror", "Memory of the rays of mirrors", MIRROR, 1),
)
