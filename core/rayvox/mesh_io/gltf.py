"""GLB (binary glTF 2.0): the triangles of its scene, in metres. Everything comes from the file's own binary chunk."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import numpy.typing as npt

from rayvox.errors import MeshFormatError
from rayvox.mesh_io.load_limits import LoadBudget
from rayvox.mesh_io.polygons import Polygons
from rayvox.mesh_io.triangle_mesh import TriangleMesh

_JSON, _BIN = 0x4E4F534A, 0x004E4942
_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_MOST_NODES = 100_000
_MOST_DEPTH = 100
_MOST_JSON_BYTES = 16 << 20
# Those that only say how things look, or how integers stand for coordinates.
_HARMLESS = ("KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "KHR_mesh_quantization")


def decode_glb(data: bytes, budget: LoadBudget, source: str) -> TriangleMesh:
    """Raises MeshFormatError."""
    document, binary = _chunks(data, source)
    try:
        return _Document(document, binary, budget, source).mesh()
    except (KeyError, IndexError, TypeError, AttributeError, ValueError, OverflowError) as error:
        if isinstance(error, MeshFormatError) or not type(error).__module__ == "builtins":
            raise
        # One place for whatever is missing or of another type in the JSON.
        raise MeshFormatError(f"{source}: not valid glTF ({type(error).__name__}: {str(error)[:80]})") from None


def _chunks(data: bytes, source: str) -> tuple[dict[str, Any], bytes]:
    if len(data) < 20 or data[:4] != b"glTF":
        raise MeshFormatError(f"{source}: not a GLB file")
    version, length, json_bytes, kind = struct.unpack_from("<IIII", data, 4)
    if version != 2 or length != len(data) or kind != _JSON or json_bytes > min(len(data) - 20, _MOST_JSON_BYTES):
        raise MeshFormatError(f"{source}: a GLB header of version {version} and {length} bytes on {len(data)} bytes")
    try:
        document = json.loads(data[20 : 20 + json_bytes])
    except (ValueError, RecursionError) as error:
        raise MeshFormatError(f"{source}: its JSON cannot be read: {error}") from None
    if not isinstance(document, dict):
        raise MeshFormatError(f"{source}: its JSON is no object")
    rest = 20 + json_bytes
    if rest + 8 > len(data):
        return document, b""
    size, kind = struct.unpack_from("<II", data, rest)
    if kind != _BIN or size > len(data) - rest - 8:
        raise MeshFormatError(f"{source}: its second chunk is no binary chunk of {size} bytes")
    return document, data[rest + 8 : rest + 8 + size]


class _Document:
    def __init__(self, document: dict[str, Any], binary: bytes, budget: LoadBudget, source: str) -> None:
        self._document, self._binary, self._budget, self._source = document, binary, budget, source
        self._meshes: dict[int, TriangleMesh] = {}
        self._nodes_left = _MOST_NODES
        for name in document.get("extensionsRequired", []):
            if not name.startswith(_HARMLESS):
                raise self._wrong(f"the extension {name[:80]} is not supported")
        if any("uri" in buffer for buffer in document.get("buffers", [])):
            raise self._wrong("buffers outside of the file are not read")

    def mesh(self) -> TriangleMesh:
        nodes = self._document.get("nodes", [])
        scenes = self._document.get("scenes", [])
        if scenes:
            roots = _at(scenes, self._document.get("scene", 0)).get("nodes", [])
        else:
            children = {child for node in nodes for child in node.get("children", [])}
            roots = [i for i in range(len(nodes)) if i not in children]
        return TriangleMesh.concatenate([mesh for root in roots for mesh in self._placed(root, np.eye(4), 0)])

    def _placed(self, index: int, T_scene_parent: npt.NDArray[np.float64], depth: int) -> list[TriangleMesh]:
        self._nodes_left -= 1
        if self._nodes_left < 0 or depth > _MOST_DEPTH:
            raise self._wrong(f"more than {_MOST_NODES} nodes, or {_MOST_DEPTH} within each other")
        self._budget.check_time(self._source)
        node = _at(self._document["nodes"], index)
        if "skin" in node:
            raise self._wrong("skinned meshes are not supported")
        T_scene_node = T_scene_parent @ _local_transform(node)
        meshes = []
        if "mesh" in node:
            mesh = self._mesh(node["mesh"])
            self._budget.take_triangles(len(mesh), self._source)
            meshes.append(mesh.transformed(T_scene_node))
        for child in node.get("children", []):
            meshes += self._placed(child, T_scene_node, depth + 1)
        return meshes

    def _mesh(self, index: int) -> TriangleMesh:
        if index not in self._meshes:
            primitives = _at(self._document["meshes"], index)["primitives"]
            self._meshes[index] = TriangleMesh.concatenate(
                [self._primitive(p) for p in primitives if p.get("mode", _TRIANGLES) >= _TRIANGLES]
            )
        return self._meshes[index]

    def _primitive(self, primitive: dict[str, Any]) -> TriangleMesh:
        vertices = self._accessor(primitive["attributes"]["POSITION"], "VEC3").astype(np.float64)
        corners = np.arange(len(vertices))
        if "indices" in primitive:
            corners = self._accessor(primitive["indices"], "SCALAR")[:, 0].astype(np.int64)
        mode = primitive.get("mode", _TRIANGLES)
        if mode == _TRIANGLES:
            if len(corners) % 3:
                raise self._wrong(f"triangles of {len(corners)} corners")
            triangles = corners.reshape(-1, 3)
        elif mode == _STRIP:
            triangles = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
        elif mode == _FAN:
            triangles = np.stack([np.broadcast_to(corners[:1], len(corners[2:])), corners[1:-1], corners[2:]], axis=1)
        else:
            raise self._wrong(f"a primitive of mode {mode}")
        polygons = Polygons()
        polygons.add(np.full(len(triangles), 3), triangles)
        return polygons.mesh(vertices, self._budget, self._source)

    def _accessor(self, index: int, kind: str) -> npt.NDArray[Any]:
        """(count, width) numbers; a view where they lie densely."""
        accessor = _at(self._document["accessors"], index)
        if accessor["type"] != kind or "sparse" in accessor or "bufferView" not in accessor:
            raise self._wrong(f"accessor {index} is not a dense {kind}")
        view = _at(self._document["bufferViews"], accessor["bufferView"])
        dtype, width, count = np.dtype(_COMPONENTS[accessor["componentType"]]), _WIDTHS[kind], int(accessor["count"])
        row = dtype.itemsize * width
        stride, start, size = int(view.get("byteStride", row)), int(view.get("byteOffset", 0)), int(view["byteLength"])
        first = int(accessor.get("byteOffset", 0))
        if (
            min(count, start, first, size) < 0
            or stride < row
            or view.get("buffer", 0) != 0
            or start + size > len(self._binary)
            or (count > 0 and first + stride * (count - 1) + row > size)
        ):
            raise self._wrong(f"accessor {index} reaches beyond the file's binary chunk")
        array = np.ndarray((count, width), dtype, self._binary, start + first, (stride, dtype.itemsize))
        if accessor.get("normalized", False) and dtype.kind != "f":
            return np.maximum(array.astype(np.float64) / np.iinfo(dtype).max, -1.0)
        return array

    def _wrong(self, what: str) -> MeshFormatError:
        return MeshFormatError(f"{self._source}: {what}")


def _at(items: list[Any], index: int) -> dict[str, Any]:
    if not isinstance(index, int) or index < 0:
        raise IndexError(f"index {index!r:.40}")
    item = items[index]
    if not isinstance(item, dict):
        raise TypeError("an object is needed")
    return item


def _local_transform(node: dict[str, Any]) -> npt.NDArray[np.float64]:
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    T = np.eye(4)
    x, y, z, w = (float(v) for v in node.get("rotation", (0, 0, 0, 1)))
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    scale = np.array(node.get("scale", (1, 1, 1)), dtype=np.float64)
    T[:3, :3] = (np.eye(3) + 2 * w * cross + 2 * cross @ cross) * scale.reshape(3)
    T[:3, 3] = np.array(node.get("translation", (0, 0, 0)), dtype=np.float64).reshape(3)
    return T
