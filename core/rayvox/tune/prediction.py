"""From what was measured on some parts to what will be measured on the next one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import fmean, stdev

# Quantiles of Student's t at 99 %, by degrees of freedom.
_T_99 = (31.821, 6.965, 4.541, 3.747, 3.365, 3.143, 2.998, 2.896, 2.821, 2.764, 2.718, 2.681, 2.650, 2.624, 2.602)
_T_99_MANY = 2.602
FEWEST_PARTS = 3


def upper_bound(measured: Sequence[float]) -> float | None:
    """A bound that the next measurement keeps with 99 % probability, if it is of the same kind as these.

    The one-sided prediction interval of a normal distribution (Hahn, Meeker: Statistical Intervals, Sec. 4.7), of the
    logarithms since errors are positive. 99 rather than 95 %: whoever picks the best of many settings picks some whose
    error was measured too small. None for fewer than three measurements, whose spread says nothing.
    """
    if len(measured) < FEWEST_PARTS:
        return None
    logs = [math.log(max(value, 1e-12)) for value in measured]
    degrees = len(logs) - 1
    t = _T_99[degrees - 1] if degrees <= len(_T_99) else _T_99_MANY
    return math.exp(fmean(logs) + t * stdev(logs) * math.sqrt(1 + 1 / len(logs)))


def error_bound(p95: Sequence[float], p98: Sequence[float]) -> float | None:
    """A bound of the next part's 95 % error, from the 95 and 98 % errors of these; None for too few.

    Above the prediction for the 95 % error, it is not below any part's 98 % error: a tail that holds a little less than
    5 % of one scene's surface, as what lies beyond the range of the rays, holds a little more in the next.
    """
    predicted = upper_bound(p95)
    return None if predicted is None else max(predicted, *p98)
