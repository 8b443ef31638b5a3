"""URDF (wiki.ros.org/urdf/XML): the link tree of a robot and its geometry."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal
from xml.etree.ElementTree import Element

import numpy as np
import numpy.typing as npt

from rayvox.errors import MeshFormatError, RobotFormatError
from rayvox.mesh_io import LoadBudget, TriangleMesh, decode_mesh, mesh_format_of
from rayvox.mesh_io.mesh_file import LARGEST_COORDINATE
from rayvox.mesh_io.safe_xml import parse_xml
from rayvox.robot.file_source import FileSource, resolve_reference
from rayvox.robot.joint import Joint, JointMotion, Mimic
from rayvox.robot.link import Link, LinkGeometry
from rayvox.robot.primitives import box_mesh, cylinder_mesh, sphere_mesh

GeometryKind = Literal["collision", "visual"]
MOST_LINKS = 2000
MOST_NAME_CHARACTERS = 200

_MOTIONS = {
    "fixed": JointMotion.FIXED,
    "revolute": JointMotion.REVOLUTE,
    "continuous": JointMotion.REVOLUTE,
    "prismatic": JointMotion.PRISMATIC,
}
_BASE_MOTIONS = ("floating", "planar")
_XACRO = re.compile(rb"<\s*xacro:|\$[{(]")


@dataclass(frozen=True)
class RobotDescription:
    """Links and joints in the order of the file."""

    name: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]


def parse_urdf(
    data: bytes, description: str, files: FileSource, geometry: GeometryKind, budget: LoadBudget
) -> RobotDescription:
    """A robot from a URDF, whose meshes are read from `files`.

    `description` is its name there. Raises RobotFormatError, MeshFormatError, LoadLimitError.
    """
    if _XACRO.search(data):
        raise RobotFormatError(
            f"{description}: xacro is not supported; expand it first: xacro robot.xacro > robot.urdf"
        )
    root = parse_xml(data, budget, RobotFormatError, description)
    if root.tag != "robot":
        raise RobotFormatError(f"{description}: not a URDF but <{root.tag[:80]}>")
    reader = _Reader(description, files, budget)
    links, joints = root.findall("link"), root.findall("joint")
    if max(len(links), len(joints)) > MOST_LINKS:
        raise RobotFormatError(f"{description}: {len(links)} links, {len(joints)} joints; the limit is {MOST_LINKS}")
    return RobotDescription(
        root.get("name", "robot")[:MOST_NAME_CHARACTERS],
        tuple(reader.link(element, geometry) for element in links),
        tuple(reader.joint(element) for element in joints),
    )


class _Reader:
    def __init__(self, description: str, files: FileSource, budget: LoadBudget) -> None:
        self._description, self._files, self._budget = description, files, budget
        self._meshes: dict[str, TriangleMesh] = {}

    def link(self, element: Element, kind: GeometryKind) -> Link:
        name = self._name(element)
        return Link(name, tuple(self._geometry(body, f"link {name}") for body in element.findall(kind)))

    def joint(self, element: Element) -> Joint:
        name, kind = self._name(element), element.get("type", "")
        where = f"joint {name}"
        if kind in _BASE_MOTIONS:
            raise self._wrong(where, f"{kind} joints are not supported; where the base is, T_map_base says")
        if kind not in _MOTIONS:
            raise self._wrong(where, f"type {kind[:40]!r} is none of {', '.join(_MOTIONS)}")
        parent, child = element.find("parent"), element.find("child")
        if parent is None or child is None:
            raise self._wrong(where, "it has no parent or no child")
        lower, upper = self._limits(element, kind, where)
        return Joint(
            name,
            _MOTIONS[kind],
            parent.get("link", ""),
            child.get("link", ""),
            self._origin(element, where),
            self._axis(element, where) if kind != "fixed" else (1.0, 0.0, 0.0),
            lower,
            upper,
            self._mimic(element, where) if kind != "fixed" else None,
        )

    def _limits(self, element: Element, kind: str, where: str) -> tuple[float, float]:
        limit = element.find("limit")
        if limit is None or kind in ("continuous", "fixed"):
            return -math.inf, math.inf
        lower, upper = (self._numbers(limit.get(end, "0"), 1, where)[0] for end in ("lower", "upper"))
        if lower > upper:
            raise self._wrong(where, f"its lower limit {lower} is above the upper one {upper}")
        return lower, upper

    def _mimic(self, element: Element, where: str) -> Mimic | None:
        mimic = element.find("mimic")
        if mimic is None:
            return None
        multiplier, offset = (
            self._numbers(mimic.get(name, default), 1, where)[0]
            for name, default in (("multiplier", "1"), ("offset", "0"))
        )
        return Mimic(mimic.get("joint", ""), multiplier, offset)

    def _axis(self, element: Element, where: str) -> tuple[float, float, float]:
        axis = element.find("axis")
        x, y, z = self._numbers(axis.get("xyz", "1 0 0") if axis is not None else "1 0 0", 3, where)
        length = math.hypot(x, y, z)
        if length < 1e-6:
            raise self._wrong(where, "its axis has no direction")
        return x / length, y / length, z / length

    def _geometry(self, body: Element, where: str) -> LinkGeometry:
        shape = next(iter(body.findall("geometry/*")), None)
        if shape is None:
            raise self._wrong(where, f"a <{body.tag}> without geometry")
        mesh, excess_m = self._shape(shape, where)
        self._budget.take_triangles(len(mesh), where)
        return LinkGeometry(shape.tag, mesh.transformed(self._origin(body, where)), excess_m)

    def _shape(self, shape: Element, where: str) -> tuple[TriangleMesh, float]:
        match shape.tag:
            case "mesh":
                return self._mesh(shape, where), 0.0
            case "box":
                x, y, z = self._sizes(shape, "size", 3, where)
                return box_mesh((x, y, z)), 0.0
            case "cylinder":
                (radius_m,), (length_m,) = (self._sizes(shape, name, 1, where) for name in ("radius", "length"))
                return cylinder_mesh(radius_m, length_m)
            case "sphere":
                return sphere_mesh(self._sizes(shape, "radius", 1, where)[0])
        raise self._wrong(where, f"<{shape.tag[:40]}> is none of mesh, box, cylinder, sphere")

    def _mesh(self, shape: Element, where: str) -> TriangleMesh:
        name = resolve_reference(shape.get("filename", ""), self._description, self._files)
        if name not in self._meshes:
            data = self._files.read(name, self._budget)
            self._meshes[name] = decode_mesh(data, mesh_format_of(name), name, self._budget)
        scale = self._numbers(shape.get("scale", "1 1 1"), 3, where)
        if 0 in scale:
            raise self._wrong(where, f"a mesh scaled by {scale}")
        try:
            return self._meshes[name].scaled(scale)
        except ValueError as error:
            raise MeshFormatError(f"{name}: scaled by {scale}: {error}") from None

    def _origin(self, element: Element, where: str) -> npt.NDArray[np.float64]:
        """T of an element's <origin>: fixed-axis roll, pitch, yaw, then the translation."""
        origin = element.find("origin")
        T = np.eye(4)
        if origin is None:
            return T
        roll, pitch, yaw = self._numbers(origin.get("rpy", "0 0 0"), 3, where)
        cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
        T[:3, :3] = [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
        T[:3, 3] = self._numbers(origin.get("xyz", "0 0 0"), 3, where)
        return T

    def _name(self, element: Element) -> str:
        name = element.get("name", "")
        if not name or len(name) > MOST_NAME_CHARACTERS:
            raise RobotFormatError(f"{self._description}: a <{element.tag}> without a name, or with one too long")
        return name

    def _sizes(self, shape: Element, attribute: str, count: int, where: str) -> list[float]:
        values = self._numbers(shape.get(attribute, ""), count, where)
        if min(values) <= 0:
            raise self._wrong(where, f"a {shape.tag} of {attribute} {values}")
        return values

    def _numbers(self, text: str, count: int, where: str) -> list[float]:
        try:
            values = [float(word) for word in text.split()]
        except ValueError:
            values = []
        if len(values) != count or not all(abs(value) <= LARGEST_COORDINATE for value in values):
            raise self._wrong(where, f"{text[:80]!r} is not {count} finite numbers")
        return values

    def _wrong(self, where: str, what: str) -> RobotFormatError:
        return RobotFormatError(f"{self._description}: {where}: {what}")
