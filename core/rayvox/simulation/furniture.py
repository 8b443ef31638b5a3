"""Furniture: each piece is a handful of solids standing on the floor at z = 0."""

from __future__ import annotations

import numpy as np

from .box import Box
from .cylinder import Cylinder
from .shape import Shape
from .sphere import Sphere


def _place(x: float, y: float, yaw_rad: float, along: float, across: float) -> tuple[float, float]:
    """Map position of a point `along`, `across` in the frame of a piece that stands at (x, y) turned by `yaw_rad`."""
    cos, sin = float(np.cos(yaw_rad)), float(np.sin(yaw_rad))
    return x + cos * along - sin * across, y + sin * along + cos * across


def _part(
    x: float, y: float, yaw: float, at: tuple[float, float, float], size: tuple[float, float, float], roll: float = 0.0
) -> Box:
    px, py = _place(x, y, yaw, at[0], at[1])
    return Box.turned((px, py, at[2]), size, yaw, roll)


def table(x: float, y: float, yaw: float = 0.0, length: float = 1.6, width: float = 0.8) -> list[Shape]:
    """A table top 4 cm thick on four round legs."""
    parts: list[Shape] = [_part(x, y, yaw, (0.0, 0.0, 0.73), (length, width, 0.04))]
    for along in (-length / 2 + 0.06, length / 2 - 0.06):
        for across in (-width / 2 + 0.06, width / 2 - 0.06):
            px, py = _place(x, y, yaw, along, across)
            parts.append(Cylinder.upright(px, py, 0.0, 0.71, 0.025))
    return parts


def chair(x: float, y: float, yaw: float = 0.0) -> list[Shape]:
    """An office chair that faces along `yaw`, its back slightly reclined."""
    return [
        Cylinder.upright(x, y, 0.0, 0.06, 0.28),
        Cylinder.upright(x, y, 0.06, 0.45, 0.03),
        _part(x, y, yaw, (0.0, 0.0, 0.48), (0.46, 0.46, 0.07)),
        _part(x, y, yaw + np.pi / 2.0, (0.0, 0.24, 0.78), (0.44, 0.05, 0.5), roll=0.15),
    ]


def shelf(x: float, y: float, yaw: float = 0.0, length: float = 1.2, levels: int = 5) -> list[Shape]:
    """An open shelf with a back panel, two sides and `levels` boards."""
    depth, height = 0.35, 2.0
    parts: list[Shape] = [
        _part(x, y, yaw, (0.0, -depth / 2, height / 2), (length, 0.02, height)),
        _part(x, y, yaw, (-length / 2, 0.0, height / 2), (0.03, depth, height)),
        _part(x, y, yaw, (length / 2, 0.0, height / 2), (0.03, depth, height)),
    ]
    for level in range(levels):
        z = 0.08 + level * (height - 0.1) / (levels - 1)
        parts.append(_part(x, y, yaw, (0.0, 0.0, z), (length, depth, 0.03)))
    return parts


def cupboard(x: float, y: float, yaw: float = 0.0, length: float = 1.0, height: float = 1.9) -> list[Shape]:
    """A closed cupboard."""
    return [_part(x, y, yaw, (0.0, 0.0, height / 2), (length, 0.5, height))]


def sofa(x: float, y: float, yaw: float = 0.0, length: float = 1.9) -> list[Shape]:
    """A sofa whose seat faces the direction `yaw` + 90 degrees."""
    return [
        _part(x, y, yaw, (0.0, 0.0, 0.21), (length, 0.85, 0.42)),
        _part(x, y, yaw, (0.0, -0.35, 0.6), (length, 0.18, 0.5)),
        _part(x, y, yaw, (-length / 2 + 0.09, 0.0, 0.52), (0.18, 0.85, 0.24)),
        _part(x, y, yaw, (length / 2 - 0.09, 0.0, 0.52), (0.18, 0.85, 0.24)),
    ]


def plant(x: float, y: float) -> list[Shape]:
    """A pot, a stem and three round crowns."""
    return [
        Cylinder.upright(x, y, 0.0, 0.35, 0.18),
        Cylinder.upright(x, y, 0.35, 0.9, 0.03),
        Sphere.at(x, y, 1.05, 0.28),
        Sphere.at(x + 0.16, y + 0.1, 1.32, 0.2),
        Sphere.at(x - 0.12, y - 0.08, 1.4, 0.16),
    ]


def crates(x: float, y: float, yaw: float = 0.0) -> list[Shape]:
    """Three crates, the upper one turned against the lower two."""
    return [
        _part(x, y, yaw, (-0.31, 0.0, 0.2), (0.6, 0.4, 0.4)),
        _part(x, y, yaw, (0.31, 0.02, 0.2), (0.6, 0.4, 0.4)),
        _part(x, y, yaw + 0.4, (0.05, 0.0, 0.55), (0.5, 0.35, 0.3)),
    ]


def door_leaf(hinge_x: float, hinge_y: float, yaw: float, width: float = 0.95) -> list[Shape]:
    """A door that stands open: it reaches from its hinge in the direction `yaw`."""
    return [_part(hinge_x, hinge_y, yaw, (width / 2, 0.0, 1.02), (width, 0.04, 2.02))]
