"""What collides with a map, by looking at every triangle and every voxel near it: no hierarchy, no octree descent."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import rayvox
from rayvox import _native

FloatArray = npt.NDArray[np.float64]
UNKNOWN, OCCUPIED = 0, 2  # MapSnapshot.states_at


class MapBruteForce:
    """Oracle of CollisionChecker's verdicts for one robot and map."""

    def __init__(self, map_snapshot: rayvox.MapSnapshot, robot: rayvox.Robot) -> None:
        self._map = map_snapshot
        self._r = map_snapshot.resolution_m
        self._links = [(i, link) for i, link in enumerate(robot.links) if link.geometries]
        self._trees = [_native.TriangleTree(link.mesh.vertices, link.mesh.triangles) for _, link in self._links]

    def verdict(self, T_map_links: FloatArray, margin_m: float) -> int:
        """CollisionVerdict, unknown space counting, with voxels grown by `margin_m` on all sides."""
        triangles, halves = self._placed(T_map_links, margin_m)
        cells, of_triangle = self._cells_around(triangles, halves)
        states = self._map.states_at((cells + 0.5) * self._r)
        inside, inside_states = self._cells_inside(T_map_links)
        for state, verdict in ((OCCUPIED, 1), (UNKNOWN, 2)):
            near = states == state
            if (inside & (inside_states == state)).any() or self._meets(
                triangles[of_triangle[near]], (cells[near] + 0.5) * self._r, halves[of_triangle[near]]
            ):
                return verdict
        return 0

    def _placed(self, T_map_links: FloatArray, margin_m: float) -> tuple[FloatArray, FloatArray]:
        triangles, halves = [], []
        for i, link in self._links:
            T = T_map_links[i]
            triangles.append((link.mesh.vertices @ T[:3, :3].T + T[:3, 3])[link.mesh.triangles])
            halves.append(np.full(len(link.mesh), 0.5 * self._r + link.padding_m + margin_m))
        return np.concatenate(triangles), np.concatenate(halves)

    def _cells_around(
        self, triangles: FloatArray, halves: FloatArray
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.intp]]:
        # Of each triangle the cells whose centres lie within the half edge of its box.
        reach = (halves / self._r - 0.5)[:, None] + 1e-6
        low = np.floor(triangles.min(axis=1) / self._r - reach).astype(np.int64)
        high = np.floor(triangles.max(axis=1) / self._r + reach).astype(np.int64)
        return _cells_of_boxes(low, high)

    def _cells_inside(self, T_map_links: FloatArray) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.uint8]]:
        inside, states = [], []
        for (i, link), tree in zip(self._links, self._trees, strict=True):
            T = T_map_links[i]
            vertices = link.mesh.vertices @ T[:3, :3].T + T[:3, 3]
            low = np.floor(vertices.min(axis=0) / self._r).astype(np.int64)[None]
            cells, _ = _cells_of_boxes(low, np.floor(vertices.max(axis=0) / self._r).astype(np.int64)[None])
            centres = (cells + 0.5) * self._r
            state = self._map.states_at(centres)
            centres, state = centres[state != 1], state[state != 1]
            inside.append(tree.inside(np.ascontiguousarray((centres - T[:3, 3]) @ T[:3, :3])))
            states.append(state)
        return np.concatenate(inside), np.concatenate(states)

    @staticmethod
    def _meets(triangles: FloatArray, centres: FloatArray, halves: FloatArray) -> bool:
        # Where a corner lies in a voxel, no axis need be asked.
        at = triangles - centres[:, None]
        if (np.abs(at).max(axis=2).min(axis=1) < halves).any():
            return True
        return any(
            _no_axis_separates(at[first : first + 20000], halves[first : first + 20000]).any()
            for first in range(0, len(at), 20000)
        )


def _cells_of_boxes(
    low: npt.NDArray[np.int64], high: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.intp]]:
    size = high - low + 1
    counts = size.prod(axis=1)
    box = np.repeat(np.arange(len(low)), counts)
    index = np.arange(len(box)) - np.repeat(np.cumsum(counts) - counts, counts)
    wide = size[box]
    steps = np.stack([index % wide[:, 0], index // wide[:, 0] % wide[:, 1], index // (wide[:, 0] * wide[:, 1])], axis=1)
    return low[box] + steps, box


def _no_axis_separates(triangles: FloatArray, halves: FloatArray) -> npt.NDArray[np.bool_]:
    """(n, 3, 3) triangles, each against the cube around the origin: Akenine-Moller's test (2001)."""
    edges = np.roll(triangles, -1, axis=1) - triangles
    normal = np.cross(edges[:, 0], edges[:, 1])[:, None]
    crossed = np.cross(edges[:, :, None], np.eye(3)).reshape(-1, 9, 3)
    axes = np.concatenate([np.broadcast_to(np.eye(3), (len(triangles), 3, 3)), normal, crossed], axis=1)
    along = np.einsum("nax,nkx->nak", axes, triangles)
    reach = np.abs(axes).sum(axis=2) * halves[:, None]
    return ~((along.min(axis=2) > reach) | (along.max(axis=2) < -reach)).any(axis=1)
