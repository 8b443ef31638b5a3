"""The questions that a map and each of its snapshots answer."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from rayvox import _native
from rayvox.arrays import as_points, as_points_f64, as_rigid, as_vector
from rayvox.embree_library import load_embree
from rayvox.errors import InvalidInputError
from rayvox.pinhole_camera import PinholeCamera
from rayvox.results import ChangeSet, MapStatistics, RayHits
from rayvox.sensor_model import SensorModel

Leaves = tuple[npt.NDArray[np.int64], npt.NDArray[np.uint8], npt.NDArray[np.float32]]
ExportFormat = Literal["bt", "ot", "ply"]
RayEngine = Literal["auto", "octree", "masks", "embree"]
RAY_ENGINES: tuple[RayEngine, ...] = ("auto", "octree", "masks", "embree")


class MapQueries(ABC):
    """Queries of an octree; each is answered by one revision, and may be asked from any thread."""

    sensor_model: SensorModel
    resolution_m: float  # edge of the finest voxels, metres
    depth: int  # number of octree levels below the root

    @abstractmethod
    def _revision_asked(self) -> _native.MapSnapshot:
        """The revision that answers."""

    @property
    def revision(self) -> int:
        """Number of edits that led here."""
        return self._revision_asked().revision

    @property
    def nbytes(self) -> int:
        """Bytes of the octree's nodes, those shared with other revisions included."""
        return self._revision_asked().nbytes

    def leaves(self) -> Leaves:
        """All leaves, pruned as OctoMap prunes, in octree order.

        Returns keys (n, 3) int64, the lowest finest-level cell of each leaf (cell k covers [k r, (k+1) r) metres);
        depth (n,) uint8, 0 = root, a leaf is 2**(map depth - depth) cells wide; log_odds (n,) float32.
        """
        return self._revision_asked().leaves()

    def leaves_in_box(self, lo: Sequence[float], hi: Sequence[float]) -> Leaves:
        """The leaves that touch the closed box [lo, hi] (metres), whole; arrays as leaves()."""
        return self._revision_asked().leaves_in_box(as_vector(lo, "lo"), as_vector(hi, "hi"))

    def log_odds_at(self, points: npt.ArrayLike, depth: int | None = None) -> npt.NDArray[np.float32]:
        """Log-odds at (n, 3) points (metres, map frame): (n,) float32, NaN where unknown or beyond the octree.

        depth: ask the node at this depth instead of the finest; an inner node's value is the maximum below it.
        """
        return self._revision_asked().log_odds_at(as_points(points, "points"), self._level(depth))

    def states_at(self, points: npt.ArrayLike, depth: int | None = None) -> npt.NDArray[np.uint8]:
        """As log_odds_at, as states: (n,) uint8, 0 unknown, 1 free, 2 occupied."""
        return self._revision_asked().states_at(as_points(points, "points"), self._level(depth))

    def box_states(self, lo: npt.ArrayLike, hi: npt.ArrayLike) -> npt.NDArray[np.uint8]:
        """States of n closed boxes [lo, hi], each (n, 3) metres: (n,) uint8.

        2 if any occupied voxel touches the box, else 0 if any part is unknown (or beyond the octree), else 1: wholly
        free.
        """
        low, high = as_points_f64(lo, "lo"), as_points_f64(hi, "hi")
        if low.shape != high.shape:
            raise InvalidInputError(f"lo has shape {low.shape}, hi {high.shape}")
        return self._revision_asked().box_states(low, high)

    def cast_rays(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        max_range_m: float | None = None,
        unknown: Literal["free", "occupied"] = "free",
        engine: RayEngine = "auto",
    ) -> RayHits:
        """The first occupied voxel along n rays; with unknown="occupied" also the first unknown one.

        origins (n, 3) or (3,) metres; directions (n, 3), any length. The origin's own voxel counts. max_range_m None:
        as far as the octree reaches. engine: "octree" strides through the octree's nodes; "masks" through bit masks of
        what stops rays; "embree" shoots through a scene of the occupied leaves, and passes unknown space. A snapshot
        keeps its masks and its scene from the first call that needs them (a map makes them anew in every call); "auto"
        takes masks that are there, or makes them for many rays. The answers are the same. Raises InvalidInputError
        naming the ray, OutOfRangeError for an origin beyond the octree, EngineUnavailableError.
        """
        if engine not in RAY_ENGINES:
            raise InvalidInputError(f"engine must be one of {', '.join(RAY_ENGINES)}, got {engine!r}")
        if unknown not in ("free", "occupied"):
            raise InvalidInputError(f"unknown must be 'free' or 'occupied', got {unknown!r}")
        towards = as_points_f64(directions, "directions")
        start = as_points_f64(origins, "origins")
        if len(start) == 1:
            start = np.ascontiguousarray(np.broadcast_to(start, towards.shape))
        if start.shape != towards.shape:
            raise InvalidInputError(f"origins has shape {start.shape}, directions {towards.shape}")
        reach = checked_range(max_range_m)
        if engine == "embree":
            load_embree()
        asked, how = self._revision_asked(), _native.RayEngine[engine]
        return RayHits(*asked.cast_rays(start, towards, reach, unknown == "occupied", how))

    def depth_image(
        self,
        camera: PinholeCamera,
        T_map_camera: npt.ArrayLike,
        max_range_m: float | None = None,
        unknown: Literal["free", "occupied"] = "free",
    ) -> npt.NDArray[np.float32]:
        """What a depth camera at T_map_camera (4, 4), z forward, would measure: (height, width) float32.

        Metres along the optical axis to where a pixel's ray enters an occupied voxel; 0 where it meets none within
        max_range_m (along the ray), or, with unknown="occupied", where unknown space comes first. Raises as cast_rays.
        """
        pose = as_rigid(T_map_camera, "T_map_camera")
        directions = camera.rays()
        lengths = np.linalg.norm(directions, axis=1)
        hits = self.cast_rays(pose[:3, 3], directions @ pose[:3, :3].T, max_range_m, unknown)
        depth = np.where(hits.hit == 1, hits.t_m / lengths, 0.0).astype(np.float32)
        return depth.reshape(camera.height, camera.width)

    def changes_since(self, revision: int) -> ChangeSet:
        """What a copy of this map at `revision` must replace to be up to date."""
        if revision < 0:
            raise InvalidInputError(f"revision must not be negative, got {revision}")
        asked = self._revision_asked()
        full, region_keys, region_depth, leaves = asked.changes(revision)
        return ChangeSet(revision, asked.revision, full, region_keys, region_depth, *leaves)

    def statistics(self) -> MapStatistics:
        """Leaf counts, volumes, bounds."""
        counts = self._revision_asked().statistics()
        low, high = counts.pop("low_cell"), counts.pop("high_cell")
        known = counts["nodes"] > 0
        r = self.resolution_m
        return MapStatistics(
            **counts,
            bounds_lo_m=(low[0] * r, low[1] * r, low[2] * r) if known else None,
            bounds_hi_m=((high[0] + 1) * r, (high[1] + 1) * r, (high[2] + 1) * r) if known else None,
        )

    def export_bytes(self, format: ExportFormat) -> bytes:
        """The map as an OctoMap .bt (occupied or free only) or .ot (with log-odds) file, or its occupied leaves as PLY.

        Raises InvalidInputError for an unknown format, and for bt and ot if the map's depth is not OctoMap's 16.
        """
        asked = self._revision_asked()
        writers = {"bt": asked.to_bt, "ot": asked.to_ot, "ply": asked.to_ply}
        if format not in writers:
            raise InvalidInputError(f"format must be one of bt, ot, ply, got {format!r}")
        return writers[format]()

    def to_bytes(self) -> bytes:
        """The octree's nodes with their exact log-odds, for OccupancyMap.from_bytes."""
        return self._revision_asked().to_nodes()

    def _level(self, depth: int | None) -> int:
        if depth is None:
            return 0
        if not 0 <= depth <= self.depth:
            raise InvalidInputError(f"depth must be from 0 to {self.depth}, got {depth}")
        return self.depth - depth


def checked_range(max_range_m: float | None) -> float:
    """A range for the kernel, where 0 stands for none. Raises InvalidInputError unless positive."""
    if max_range_m is None:
        return 0.0
    if not max_range_m > 0:
        raise InvalidInputError(f"max_range_m must be positive, got {max_range_m}")
    return float(max_range_m) if np.isfinite(max_range_m) else 0.0
