"""Wavefront OBJ: vertices and faces. Materials, textures, normals, lines and points are passed over."""

from __future__ import annotations

from array import array

import numpy as np

from rayvox.errors import MeshFormatError
from rayvox.mesh_io.load_limits import LoadBudget
from rayvox.mesh_io.polygons import Polygons
from rayvox.mesh_io.text_lines import text_lines
from rayvox.mesh_io.triangle_mesh import TriangleMesh

# mtllib and maplib are among them: no other file is ever opened.
_IGNORED = frozenset(
    b"vt vn g o s l p usemtl mtllib usemap maplib bevel c_interp d_interp lod shadow_obj trace_obj".split()
)


def decode_obj(data: bytes, budget: LoadBudget, source: str) -> TriangleMesh:
    """All objects of the file as one mesh. Raises MeshFormatError, which names the line."""
    coordinates, counts, corners = array("d"), array("q"), array("q")
    for number, line in text_lines(data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" "), budget, source):
        words = line.partition(b"#")[0].split()
        # A line of numbers is how some writers begin: how many vertices and faces will follow.
        if not words or words[0] in _IGNORED or words[0].isdigit():
            continue
        if words[0] not in (b"v", b"f", b"fo"):
            raise MeshFormatError(f"{source}: line {number} is none that rayvox reads: {line[:80]!r}")
        try:
            if words[0] == b"v":
                coordinates.extend((float(words[1]), float(words[2]), float(words[3])))
            else:
                face = [int(word.partition(b"/")[0]) for word in words[1:]]
                # Counted from 1, or backwards from the newest vertex.
                newest = len(coordinates) // 3
                if 0 in face or min(face) < -newest:
                    raise ValueError
                corners.extend(index - 1 if index > 0 else newest + index for index in face)
                counts.append(len(face))
        except (ValueError, IndexError, OverflowError):
            raise MeshFormatError(f"{source}: line {number} is no vertex or face: {line[:80]!r}") from None
    points = np.array(coordinates).reshape(-1, 3)
    polygons = Polygons()
    polygons.add(counts, corners)
    return polygons.mesh(points, budget, source)
