"""OFF (Geomview), text, also with normals or colours, which are passed over."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator

import numpy as np

from rayvox.errors import MeshFormatError, RayvoxError
from rayvox.mesh_io.load_limits import LoadBudget
from rayvox.mesh_io.polygons import Polygons
from rayvox.mesh_io.text_lines import text_lines
from rayvox.mesh_io.triangle_mesh import TriangleMesh


def decode_off(data: bytes, budget: LoadBudget, source: str) -> TriangleMesh:
    """Raises MeshFormatError."""
    lines = _lines(data, budget, source)
    try:
        keyword, *counts = next(lines)
        if not re.fullmatch(rb"(ST)?C?N?OFF", keyword) or b"BINARY" in counts:
            raise MeshFormatError(f"{source}: not a text OFF file")
        # The counts follow the keyword, on its own line or on the next.
        vertex_count, face_count = (int(word) for word in (counts or next(lines))[:2])
        if not 0 <= vertex_count + face_count <= len(data) or min(vertex_count, face_count) < 0:
            raise MeshFormatError(f"{source}: {vertex_count} vertices and {face_count} faces in {len(data)} bytes")
        coordinates, counts_of_faces, corners = array("d"), array("q"), array("q")
        for _ in range(vertex_count):
            x, y, z = next(lines)[:3]
            coordinates.extend((float(x), float(y), float(z)))
        for _ in range(face_count):
            row = next(lines)
            counts_of_faces.append(int(row[0]))
            corners.extend(int(word) for word in row[1 : int(row[0]) + 1])
    except StopIteration:
        raise MeshFormatError(f"{source}: the file ends before what its header promises") from None
    except (ValueError, OverflowError) as error:
        if isinstance(error, RayvoxError):
            raise
        raise MeshFormatError(f"{source}: not an OFF file: {error}") from None
    vertices = np.array(coordinates).reshape(-1, 3)
    polygons = Polygons()
    polygons.add(counts_of_faces, corners)
    return polygons.mesh(vertices, budget, source)


def _lines(data: bytes, budget: LoadBudget, source: str) -> Iterator[list[bytes]]:
    """Words of the lines that hold any, comments left out."""
    for _, line in text_lines(data, budget, source):
        if words := line.partition(b"#")[0].split():
            yield words
