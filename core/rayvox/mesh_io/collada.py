"""COLLADA (DAE) 1.4 and 1.5: the triangles of its scene, in metres by the file's own unit.

The up axis is left as it is, which is what robot descriptions count on.
"""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

import numpy as np
import numpy.typing as npt

from rayvox.errors import MeshFormatError
from rayvox.mesh_io.load_limits import LoadBudget
from rayvox.mesh_io.polygons import Polygons
from rayvox.mesh_io.safe_xml import parse_xml
from rayvox.mesh_io.triangle_mesh import TriangleMesh

_MOST_NODES = 100_000
_MOST_DEPTH = 100
_FACES = ("triangles", "polylist", "polygons", "trifans", "tristrips")


def decode_collada(data: bytes, budget: LoadBudget, source: str) -> TriangleMesh:
    """All geometry that the scene shows; all that there is, where the file has no scene. Raises MeshFormatError."""
    return _Document(parse_xml(data, budget, MeshFormatError, source), budget, source).mesh()


class _Document:
    def __init__(self, root: Element, budget: LoadBudget, source: str) -> None:
        self._root, self._budget, self._source = root, budget, source
        if root.tag != "COLLADA":
            raise MeshFormatError(f"{source}: not a COLLADA file but <{root.tag}>")
        self._by_id = {element.get("id"): element for element in root.iter() if element.get("id")}
        self._geometries: dict[int, TriangleMesh] = {}
        self._nodes_left = _MOST_NODES

    def mesh(self) -> TriangleMesh:
        scene = self._root.find("scene/instance_visual_scene")
        if scene is not None:
            placed = [self._placed(node, np.eye(4), 0) for node in self._target(scene).findall("node")]
            meshes = [mesh for part in placed for mesh in part]
        else:
            meshes = [self._geometry(geometry) for geometry in self._root.findall("library_geometries/geometry")]
        unit = self._root.find("asset/unit")
        scale = 1.0 if unit is None else self._number(unit.get("meter", "1"))
        if not 0 < scale < float("inf"):
            raise MeshFormatError(f"{self._source}: a unit of {scale} metres")
        return TriangleMesh.concatenate(meshes).scaled(scale)

    def _placed(self, node: Element, T_scene_parent: npt.NDArray[np.float64], depth: int) -> list[TriangleMesh]:
        self._nodes_left -= 1
        if self._nodes_left < 0 or depth > _MOST_DEPTH:
            raise self._wrong(f"more than {_MOST_NODES} nodes, or {_MOST_DEPTH} within each other")
        self._budget.check_time(self._source)
        T_scene_node = T_scene_parent
        meshes: list[TriangleMesh] = []
        for child in node:
            if child.tag in _TRANSFORMS:
                T_scene_node = T_scene_node @ self._transform(child)
            elif child.tag in ("lookat", "skew", "instance_controller"):
                raise self._wrong(f"<{child.tag}> is not supported")
            elif child.tag == "instance_geometry":
                mesh = self._geometry(self._target(child))
                self._budget.take_triangles(len(mesh), self._source)
                meshes.append(mesh.transformed(T_scene_node))
            elif child.tag in ("node", "instance_node"):
                inner = child if child.tag == "node" else self._target(child)
                meshes += self._placed(inner, T_scene_node, depth + 1)
        return meshes

    def _transform(self, element: Element) -> npt.NDArray[np.float64]:
        values = self._floats(element)
        if len(values) != _TRANSFORMS[element.tag]:
            raise self._wrong(f"<{element.tag}> of {len(values)} numbers")
        T = np.eye(4)
        if element.tag == "matrix":
            return values.reshape(4, 4)
        if element.tag == "translate":
            T[:3, 3] = values
        elif element.tag == "scale":
            T[:3, :3] = np.diag(values)
        else:
            T[:3, :3] = _rotation(values[:3], np.deg2rad(values[3]))
        return T

    def _geometry(self, geometry: Element) -> TriangleMesh:
        if id(geometry) not in self._geometries:
            mesh = geometry.find("mesh")
            if geometry.tag != "geometry" or mesh is None:
                raise self._wrong("geometry that is no <mesh> is not supported")
            self._geometries[id(geometry)] = TriangleMesh.concatenate(
                [self._triangles(mesh, faces) for faces in mesh if faces.tag in _FACES]
            )
        return self._geometries[id(geometry)]

    def _triangles(self, mesh: Element, faces: Element) -> TriangleMesh:
        inputs = faces.findall("input")
        offsets = [self._integer(i.get("offset", "0")) for i in inputs]
        vertex = [o for i, o in zip(inputs, offsets, strict=True) if i.get("semantic") == "VERTEX"]
        if not vertex or min(offsets) < 0 or max(offsets) > len(inputs) + 16:
            raise self._wrong(f"<{faces.tag}> without a usable VERTEX input")
        stride = max(offsets) + 1
        polygons = Polygons()
        for counts, indices in self._faces(faces, stride):
            if len(indices) % stride:
                raise self._wrong(f"<{faces.tag}> has {len(indices)} indices, which {stride} inputs do not divide")
            corners = indices.reshape(-1, stride)[:, vertex[0]]
            _ADDERS.get(faces.tag, _add_faces)(polygons, counts, corners)
        positions = self._positions(mesh, next(i for i in inputs if i.get("semantic") == "VERTEX"))
        return polygons.mesh(positions, self._budget, self._source)

    def _faces(
        self, faces: Element, stride: int
    ) -> Iterator[tuple[npt.NDArray[np.int64] | None, npt.NDArray[np.int64]]]:
        """Numbers of corners (None: what the kind of element says) and indices, for each <p>."""
        if faces.find("ph") is not None:
            raise self._wrong("polygons with holes are not supported")
        vcount = faces.find("vcount")
        for p in faces.findall("p"):
            indices = self._integers(p)
            if faces.tag == "polylist":
                yield (self._integers(vcount) if vcount is not None else np.zeros(0, np.int64)), indices
            elif faces.tag == "triangles":
                yield np.full(len(indices) // stride // 3, 3), indices
            else:
                yield None, indices

    def _positions(self, mesh: Element, vertex_input: Element) -> npt.NDArray[np.float64]:
        """(n, 3) positions behind an input's <vertices>."""
        positions = [
            i for i in self._target(vertex_input, "source").findall("input") if i.get("semantic") == "POSITION"
        ]
        if not positions:
            raise self._wrong("<vertices> without POSITION")
        accessor = self._target(positions[0], "source").find("technique_common/accessor")
        if accessor is None:
            raise self._wrong("a <source> without an accessor")
        values = self._floats(self._target(accessor, "source"))
        stride = self._integer(accessor.get("stride", "1"))
        offset, count = self._integer(accessor.get("offset", "0")), self._integer(accessor.get("count", "0"))
        if stride < 3 or offset < 0 or count < 0 or offset + count * stride > len(values):
            raise self._wrong(f"an accessor of {count} x {stride} on {len(values)} numbers")
        return values[offset : offset + count * stride].reshape(count, stride)[:, :3]

    def _target(self, element: Element, attribute: str = "url") -> Element:
        name = element.get(attribute, "")
        target = self._by_id.get(name[1:]) if name.startswith("#") else None
        if target is None:
            raise self._wrong(f"<{element.tag}> names {name[:80]!r}, which is not in the file")
        return target

    def _floats(self, element: Element) -> npt.NDArray[np.float64]:
        self._budget.check_time(self._source)
        try:
            return np.array((element.text or "").split(), dtype=np.float64)
        except ValueError as error:
            raise self._wrong(f"<{element.tag}>: {error}") from None

    def _integers(self, element: Element) -> npt.NDArray[np.int64]:
        values = self._floats(element)
        with np.errstate(invalid="ignore"):
            integers = values.astype(np.int64)
        if (integers != values).any():
            raise self._wrong(f"<{element.tag}> holds other than whole numbers")
        return integers

    def _number(self, text: str) -> float:
        try:
            return float(text)
        except ValueError:
            raise self._wrong(f"{text[:80]!r} is no number") from None

    def _integer(self, text: str) -> int:
        try:
            return int(text[:20])
        except ValueError:
            raise self._wrong(f"{text[:80]!r} is no whole number") from None

    def _wrong(self, what: str) -> MeshFormatError:
        return MeshFormatError(f"{self._source}: {what}")


def _add_faces(polygons: Polygons, counts: npt.NDArray[np.int64] | None, corners: npt.NDArray[np.int64]) -> None:
    polygons.add([len(corners)] if counts is None else counts, corners)


def _add_fan(polygons: Polygons, counts: object, corners: npt.NDArray[np.int64]) -> None:
    triangles = np.stack([np.broadcast_to(corners[:1], len(corners[2:])), corners[1:-1], corners[2:]], axis=1)
    polygons.add(np.full(len(triangles), 3), triangles)


def _add_strip(polygons: Polygons, counts: object, corners: npt.NDArray[np.int64]) -> None:
    triangles = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    polygons.add(np.full(len(triangles), 3), triangles)


def _rotation(axis: npt.NDArray[np.float64], angle: float) -> npt.NDArray[np.float64]:
    length = np.linalg.norm(axis)
    x, y, z = axis / length if length > 0 else axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rotation: npt.NDArray[np.float64] = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return rotation


_TRANSFORMS = {"matrix": 16, "translate": 3, "scale": 3, "rotate": 4}
_ADDERS = {"trifans": _add_fan, "tristrips": _add_strip}
