"""The reader of scene text: what it takes, what it says of files that hold none, and how long it takes."""

import re
import time

import pytest

from harness.errors import UserError
from harness.scene import load, text
from harness.scene.model import Air, Camera, Material, Scene

CAMERA = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,2)\n"
MATERIAL = " (1,1,1) 0 1 (0,0,0) 1e6 1\n"


def test_defaults():
    scene = text.read(CAMERA)
    camera = Camera((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 2))
    assert scene == Scene(camera, (), (), (0, 0, 0), (0, 0, 0), Air(1, 1, (1, 1, 1)))


def test_all_entities_in_any_order():
    scene = text.read(
        "ELLIPSOID (0,0,0) (1,0,0) (0,1,0) (0,0,1)" + MATERIAL
        + "BACKGROUND (0.1,0.2,0.3) LIGHT (1,2,3) (1,1,1) 0.5 AIR 2 3 (0,0.5,1) AMBIENT (.1,.2,.3)\n"
        + "POLYGON 3 (0,0,0) (1,0,0) (0,1,0)" + MATERIAL
        + CAMERA
        + "LIGHT (4,5,6) (1,1,1) 0 SPHERE (-1,+2,3e0) 4.\n (.5,0.5,5e-1) 0.3 50 (0,0,0) 1e6 1 0.25\n"
        + "BOX (0,0,0) (1,0,0) (0,1,0) (0.2,0.3,1)" + MATERIAL
    )  # fmt: skip
    assert [type(thing).__name__ for thing in scene.objects] == ["Ellipsoid", "Polygon", "Sphere", "Box"]
    assert [thing.line for thing in scene.objects] == [1, 3, 5, 7]
    assert scene.objects[2].centre == (-1, 2, 3)
    assert scene.objects[2].material == Material((0.5, 0.5, 0.5), 0.3, 50, (0, 0, 0), 1e6, 1, 0.25)
    assert scene.objects[3].material.roughness == 0
    assert scene.objects[3].edges[2] == (0.2, 0.3, 1)
    assert [light.position for light in scene.lights] == [(1, 2, 3), (4, 5, 6)]
    assert (scene.ambient, scene.background) == ((0.1, 0.2, 0.3), (0.1, 0.2, 0.3))
    assert scene.air == Air(2, 3, (0, 0.5, 1))


@pytest.mark.parametrize(
    "layout",
    [
        "SPHERE (1,2,3) 4 (1,1,1) 0 1 (0,0,0) 1e6 1\n" + CAMERA,
        CAMERA + "SPHERE (1,2,3) 4 (1,1,1) 0 1 (0,0,0) 1e6 1",
        "\ufeffSPHERE ( 1 ,\t2\n, 3 )4(1,1,1)0 1(0,0,0) 1e6 1 " + CAMERA,
        "# one (\nSPHERE (1,2,3) # and ) two\n4 #\n(1,1,1) 0 1 (0,0,0)# 2\n 1e6 1 #2\n" + CAMERA,
        ("SPHERE (1,2,3) 4\n(1,1,1) 0 1 (0,0,0) 1e6 1\n# end\n" + CAMERA).replace("\n", "\r\n"),
        ("SPHERE (1,2,3) 4\n(1,1,1) 0 1 (0,0,0) 1e6 1 0\n# end\n" + CAMERA).replace("\n", "\r"),
    ],
)
def test_layout_does_not_matter(layout, tmp_path):
    path = tmp_path / "scene.TXT"
    path.write_bytes(layout.encode())
    plain = text.read("SPHERE (1,2,3) 4" + MATERIAL + CAMERA)
    assert load(path) == plain


def test_eye_at_a_distance():
    camera = text.read("CAMERA (1,1,1) (0,0,2) (2,0,0) 5").camera
    assert camera.e == (0, 5, 0)
    assert text.read("CAMERA (1,1,1) (0,0,2) (2,0,0) -5").camera.e == (0, -5, 0)


@pytest.mark.parametrize(
    "vertices",
    [
        ("(0,0,0)", "(0,1,0)", "(1,0,0)"),  # either way round
        ("(0,0,0)", "(1,0,0)", "(2,0,0)", "(2,2,0)", "(0,2,0)"),  # a vertex inside a side
        ("(1e9,0,0)", "(1.000000001e9,0,0)", "(1e9,1,0)"),  # small and far away
        ("(0,0,0)", "(1e-20,0,0)", "(0,1e-20,0)"),
        ("(0,0,0)", "(1e20,0,0)", "(0,1e20,0)"),
        ("(0,0,0)", "(1,0,0)", "(1,1,1e-7)", "(0,1,0)"),  # planar to six digits
    ],
)
def test_good_polygons(vertices):
    scene = text.read(f"POLYGON {len(vertices)} {' '.join(vertices)} {MATERIAL} {CAMERA}")
    assert len(scene.objects[0].vertices) == len(vertices)


@pytest.mark.parametrize("size", ["1e-30", "1", "1e30"])
def test_any_unit_of_length(size):
    frame = f"({size},0,0) ({size},{size},0) (0,{size},{size})"
    scene = text.read(
        f"CAMERA (0,0,0) ({size},0,0) (0,{size},0) (0,0,{size}) BOX (0,0,0) {frame}{MATERIAL}"
        f"ELLIPSOID (0,0,0) {frame}{MATERIAL} SPHERE (0,0,0) {size}{MATERIAL}"
    )
    assert len(scene.objects) == 3


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.txt", b"\x89PNG\r\n\x1a\n\0\0", "a.txt:3:1: not a text file (UTF-8): it has a NUL byte here"),
        (
            "a.txt",
            "# a\nCAMERA é".encode("latin-1"),
            "a.txt:2:8: not a text file (UTF-8): byte 0xe9 here is no UTF-8"
            + '; in Windows-1252 it is "é"; save it as text in UTF-8',
        ),
        (
            "a.txt",
            CAMERA.encode("utf-16"),
            "a.txt:1: not a text file (UTF-8): it is in UTF-16; save it as text in UTF-8",
        ),
        ("a.txt", CAMERA.encode() + b"\0", "a.txt:2:1: not a text file (UTF-8): it has a NUL byte here"),
        ("a.txt", b"", "a.txt:1:1: the file is empty"),
        ("a.obj", b"v 0 0 0", 'a.obj: unknown kind of scene file ".obj"; supported: .txt'),
        ("noext", b"", "supported: .txt"),
        ("a.txt", None, "a.txt: no such file"),
    ],
)
def test_files(name, content, message, tmp_path):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(UserError, match=re.escape(message)):
        load(path)


def test_no_file_at_all(tmp_path):
    for path in (tmp_path, str(tmp_path) + "/"):
        with pytest.raises(UserError, match="expected a file, found a folder"):
            load(path)
    with pytest.raises(UserError, match="no such file"):
        load("a\0.txt")


@pytest.mark.alone
def test_reading_is_linear():
    def seconds(spheres):
        content = CAMERA + ("SPHERE (1,2,3) 4" + MATERIAL) * spheres
        start = time.process_time()
        assert len(text.read(content).objects) == spheres
        return time.process_time() - start

    once = min(seconds(300) for _ in range(3))
    assert min(seconds(4800) for _ in range(3)) < 4 * 16 * once


@pytest.mark.alone
@pytest.mark.parametrize("token", ["1" * 50_000 + "x", "1." * 25_000, "(" * 50_000, "S" * 50_000])
def test_long_tokens_take_no_time(token):
    start = time.process_time()
    with pytest.raises(UserError):
        text.read("SPHERE (0,0,0) " + token)
    with pytest.raises(UserError):
        text.read(token)
    assert time.process_time() - start < 2
