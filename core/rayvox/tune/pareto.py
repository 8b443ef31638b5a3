"""Who is beaten by whom."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def dominators(costs: npt.NDArray[np.float64]) -> list[int | None]:
    """For each row of costs (n, objectives), all to be small: None if it is on the Pareto front, else a row of the front
    that is nowhere worse and somewhere better. Rows that are equal do not dominate each other."""
    front = [row for row in range(len(costs)) if not _better_than(costs, costs[row]).any()]
    return [
        None if row in front else front[int(np.argmax(_better_than(costs[front], costs[row])))]
        for row in range(len(costs))
    ]


def two_digits(value: float) -> float:
    """Rounded to two significant digits: what differs by less than times repeat does not count as better."""
    return float(f"{value:.2g}")


def _better_than(costs: npt.NDArray[np.float64], row: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    better: npt.NDArray[np.bool_] = (costs <= row).all(axis=1) & (costs < row).any(axis=1)
    return better
