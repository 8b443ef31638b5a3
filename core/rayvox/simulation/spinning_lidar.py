"""A spinning lidar: rings of beams around its z axis, one revolution taken at one pose (no motion distortion)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .placement import Float64Array
from .scan import Scan
from .scene import Scene


@dataclass(frozen=True, slots=True)
class SpinningLidar:
    """`rings` beams between `lowest_deg` and `highest_deg` of elevation, at `columns` azimuths per revolution."""

    rings: int = 64
    columns: int = 1024
    lowest_deg: float = -22.5
    highest_deg: float = 22.5
    min_range_m: float = 0.4
    max_range_m: float = 40.0
    noise_sigma_m: float = 0.015
    dropout_rate: float = 0.01

    def rays(self) -> Float64Array:
        """Unit direction of every beam, (columns * rings, 3) float64, sensor frame, column by column."""
        azimuth = np.linspace(0.0, 2.0 * np.pi, self.columns, endpoint=False)[:, None]
        elevation = np.radians(np.linspace(self.lowest_deg, self.highest_deg, self.rings))[None, :]
        flat = np.cos(elevation)
        up = np.broadcast_to(np.sin(elevation), (self.columns, self.rings))
        rays: Float64Array = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), up], axis=-1).reshape(-1, 3)
        return rays

    def sweep(
        self, scene: Scene, T_map_sensor: Float64Array, random: np.random.Generator, stamp_s: float = 0.0
    ) -> Scan:
        """Measure `scene` in one revolution at the pose `T_map_sensor` (4,4) float64."""
        rays = self.rays()
        true_range = scene.cast_rays(T_map_sensor[:3, 3], rays @ T_map_sensor[:3, :3].T)
        reached = true_range <= self.max_range_m
        measured = np.where(reached, true_range, 0.0) + self.noise_sigma_m * random.standard_normal(rays.shape[0])
        kept = reached & (measured >= self.min_range_m) & (measured <= self.max_range_m)
        kept &= random.random(rays.shape[0]) >= self.dropout_rate
        points = rays[kept] * measured[kept, None]
        no_return = rays[~reached] * self.max_range_m
        return Scan(
            points.astype(np.float32),
            T_map_sensor,
            no_return.astype(np.float32),
            self.max_range_m,
            stamp_s,
            "spinning_lidar",
        )
