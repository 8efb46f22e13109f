"""Reads PLY (Turk, 1994): text and binary of both byte orders, faces of any number of corners, strips of triangles.

The header names elements and their properties. Read are x, y and z of `vertex`, the list vertex_index or vertex_indices
of `face`, and that of `tristrips`, where -1 ends a strip. All else is passed over.
"""

import re
import struct
from dataclasses import dataclass, field
from itertools import chain

import numpy as np

from harness.scene.mesh.faces import Faces, Fault

TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "int64": "i8", "uint64": "u8",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q", "u8": "Q"}  # of struct
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
CORNERS = ("vertex_index", "vertex_indices")
AGAIN = "the file is incomplete or damaged; export it again"


@dataclass
class Property:
    """A property of an element. kind: of its number, or of the items of its list; count: kind of the list's length."""

    name: str
    kind: str
    count: str = ""


@dataclass
class Element:
    name: str
    rows: int
    properties: list[Property] = field(default_factory=list)

    def find(self, *names: str) -> Property:
        """The first property of one of these names. Fault if there is none."""
        match = next((each for each in self.properties if each.name in names), None)
        if match is None:
            raise Fault(f"the element {self.name} has no property {names[-1]}", "", AGAIN)
        return match


def read(content: bytes) -> tuple[np.ndarray, Faces]:
    """Vertices (V, 3) and faces of a PLY file. Fault, with its line or element, for what cannot be read right."""
    order, elements, first, start = _header(content)
    body = _Binary(content, start, ORDERS[order]) if ORDERS[order] else _Text(content[start:], first)
    vertices, groups = np.empty((0, 3)), []
    for element in elements:
        if element.name == "vertex":
            axes = [element.find(axis) for axis in "xyz"]
            if any(each.count for each in axes):
                raise Fault("x, y and z of a vertex must be numbers, not lists", "", AGAIN)
            columns, _ = body.read(element, axes)
            with np.errstate(invalid="ignore"):  # of a signalling NaN; the vertex is refused if a face has it
                vertices = np.stack([np.asarray(values, np.float64) for values, _ in columns], axis=1)
        elif element.name in ("face", "tristrips") and element.rows:
            corners = element.find(*CORNERS)
            if not corners.count or corners.kind[0] == "f":
                raise Fault(f"the corners of a {element.name} must be a list of whole numbers", "", AGAIN)
            ((values, counts),), places = body.read(element, [corners])
            kind = "line" if ORDERS[order] == "" else element.name
            faces = Faces(np.asarray(values, np.int64), np.asarray(counts, np.int64), places, kind)
            groups.append(faces if element.name == "face" else _strips(faces))
        else:
            body.read(element, [])
    body.end()
    if not groups:
        return vertices, Faces(*(np.empty(0, np.int64) for _ in range(3)))
    parts = ([getattr(faces, name) for faces in groups] for name in ("corners", "counts", "places"))
    return vertices, Faces(*map(np.concatenate, parts), groups[0].kind)


def _header(content: bytes) -> tuple[str, list[Element], int, int]:
    """The format, the elements, and of what follows the header its line and its place in the content."""
    start = 3 if content.startswith(b"\xef\xbb\xbf") else 0
    begin = re.match(rb"ply[ \t]*(\r\n|\n|\r)", content[start : start + 100])
    if not begin:
        raise Fault("a PLY file begins with a line ply", "line 1", AGAIN)
    order, elements = "", []
    place, number = start + begin.end(), 2
    while True:
        end = content.find(begin[1], place)
        line = content[place : end if end >= 0 else len(content)]
        words = line[:1000].decode("ascii", "replace").split()
        where = f"line {number}"
        if end < 0 and words[:1] != ["end_header"]:
            raise Fault("the header of the PLY has no end (end_header)", where, AGAIN)
        place, number = end + len(begin[1]) if end >= 0 else len(content), number + 1
        match words:
            case ["end_header"]:
                break
            case [] | ["comment" | "obj_info", *_]:
                pass
            case ["format", name, "1.0"] if name in ORDERS:
                order = name
            case ["element", name, count] if re.fullmatch(r"\d{1,18}", count):
                elements.append(Element(name, int(count)))
            case ["property", "list", count, kind, name] if elements and {count, kind} <= set(TYPES):
                if TYPES[count][0] == "f":
                    raise Fault("the length of a list must be a whole number", where, AGAIN)
                elements[-1].properties.append(Property(name, TYPES[kind], TYPES[count]))
            case ["property", kind, name] if elements and kind in TYPES:
                elements[-1].properties.append(Property(name, TYPES[kind]))
            case _:
                raise Fault("a line of the header that PLY 1.0 does not have", where, AGAIN)
    if not order:
        raise Fault("the header names no format: ascii, binary_little_endian or binary_big_endian, 1.0", "", AGAIN)
    return order, elements, number, place


class _Text:
    """The lines after the header, one for each row of an element. first: the number of the first line."""

    def __init__(self, content: bytes, first: int):
        lines = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
        self.lines = [(number, line) for number, line in enumerate(lines, first) if not line.isspace() and line]
        self.next = 0

    def read(self, element: Element, wanted: list[Property]):
        """Of each wanted property its numbers, one row after the other, and how many each row has; the lines."""
        some = self.lines[self.next : self.next + element.rows] if element.properties else []
        if len(some) < element.rows and element.properties:
            why = f"the header announces {element.rows:,} of the element {element.name}; here are {len(some):,}"
            raise Fault(why, "", AGAIN)
        self.next += len(some)
        places = np.array([number for number, _ in some], np.int64)
        columns = [([], []) for _ in wanted]
        places_in = [next((i for i, each in enumerate(wanted) if each is own), -1) for own in element.properties]
        for number, line in some:
            words, at = line.split(), 0
            for own, column in zip(element.properties, places_in, strict=True):
                size = 1
                if own.count:
                    text = words[at] if at < len(words) else b""
                    if not re.fullmatch(rb"\d{1,9}", text):
                        raise Fault("a list without its length", f"line {number}", AGAIN)
                    at, size = at + 1, int(text)
                if column >= 0:
                    columns[column][0].append(words[at : at + size])
                    columns[column][1].append(size)
                at += size
            if at != len(words):
                why = f"the element {element.name} has {at} numbers here, by the header; the line has {len(words)}"
                raise Fault(why, f"line {number}", AGAIN)
        return [
            (self.numbers(each, *column, places), column[1]) for each, column in zip(wanted, columns, strict=True)
        ], places

    @staticmethod
    def numbers(each: Property, rows, counts, places) -> np.ndarray:
        number = float if each.kind[0] == "f" else int
        try:
            values = list(map(number, chain.from_iterable(rows)))
            if any(b"_" in word for row in rows for word in row):  # Python takes 1_000
                raise ValueError
            return np.array(values, np.float64 if number is float else np.int64)
        except (ValueError, OverflowError):
            kind = "a number" if number is float else "a whole number"
            for row, place in zip(rows, places, strict=True):
                for word in row:
                    try:
                        if b"_" in word or (abs(number(word)) >= 2**63 and number is int):
                            raise ValueError
                    except ValueError:
                        why = f"the property {each.name} has a word that is not {kind}"
                        raise Fault(why, f"line {place}", "correct the line") from None
            raise

    def end(self) -> None:
        if self.next < len(self.lines):
            why = "a line more than the header announces"
            raise Fault(why, f"line {self.lines[self.next][0]}", "correct the header, or remove what is too much")


class _Binary:
    """The bytes after the header. order: < or >, as struct has it."""

    def __init__(self, content: bytes, start: int, order: str):
        self.content, self.at, self.order = content, start, order

    def read(self, element: Element, wanted: list[Property]):
        """As `_Text.read`; the places are numbers of rows, from 1."""
        if not element.properties or not element.rows:
            return [(np.empty(0), []) for _ in wanted], np.arange(1, 1)
        columns = self._even(element, wanted)
        if columns is None:
            columns = self._uneven(element, wanted)
        return columns, np.arange(1, element.rows + 1)

    def _even(self, element: Element, wanted: list[Property]):
        """`read` where the lists of all rows are as long as those of the first; else None."""
        offsets, sizes, lengths, at = {}, {}, [], self.at
        for i, own in enumerate(element.properties):
            sizes[i] = 1
            if own.count:
                kind = np.dtype(self.order + own.count)
                if at + kind.itemsize > len(self.content):
                    return None
                sizes[i] = int(np.frombuffer(self.content, kind, 1, at)[0])
                lengths.append((kind, at, sizes[i]))
                at += kind.itemsize
            offsets[i] = at
            at += max(sizes[i], 0) * np.dtype(own.kind).itemsize
        width, rows = at - self.at, element.rows
        if self.at + rows * width > len(self.content):
            return None
        for kind, place, size in lengths:
            column = np.ndarray((rows,), kind, self.content, place, (width,))
            if size < 0 or (column != size).any():
                return None
        columns = []
        for each in wanted:
            i = next(i for i, own in enumerate(element.properties) if own is each)
            kind = np.dtype(self.order + each.kind)
            values = np.ndarray((rows, sizes[i]), kind, self.content, offsets[i], (width, kind.itemsize))
            columns.append((values.reshape(-1), np.full(rows, sizes[i])))
        self.at += rows * width
        return columns

    def _uneven(self, element: Element, wanted: list[Property]):
        """`read` where each row has its own length."""
        steps = []
        for own in element.properties:
            length = struct.Struct(self.order + CODES[own.count]) if own.count else None
            column = next((i for i, each in enumerate(wanted) if each is own), -1)
            steps.append((length, np.dtype(own.kind).itemsize, column))
        places = [([], []) for _ in wanted]
        content, at, end = self.content, self.at, len(self.content)
        for row in range(1, element.rows + 1):
            for length, size, column in steps:
                count = 1
                if length:
                    if at + length.size > end:
                        raise self._short(element, row)
                    (count,) = length.unpack_from(content, at)
                    at += length.size
                if column >= 0:
                    places[column][0].append(at)
                    places[column][1].append(count)
                if count < 0:
                    raise Fault("a list of negative length", f"{element.name} {row}", AGAIN)
                at += count * size
                if at > end:
                    raise self._short(element, row)
        self.at = at
        return [self._gathered(each, *map(np.array, place)) for each, place in zip(wanted, places, strict=True)]

    def _gathered(self, each: Property, starts, counts):
        kind = np.dtype(self.order + each.kind)
        values = np.empty(counts.sum(), kind)
        firsts = np.cumsum(counts) - counts
        data = np.frombuffer(self.content, np.uint8)
        for count in np.unique(counts):
            rows = np.flatnonzero(counts == count)
            some = data[starts[rows][:, None] + np.arange(count * kind.itemsize)]
            values[firsts[rows][:, None] + np.arange(count)] = some.view(kind)
        return values, counts

    @staticmethod
    def _short(element: Element, row: int) -> Fault:
        why = f"the header announces {element.rows:,} of the element {element.name}; the file ends in number {row:,}"
        return Fault(why, "", AGAIN)

    def end(self) -> None:
        pass  # what follows the elements is nobody's


def _strips(strips: Faces) -> Faces:
    """The triangles of strips: every other one is turned over; -1 ends a strip."""
    corners = strips.corners
    owner = np.repeat(np.arange(len(strips.counts)), strips.counts)
    ends = corners == -1
    index = np.arange(len(corners))
    begins = np.ones(len(corners), bool)
    begins[1:] = ends[:-1] | (owner[1:] != owner[:-1])
    start = np.maximum.accumulate(np.where(begins, index, 0))
    three = index[: max(len(corners) - 2, 0)]
    good = (start[three + 2] <= three) & ~ends[three] & ~ends[three + 1] & ~ends[three + 2]
    three = three[good]
    odd = (three - start[three]) % 2
    rows = np.stack([three + odd, three + 1 - odd, three + 2], axis=1)
    return Faces(corners[rows].reshape(-1), np.full(len(rows), 3), strips.places[owner[three]], strips.kind)
