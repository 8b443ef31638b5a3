"""Walls with doors and windows, as boxes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from .box import Box

ROOM_HEIGHT_M = 2.8
WALL_THICKNESS_M = 0.12


@dataclass(frozen=True, slots=True)
class Opening:
    """A hole in a wall from `start` to `end` along it and from `sill` to `head` above the floor, metres."""

    start: float
    end: float
    sill: float = 0.0
    head: float = 2.1


def door(center: float, width_m: float = 1.2) -> Opening:
    """A doorway around `center`, metres along its wall."""
    return Opening(center - width_m / 2.0, center + width_m / 2.0)


def window(start: float, end: float) -> Opening:
    """A window between `start` and `end`, metres along its wall; there is nothing behind it to measure."""
    return Opening(start, end, sill=0.9, head=2.2)


def wall(
    axis: Literal["x", "y"], offset: float, start: float, end: float, openings: Sequence[Opening] = ()
) -> list[Box]:
    """A wall along `axis` from `start` to `end` at the other coordinate `offset`, as boxes around its openings."""

    def piece(piece_start: float, piece_end: float, low: float, high: float) -> Box:
        near, far = offset - WALL_THICKNESS_M / 2.0, offset + WALL_THICKNESS_M / 2.0
        if axis == "x":
            return Box.between((piece_start, near, low), (piece_end, far, high))
        return Box.between((near, piece_start, low), (far, piece_end, high))

    pieces: list[Box] = []
    position = start
    for opening in sorted(openings, key=lambda hole: hole.start):
        pieces.append(piece(position, opening.start, 0.0, ROOM_HEIGHT_M))
        if opening.sill > 0.0:
            pieces.append(piece(opening.start, opening.end, 0.0, opening.sill))
        pieces.append(piece(opening.start, opening.end, opening.head, ROOM_HEIGHT_M))
        position = opening.end
    pieces.append(piece(position, end, 0.0, ROOM_HEIGHT_M))
    return pieces
