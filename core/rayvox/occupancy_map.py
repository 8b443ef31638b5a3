"""The map that scans are inserted into."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy.typing as npt

from rayvox import _native
from rayvox.arrays import as_points, as_points_f64, as_pose, as_vector
from rayvox.embree_library import load_embree
from rayvox.errors import InvalidInputError
from rayvox.map_queries import ExportFormat, MapQueries, checked_range
from rayvox.map_snapshot import MapSnapshot
from rayvox.results import ScanResult, ScanStatistics
from rayvox.sensor_model import SensorModel

Engine = Literal["auto", "dda", "embree", "beam"]
ENGINES: tuple[Engine, ...] = ("auto", "dda", "embree", "beam")


class PreparedScan:
    """A scan that was validated and transformed for one map, ready to be inserted."""

    def __init__(self, native: _native.PreparedScan) -> None:
        self.native = native

    @property
    def ray_count(self) -> int:
        """Rays, those without return included."""
        return self.native.ray_count

    @property
    def nbytes(self) -> int:
        """Bytes held."""
        return self.native.nbytes


class OccupancyMap(MapQueries):
    """A probabilistic occupancy octree that equals OctoMap's for the same scans.

    resolution_m: edge of the finest voxels. depth: levels below the root, 4 to 21; coordinates reach to
    +-resolution_m * 2**(depth - 1) metres. Edits are serialised, queries run on snapshots: all methods may be called
    from any thread.
    """

    def __init__(self, resolution_m: float, depth: int = 16, sensor_model: SensorModel | None = None) -> None:
        self.sensor_model = sensor_model or SensorModel()
        self._native = _native.OccupancyMap(resolution_m, depth, self.sensor_model.native)
        self.resolution_m = resolution_m
        self.depth = depth

    @classmethod
    def _from_native(cls, snapshot: _native.MapSnapshot, sensor_model: SensorModel) -> OccupancyMap:
        made = cls.__new__(cls)
        made.sensor_model = sensor_model
        made._native = _native.OccupancyMap(snapshot)
        made.resolution_m = snapshot.resolution_m
        made.depth = snapshot.depth
        return made

    @classmethod
    def load(cls, path: str | os.PathLike[str], sensor_model: SensorModel | None = None) -> OccupancyMap:
        """A map from an OctoMap .bt or .ot file (told apart by content). Raises MapFormatError, OSError."""
        model = sensor_model or SensorModel()
        return cls._from_native(_native.read_octomap(Path(path).read_bytes(), model.native), model)

    @classmethod
    def from_bytes(
        cls,
        data: bytes,
        resolution_m: float,
        depth: int = 16,
        sensor_model: SensorModel | None = None,
        revision: int = 0,
    ) -> OccupancyMap:
        """The map whose snapshot gave `data` with to_bytes(). Raises MapFormatError."""
        model = sensor_model or SensorModel()
        return cls._from_native(_native.read_nodes(data, resolution_m, depth, model.native, revision), model)

    def _revision_asked(self) -> _native.MapSnapshot:
        return self._native.snapshot()

    def prepare_scan(
        self,
        points: npt.ArrayLike,
        T_map_sensor: npt.ArrayLike | None = None,
        origin: Sequence[float] = (0.0, 0.0, 0.0),
        max_range_m: float | None = None,
        no_return: npt.ArrayLike | None = None,
        discretize: bool = False,
    ) -> PreparedScan:
        """Validates and transforms a scan (arguments as insert_scan) without touching the map; for any thread."""
        return PreparedScan(
            self._native.prepare(
                as_points(points, "points"),
                as_pose(T_map_sensor, "T_map_sensor"),
                as_vector(origin, "origin"),
                checked_range(max_range_m),
                None if no_return is None else as_points_f64(no_return, "no_return"),
                discretize,
            )
        )

    def insert_prepared(self, scan: PreparedScan, engine: Engine = "auto") -> ScanResult:
        """Inserts a scan made by prepare_scan of a map with the same resolution and depth."""
        if engine not in ENGINES:
            raise InvalidInputError(f"engine must be one of {', '.join(ENGINES)}, got {engine!r}")
        if engine == "embree":
            load_embree()
        revision, statistics = self._native.insert(scan.native, _native.Engine[engine])
        names = [name for name in ScanStatistics.__dataclass_fields__ if name != "engine"]
        return ScanResult(
            revision, ScanStatistics(statistics.engine.name, **{name: getattr(statistics, name) for name in names})
        )

    def insert_scan(
        self,
        points: npt.ArrayLike,
        T_map_sensor: npt.ArrayLike | None = None,
        origin: Sequence[float] = (0.0, 0.0, 0.0),
        max_range_m: float | None = None,
        no_return: npt.ArrayLike | None = None,
        engine: Engine = "auto",
        discretize: bool = False,
    ) -> ScanResult:
        """Inserts one scan: voxels that rays pass become freer, those that hold an end point more occupied.

        points: (n, 3) float32 or float64, metres, sensor frame: where rays ended.
        T_map_sensor: (4, 4) rigid, map = T @ sensor; None is the identity.
        origin: where the beams start, sensor frame, metres.
        max_range_m: longer rays are cut there and mark no end point.
        no_return: (k, 3), direction times range of rays that met nothing; they only clear.
        discretize: one ray per end-point voxel, as OctoMap's option of that name (faster, but another map).
        Occupied wins over free within a scan.

        Raises InvalidInputError (empty, NaN, wrong shape, pose not rigid) or OutOfRangeError, naming index and value;
        the map is then unchanged.
        """
        return self.insert_prepared(
            self.prepare_scan(points, T_map_sensor, origin, max_range_m, no_return, discretize), engine
        )

    def clear_box(self, lo: Sequence[float], hi: Sequence[float]) -> int:
        """Makes every voxel that touches the closed box [lo, hi] (metres) unknown; returns the new revision."""
        return self._native.clear_box(as_vector(lo, "lo"), as_vector(hi, "hi"))

    def prune(self) -> int:
        """The revision. The octree is always pruned; the method is there for those who come from OctoMap."""
        return self.revision

    def snapshot(self) -> MapSnapshot:
        """The map as it is now, immutable."""
        return MapSnapshot(self._native.snapshot(), self.sensor_model)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes .bt, .ot or .ply, by the path's suffix (see export_bytes), whole or not at all."""
        target = Path(path)
        suffix: ExportFormat = target.suffix.removeprefix(".")  # type: ignore[assignment]  # checked by export_bytes
        data = self.export_bytes(suffix)
        partial = target.with_name(f".{target.name}.{os.getpid()}.part")
        try:
            partial.write_bytes(data)
            partial.replace(target)
        finally:
            partial.unlink(missing_ok=True)
