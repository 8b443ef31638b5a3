"""A camera to look at maps with."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rayvox.errors import InvalidInputError


@dataclass(frozen=True)
class PinholeCamera:
    """Pixel (column, row) = (fx x / z + cx, fy y / z + cy); z forward, x right, y down.

    width, height: pixels; fx, fy: focal lengths, cx, cy: principal point, pixels; the centre of the upper left pixel is
    (0, 0). Raises InvalidInputError for numbers that make no camera.
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise InvalidInputError(f"an image of {self.width} x {self.height} pixels is empty")
        for name in ("fx", "fy", "cx", "cy"):
            value = getattr(self, name)
            if not math.isfinite(value) or (name in ("fx", "fy") and value <= 0):
                raise InvalidInputError(f"{name} = {value!r} cannot be a camera's")

    def rays(self) -> npt.NDArray[np.float64]:
        """Where pixels look, row by row: (height * width, 3), camera frame, z = 1."""
        v, u = np.mgrid[0 : self.height, 0 : self.width].astype(np.float64)
        directions = np.stack([(u - self.cx) / self.fx, (v - self.cy) / self.fy, np.ones_like(u)], axis=-1)
        return np.ascontiguousarray(directions.reshape(-1, 3))
