"""A robot: rigid links on joints, with the geometry that collides."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np
import numpy.typing as npt

from rayvox import _native
from rayvox.arrays import as_pose
from rayvox.errors import InvalidInputError, RobotFormatError
from rayvox.mesh_io import LoadBudget, LoadLimits, TriangleMesh, decode_mesh, mesh_format_of
from rayvox.robot.allowed_collisions import AllowedCollisions
from rayvox.robot.configurations import as_configurations, as_poses
from rayvox.robot.file_source import FileSource, FolderSource, ZipSource
from rayvox.robot.joint import Joint, JointMotion
from rayvox.robot.link import Link, LinkGeometry
from rayvox.robot.link_tree import LinkTree
from rayvox.robot.urdf import GeometryKind, RobotDescription, parse_urdf

FloatArray = npt.NDArray[np.float64]
# Says for (n, j) configurations whether each of (k, 2) pairs of links touches: (n, k) bool.
TouchTest = Callable[["Robot", FloatArray, npt.NDArray[np.intp]], npt.NDArray[np.bool_]]

UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
BODY = "body"  # the link of a robot that is one mesh
# A continuous joint is sampled over one turn, and so is what has no limits.
_SAMPLED_TURN = np.pi
_SAMPLES_AT_LOAD = 200
_PAIRS_AT_ONCE = 32


class Robot:
    """Immutable; the methods `with_...` give a changed one.

    links: parents before their children; link i of poses and bounds is links[i]. joint_names: joints with a value of
    their own, in the order of the description: column i of a configuration is joint_names[i]. Joints that mimic
    another have no column. limits: (2, j) float64, lower and upper, radians or metres. allowed_collisions: pairs that
    may touch, at first those that one joint joins or that are rigidly connected; of a robot that was loaded also those
    that touch wherever its joints stand.
    """

    def __init__(
        self,
        name: str,
        links: Sequence[Link],
        joints: Sequence[Joint],
        allowed_collisions: AllowedCollisions | None = None,
    ) -> None:
        """Raises RobotFormatError where links and joints form no tree."""
        self.name = name
        self._tree = LinkTree(links, joints, f"robot {name}")
        self._native = self._tree.native()
        self.links = self._tree.links
        self.joints = self._tree.joints
        self.link_names = tuple(link.name for link in self.links)
        self.joint_names = tuple(joint.name for joint in self._tree.value_joints)
        self.limits = np.array([[j.lower, j.upper] for j in self._tree.value_joints]).reshape(-1, 2).T.copy()
        self.limits.flags.writeable = False
        if allowed_collisions is None:
            allowed_collisions = AllowedCollisions(self.link_names, self._tree.adjacent())
        self.allowed_collisions = allowed_collisions.with_links(self.link_names)

    @classmethod
    def from_mesh(
        cls, path: str | os.PathLike[str], scale: float = 1.0, unit: str = "m", limits: LoadLimits | None = None
    ) -> Self:
        """A rigid robot from an STL, OBJ, PLY, OFF, DAE or GLB file whose numbers are in `unit` (m, cm, mm, in, ft).

        DAE and GLB are in metres already. Raises MeshFormatError, LoadLimitError, InvalidInputError, OSError.
        """
        path = Path(path)
        if unit not in UNITS_M:
            raise InvalidInputError(f"unit {unit!r} is none of {', '.join(UNITS_M)}")
        file_format = mesh_format_of(path.name)
        return cls.from_mesh_bytes(path.read_bytes(), file_format, path.stem, scale * UNITS_M[unit], limits)

    @classmethod
    def from_mesh_bytes(
        cls, data: bytes, file_format: str, name: str = BODY, scale: float = 1.0, limits: LoadLimits | None = None
    ) -> Self:
        """As from_mesh, from a file's bytes. Raises MeshFormatError, LoadLimitError, InvalidInputError."""
        if not 0 < scale < np.inf:
            raise InvalidInputError(f"scale = {scale!r} is not a finite number above zero")
        mesh = decode_mesh(data, file_format, name, limits)
        return cls(name, [Link(BODY, (LinkGeometry("mesh", mesh.scaled(scale)),))], [])

    @classmethod
    def from_urdf(
        cls,
        path: str | os.PathLike[str],
        root: str | os.PathLike[str] | None = None,
        geometry: GeometryKind = "collision",
        limits: LoadLimits | None = None,
    ) -> Self:
        """A robot from a URDF file and the meshes it names, none of which may lie outside of the folder `root`.

        root: by default the ROS package that the file is in (the nearest folder with a package.xml), else its folder.
        geometry: "visual" takes the visual geometry for collisions, for descriptions without collision geometry.
        Raises RobotFormatError, MeshFormatError, LoadLimitError, OSError.
        """
        path = Path(path).resolve()
        folder = Path(root).resolve() if root is not None else _package_of(path)
        if not path.is_relative_to(folder):
            raise RobotFormatError(f"{path} does not lie in {folder}")
        return cls._load(FolderSource(folder), path.relative_to(folder).as_posix(), geometry, limits)

    @classmethod
    def from_archive(
        cls,
        data: bytes,
        description: str | None = None,
        geometry: GeometryKind = "collision",
        limits: LoadLimits | None = None,
    ) -> Self:
        """A robot from a zip file that holds a URDF and its meshes. Nothing is unpacked to disk.

        description: the URDF's name in the archive, needed where there are several.
        Raises RobotFormatError, MeshFormatError, LoadLimitError.
        """
        files = ZipSource(data)
        found = [name for name in files.names() if name.lower().endswith(".urdf") and "__MACOSX" not in name]
        if description is None and len(found) == 1:
            description = found[0]
        if description is None or not files.has(description):
            xacro = any(name.endswith(".xacro") for name in files.names())
            hint = "; xacro is not supported, expand it first" if xacro else ""
            names = ", ".join(name[:80] for name in found[:5]) or "none"
            raise RobotFormatError(f"archive: one URDF is needed, or the name of one; found {names}{hint}")
        return cls._load(files, description, geometry, limits)

    @classmethod
    def _load(cls, files: FileSource, description: str, geometry: GeometryKind, limits: LoadLimits | None) -> Self:
        budget = LoadBudget(limits or LoadLimits())
        parsed: RobotDescription = parse_urdf(files.read(description, budget), description, files, geometry, budget)
        robot = cls(parsed.name, parsed.links, parsed.joints)
        if not any(link.geometries for link in robot.links):
            raise RobotFormatError(f"{description}: no link has {geometry} geometry")
        touching = robot.with_always_touching_allowed(_touches_within(budget, description), _SAMPLES_AT_LOAD)
        return cls(robot.name, robot.links, robot.joints, touching.allowed_collisions)

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, {len(self.links)} links, {len(self.joint_names)} joints)"

    @property
    def triangle_count(self) -> int:
        return sum(len(geometry.mesh) for link in self.links for geometry in link.geometries)

    def link_index(self, name: str) -> int:
        """Raises InvalidInputError where there is no such link."""
        if name not in self._tree.index_of:
            raise InvalidInputError(f"there is no link {name!r}")
        return self._tree.index_of[name]

    def configuration(self, values: Mapping[str, float] | None = None) -> FloatArray:
        """(j,) of joint values by name; joints not named stand at 0, or at the limit nearest to it."""
        configuration: FloatArray = np.clip(np.zeros(len(self.joint_names)), *self.limits)
        for name, value in (values or {}).items():
            if name not in self.joint_names:
                raise InvalidInputError(f"there is no joint {name!r} with a value of its own")
            configuration[self.joint_names.index(name)] = value
        return configuration

    def sample_configurations(self, count: int, rng: np.random.Generator) -> FloatArray:
        """(count, j) uniformly within the limits; from -pi to pi where there are none."""
        lower = np.where(np.isfinite(self.limits[0]), self.limits[0], -_SAMPLED_TURN)
        upper = np.where(np.isfinite(self.limits[1]), self.limits[1], _SAMPLED_TURN)
        return rng.uniform(lower, upper, (count, len(self.joint_names)))

    def link_poses(
        self, configurations: npt.ArrayLike | None = None, T_map_base: npt.ArrayLike | None = None
    ) -> FloatArray:
        """T_map_link of every link, (n, links, 4, 4) float64.

        configurations: (n, j) or (j,), radians and metres; None for a robot without joints. T_map_base: (n, 4, 4) or
        (4, 4); None for identity. One configuration or base goes with any number of the other. Values beyond the
        limits are taken as they are. Raises InvalidInputError.
        """
        T = as_poses(T_map_base, "T_map_base")
        q = as_configurations(configurations, len(self.joint_names), len(T))
        return self._native.link_poses(q, T)

    def motion_bounds(
        self,
        q_from: npt.ArrayLike | None,
        q_to: npt.ArrayLike | None,
        T_map_base_from: npt.ArrayLike | None = None,
        T_map_base_to: npt.ArrayLike | None = None,
    ) -> FloatArray:
        """How long a path the points of each link may take, padding included: (n, links) float64, metres.

        Over a motion in which joints and base position change linearly, and the base's rotation at constant speed
        about one axis, any point of a link moves by at most |t - s| times this between parameters s and t in 0 to 1.
        Shapes as for link_poses; without T_map_base_to the base rests. Raises InvalidInputError.
        """
        T_from = as_poses(T_map_base_from, "T_map_base_from")
        T_to = as_poses(T_map_base_to, "T_map_base_to") if T_map_base_to is not None else T_from
        count = max(len(T_from), len(T_to))
        q0, q1 = (as_configurations(q, len(self.joint_names), count) for q in (q_from, q_to))
        count = max(len(q0), len(q1))
        q0, q1 = (np.ascontiguousarray(np.broadcast_to(q, (count, q.shape[1]))) for q in (q0, q1))
        bases = max(len(T_from), len(T_to))
        T_from, T_to = (np.ascontiguousarray(np.broadcast_to(T, (bases, 4, 4))) for T in (T_from, T_to))
        return self._native.motion_bounds(self.padded_capsules(), q0, q1, T_from, T_to)

    def padded_capsules(self) -> FloatArray:
        """(links, 7): per link the ends and the radius of a capsule around its padded mesh; radius -1 without one."""
        capsules = np.array([link.capsule for link in self.links])
        capsules[:, 6] += [link.padding_m if link.geometries else 0.0 for link in self.links]
        return capsules

    def paddings_m(self, more_m: float | Mapping[str, float] = 0.0) -> list[float]:
        """Padding of each link, with so much more on all of them, or on the named ones. Raises InvalidInputError."""
        wanted = self._by_link(more_m)
        return [link.padding_m + wanted.get(link.name, 0.0) for link in self.links]

    def _by_link(self, padding_m: float | Mapping[str, float]) -> dict[str, float]:
        wanted = dict(padding_m) if isinstance(padding_m, Mapping) else dict.fromkeys(self.link_names, padding_m)
        for name, value in wanted.items():
            self.link_index(name)
            if not 0 <= value < np.inf:
                raise InvalidInputError(f"padding of {name}: {value!r} is not a finite number of at least zero")
        return wanted

    def with_padding(self, padding_m: float | Mapping[str, float]) -> Robot:
        """All links, or the named ones, grown by so many metres in queries. Raises InvalidInputError."""
        wanted = self._by_link(padding_m)
        links = [Link(k.name, k.geometries, float(wanted.get(k.name, k.padding_m))) for k in self.links]
        return Robot(self.name, links, self.joints, self.allowed_collisions)

    def with_attached(
        self,
        name: str,
        mesh: TriangleMesh,
        link: str,
        T_link_object: npt.ArrayLike | None = None,
        touch_links: Sequence[str] = (),
        padding_m: float = 0.0,
    ) -> Robot:
        """With an object, as a grasped box, fastened to a link; it is a link of its own, the last, on a fixed joint.

        It may touch the link that it is fastened to and `touch_links`. Raises InvalidInputError.
        """
        if name in self.link_names:
            raise InvalidInputError(f"there is a link {name!r} already")
        self.link_index(link)
        pose = as_pose(T_link_object, "T_link_object")
        joint = Joint(f"{name}/attached", JointMotion.FIXED, link, name, np.eye(4) if pose is None else pose)
        links = [*self.links, Link(name, (LinkGeometry("mesh", mesh),), padding_m)]
        allowed = self.allowed_collisions.with_links([*self.link_names, name])
        allowed = allowed.with_allowed([(name, link), *((name, touched) for touched in touch_links)])
        return Robot(self.name, links, [*self.joints, joint], allowed)

    def without_attached(self, name: str) -> Robot:
        """Without an object that with_attached fastened. Raises InvalidInputError."""
        joints = [joint for joint in self.joints if joint.name != f"{name}/attached"]
        if len(joints) == len(self.joints):
            raise InvalidInputError(f"no object {name!r} is attached")
        links = [link for link in self.links if link.name != name]
        return Robot(self.name, links, joints, self.allowed_collisions)

    def with_allowed_collisions(self, allowed: AllowedCollisions) -> Robot:
        """With another allowed-collision matrix."""
        return Robot(self.name, self.links, self.joints, allowed)

    def self_collision_pairs(self) -> npt.NDArray[np.intp]:
        """(k, 2) indices of links with geometry that must not touch each other."""
        solid = np.array([bool(link.geometries) for link in self.links])
        return np.argwhere(np.triu(~self.allowed_collisions.matrix & solid[:, None] & solid[None, :]))

    @cached_property
    def self_collision(self) -> _native.SelfCollision:
        """The query for touching links that the allowed-collision matrix does not allow, made when first asked for."""
        links = [link.bvh.native if link.bvh is not None else None for link in self.links]
        return _native.SelfCollision(links, np.ascontiguousarray(self.self_collision_pairs(), dtype=np.int64))

    def with_always_touching_allowed(
        self, touches: TouchTest, samples: int = 1000, share: float = 0.95, seed: int = 0
    ) -> Robot:
        """Pairs that touch in at least `share` of random configurations within the limits are allowed to.

        Their meshes overlap wherever the joints stand: a fault of the model, not a collision.
        """
        configurations = self.sample_configurations(samples, np.random.default_rng(seed))
        pairs = self.self_collision_pairs()
        always = pairs[touches(self, configurations, pairs).mean(axis=0) >= share]
        names = [(self.link_names[i], self.link_names[j]) for i, j in always]
        return self.with_allowed_collisions(self.allowed_collisions.with_allowed(names))


def _touches_within(budget: LoadBudget, source: str) -> TouchTest:
    # Imported late: collisions of robots stand above robots.
    from rayvox.self_collision import links_touch

    def touches(robot: Robot, configurations: FloatArray, pairs: npt.NDArray[np.intp]) -> npt.NDArray[np.bool_]:
        found = np.zeros((len(configurations), len(pairs)), dtype=bool)
        for begin in range(0, len(pairs), _PAIRS_AT_ONCE):
            budget.check_time(source)
            part = slice(begin, begin + _PAIRS_AT_ONCE)
            found[:, part] = links_touch(robot, configurations, pairs[part])
        return found

    return touches


def _package_of(path: Path) -> Path:
    return next((folder for folder in path.parents if (folder / "package.xml").is_file()), path.parent)
