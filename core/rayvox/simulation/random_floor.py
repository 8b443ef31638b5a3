"""Floors of rooms that differ with a seed: what is learned on some of them can be tested on others."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .box import Box
from .furniture import chair, crates, cupboard, plant, shelf, sofa, table
from .placement import Float64Array, rigid_transform, rotation_from_rpy
from .robot_run import RobotRun
from .scene import Scene
from .shape import Shape
from .wall import ROOM_HEIGHT_M, Opening, wall, window

WIDTH_M, DEPTH_M = (9.0, 12.0), (6.5, 8.5)
"""Ranges of a floor's size along x and y; its south-west corner is the map's origin."""
PIECES = (10, 18)
"""Range of the number of pieces of furniture."""
ROBOT_CLEARANCE_M = 0.5
"""What stands no closer to the stops of a run, and is not overtowered there."""

_FURNITURE: tuple[Callable[[float, float, float], list[Shape]], ...] = (
    table,
    chair,
    shelf,
    cupboard,
    sofa,
    crates,
    lambda x, y, yaw: plant(x, y),
)


def make_random_floor(seed: int) -> Scene:
    """Two rooms with a doorway between them, windows and furniture; the same for the same seed."""
    rng = np.random.default_rng([seed, 0])
    width, depth = rng.uniform(*WIDTH_M), rng.uniform(*DEPTH_M)
    return Scene([*_rooms(rng, width, depth), *_furnish(rng, width, depth)])


def random_floor_run(seed: int, stations: int = 12, lidar_every: int = 4) -> RobotRun:
    """A run through make_random_floor(seed) that stops at random places with nothing near."""
    scene = make_random_floor(seed)
    poses = _clear_places(scene, stations, np.random.default_rng([seed, 1]))
    return RobotRun(stations, lidar_every, seed, scene, T_map_base=poses)


def _rooms(rng: np.random.Generator, width: float, depth: float) -> list[Shape]:
    between = rng.uniform(0.35, 0.65) * width
    doorway = rng.uniform(1.0, depth - 1.0)
    glass = rng.uniform(0.5, between - 2.0)
    return [
        Box.between((-0.2, -0.2, -0.2), (width + 0.2, depth + 0.2, 0.0)),
        Box.between((-0.2, -0.2, ROOM_HEIGHT_M), (width + 0.2, depth + 0.2, ROOM_HEIGHT_M + 0.2)),
        *wall("x", depth, 0.0, width, [window(glass, glass + rng.uniform(0.8, 1.5))]),
        *wall("x", 0.0, 0.0, width),
        *wall("y", 0.0, 0.0, depth),
        *wall("y", width, 0.0, depth),
        *wall("y", between, 0.0, depth, [Opening(doorway - 0.6, doorway + 0.6)]),
    ]


def _furnish(rng: np.random.Generator, width: float, depth: float) -> list[Shape]:
    pieces: list[Shape] = []
    for _ in range(rng.integers(*PIECES)):
        x, y, yaw = rng.uniform(0.6, width - 0.6), rng.uniform(0.6, depth - 0.6), rng.uniform(0.0, 2.0 * np.pi)
        pieces += _FURNITURE[rng.integers(len(_FURNITURE))](float(x), float(y), float(yaw))
    return pieces


def _clear_places(scene: Scene, count: int, rng: np.random.Generator) -> Float64Array:
    """T_map_base (count,4,4) on the floor, turned at random, clear of everything at the height of robot and sensors."""
    heights = np.array([0.6, 1.1])
    places: list[Float64Array] = []
    while len(places) < count:
        x, y = rng.uniform(0.6, WIDTH_M[1]), rng.uniform(0.6, DEPTH_M[1])
        at_sensors = np.column_stack([np.full(2, x), np.full(2, y), heights])
        indoors = np.isfinite(scene.cast_rays(at_sensors[0], np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]))).all()
        if indoors and (scene.signed_distance(at_sensors) > ROBOT_CLEARANCE_M).all():
            yaw = float(rng.uniform(0.0, 2.0 * np.pi))
            places.append(rigid_transform(rotation_from_rpy(yaw_rad=yaw), np.array([x, y, 0.0])))
    return np.stack(places)
