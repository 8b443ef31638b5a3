"""rayvox's maps in the form that the oracles and peers use."""

from __future__ import annotations

import numpy as np
import rayvox
from rayvox.occupancy_map import Engine

from tests.support.equality_inputs import MapScan
from tests.support.occupancy_oracle import Leaves


def leaves_of(occupancy_map: rayvox.OccupancyMap) -> Leaves:
    """All leaves, sorted by key."""
    keys, depth, log_odds = occupancy_map.leaves()
    return Leaves(keys, depth, log_odds, occupancy_map.depth).sorted()


def insert_map_scan(
    occupancy_map: rayvox.OccupancyMap, scan: MapScan, max_range_m: float | None = None, engine: Engine = "auto"
) -> None:
    """A scan whose rays are already in the map frame."""
    occupancy_map.insert_scan(
        scan.points,
        origin=tuple(scan.origin.tolist()),
        max_range_m=max_range_m,
        # The map wants them relative to the beam origin; float32 coordinates subtract exactly in float64.
        no_return=scan.no_return.astype(np.float64) - scan.origin if len(scan.no_return) else None,
        engine=engine,
    )
