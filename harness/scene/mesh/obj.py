"""Reads OBJ (Wavefront, 1995): vertices and faces. Lines that place no surface are ignored by name.

    v x y z [w] [r g b [a]]     w and colours are ignored
    f i j k ...                 each i, i/t, i//n or i/t/n, in any mixture; from 1, or counted back from here with -1
    #                           comment, to the end of its line, also after a statement
    \\                           at the end of a line: the statement goes on in the next; not in a comment

Keywords may be in capitals and indented; between words stand spaces or tabs. A face may refer to vertices that come
later, by their number.
"""

import re
from itertools import compress

import numpy as np

from harness.scene.mesh.faces import Faces, Fault

# Statements of the format that place no surface: names, materials, lines, points, curves, and how things are drawn.
IGNORED = frozenset(
    b"vt vn vp g o s mg usemtl mtllib maplib usemap l p lod bevel c_interp d_interp shadow_obj trace_obj ctech stech "
    b"cstype deg bmat step curv curv2 parm trim hole scrv sp con end res".split()
)
NAMES = frozenset(b"g o usemtl mtllib maplib usemap shadow_obj trace_obj".split())  # which any text may follow
SURFACES = frozenset(b"surf bzp bsp cdc cdp".split())  # free-form
COMMANDS = frozenset(b"call csh".split())
KEYWORDS = IGNORED | SURFACES | COMMANDS | {b"v", b"f", b"fo"}

_FACES = re.compile(rb"(?:f(?:[^\S\n]++[+-]?\d{1,15}+(?:/[+-]?\d*+){0,2}+)*+[^\S\n]*+\n)*+")
_NOT_CORNER = re.compile(rb"/\S*")
_MARK = b"999999999999999999"  # in place of a face's f; no number of a vertex has so many digits
_NUMBER = re.compile(rb"[+-]?(?:(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?|nan|inf(?:inity)?)", re.IGNORECASE)
_WORDS = 4, 5, 7, 8, 9  # of the line of a vertex: v x y z, with w, with a colour, with both or alpha, with all


def read(content: bytes) -> tuple[np.ndarray, Faces]:
    """Vertices (V, 3) and faces of an OBJ file. Fault, with its line, for what cannot be read right."""
    lines, numbers = _statements(content)
    heads = np.array(lines, "S2")  # two letters of each
    for i in np.flatnonzero((heads != b"v ") & (heads != b"f ")).tolist():
        lines[i] = _plain(lines[i], numbers[i])
        heads[i] = lines[i][:2]
    is_point, is_face = heads == b"v ", heads == b"f "
    numbers = np.array(numbers, np.int64)
    vertices = _vertices(list(compress(lines, is_point.tolist())), numbers[is_point])
    before = np.cumsum(is_point)[is_face]
    return vertices, _faces(list(compress(lines, is_face.tolist())), numbers[is_face], before)


def _statements(content: bytes) -> tuple[list[bytes], list[int] | range]:
    """The statements, without comments, and the number of the first line of each."""
    text = content.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    if b"#" in text:
        text = re.sub(rb"#[^\n]*", b"", text)
    lines = text.split(b"\n")
    return _continued(lines) if b"\\" in text else (lines, range(1, len(lines) + 1))


def _continued(lines: list[bytes]) -> tuple[list[bytes], list[int]]:
    """As `_statements`, for lines that may go on in the next."""
    statements, numbers, goes_on = [], [], False
    for number, line in enumerate(lines, 1):
        # A name may end in a backslash, such as that of a folder of Windows: a keyword does not continue it.
        if goes_on and not (_keyword(statements[-1][0]) in NAMES and _keyword(line) in KEYWORDS):
            statements[-1].append(line)
        else:
            statements.append([line])
            numbers.append(number)
        bare = line.rstrip()
        goes_on = bare.endswith(b"\\")
        if goes_on:
            statements[-1][-1] = bare[:-1]
    return [b" ".join(parts) for parts in statements], numbers


def _keyword(line: bytes) -> bytes:
    return b"".join(line.split(None, 1)[:1]).lower()


def _plain(line: bytes, number: int) -> bytes:
    """A statement that begins with "v " or "f ", or b"" for others. Fault for one that would be missing."""
    words = line.split(None, 1)
    keyword = words[0].lower() if words else b""
    if keyword in (b"v", b"f", b"fo"):
        return keyword[:1] + b" " + b"".join(words[1:])
    if not words or keyword in IGNORED:
        return b""
    place = f"line {number}"
    if keyword in SURFACES:
        raise Fault("free-form surfaces are not read", place, "turn them into polygons in a modelling program")
    if keyword in COMMANDS:
        raise Fault("commands (call, csh) are not carried out", place, "put what they add into the file")
    remedy = (
        "statements are v, f, and others of OBJ such as vn, vt, o, g, usemtl, which are ignored; # begins a comment"
    )
    raise Fault("the line does not begin with a keyword of OBJ", place, remedy)


def _vertices(rows: list[bytes], at: np.ndarray) -> np.ndarray:
    """rows: statements; at: their lines."""
    words = [row.split() for row in rows]
    if wrong := set(map(len, words)).difference(_WORDS):
        i, row = next((i, row) for i, row in enumerate(words) if len(row) in wrong)
        why = (
            "a vertex has three numbers, and may have w and a colour" if len(row) > 4 else "a vertex has three numbers"
        )
        raise Fault(f"{why}; here are {len(row) - 1}", f"line {at[i]}", "correct the line")
    try:
        if b"_" in b"".join(rows):  # float takes 1_000
            raise ValueError
        columns = [list(map(float, [row[axis] for row in words])) for axis in (1, 2, 3)]
    except ValueError:
        wrong = ((i, word) for i, row in enumerate(words) for word in row[1:4] if not _NUMBER.fullmatch(word))
        i, word = next(wrong, (0, b""))
        remedy = "write a point for the decimal comma" if b"," in word else "correct the line"
        raise Fault("a vertex has a word that is not a number", f"line {at[i]}", remedy) from None
    return np.array(columns, np.float64).T.copy()


def _faces(rows: list[bytes], at: np.ndarray, before: np.ndarray) -> Faces:
    """rows: statements; at: their lines; before: the vertices before each."""
    text = b"".join(row + b"\n" for row in rows)
    if not _FACES.fullmatch(text):
        line = at[next(i for i, row in enumerate(rows) if not _FACES.fullmatch(row + b"\n"))]
        why = "a face has a word that is not a corner: i, i/t, i//n or i/t/n, in whole numbers of at most 15 digits"
        raise Fault(why, f"line {line}", "correct the line")
    if b"/" in text:
        text = _NOT_CORNER.sub(b"", text)
    words = np.fromstring(text.replace(b"f", _MARK), np.int64, sep=" ")
    marks = np.flatnonzero(words == int(_MARK))
    counts = np.diff(marks, append=len(words)) - 1
    corners = np.delete(words, marks)
    from_here = np.repeat(before, counts)
    faces = Faces(np.where(corners > 0, corners - 1, corners + from_here), counts, at)
    if not corners.all():
        place = faces.place_of_corner(int((corners == 0).argmax()))
        raise Fault("a face refers to vertex 0; OBJ counts from 1", place, "add 1 to the numbers of all faces")
    early = (corners < 0) & (faces.corners < 0)
    if early.any():
        corner = int(early.argmax())
        why = f"a face counts back to vertex {corners[corner]}; only {from_here[corner]} come before it"
        raise Fault(why, faces.place_of_corner(corner), "move the face behind its vertices, or count from 1")
    return faces
