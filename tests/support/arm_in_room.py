"""The arm of `robots.arm_archive` in a room of scattered voxels: what questions are asked about over a socket."""

from __future__ import annotations

import numpy as np
import rayvox

from tests.support.robots import arm_archive

ARM = rayvox.Robot.from_archive(arm_archive())
ROOM_POINTS = np.random.default_rng(0).normal(0, 1, (400, 3))
ROOM_RESOLUTION_M = 0.1


def room_snapshot() -> rayvox.MapSnapshot:
    """What the service's map of the room is."""
    room = rayvox.OccupancyMap(ROOM_RESOLUTION_M)
    room.insert_scan(ROOM_POINTS)
    return room.snapshot()
