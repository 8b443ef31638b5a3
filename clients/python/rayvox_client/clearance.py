"""Answers about distances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rayvox_client.errors import MalformedAnswerError
from rayvox_client.frame import Frame


@dataclass(frozen=True, eq=False, repr=False)
class Clearance:
    """How far a robot is from the nearest voxel that counts, n poses, all on one revision of the map.

    What says where the distance was taken is NaN (link: -1) for poses that collide and those that were cut off.

    Attributes:
        verdicts: (n,) uint8, as in `CollisionCheck`.
        clearance_m: (n,) float64, never more than the true distance, 0 where the pose collides, the bound where nothing
            is nearer.
        is_lower_bound: (n,) bool, the distance was cut off at the bound.
        direction: (n,3) float64 unit vectors from the robot to the voxel, map frame.
        link: (n,) int32 index in `RobotInfo.links` of the nearest link.
        point_m: (n,3) float64, its nearest point, map frame, without padding.
        voxel_centre_m: (n,3) float64 centre of the nearest voxel; NaN too where that is the octree's border.
        voxel_size_m: (n,) float64 edge of the voxel; NaN as its centre.
        revision: the map's revision that was asked.
    """

    verdicts: NDArray[np.uint8]
    clearance_m: NDArray[np.float64]
    is_lower_bound: NDArray[np.bool_]
    direction: NDArray[np.float64]
    link: NDArray[np.int32]
    point_m: NDArray[np.float64]
    voxel_centre_m: NDArray[np.float64]
    voxel_size_m: NDArray[np.float64]
    revision: int

    @classmethod
    def from_frame(cls, frame: Frame, count: int) -> Clearance:
        """Read a `verdicts` frame with clearances that answers `count` poses."""
        frame.expect("verdicts")
        columns = (
            frame.array("verdicts", "|u1"),
            frame.array("clearance_m", "<f8"),
            frame.array("clearance_is_lower_bound", "|u1").astype(np.bool_),
            frame.array("clearance_direction", "<f8", columns=3),
            frame.array("clearance_link", "<i4"),
            frame.array("clearance_point_m", "<f8", columns=3),
            frame.array("clearance_voxel_centre_m", "<f8", columns=3),
            frame.array("clearance_voxel_size_m", "<f8"),
        )
        if {len(column) for column in columns} != {count}:
            raise MalformedAnswerError(f"verdicts frame: its clearances do not answer {count} poses")
        return cls(*columns, frame.fields.integer("revision"))

    def __repr__(self) -> str:
        least = self.clearance_m.min(initial=np.inf)
        return f"Clearance({len(self.clearance_m)} poses, least {least:g} m at revision {self.revision})"
