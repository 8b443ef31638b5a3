"""One simulated measurement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .placement import Float64Array


@dataclass(frozen=True, slots=True)
class Scan:
    """What a sensor saw at one pose.

    points: (n,3) float32 metres, sensor frame. T_map_sensor: (4,4) float64. no_return: (k,3) float32 metres, sensor
    frame, direction times range of the rays that met nothing. max_range_m: the sensor's reach along a ray.
    stamp_s: seconds since the run's start. sensor: "depth_camera" or "spinning_lidar".
    """

    points: NDArray[np.float32]
    T_map_sensor: Float64Array
    no_return: NDArray[np.float32]
    max_range_m: float
    stamp_s: float
    sensor: str
