"""Forms in which a map is stored and sent: their size, and what a map loses that is read back from them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rayvox import _native
from rayvox.map_snapshot import MapSnapshot
from rayvox.occupancy_map import OccupancyMap
from rayvox.sensor_model import SensorModel
from rayvox.tune.candidate import MapSettings
from rayvox.tune.map_run import build_map
from rayvox.tune.scan_input import Part

_LEVELS = 255
_OT_NODE = np.dtype([("log_odds", "<f4"), ("children", "u1")])


@dataclass(frozen=True, slots=True)
class StorageFigures:
    """bytes_per_map: of the map halfway through the scans.

    changed_states: share of the volume of the map after all scans whose state is another if the map was stored and read
    back halfway. log_odds_error: largest difference of log-odds.
    """

    bytes_per_map: float
    changed_states: float
    log_odds_error: float


@dataclass(frozen=True)
class StorageForm:
    """write: its bytes, and the map that is read back from them."""

    name: str
    write: Callable[[OccupancyMap], tuple[int, OccupancyMap]]


def measure_storage(part: Part, settings: MapSettings, form: StorageForm) -> StorageFigures:
    """Stores halfway, goes on with what was read back, and compares with what never was stored."""
    half = (len(part.scans) + 1) // 2
    stored_bytes, restored = form.write(build_map(part.scans[:half], settings).occupancy_map)
    through_storage = build_map(part.scans[half:], settings, restored).occupancy_map.snapshot()
    direct = build_map(part.scans, settings).occupancy_map.snapshot()
    changed, error = _difference(direct, through_storage)
    return StorageFigures(stored_bytes, changed, error)


def _difference(direct: MapSnapshot, other: MapSnapshot) -> tuple[float, float]:
    """Over the leaves of the direct map, by volume; a leaf is asked at its centre."""
    keys, depth, log_odds = direct.leaves()
    wide = np.ldexp(1.0, direct.depth - depth.astype(np.int64))
    centres = (keys + 0.5 * wide[:, None]) * direct.resolution_m
    theirs = other.log_odds_at(centres)
    threshold = direct.sensor_model.native.occupied_log_odds
    changed = np.isnan(theirs) | ((theirs >= threshold) != (log_odds >= threshold))
    return float((changed * wide**3).sum() / (wide**3).sum()), float(np.nanmax(np.abs(theirs - log_odds)))


def _as_nodes(octree: OccupancyMap) -> tuple[int, OccupancyMap]:
    data = octree.to_bytes()
    return len(data), OccupancyMap.from_bytes(data, octree.resolution_m, octree.depth, octree.sensor_model)


def _as_ot(octree: OccupancyMap) -> tuple[int, OccupancyMap]:
    data = octree.export_bytes("ot")
    return len(data), _read(data, octree.sensor_model)


def _as_bt(octree: OccupancyMap) -> tuple[int, OccupancyMap]:
    data = octree.export_bytes("bt")
    return len(data), _read(data, octree.sensor_model)


def _as_eight_bits(octree: OccupancyMap) -> tuple[int, OccupancyMap]:
    """An .ot file whose float32 log-odds would be one byte each: every node's value is moved to the nearest of 255
    levels between the clamping bounds. Moving keeps the order, so that an inner node stays its children's maximum."""
    data = octree.export_bytes("ot")
    start = data.index(b"data\n") + len(b"data\n")
    nodes = np.frombuffer(data, _OT_NODE, offset=start).copy()
    nodes["log_odds"] = eight_bit_log_odds(nodes["log_odds"], octree.sensor_model)
    return start + 2 * len(nodes), _read(data[:start] + nodes.tobytes(), octree.sensor_model)


def eight_bit_log_odds(log_odds: npt.NDArray[np.float32], model: SensorModel) -> npt.NDArray[np.float32]:
    """The nearest of 255 levels from the lower to the upper clamping bound."""
    low, high = model.native.clamp_min_log_odds, model.native.clamp_max_log_odds
    step = (high - low) / (_LEVELS - 1)
    return np.clip(low + np.round((log_odds - low) / step) * step, low, high).astype(np.float32)


def _read(data: bytes, model: SensorModel) -> OccupancyMap:
    return OccupancyMap._from_native(_native.read_octomap(data, model.native), model)


STORAGE_FORMS = (
    StorageForm("nodes, float32 (snapshots of the service)", _as_nodes),
    StorageForm(".ot, float32", _as_ot),
    StorageForm(".ot with 8-bit log-odds", _as_eight_bits),
    StorageForm(".bt, free or occupied only", _as_bt),
)
