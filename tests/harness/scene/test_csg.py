"""CSG blocks of scene text: what they mean, and what is said of faulty ones."""

import numpy as np
import pytest

from harness.errors import UserError
from harness.renderer.parameters import Parameters
from harness.scene import load, text
from harness.scene.flatten import flatten
from harness.scene.media import holds
from harness.scene.model import Box, Csg, Ellipsoid, Material, Mesh, Operator, Sphere
from harness.scene.needs import needs

CAMERA = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,2)\n"
MATERIAL = " (0.9,0.2,0.1) 0.3 50 (0,0,0) 1e6 1\n"
A, B, C = "SPHERE (0,0,0) 1 ", "SPHERE (0,0,0) 2 ", "SPHERE (0,0,0) 3 "
EXAMPLE = """
OR
  BOX (0,0,-4) (1,0,0) (0,1,0) (0,0,1)
  AND
    SPHERE (0.5,0.5,-3.5) 0.7
    NOT
      SPHERE (0.5,0.5,-3) 0.4
    END
  END
END
(0.9,0.2,0.1) 0.3 50 (0,0,0) 1e6 1
"""


def solid(block):
    (found,) = text.read(CAMERA + block + MATERIAL).objects
    return found


def words(block):
    """The postfix of a block of the spheres A, B and C, in letters."""
    names = {Operator.OR: "|", Operator.AND: "&", Operator.NOT: "!"}
    return "".join(names.get(word) or " abc"[int(word.radius)] for word in solid(block).code)


def test_example():
    (found,) = text.read(CAMERA + EXAMPLE).objects
    assert found.material == Material((0.9, 0.2, 0.1), 0.3, 50, (0, 0, 0), 1e6, 1)
    assert (type(found), found.line) == (Csg, 3)
    assert [(type(part), part.line, part.material) for part in found.parts()] == [
        (Box, 4, None), (Sphere, 6, None), (Sphere, 8, None),
    ]  # fmt: skip
    arrays = {name: array.tolist() for name, array in flatten(text.read(CAMERA + EXAMPLE)).items()}
    assert arrays["csg_code"] == [[1, 0], [0, 0], [0, 1], [6, 0], [5, 0], [4, 0]]
    assert arrays["csg_ranges"] == [[0, 6]]
    assert arrays["csg_ids"] == [[0, 0]]
    assert arrays["csg_spheres"] == [[0.5, 0.5, -3.5, 0.7], [0.5, 0.5, -3, 0.4]]
    assert arrays["spheres"] == arrays["boxes"] == []


@pytest.mark.parametrize(
    ("block", "expected"),
    [
        (f"OR {A} END", "a"),
        (f"AND {A} END", "a"),
        (f"NOT {A} END", "a!"),
        (f"OR {A}{B} END", "ab|"),
        (f"OR {A}{B}{C} END", "ab|c|"),
        (f"AND {A}{B}{C} END", "ab&c&"),
        (f"OR {A} AND {B}{C} END END", "abc&|"),
        (f"OR AND {A}{B} END {C} END", "ab&c|"),
        (f"AND {A} NOT {B} END NOT {C} END END", "ab!&c!&"),
        (f"NOT NOT {A} END END", "a!!"),
        (f"NOT OR {A}{B} END END", "ab|!"),
        (f"OR OR OR {A} END END {B} END", "ab|"),
        (f"AND OR {A} NOT {B} END {C} END OR {A}{B} END {C} END", "ab!|c|ab|&c&"),
    ],
)
def test_postfix(block, expected):
    assert words(block) == expected


def test_fold_keeps_the_order_of_operands():
    found = solid(f"OR AND {A} NOT {B} END END {C} END")
    written = found.fold(
        lambda part: f"{part.radius:g}",
        lambda a, b: f"({a} or {b})",
        lambda a, b: f"({a} and {b})",
        lambda a: f"not {a}",
    )
    assert written == "((1 and not 2) or 3)"


def random_block(rng, depth):
    """Text of a block, and the same as a predicate of a point."""
    if depth == 0 or rng.random() < 0.2:
        centre, radius = rng.uniform(-1, 1, 3).round(3), round(float(rng.uniform(0.5, 1.5)), 3)
        part = "SPHERE ({},{},{}) {}".format(*centre, radius)
        return part, lambda p: np.linalg.norm(p - centre) < radius
    word = rng.choice(["OR", "AND", "NOT"])
    parts = [random_block(rng, depth - 1) for _ in range(1 if word == "NOT" else rng.integers(1, 5))]
    fold = {"OR": any, "AND": all, "NOT": lambda inside: not next(inside)}[word]
    block = f"{word}\n" + "\n".join(part for part, _ in parts) + "\nEND"
    return block, lambda p: bool(fold(test(p) for _, test in parts))


@pytest.mark.parametrize("seed", range(20))
def test_blocks_hold_what_they_say(seed):
    rng = np.random.default_rng(seed)
    block, test = random_block(rng, 4)
    while block.startswith("SPHERE"):
        block, test = random_block(rng, 4)
    found = solid(block)
    for point in rng.uniform(-2, 2, (100, 3)):
        assert holds(found, point) == test(point)


@pytest.mark.parametrize(
    ("opening", "part", "count"),
    [("NOT ", A, 5000), ("OR " + A, A, 5000), ("AND NOT " + A + "END ", A, 5000), ("NOT ", A, 5001)],
)
def test_no_nesting_is_too_deep(opening, part, count):
    content = CAMERA + opening * count + part + "END " * count + MATERIAL
    scene = text.read(content)
    assert scene == text.read(content) and hash(scene) == hash(text.read(content)) and repr(scene)
    arrays = flatten(scene)
    assert len(arrays["csg_code"]) == len(scene.objects[0].code)
    inside = holds(scene.objects[0], (0, 0, 0))
    assert inside == {"N": count % 2 == 0, "O": True, "A": False}[opening[0]]
    glass = text.read(content.replace("(0,0,0) 1e6", "(1,1,1) 1e6"))
    # Alone, it has a rank only if its box is all space, or the eye (0, 0, 2) is in it.
    assert ("media" in needs(glass, Parameters())) == (opening == "NOT " and count % 2 == 1)


def test_all_kinds_of_parts(tmp_path):
    import trimesh

    trimesh.creation.box().export(tmp_path / "a.stl")
    (tmp_path / "a.txt").write_text(
        f"{CAMERA}MESH a.stl (9,0,0) (0,0,0) 1 {MATERIAL}"
        "AND MESH a.stl (0,0,0) (0,45,0) 2 ELLIPSOID (0,0,0) (2,0,0) (0,1,0) (0,0,1)"
        f"OR MESH a.stl (0,0,0) (0,0,0) 1 BOX (0,0,0) (1,0,0) (0,1,0) (0,0,1) END END {MATERIAL}"
        f"NOT BOX (5,0,0) (1,0,0) (0,1,0) (0,0,1) END {MATERIAL}"
    )
    scene = load(tmp_path / "a.txt")
    assert [type(part) for part in scene.objects[1].parts()] == [Mesh, Ellipsoid, Mesh, Box]
    arrays = flatten(scene)
    assert arrays["mesh_ranges"].tolist() == [[0, 12, 1]]
    assert arrays["csg_meshes"].tolist() == [[12, 12], [24, 12]]
    assert arrays["csg_code"].tolist() == [[3, 0], [2, 0], [5, 0], [3, 1], [1, 0], [4, 0], [5, 0], [1, 1], [6, 0]]
    assert arrays["csg_ranges"].tolist() == [[0, 7], [7, 2]]
    assert arrays["csg_ids"].tolist() == [[1, 0], [2, 0]]
    assert arrays["mesh_ids"].tolist() == [[0, 0]]
    assert arrays["csg_boxes"].tolist() == [[0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1], [5, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]]
    corners = arrays["mesh_vertices"][arrays["mesh_triangles"]]
    assert corners.shape == (36, 3, 3)
    for first, number, place in ((0, 12, 9), (12, 12, 0), (24, 12, 0)):
        assert corners[first : first + number].mean(axis=(0, 1)) == pytest.approx([place, 0, 0], abs=0.5)
    assert needs(scene, Parameters(depth=0)) == ("csg", "mesh")


FAULTS = [
    ("OR END", "2:4", "OR without a part (opened on line 2)"),
    ("OR\n AND\n END\nEND", "4:2", "AND without a part (opened on line 3)"),
    (f"NOT {A}{B} END", "2:22", 'a second part in NOT, "SPHERE"; it takes one; put them in an OR or an AND'),
    (f"NOT {A} OR {B} END END", "2:23", 'a second part in NOT, "OR"'),
    (f"NOT OR {A}{B} END OR {A} END END", "2:47", 'a second part in NOT, "OR"'),
    (f"OR {A} AND {B} END", "END", "expected END for the OR of line 2, found the end of the file"),
    (f"OR {A}\nLIGHT (0,0,0) (1,1,1) 0", "3:1", "LIGHT in the OR of line 2; is an END missing before it?"),
    (f"OR {A}\nCAMERA", "3:1", "CAMERA in the OR of line 2"),
    (f"OR\nNOT {A} END\nAIR 1 1 (1,1,1)", "4:1", "AIR in the OR of line 2"),
    ("END", "2:1", "END without an OR, AND or NOT before it"),
    (f"OR {A} END END{MATERIAL}", "2:26", 'expected a vector (x,y,z) for the diffuse colour, found "END"'),
    (f"OR {A} END{MATERIAL} END", "3:2", "END without an OR, AND or NOT before it"),
    (
        f"OR {A} (1,1,1) 0 1 (0,0,0) 1 1 END",
        "2:22",
        "parts of a block have no material; that of the block follows its last END",
    ),
    (f"OR {A} 0.5 END", "2:22", "parts of a block have no material"),
    (f"OR {A} END", "END", "expected a vector (x,y,z) for the diffuse colour, found the end of the file"),
    (f"or {A} END", "2:1", 'unknown keyword "or"; did you mean OR?'),
    (f"OR SPERE {A} END", "2:4", 'unknown keyword "SPERE"; did you mean SPHERE?'),
    ("OR SPHERE (0,0,0) -1 END", "2:19", "expected a number from 1e-30"),
    ("OR BOX (0,0,0) (1,0,0) (0,1,0) (1,1,0) END", "2:32", "the three edges lie in one plane"),
    (
        "AND POLYGON 3 (0,0,0) (1,0,0) (0,1,0) END",
        "2:5",
        "a POLYGON has no inside, so it cannot be a part of CSG; use a BOX",
    ),
    ("MESH", "END", "expected the path of a mesh, found the end of the file"),
    ("MESH (0,0,0)", "2:6", 'expected the path of a mesh, found "("'),
    ('MESH "a b.obj (0,0,0)', "2:6", 'expected the path of a mesh between quotes, found ""a"; close it with "'),
    ('MESH "" (0,0,0) (0,0,0) 1', "2:6", "expected the path of a mesh between quotes"),
    ("MESH a.obj 1 (0,0,0) 1", "2:12", "vector (x,y,z) for the position"),
    ("MESH a.obj (0,0,0) 45 1", "2:20", "vector (x,y,z) for the rotation in degrees"),
    ("MESH a.obj (0,0,0) (0,0,0) 0", "2:28", "for the scale"),
    ("MESH a.obj (0,0,0) (0,0,0) (1,1,1)", "2:28", 'expected a number for the scale, found "("'),
    ("MESH a.obj (0,0,0) (0,0,0) 1", "2:6", "no such file"),
    ("OR MESH a.obj (0,0,0) (0,0,0) 1 END", "2:9", "no such file"),
]


@pytest.mark.parametrize(("content", "place", "message"), FAULTS)
def test_faults(content, place, message):
    with pytest.raises(UserError) as caught:
        text.read(CAMERA + content, "scenes/a.txt")
    error = str(caught.value)
    assert message in error and "\n" not in error
    if place == "END":
        place = f"{content.count(chr(10)) + 2}:{len(content.rstrip().splitlines()[-1]) + 1}"
    assert error.startswith(f"scenes/a.txt:{place}: ")


def test_an_open_mesh_is_no_part(tmp_path):
    (tmp_path / "a b.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / "a.txt").write_text(f'{CAMERA}OR\n {A}\n MESH "a b.obj" (0,0,0) (0,0,0) 1 END {MATERIAL}')
    with pytest.raises(UserError) as caught:
        load(tmp_path / "a.txt")
    message = 'the open mesh "a b.obj" has no inside, so it cannot be a part of CSG; close its holes'
    assert str(caught.value).startswith(f"{tmp_path}/a.txt:4:7: {message}")
