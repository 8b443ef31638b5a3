"""A depth camera that looks along its z axis, x to the right and y down, with the noise of an active stereo sensor."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .placement import Float64Array
from .scan import Scan
from .scene import Scene

DEPTH_SCALE_M = 0.001


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """A pinhole in pixels; pixel (u, v) = (0, 0) is the centre of the upper left pixel."""

    width: int = 320
    height: int = 240
    fx: float = 200.0
    fy: float = 200.0
    cx: float = 159.5
    cy: float = 119.5


@dataclass(frozen=True, slots=True)
class DepthCapture:
    """A depth image and the same measurement as points.

    depth_u16: (height, width) uint16 z-depth in units of `depth_scale_m`, 0 where nothing was measured.
    scan: the points of exactly these depths, row by row.
    """

    depth_u16: NDArray[np.uint16]
    intrinsics: Intrinsics
    depth_scale_m: float
    scan: Scan


@dataclass(frozen=True, slots=True)
class DepthCamera:
    """Depth noise sigma = noise_floor_m + noise_growth_per_m * z^2; pixels are lost at random and at depth edges."""

    intrinsics: Intrinsics = field(default_factory=Intrinsics)
    min_range_m: float = 0.3
    max_range_m: float = 10.0
    noise_floor_m: float = 0.001
    noise_growth_per_m: float = 0.0015
    dropout_rate: float = 0.005
    edge_dropout_rate: float = 0.5

    def rays(self) -> Float64Array:
        """One ray per pixel with z = 1, (height * width, 3) float64, sensor frame, row by row."""
        lens = self.intrinsics
        v, u = np.mgrid[0 : lens.height, 0 : lens.width].astype(np.float64)
        rays = np.stack([(u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy, np.ones_like(u)], axis=-1)
        flat: Float64Array = rays.reshape(-1, 3)
        return flat

    def true_depth(self, scene: Scene, T_map_sensor: Float64Array) -> Float64Array:
        """Noise-free z-depth (height, width) float64 metres, infinity where a ray meets nothing."""
        rays = self.rays()
        lengths = np.linalg.norm(rays, axis=1)
        directions = (rays / lengths[:, None]) @ T_map_sensor[:3, :3].T
        depth = scene.cast_rays(T_map_sensor[:3, 3], directions) / lengths
        image: Float64Array = depth.reshape(self.intrinsics.height, self.intrinsics.width)
        return image

    def capture(
        self, scene: Scene, T_map_sensor: Float64Array, random: np.random.Generator, stamp_s: float = 0.0
    ) -> DepthCapture:
        """Measure `scene` from the pose `T_map_sensor` (4,4) float64."""
        true_depth = self.true_depth(scene, T_map_sensor)
        rays = self.rays()
        lengths = np.linalg.norm(rays, axis=1).reshape(true_depth.shape)
        reached = true_depth * lengths <= self.max_range_m
        depth_u16 = self._measure(np.where(reached, true_depth, 0.0), lengths, random)
        measured = depth_u16.reshape(-1).astype(np.float64) * DEPTH_SCALE_M
        kept = measured > 0.0
        points = rays[kept] * measured[kept, None]
        beyond = ~reached.reshape(-1)
        no_return = rays[beyond] * (self.max_range_m / lengths.reshape(-1)[beyond, None])
        scan = Scan(
            points.astype(np.float32),
            T_map_sensor,
            no_return.astype(np.float32),
            self.max_range_m,
            stamp_s,
            "depth_camera",
        )
        return DepthCapture(depth_u16, self.intrinsics, DEPTH_SCALE_M, scan)

    def _measure(self, depth: Float64Array, lengths: Float64Array, random: np.random.Generator) -> NDArray[np.uint16]:
        """Noise, dropouts and rounding on true depths (height, width), 0 where out of reach."""
        sigma = self.noise_floor_m + self.noise_growth_per_m * depth**2
        noisy = depth + sigma * random.standard_normal(depth.shape)
        lost = random.random(depth.shape) < self.dropout_rate
        lost |= _at_depth_edge(depth) & (random.random(depth.shape) < self.edge_dropout_rate)
        ranges = noisy * lengths
        lost |= (depth <= 0.0) | (ranges < self.min_range_m) | (ranges > self.max_range_m)
        units = np.round(np.where(lost, 0.0, noisy) / DEPTH_SCALE_M)
        image: NDArray[np.uint16] = units.astype(np.uint16)
        return image


def _at_depth_edge(depth: Float64Array) -> NDArray[np.bool_]:
    """Pixels whose right or lower neighbour is more than 10 % nearer or farther, and those neighbours."""
    edge = np.zeros(depth.shape, dtype=np.bool_)
    across = np.abs(np.diff(depth, axis=1)) > 0.1 * np.minimum(depth[:, 1:], depth[:, :-1])
    down = np.abs(np.diff(depth, axis=0)) > 0.1 * np.minimum(depth[1:], depth[:-1])
    edge[:, 1:] |= across
    edge[:, :-1] |= across
    edge[1:] |= down
    edge[:-1] |= down
    return edge
