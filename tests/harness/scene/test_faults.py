"""The faults of scene text: where each is found and what is said of it."""

import pytest

from harness.errors import UserError
from harness.scene import text

CAMERA = "CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,2)\n"
MATERIAL = " (1,1,1) 0 1 (0,0,0) 1e6 1\n"


def polygon(*vertices):
    return f"POLYGON {len(vertices)} " + " ".join(vertices) + MATERIAL + CAMERA


FAULTS = [
    # keywords
    ("", "1:1", "the file is empty"),
    (" \n# nothing\n", "1:1", "the file is empty"),
    ("SHPERE (0,0,0) 1", "1:1", 'unknown keyword "SHPERE"; did you mean SPHERE?'),
    ("sphere (0,0,0) 1", "1:1", "did you mean SPHERE?"),
    (CAMERA + "  TEXTURE a.png", "2:3", 'expected a keyword, found "TEXTURE"; keywords are SPHERE, BOX'),
    (CAMERA + "(0,0,0)", "2:1", 'expected a keyword, found "("'),
    (CAMERA + "\x07", "2:1", r"found '\x07'"),
    (CAMERA + "x" * 1000, "2:1", "x..."),
    # the end
    ("SPHERE", "1:7", "expected a vector (x,y,z) for the centre, found the end of the file"),
    ("SPHERE (0,0", "1:12", 'expected "," in the vector for the centre, found the end of the file'),
    ("SPHERE (0,0,0)\n\n# end", "1:15", "expected a number for the radius, found the end of the file"),
    ("SPHERE (0,0,0) 1 (1,1,1) 0 1 (0,0,0) 1", "1:39", "expected a number for mu_r, found the end"),
    (CAMERA + "POLYGON 999999999 (0,0,0)", "2:26", "for vertex 2, found the end"),
    # vectors
    ("SPHERE 0,0,0 1", "1:8", 'expected a vector (x,y,z) for the centre, found "0"'),
    ("SPHERE (0 0,0) 1", "1:11", 'expected "," in the vector for the centre, found "0"'),
    ("SPHERE (0,0) 1", "1:12", 'expected "," in the vector for the centre, found ")"'),
    ("SPHERE (0,0,0,0) 1", "1:14", 'expected ")" in the vector for the centre, found ","'),
    ("SPHERE (0,,0) 1", "1:11", 'expected a number for the centre, found ","'),
    ("SPHERE [0,0,0] 1", "1:8", 'found "[0"'),
    # numbers
    ('SPHERE (0,0,0)\n\t "abc"', "2:3", 'expected a number for the radius, found ""abc""'),
    ("SPHERE (0,0,0) abc", "1:16", 'expected a number for the radius, found "abc"'),
    ("SPHERE (0,0,0) 1.2.3", "1:16", 'expected a number for the radius, found "1.2.3"'),
    ("SPHERE (0,0,0) 1_000", "1:16", "expected a number for the radius"),
    ("SPHERE (0,0,0) ١", "1:16", "expected a number for the radius"),
    ("SPHERE (0,0,0) 0x10", "1:16", "expected a number for the radius"),
    ("SPHERE (0,nan,0) 1", "1:11", 'expected a finite number for the centre, found "nan"'),
    ("SPHERE (0,0,-Infinity) 1", "1:13", "expected a finite number for the centre"),
    ("SPHERE (0,0,0) inf", "1:16", "expected a finite number for the radius"),
    ("SPHERE (0,0,1e999) 1", "1:13", 'expected a number of at most 1e+30 in size for the centre, found "1e999"'),
    ("SPHERE (0,0,-1e31) 1", "1:13", "at most 1e+30 in size"),
    ("BOX (0,0,0) (1e300,0,0) (0,1e300,0) (0,0,1e300)", "1:14", "at most 1e+30 in size for edge 1"),
    ("SPHERE (0,0,0) 0", "1:16", "expected a number from 1e-30 to 1e+30 for the radius"),
    ("SPHERE (0,0,0) -1", "1:16", "expected a number from 1e-30 to"),
    ("SPHERE (0,0,0) 1e-200", "1:16", "expected a number from 1e-30 to"),
    # materials
    ("SPHERE (0,0,0) 1\n(1,-1,1) 0 1 (0,0,0) 1 1", "2:4", "from 0 to 1e+30 for the diffuse colour"),
    ("SPHERE (0,0,0) 1\n(1,1,1) -1 1 (0,0,0) 1 1", "2:9", "for k_s"),
    ("SPHERE (0,0,0) 1\n(1,1,1) 0 -1 (0,0,0) 1 1", "2:11", "for the exponent"),
    ("SPHERE (0,0,0) 1\n(1,1,1) 0 1 (0,0,1.1) 1 1", "2:18", "a number from 0 to 1 for the attenuation"),
    ("SPHERE (0,0,0) 1\n(1,1,1) 0 1 (-0.1,0,0) 1 1", "2:14", "a number from 0 to 1 for the attenuation"),
    ("SPHERE (0,0,0) 1\n(1,1,1) 0 1 (0,0,0) 0 1", "2:21", "expected a number from 1e-30 to 1e+30 for eps_r"),
    ("SPHERE (0,0,0) 1\n(1,1,1) 0 1 (0,0,0) 1 -1", "2:23", "for mu_r"),
    ("SPHERE (0,0,0) 1\n(1,1,1) 0 1 (0,0,0) 1 1 -1", "2:25", "for the roughness"),
    ("SPHERE (0,0,0) 1\n(1,1,1) 0 1 (0,0,0) 1 1 1.5", "2:25", "expected 0 or a number from 1e-06 to 1"),
    ("SPHERE (0,0,0) 1\n(1,1,1) 0 1 (0,0,0) 1 1 1e-7", "2:25", "0 is a perfect mirror"),
    ("SPHERE (0,0,0) 1\n(1,1,1) 0 1 (0,0,0) 1 1 nan", "2:25", "expected a finite number for the roughness"),
    ("SPHERE (0,0,0) 1\n(1,1,1) 0 1 (0,0,0) 1 1 0 1", "2:27", 'expected a keyword, found "1"'),
    ("SPHERE (0,0,0) 1\n(1,1,1) 0 1 (0,0,0) 1 LIGHT", "2:23", "expected a number for mu_r"),
    # lights and media
    ("LIGHT (0,0,0) (1,1,1)\nCAMERA", "2:1", 'expected a number for the radius, found "CAMERA"'),
    ("LIGHT (0,0,0) (1,1,1) -1", "1:23", "for the radius"),
    ("LIGHT (0,0,0) (-1,1,1) 0", "1:16", "for the colour"),
    ("AMBIENT 0.1", "1:9", "expected a vector (x,y,z) for the colour"),
    ("AMBIENT (0,0,-0.1)", "1:14", "for the colour"),
    ("BACKGROUND (0,0,-0.1)", "1:17", "for the colour"),
    ("AIR 0 1 (1,1,1)", "1:5", "for eps_r"),
    ("AIR 1 0 (1,1,1)", "1:7", "for mu_r"),
    ("AIR 1 1 (1,1,2)", "1:14", "a number from 0 to 1 for the attenuation"),
    ("AIR 1 1 (1,1,1)\nAIR 1 1 (1,1,1)", "2:1", "a second AIR; the first is on line 1; keep one of them"),
    ("AMBIENT (0,0,0) AMBIENT (0,0,0)", "1:17", "a second AMBIENT"),
    ("BACKGROUND (0,0,0)\nBACKGROUND (0,0,0)", "2:1", "a second BACKGROUND"),
    # the camera
    ("AMBIENT (0,0,0)", "1:16", "expected a CAMERA, found the end of the file"),
    (CAMERA + CAMERA, "2:1", "a second CAMERA; the first is on line 1"),
    ("CAMERA (0,0,0) (0,0,0) (0,1,0) (0,0,2)", "1:16", "u has no length"),
    ("CAMERA (0,0,0) (1,0,0) (0,0,0) (0,0,2)", "1:24", "v has no length"),
    ("CAMERA (0,0,0) (1,0,0) (0,1,0) (0,0,0)", "1:32", "e has no length"),
    ("CAMERA (0,0,0) (1,0,0) (0,1,0) 0", "1:32", "e has no length"),
    ("CAMERA (0,0,0) (1,0,0) (1e-5,1,0) (0,0,2)", "1:24", "u and v must be at right angles"),
    ("CAMERA (0,0,0) (1e20,0,0) (1e-25,1e-20,0) 2", "1:27", "right angles; the cosine between them is 1e-05"),
    ("CAMERA (0,0,0) (1,0,0) (0,1,0) (3,4,0)", "1:32", "e lies in the plane of u and v"),
    ("CAMERA (0,0,0) (1,0,0) (0,1,0) (3,4,1e-10)", "1:32", "e lies in the plane of u and v"),
    ("CAMERA (0,0,0) (1,0,0) (0,1,0) LIGHT", "1:32", "for the distance of the eye (or a vector for e)"),
    # solids
    ("BOX (0,0,0) (0,0,0) (0,1,0) (0,0,1)", "1:13", "edge 1 has no length"),
    ("BOX (0,0,0) (1,0,0) (0,1,0) (1,1,0)", "1:29", "the three edges lie in one plane; they span no volume"),
    ("BOX (0,0,0) (1e-9,0,0) (0,1e9,0) (1e-9,1e9,1e-6)", "1:34", "the three edges lie in one plane"),
    ("ELLIPSOID (0,0,0) (1,0,0) (0,0,0) (0,0,1)", "1:27", "semi-axis 2 has no length"),
    ("ELLIPSOID (0,0,0) (1,0,0) (2,0,0) (0,0,1)", "1:35", "the three semi-axes lie in one plane"),
    # polygons
    ("POLYGON 2 (0,0,0) (1,0,0)", "1:9", 'expected a whole number of vertices, 3 or more, found "2"'),
    ("POLYGON 3.5 (0,0,0)", "1:9", "expected a whole number"),
    ("POLYGON (0,0,0) (1,0,0) (0,1,0)", "1:9", 'whole number of vertices, 3 or more, found "("'),
    ("POLYGON 99999999999999999999 (0,0,0)", "1:9", "expected a whole number"),
    ("POLYGON 4 (0,0,0) (1,0,0) (0,1,0) 0 1 (0,0,0) 1e6 1", "1:35", "vector (x,y,z) for vertex 4"),
    (polygon("(0,0,0)", "(0,0,0)", "(0,0,0)"), "1:19", "vertices 1 and 2 are the same point"),
    (polygon("(0,0,0)", "(1,0,0)", "(1,0,0)", "(0,1,0)"), "1:27", "vertices 2 and 3 are the same point"),
    (polygon("(0,0,0)", "(1,0,0)", "(0,1,0)", "(0,0,0)"), "1:35", "vertices 4 and 1 are the same point"),
    (polygon("(0,0,0)", "(1,0,0)", "(2,0,0)"), "1:11", "the vertices lie on one line"),
    (polygon("(0,0,0)", "(1,1,1)", "(3,3,3)", "(2,2,2)"), "1:11", "the vertices lie on one line"),
    (polygon("(0,0,0)", "(1e9,0,0)", "(2e9,1e-3,0)"), "1:11", "the vertices lie on one line"),
    (polygon("(0,0,0)", "(1,0,0)", "(1,1,0.01)", "(0,1,0)"), "1:", "not planar"),
    (polygon("(0,0,0)", "(1,1,0)", "(1,0,0)", "(0,1,0)"), "1:11", "the polygon crosses itself"),
    (polygon("(0,0,0)", "(1,2,0)", "(1,0,0)", "(0,1,0)"), "1:", "; cut it into convex ones, or make it a MESH"),
    (polygon("(0,0,0)", "(2,0,0)", "(0.5,0.5,0)", "(0,2,0)"), "1:27", "it turns inward at vertex 3"),
    (polygon("(0,0,0)", "(4,0,0)", "(2,0,0)", "(2,2,0)"), "1:", "not convex"),
    (
        polygon("(0,1,0)", "(0.588,-0.809,0)", "(-0.951,0.309,0)", "(0.951,0.309,0)", "(-0.588,-0.809,0)"),
        "1:11",
        "its outline goes round more than once",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("content", "place", "message"), FAULTS)
def test_faults(content, place, message):
    with pytest.raises(UserError) as caught:
        text.read(content, "scenes/a.txt")
    assert str(caught.value).startswith(f"scenes/a.txt:{place}" + ": " * (not place.endswith(":")))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
