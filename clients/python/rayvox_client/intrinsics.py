"""A depth camera's pinhole model."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

from rayvox_client.errors import InvalidInputError


@dataclass(frozen=True)
class Intrinsics:
    """Pinhole intrinsics: pixel (column, row) = (fx x / z + cx, fy y / z + cy), z forward, x right, y down.

    Attributes:
        fx, fy: focal lengths, pixels.
        cx, cy: principal point, pixels; the centre of the top left pixel is (0, 0).
        depth_scale_m: metres per unit of the depth image, 0.001 for millimetres.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    depth_scale_m: float = 0.001

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not math.isfinite(value) or (name not in ("cx", "cy") and value <= 0):
                raise InvalidInputError(f"intrinsics: {name} = {value!r} is not a finite number above zero")

    def to_json(self) -> dict[str, float]:
        """The frame's `intrinsics` object."""
        return {name: float(value) for name, value in asdict(self).items()}
