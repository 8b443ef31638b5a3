"""Mesh files: STL, OBJ, PLY, OFF, COLLADA (DAE) and GLB from bytes, within limits, never opening another file."""

from rayvox.mesh_io.load_limits import LoadBudget, LoadLimits
from rayvox.mesh_io.mesh_file import MESH_FORMATS, decode_mesh, mesh_format_of, read_mesh
from rayvox.mesh_io.triangle_mesh import TriangleMesh

__all__ = [
    "MESH_FORMATS",
    "LoadBudget",
    "LoadLimits",
    "TriangleMesh",
    "decode_mesh",
    "mesh_format_of",
    "read_mesh",
]
