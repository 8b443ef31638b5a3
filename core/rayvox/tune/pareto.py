"""Who is beaten by whom."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt


def dominators(costs: npt.NDArray[np.float64]) -> list[int | None]:
    """For each row of costs (n, objectives), all to be small: None if it is on the Pareto front, else a row of the
    front that is nowhere worse and somewhere better. Rows that are equal do not dominate each other."""
    front = [row for row in range(len(costs)) if not _better_than(costs, costs[row]).any()]
    return [
        None if row in front else front[int(np.argmax(_better_than(costs[front], costs[row])))]
        for row in range(len(costs))
    ]


def coarse(value: float) -> float:
    """On a grid of steps of 10 %: what differs by less than times repeat does not count as better."""
    return round(math.log(max(value, 1e-12)) / math.log(1.1))


def _better_than(costs: npt.NDArray[np.float64], row: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    better: npt.NDArray[np.bool_] = (costs <= row).all(axis=1) & (costs < row).any(axis=1)
    return better
