"""Whole robots as one triangle mesh at a wanted number of triangles, from URDFs with STL and DAE meshes.

Joints are at zero. More triangles than the robot has: the longest edges are split until there are enough, so the shape
stays; fewer: quadric decimation (Open3D).
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Vertices = NDArray[np.float64]
Triangles = NDArray[np.int64]


@dataclass(frozen=True)
class Mesh:
    """vertices (n,3) float64 metres, triangles (m,3) int64."""

    name: str
    vertices: Vertices
    triangles: Triangles


def _origin(element: ElementTree.Element | None) -> NDArray[np.float64]:
    pose = np.eye(4)
    if element is None:
        return pose
    roll, pitch, yaw = (float(v) for v in element.get("rpy", "0 0 0").split())
    cr, sr, cp, sp, cy, sy = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch), np.cos(yaw), np.sin(yaw)
    pose[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    pose[:3, 3] = [float(v) for v in element.get("xyz", "0 0 0").split()]
    return pose


def _link_poses(robot: ElementTree.Element) -> dict[str, NDArray[np.float64]]:
    joints = [
        (j.find("parent").get("link"), j.find("child").get("link"), _origin(j.find("origin")))  # type: ignore[union-attr]
        for j in robot.findall("joint")
    ]
    children = {child for _, child, _ in joints}
    poses = {link.get("name", ""): np.eye(4) for link in robot.findall("link") if link.get("name") not in children}
    while len(poses) < len(robot.findall("link")):
        for parent, child, pose in joints:
            if parent in poses and child not in poses:
                poses[str(child)] = poses[str(parent)] @ pose
    return poses


def _load(path: Path) -> tuple[Vertices, Triangles]:
    import trimesh

    scene = trimesh.load(path, force="scene")
    mesh = scene.to_geometry() if hasattr(scene, "to_geometry") else scene.dump(concatenate=True)
    return np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)


def load_robot(folder: Path, kind: str = "visual") -> Mesh:
    """All mesh geometry of a robot at its zero configuration."""
    robot = ElementTree.parse(folder / "robot.urdf").getroot()
    poses = _link_poses(robot)
    vertices, triangles, count = [], [], 0
    for link in robot.findall("link"):
        for part in link.findall(kind):
            element = part.find("geometry/mesh")
            if element is None:
                continue
            v, t = _load(folder / element.get("filename", ""))
            v = v * [float(s) for s in element.get("scale", "1 1 1").split()]
            pose = poses[link.get("name", "")] @ _origin(part.find("origin"))
            vertices.append(v @ pose[:3, :3].T + pose[:3, 3])
            triangles.append(t + count)
            count += len(v)
    return Mesh(folder.name, np.concatenate(vertices), np.concatenate(triangles))


def resized(mesh: Mesh, count: int) -> Mesh:
    """The mesh with about `count` triangles."""
    vertices, triangles = mesh.vertices, mesh.triangles
    if len(triangles) > count:
        vertices, triangles = _decimated(vertices, triangles, count)
    while len(triangles) < count:
        vertices, triangles = _longest_edges_split(vertices, triangles, count - len(triangles))
    return Mesh(mesh.name, np.ascontiguousarray(vertices), np.ascontiguousarray(triangles))


def _decimated(vertices: Vertices, triangles: Triangles, count: int) -> tuple[Vertices, Triangles]:
    import open3d

    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(vertices), open3d.utility.Vector3iVector(triangles.astype(np.int32))
    )
    mesh = mesh.merge_close_vertices(1e-9).simplify_quadric_decimation(count)
    return np.asarray(mesh.vertices), np.asarray(mesh.triangles, dtype=np.int64)


def _longest_edges_split(vertices: Vertices, triangles: Triangles, wanted: int) -> tuple[Vertices, Triangles]:
    """Each triangle among the `wanted` with the longest edges is halved at its longest edge's middle."""
    corners = vertices[triangles]
    lengths = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)
    longest = lengths.argmax(axis=1)
    chosen = np.argsort(-lengths.max(axis=1), kind="stable")[:wanted]
    rows = np.arange(len(chosen))
    a, b, c = (triangles[chosen][rows, (longest[chosen] + i) % 3] for i in range(3))
    middle = (vertices[a] + vertices[b]) / 2
    m = len(vertices) + rows
    kept = triangles.copy()
    kept[chosen] = np.stack([a, m, c], axis=1)
    return np.concatenate([vertices, middle]), np.concatenate([kept, np.stack([m, b, c], axis=1)])
