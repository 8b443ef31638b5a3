"""How far robots are from what they must not touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Clearance:
    """Distances of n poses from the nearest voxel that counts, all of one revision of the map.

    What says where the distance was taken is NaN (link: -1) for poses that collide and those that were cut off.
    """

    verdicts: npt.NDArray[np.uint8]
    """(n,): CollisionVerdict."""
    clearance_m: FloatArray
    """(n,): never more than the true distance, 0 where the pose collides, the bound where nothing is nearer."""
    is_lower_bound: npt.NDArray[np.bool_]
    """(n,): the distance was cut off at the bound."""
    direction: FloatArray
    """(n, 3): unit vectors from the robot to the voxel, map frame."""
    link: npt.NDArray[np.int64]
    """(n,): index in Robot.links of the nearest link."""
    point_m: FloatArray
    """(n, 3): its nearest point, map frame, without padding."""
    voxel_centre_m: FloatArray
    """(n, 3): centre of the nearest voxel, a leaf of the pruned octree; NaN too where that is the octree's border."""
    voxel_size_m: FloatArray
    """(n,): edge of the voxel; NaN as its centre."""
    revision: int
    """Revision of the map."""


def clearance_of(
    verdicts: npt.NDArray[np.uint8],
    is_lower_bound: npt.NDArray[np.uint8],
    metres: FloatArray,
    voxel: npt.NDArray[np.int64],
    resolution_m: float,
    revision: int,
) -> Clearance:
    """From the kernel's rows: `metres` clearance, direction, point; `voxel` link, first cell, level (-1: no voxel)."""
    found, has_voxel = voxel[:, :1] >= 0, voxel[:, 4] >= 0
    cells_wide = np.ldexp(1.0, np.maximum(voxel[:, 4], 0)).astype(np.float64)
    centre_m = (voxel[:, 1:4] + 0.5 * cells_wide[:, None]) * resolution_m
    return Clearance(
        verdicts=verdicts,
        clearance_m=metres[:, 0].copy(),
        is_lower_bound=is_lower_bound.astype(np.bool_),
        direction=np.where(found, metres[:, 1:4], np.nan),
        link=voxel[:, 0].copy(),
        point_m=np.where(found, metres[:, 4:7], np.nan),
        voxel_centre_m=np.where(has_voxel[:, None], centre_m, np.nan),
        voxel_size_m=np.where(has_voxel, cells_wide * resolution_m, np.nan),
        revision=revision,
    )
