"""What connects two links."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt


class JointMotion(IntEnum):
    """The kernel's numbering."""

    FIXED = 0
    REVOLUTE = 1
    PRISMATIC = 2


@dataclass(frozen=True)
class Mimic:
    """A joint that follows another: value = multiplier * the other's value + offset."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, eq=False)
class Joint:
    """Places the link `child` on the link `parent`.

    T_parent_joint: (4, 4), the joint's frame at value 0, which is also the child's. axis: unit vector in that frame.
    lower, upper: limits in radians or metres; infinite for a continuous joint.
    """

    name: str
    motion: JointMotion
    parent: str
    child: str
    T_parent_joint: npt.NDArray[np.float64]
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    lower: float = -math.inf
    upper: float = math.inf
    mimic: Mimic | None = None

    @property
    def has_value(self) -> bool:
        """Whether a configuration has a column for it."""
        return self.motion is not JointMotion.FIXED and self.mimic is None
