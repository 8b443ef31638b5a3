"""STL, binary and ASCII."""

from __future__ import annotations

from array import array

import numpy as np
import numpy.typing as npt

from rayvox.errors import MeshFormatError
from rayvox.mesh_io.load_limits import LoadBudget
from rayvox.mesh_io.text_lines import text_lines
from rayvox.mesh_io.triangle_mesh import TriangleMesh

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_HEADER_BYTES = 84


def decode_stl(data: bytes, budget: LoadBudget, source: str) -> TriangleMesh:
    """All solids of the file as one mesh, three vertices of its own for each triangle. Raises MeshFormatError."""
    claimed = int.from_bytes(data[80:84], "little") if len(data) >= _HEADER_BYTES else -1
    # Binary files may begin with "solid" as well; their size tells them apart.
    if len(data) == _HEADER_BYTES + claimed * _RECORD.itemsize:
        budget.take_triangles(claimed, source)
        corners = np.frombuffer(data, _RECORD, offset=_HEADER_BYTES)["corners"].astype(np.float64)
    elif data[:512].lstrip()[:5].lower() == b"solid":
        corners = _ascii_corners(data, budget, source)
    elif claimed >= 0:
        raise MeshFormatError(f"{source}: an STL header of {claimed} triangles does not fit {len(data)} bytes")
    else:
        raise MeshFormatError(f"{source}: neither a binary nor an ASCII STL file")
    return TriangleMesh(corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3))


def _ascii_corners(data: bytes, budget: LoadBudget, source: str) -> npt.NDArray[np.float64]:
    coordinates = array("d")
    corners_of_facet, in_solid = 0, False
    for number, line in text_lines(data, budget, source):
        words = line.lower().split()
        match words:
            case [b"vertex", x, y, z]:
                try:
                    coordinates.extend((float(x), float(y), float(z)))
                except ValueError:
                    raise MeshFormatError(f"{source}: line {number} is no vertex: {line[:80]!r}") from None
                corners_of_facet += 1
            case [b"facet", *_]:
                corners_of_facet = 0
            case [b"endfacet"]:
                if corners_of_facet != 3:
                    raise MeshFormatError(f"{source}: line {number} ends a facet of {corners_of_facet} vertices")
                budget.take_triangles(1, source)
            case [b"solid", *_] | [b"endsolid", *_]:
                in_solid = words[0] == b"solid"
            case [] | [b"outer", b"loop"] | [b"endloop"] | [b"color", *_]:
                pass
            case _:
                raise MeshFormatError(f"{source}: line {number} is no STL: {line[:80]!r}")
    if in_solid or len(coordinates) % 9:
        raise MeshFormatError(f"{source}: the file ends within a solid")
    return np.array(coordinates).reshape(-1, 3, 3)
