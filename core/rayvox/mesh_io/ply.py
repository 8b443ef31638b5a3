"""PLY (Stanford), text and binary: vertices and faces; other elements and properties are passed over."""

from __future__ import annotations

import struct
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from rayvox.errors import MeshFormatError
from rayvox.mesh_io.load_limits import LoadBudget
from rayvox.mesh_io.polygons import Polygons
from rayvox.mesh_io.text_lines import text_lines
from rayvox.mesh_io.triangle_mesh import TriangleMesh

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_STRUCT = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}
_FACE_LISTS = ("vertex_indices", "vertex_index")
_HEADER_LIMIT_BYTES = 1 << 16
_ROWS_PER_CHECK = 1 << 14


@dataclass
class _Property:
    name: str
    type: str
    count_type: str | None = None  # of a list


@dataclass
class _Element:
    name: str
    count: int
    properties: list[_Property] = field(default_factory=list)

    @property
    def has_list(self) -> bool:
        return any(p.count_type for p in self.properties)


def decode_ply(data: bytes, budget: LoadBudget, source: str) -> TriangleMesh:
    """Raises MeshFormatError."""
    encoding, elements, body = _header(data, source)
    reader = _Reader(data, body, encoding, budget, source)
    vertices = np.zeros((0, 3))
    polygons = Polygons()
    for element in elements:
        if element.name == "tristrips":
            raise MeshFormatError(f"{source}: triangle strips are not supported")
        if element.name == "vertex":
            vertices = reader.positions(element)
        elif element.name == "face":
            reader.read_faces(element, polygons)
        else:
            reader.skip(element)
    return polygons.mesh(vertices, budget, source)


def _header(data: bytes, source: str) -> tuple[str, list[_Element], int]:
    """Encoding, elements, and where the body begins."""
    end = data[:_HEADER_LIMIT_BYTES].find(b"end_header")
    line_end = data.find(b"\n", end)
    if data[:3] != b"ply" or end < 0 or line_end < 0:
        raise MeshFormatError(f"{source}: not a PLY header")
    encoding, elements = "", []
    try:
        for line in data[:end].decode("latin-1").splitlines()[1:]:
            match line.split():
                case ["format", encoding, _]:
                    pass
                case ["element", name, count]:
                    elements.append(_Element(name, int(count)))
                case ["property", "list", count_type, item_type, name]:
                    elements[-1].properties.append(_Property(name, _TYPES[item_type], _TYPES[count_type]))
                case ["property", item_type, name]:
                    elements[-1].properties.append(_Property(name, _TYPES[item_type]))
                case [] | ["comment" | "obj_info", *_]:
                    pass
                case _:
                    raise ValueError(line)
    except (ValueError, KeyError, IndexError) as error:
        raise MeshFormatError(f"{source}: not a PLY header: {str(error)[:80]}") from None
    if encoding not in ("ascii", "binary_little_endian", "binary_big_endian"):
        raise MeshFormatError(f"{source}: a PLY file of format {encoding!r}")
    # Elements without properties take no bytes, so that no size would stop a hostile count.
    if any(element.count < 0 or not element.properties for element in elements):
        raise MeshFormatError(f"{source}: a PLY element of no properties or a negative count")
    return encoding, elements, line_end + 1


class _Reader:
    """Goes through the body element by element."""

    def __init__(self, data: bytes, at: int, encoding: str, budget: LoadBudget, source: str) -> None:
        self._data, self._at, self._budget, self._source = data, at, budget, source
        self._order = ">" if encoding == "binary_big_endian" else "<"
        self._lines = _body_lines(data[at:], budget, source) if encoding == "ascii" else None

    def positions(self, element: _Element) -> npt.NDArray[np.float64]:
        names = [p.name for p in element.properties]
        if not {"x", "y", "z"} <= set(names):
            raise MeshFormatError(f"{self._source}: vertices without x, y, z")
        if self._lines is None and not element.has_list:
            table = self._table(element)
            return np.stack([table[axis].astype(np.float64) for axis in "xyz"], axis=1)
        columns = [names.index(axis) for axis in "xyz"]
        coordinates = array("d")
        for row in self._rows(element):
            coordinates.extend(row[c] for c in columns)
        return np.array(coordinates).reshape(-1, 3)

    def read_faces(self, element: _Element, polygons: Polygons) -> None:
        names = [p.name for p in element.properties if p.count_type]
        wanted = next((name for name in _FACE_LISTS if name in names), None)
        if wanted is None:
            raise MeshFormatError(f"{self._source}: faces without vertex_indices")
        if self._read_equal_faces(element, wanted, polygons):
            return
        column = [p.name for p in element.properties].index(wanted)
        counts, corners = array("q"), array("q")
        try:
            for row in self._rows(element):
                counts.append(len(row[column]))
                corners.extend(row[column])
        except (TypeError, OverflowError) as error:
            raise MeshFormatError(f"{self._source}: face: {error}") from None
        polygons.add(counts, corners)

    def skip(self, element: _Element) -> None:
        if self._lines is None and not element.has_list:
            self._table(element)
        else:
            for _ in self._rows(element):
                pass

    def _read_equal_faces(self, element: _Element, wanted: str, polygons: Polygons) -> bool:
        """At once, where all faces have as many corners as the first and no other list; False where not."""
        lists = [p for p in element.properties if p.count_type]
        if self._lines is not None or len(lists) != 1 or element.count == 0:
            return False
        start = self._at
        first = next(self._rows(_Element(element.name, 1, element.properties)))
        self._at = start
        corners = len(first[[p.name for p in element.properties].index(wanted)])
        columns: list[Any] = []
        for p in element.properties:
            if p.count_type:
                columns.append(("count of " + p.name, self._order + p.count_type))
            columns.append((p.name, self._order + p.type, (corners,) if p.count_type else ()))
        row = np.dtype(columns)
        if row.itemsize * element.count > len(self._data) - self._at:
            return False
        table = np.frombuffer(self._data, row, element.count, self._at)
        if (table["count of " + wanted] != corners).any():
            return False
        self._at += row.itemsize * element.count
        polygons.add(table["count of " + wanted], table[wanted])
        return True

    def _table(self, element: _Element) -> dict[str, npt.NDArray[Any]]:
        """Columns of a binary element without lists."""
        offsets = np.cumsum([0, *(np.dtype(p.type).itemsize for p in element.properties)])
        size = int(offsets[-1])
        block = self._take(size * element.count)
        rows = np.frombuffer(block, np.uint8).reshape(element.count, size)
        return {
            p.name: np.ascontiguousarray(rows[:, low:high]).view(self._order + p.type)[:, 0]
            for p, low, high in zip(element.properties, offsets, offsets[1:], strict=False)
        }

    def _rows(self, element: _Element) -> Iterator[list[Any]]:
        """Rows one by one; a list property is a list."""
        for number in range(element.count):
            if number % _ROWS_PER_CHECK == 0:
                self._budget.check_time(self._source)
            yield self._binary_row(element) if self._lines is None else self._text_row(element)

    def _text_row(self, element: _Element) -> list[Any]:
        # A row is a line, and what a line holds beyond the header's properties is passed over: some writers do so.
        assert self._lines is not None
        words = iter(next(self._lines, []))
        row: list[Any] = []
        try:
            for p in element.properties:
                parse = float if p.type[0] == "f" else int
                if p.count_type:
                    row.append([parse(next(words)) for _ in range(int(next(words)))])
                else:
                    row.append(parse(next(words)))
        except StopIteration:
            raise self._too_short() from None
        except (ValueError, OverflowError) as error:
            raise MeshFormatError(f"{self._source}: {element.name}: {error}") from None
        return row

    def _binary_row(self, element: _Element) -> list[Any]:
        row: list[Any] = []
        for p in element.properties:
            if p.count_type:
                (count,) = self._numbers(p.count_type, 1)
                if count < 0:
                    raise MeshFormatError(f"{self._source}: a list of {count} items")
                row.append(self._numbers(p.type, int(count)))
            else:
                row += self._numbers(p.type, 1)
        return row

    def _numbers(self, kind: str, count: int) -> tuple[Any, ...]:
        return struct.unpack(f"{self._order}{count}{_STRUCT[kind]}", self._take(np.dtype(kind).itemsize * count))

    def _take(self, count: int) -> bytes:
        if count > len(self._data) - self._at:
            raise self._too_short()
        self._at += count
        return self._data[self._at - count : self._at]

    def _too_short(self) -> MeshFormatError:
        return MeshFormatError(f"{self._source}: the file ends before what its header promises")


def _body_lines(body: bytes, budget: LoadBudget, source: str) -> Iterator[list[bytes]]:
    for _, line in text_lines(body, budget, source):
        if words := line.split():
            yield words
