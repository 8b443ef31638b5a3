"""The truth of a simulated scene."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import numpy.typing as npt

from rayvox import _native
from rayvox.mesh_io import TriangleMesh
from rayvox.robot import Robot
from rayvox.simulation import Scene, Shape
from rayvox.tune.ground_truth import ROBOT_COLLIDES, ROBOT_FREE, ROBOT_UNDECIDED, FloatArray, thinned
from rayvox.tune.scan_input import PosedScan

SAMPLES = 4000
_RAYS_PER_SCAN = 6000


class SceneTruth:
    """GroundTruth of a scene, where noise-free rays in the scans' directions go.

    accuracy_m: how finely it is sampled.
    """

    def __init__(self, scene: Scene, scans: Sequence[PosedScan], accuracy_m: float, seed: int = 0) -> None:
        self._scene, self._accuracy_m = scene, accuracy_m
        rng = np.random.default_rng(seed)
        ends, inner = zip(*(self._see(scan, rng) for scan in scans), strict=True)
        self.seen_surface = thinned(np.concatenate(ends), accuracy_m, SAMPLES, rng)
        free = thinned(np.concatenate(inner), 2 * accuracy_m, SAMPLES, rng)
        self.seen_free = free[scene.signed_distance(free) > 0]

    def _see(self, scan: PosedScan, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
        """Where rays of the scan truly end, and a point inside each."""
        chosen = scan.points[rng.permutation(len(scan.points))[:_RAYS_PER_SCAN]].astype(np.float64)
        directions = chosen @ scan.T_map_sensor[:3, :3].T
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        origin = scan.T_map_sensor[:3, 3]
        reach = self._scene.cast_rays(origin, directions)
        met = np.isfinite(reach)
        reach, directions = reach[met, None], directions[met]
        return origin + reach * directions, origin + rng.uniform(0, reach) * directions

    def distance_m(self, points: FloatArray) -> FloatArray:
        return np.abs(self._scene.signed_distance(points))

    def holds_surface(self, centres: FloatArray, edge_m: float) -> npt.NDArray[np.bool_]:
        held: npt.NDArray[np.bool_] = self._scene.signed_distance(centres) <= 0.5 * np.sqrt(3.0) * edge_m
        return held

    @cached_property
    def _shape_spheres(self) -> FloatArray:
        """(shapes, 4): centre and radius."""
        return np.array([[*shape.center, shape.bounding_radius_m] for shape in self._scene.shapes])

    def robot_states(self, robot: Robot, configurations: FloatArray, T_map_base: FloatArray) -> npt.NDArray[np.uint8]:
        """Colliding where a point of a link's surface is in a solid, or a solid in a link; undecided where surfaces
        come closer than the points lie apart."""
        T_map_links = robot.link_poses(configurations, T_map_base)
        states = np.zeros(len(T_map_links), dtype=np.uint8)
        for index, link in enumerate(robot.links):
            if link.geometries:
                body = _LinkSurface(link.mesh, self._accuracy_m)
                for pose in np.flatnonzero(states != ROBOT_COLLIDES):
                    states[pose] = max(states[pose], self._body_state(body, T_map_links[pose, index]), key=_severity)
        return states

    def _body_state(self, body: _LinkSurface, T_map_link: FloatArray) -> int:
        shapes = self._shapes_near(body, T_map_link)
        if not shapes:
            return ROBOT_FREE
        surface = body.samples @ T_map_link[:3, :3].T + T_map_link[:3, 3]
        closest_m = min(float(shape.signed_distance(surface).min()) for shape in shapes)
        centres = (np.array([shape.center for shape in shapes]) - T_map_link[:3, 3]) @ T_map_link[:3, :3]
        if closest_m <= 0 or body.tree.inside(np.ascontiguousarray(centres)).any():
            return ROBOT_COLLIDES
        return ROBOT_FREE if closest_m > body.spacing_m else ROBOT_UNDECIDED

    def _shapes_near(self, body: _LinkSurface, T_map_link: FloatArray) -> list[Shape]:
        middle = T_map_link[:3, :3] @ body.middle + T_map_link[:3, 3]
        reach = body.radius_m + body.spacing_m
        spheres = self._shape_spheres
        near = np.flatnonzero(np.linalg.norm(spheres[:, :3] - middle, axis=1) <= spheres[:, 3] + reach)
        shapes = [self._scene.shapes[i] for i in near]
        return [shape for shape in shapes if float(shape.signed_distance(middle[None])[0]) <= reach]


class _LinkSurface:
    """Points on a link's surface; every point of the surface lies within spacing_m of one."""

    def __init__(self, mesh: TriangleMesh, spacing_m: float) -> None:
        self.spacing_m = spacing_m
        self.samples = surface_samples(mesh, spacing_m)
        self.tree = _native.TriangleTree(mesh.vertices, mesh.triangles)
        self.middle = (self.samples.min(axis=0) + self.samples.max(axis=0)) / 2
        self.radius_m = float(np.linalg.norm(self.samples - self.middle, axis=1).max()) + spacing_m


def surface_samples(mesh: TriangleMesh, spacing_m: float) -> FloatArray:
    """(n, 3) points of the surface, such that each of its points is within spacing_m of one.

    A lattice over each triangle of longest edge e, n = ceil(e / edge) to an edge: a point of a small triangle is within
    its longest edge over the root of 3 of a corner. What remains of the spacing is spent on merging neighbours.
    """
    edge_m = 1.2 * spacing_m
    corners = mesh.vertices[mesh.triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    steps = np.maximum(1, np.ceil(longest / edge_m)).astype(np.int64)
    rows = []
    for n in np.unique(steps):
        i, k = np.divmod(np.arange((n + 1) ** 2), n + 1)
        weights = np.stack([i, k, n - i - k], axis=1)[i + k <= n] / n
        rows.append(np.einsum("wc,tcx->twx", weights, corners[steps == n]).reshape(-1, 3))
    points: FloatArray = np.concatenate(rows)
    # Lattice: 1.2 / sqrt(3) = 0.69 of the spacing; one point per cell of 0.17: its diagonal is 0.29.
    _, kept = np.unique(np.floor(points / (0.17 * spacing_m)).astype(np.int64), axis=0, return_index=True)
    return points[np.sort(kept)]


def _severity(state: int) -> int:
    return (ROBOT_FREE, ROBOT_UNDECIDED, ROBOT_COLLIDES).index(state)
