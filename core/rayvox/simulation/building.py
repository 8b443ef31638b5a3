"""One floor of an office building: 20 m x 12 m, five rooms, the map's origin in the corridor at floor level."""

from __future__ import annotations

import numpy as np

from .box import Box
from .cylinder import Cylinder
from .furniture import chair, crates, cupboard, door_leaf, plant, shelf, sofa, table
from .scene import Scene
from .shape import Shape
from .sphere import Sphere
from .wall import ROOM_HEIGHT_M, Opening, door, wall, window

WEST_M, EAST_M, SOUTH_M, NORTH_M = -10.0, 10.0, -6.0, 6.0


def make_building() -> Scene:
    """The scene of the demo, the benchmark views and the accuracy work; always the same."""
    return Scene([*_shell(), *_inner_walls(), *_office(), *_meeting_room(), *_laboratory(), *_store(), *_hall()])


def _shell() -> list[Shape]:
    floor = Box.between((WEST_M - 0.2, SOUTH_M - 0.2, -0.2), (EAST_M + 0.2, NORTH_M + 0.2, 0.0))
    ceiling = Box.between(
        (WEST_M - 0.2, SOUTH_M - 0.2, ROOM_HEIGHT_M), (EAST_M + 0.2, NORTH_M + 0.2, ROOM_HEIGHT_M + 0.2)
    )
    return [
        floor,
        ceiling,
        *wall("x", NORTH_M, WEST_M, EAST_M, [window(-8.5, -6.0), window(-2.0, 1.5), window(6.0, 8.5)]),
        *wall("x", SOUTH_M, WEST_M, EAST_M, [window(-8.0, -5.0)]),
        *wall("y", WEST_M, SOUTH_M, NORTH_M, [window(2.5, 4.5)]),
        *wall("y", EAST_M, SOUTH_M, NORTH_M, [window(-4.5, -1.5), Opening(0.2, 1.8), window(3.0, 5.0)]),
    ]


def _inner_walls() -> list[Shape]:
    return [
        *wall("x", 1.0, WEST_M, 4.0, [door(-5.5), door(0.5)]),
        *wall("x", -1.0, WEST_M, 4.0, [door(-7.0), door(-0.5)]),
        *wall("y", -4.0, 1.0, NORTH_M),
        *wall("y", -3.0, SOUTH_M, -1.0),
        *wall("y", 4.0, SOUTH_M, NORTH_M, [Opening(-0.85, 0.85, head=2.3)]),
    ]


def _office() -> list[Shape]:
    return [
        *table(-8.9, 4.6, yaw=np.pi / 2),
        *chair(-8.1, 4.6, yaw=np.pi),
        *table(-8.9, 2.0, yaw=np.pi / 2 + 0.12),
        *chair(-8.0, 2.1, yaw=np.pi - 0.3),
        *shelf(-4.3, 3.6, yaw=np.pi / 2),
        *cupboard(-5.6, 5.6, yaw=np.pi),
        *plant(-9.5, 5.5),
        *door_leaf(-6.1, 1.1, yaw=np.pi / 2 + 0.5),
        Sphere.at(-6.5, 4.0, 2.45, 0.18),
    ]


def _meeting_room() -> list[Shape]:
    seats: list[Shape] = []
    for x in (-1.6, -0.5, 0.6):
        seats += chair(x, 4.6, yaw=-np.pi / 2 + 0.15 * x)
        seats += chair(x, 2.75, yaw=np.pi / 2 - 0.1 * x)
    return [
        *table(-0.5, 3.7, length=3.4, width=1.1),
        *seats,
        *cupboard(-3.7, 3.5, yaw=np.pi / 2, length=1.6, height=0.9),
        *shelf(3.7, 4.4, yaw=np.pi / 2),
        *plant(3.4, 5.5),
        Sphere.at(-1.3, 3.7, 2.2, 0.22),
        Sphere.at(0.3, 3.7, 2.2, 0.22),
    ]


def _laboratory() -> list[Shape]:
    return [
        *table(-9.4, -3.4, yaw=np.pi / 2, length=3.0),
        *table(-6.2, -5.5, length=2.4),
        *chair(-6.2, -4.8, yaw=-np.pi / 2),
        *shelf(-3.3, -3.2, yaw=np.pi / 2, length=1.6),
        *crates(-4.1, -5.3, yaw=0.3),
        Cylinder.upright(-9.5, -5.4, 0.0, 1.5, 0.22),
        *door_leaf(-6.4, -1.12, yaw=-0.2),
    ]


def _store() -> list[Shape]:
    return [
        *shelf(-2.2, -5.7, length=1.4),
        *shelf(-0.6, -5.7, length=1.4),
        *shelf(1.0, -5.7, length=1.4),
        *crates(2.9, -5.3, yaw=-0.2),
        *crates(3.1, -2.2, yaw=1.3),
        *cupboard(-2.6, -2.6, yaw=np.pi / 2),
        Cylinder.upright(1.6, -2.2, 0.0, 0.9, 0.3),
    ]


def _hall() -> list[Shape]:
    return [
        *(Cylinder.upright(x, y, 0.0, ROOM_HEIGHT_M, 0.22) for x in (5.6, 8.4) for y in (-3.0, 3.0)),
        *sofa(7.0, -5.3),
        *sofa(4.7, -3.4, yaw=-np.pi / 2),
        *table(7.0, -4.1, length=0.9, width=0.6),
        *cupboard(7.2, 4.6, yaw=0.35, length=2.4, height=1.1),
        *chair(7.5, 5.4, yaw=-np.pi / 2),
        *plant(9.4, -5.4),
        *plant(4.6, 5.4),
        *crates(9.2, 2.6, yaw=0.7),
        Sphere.at(7.0, 0.0, 2.5, 0.3),
    ]
