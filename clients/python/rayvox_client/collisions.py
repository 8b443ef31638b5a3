"""Answers about collisions."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rayvox_client.errors import MalformedAnswerError
from rayvox_client.frame import Frame

POSE_FREE = 0
POSE_OCCUPIED = 1
POSE_UNKNOWN = 2


@dataclass(frozen=True, eq=False, repr=False)
class VoxelContacts:
    """Voxels that links touch or enclose, by pose and link.

    Attributes:
        pose: (m,) int32 index of the pose, ascending.
        link: (m,) int32 index of the link in `RobotInfo.links`.
        centre_m: (m,3) float64 centre of the voxel, map frame, metres.
        size_m: (m,) float64 edge of the voxel, metres.
        log_odds: (m,) float32, NaN where the voxel is unknown.
    """

    pose: NDArray[np.int32]
    link: NDArray[np.int32]
    centre_m: NDArray[np.float64]
    size_m: NDArray[np.float64]
    log_odds: NDArray[np.float32]

    def __repr__(self) -> str:
        return f"VoxelContacts({len(self.pose)} of {len(np.unique(self.pose))} poses)"


@dataclass(frozen=True, eq=False, repr=False)
class CollisionCheck:
    """Verdicts on poses, all on one revision of the map.

    Attributes:
        verdicts: (n,) uint8: 0 free, 1 an occupied voxel is met, 2 unknown space is (with unknown="occupied").
        revision: the map's revision that was asked.
        self_colliding: (n,) bool, links touch that must not; None if not asked for.
        contacts: None if not asked for.
    """

    verdicts: NDArray[np.uint8]
    revision: int
    self_colliding: NDArray[np.bool_] | None = None
    contacts: VoxelContacts | None = field(default=None, repr=False)

    @property
    def free(self) -> NDArray[np.bool_]:
        """(n,) bool: free of the map."""
        return np.equal(self.verdicts, POSE_FREE)

    @classmethod
    def from_frame(cls, frame: Frame, count: int) -> CollisionCheck:
        """Read a `verdicts` frame that answers `count` poses."""
        frame.expect("verdicts")
        verdicts = frame.array("verdicts", "|u1")
        own = frame.array("self_colliding", "|u1") if "self_colliding" in frame.payloads else None
        if len(verdicts) != count or (own is not None and len(own) != count):
            raise MalformedAnswerError(f"verdicts frame: {len(verdicts)} verdicts answer {count} poses")
        contacts = _contacts_of(frame, count) if "contact_pose" in frame.payloads else None
        revision = frame.fields.integer("revision")
        return cls(verdicts, revision, None if own is None else own.astype(np.bool_), contacts)

    def __repr__(self) -> str:
        counts = np.bincount(self.verdicts, minlength=3)
        return (
            f"CollisionCheck({counts[POSE_FREE]} free, {counts[POSE_OCCUPIED]} occupied, "
            f"{counts[POSE_UNKNOWN]} unknown at revision {self.revision})"
        )


def _contacts_of(frame: Frame, count: int) -> VoxelContacts:
    contacts = VoxelContacts(
        frame.array("contact_pose", "<i4"),
        frame.array("contact_link", "<i4"),
        frame.array("contact_centre_m", "<f8", columns=3),
        frame.array("contact_size_m", "<f8"),
        frame.array("contact_log_odds", "<f4"),
    )
    lengths = {len(column) for column in vars(contacts).values()}
    if len(lengths) > 1 or not np.all((contacts.pose >= 0) & (contacts.pose < count)):
        raise MalformedAnswerError("verdicts frame: its contacts do not fit its poses")
    return contacts


@dataclass(frozen=True, eq=False, repr=False)
class MotionCheck:
    """Answers to n motions, all on one revision of the map.

    Attributes:
        verdicts: (n,) uint8, as of `CollisionCheck`, of where the motion first collides, or comes within the tolerance.
        free_until: (n,) float64, the motion is free from parameter 0 up to this one; 1 where all of it is.
        tolerance_m: a motion that is not free comes within this of a voxel that counts, along each axis of the map.
        revision: the map's revision that was asked.
    """

    verdicts: NDArray[np.uint8]
    free_until: NDArray[np.float64]
    tolerance_m: float
    revision: int

    @property
    def free(self) -> NDArray[np.bool_]:
        """(n,) bool: free of the map from end to end."""
        return np.equal(self.verdicts, POSE_FREE)

    @classmethod
    def from_frame(cls, frame: Frame, count: int) -> MotionCheck:
        """Read a `motion_verdicts` frame that answers `count` motions."""
        frame.expect("motion_verdicts")
        verdicts, free_until = frame.array("verdicts", "|u1"), frame.array("free_until", "<f8")
        if len(verdicts) != count or len(free_until) != count:
            raise MalformedAnswerError(f"motion_verdicts frame: {len(verdicts)} verdicts answer {count} motions")
        return cls(verdicts, free_until, frame.fields.number("tolerance_m"), frame.fields.integer("revision"))

    def __repr__(self) -> str:
        return f"MotionCheck({int(self.free.sum())} of {len(self.verdicts)} free at revision {self.revision})"
