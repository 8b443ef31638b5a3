"""Depth images of a map, as a camera at a pose would take them."""

from __future__ import annotations

import io
from typing import Annotated, Literal

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field
from rayvox import MapSnapshot, PinholeCamera

Pixels = Annotated[int, Field(gt=0, le=1 << 16)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]

MILLIMETRES_PER_METRE = 1000.0
MOST_MILLIMETRES = (1 << 16) - 1


class DepthImageQuery(BaseModel):
    """A camera and where it stands; lengths in metres, the camera's numbers in pixels."""

    model_config = ConfigDict(extra="forbid")

    T_map_camera: Annotated[list[Finite], Field(min_length=16, max_length=16)]  # row-major
    width: Pixels
    height: Pixels
    fx: Positive
    fy: Positive
    cx: Finite
    cy: Finite
    max_range_m: Positive | None = None
    unknown: Literal["free", "occupied"] = "free"

    def render(self, snapshot: MapSnapshot) -> npt.NDArray[np.float32]:
        """(height, width) metres along the optical axis, 0 where nothing is met."""
        camera = PinholeCamera(self.width, self.height, self.fx, self.fy, self.cx, self.cy)
        pose = np.array(self.T_map_camera).reshape(4, 4)
        return snapshot.depth_image(camera, pose, self.max_range_m, self.unknown)


def depth_png(depth_m: npt.NDArray[np.float32]) -> bytes:
    """A 16-bit PNG in millimetres; 0 where there is no depth or more than 16 bits hold."""
    from PIL import Image

    millimetres = np.round(depth_m * MILLIMETRES_PER_METRE)
    units = np.where(millimetres > MOST_MILLIMETRES, 0, millimetres).astype(np.uint16)
    out = io.BytesIO()
    Image.fromarray(units).save(out, format="PNG")
    return out.getvalue()
