"""One door for every mesh format.

The readers are rayvox's own: the libraries at hand fail one or the other need of files from strangers. trimesh takes
1.2 s to import, lets NaN vertices and XML entities through, raises whatever comes up, and fans concave polygons, which
covers the wrong area. open3d reads some polygon files as empty, and only from disk. Neither bounds time.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from rayvox.errors import InvalidInputError, MeshFormatError
from rayvox.mesh_io.collada import decode_collada
from rayvox.mesh_io.gltf import decode_glb
from rayvox.mesh_io.load_limits import LoadBudget, LoadLimits
from rayvox.mesh_io.obj import decode_obj
from rayvox.mesh_io.off import decode_off
from rayvox.mesh_io.ply import decode_ply
from rayvox.mesh_io.stl import decode_stl
from rayvox.mesh_io.triangle_mesh import TriangleMesh

_DECODERS: dict[str, Callable[[bytes, LoadBudget, str], TriangleMesh]] = {
    "stl": decode_stl,
    "obj": decode_obj,
    "ply": decode_ply,
    "off": decode_off,
    "dae": decode_collada,
    "glb": decode_glb,
}
MESH_FORMATS = tuple(_DECODERS)
# Far beyond any robot in any unit, and far from where products of coordinates overflow.
LARGEST_COORDINATE = 1e9


def mesh_format_of(name: str) -> str:
    """The format that a file name's suffix says. Raises MeshFormatError."""
    suffix = os.path.splitext(name)[1].lstrip(".").lower()
    if suffix not in _DECODERS:
        raise MeshFormatError(f"{name[:120]}: meshes are {', '.join(MESH_FORMATS)}, not {suffix[:20]!r}")
    return suffix


def decode_mesh(
    data: bytes, file_format: str, source: str = "mesh", limits: LoadLimits | LoadBudget | None = None
) -> TriangleMesh:
    """Triangles of a mesh file's bytes, polygons cut into triangles, in the file's unit (DAE: in metres).

    `source` is how errors name it. Raises MeshFormatError for a file that is corrupt or holds no triangles,
    LoadLimitError.
    """
    if file_format not in _DECODERS:
        raise MeshFormatError(f"{source}: meshes are {', '.join(MESH_FORMATS)}, not {file_format[:20]!r}")
    budget = limits if isinstance(limits, LoadBudget) else LoadBudget(limits or LoadLimits())
    budget.take_bytes(len(data), source)
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            mesh = _DECODERS[file_format](data, budget, source)
    except InvalidInputError as error:
        raise MeshFormatError(f"{source}: {error}") from None
    if len(mesh) == 0:
        raise MeshFormatError(f"{source}: it holds no triangles")
    if np.abs(mesh.vertices).max() > LARGEST_COORDINATE:
        raise MeshFormatError(f"{source}: a coordinate beyond {LARGEST_COORDINATE:g}")
    return mesh


def read_mesh(path: str | os.PathLike[str], limits: LoadLimits | LoadBudget | None = None) -> TriangleMesh:
    """As decode_mesh, of the format that the file's suffix says. Raises OSError too."""
    path = Path(path)
    return decode_mesh(path.read_bytes(), mesh_format_of(path.name), path.name, limits)
