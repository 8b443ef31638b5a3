"""Log-odds after very many updates, and of sensor models near 0, 0.5 and 1, against exact arithmetic."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from decimal import Decimal, localcontext
from fractions import Fraction
from typing import Any

import numpy as np
import rayvox
from numpy.typing import NDArray

from benchmarks.extreme_cases.case import Case, Outcome, PeerOutcome

_SMALLEST, _HALF_UP, _HALF_DOWN = 5e-324, math.nextafter(0.5, 1), math.nextafter(0.5, 0)
_LARGEST = math.nextafter(1, 0)


@dataclass(frozen=True)
class Model:
    """A sensor model's probabilities."""

    hit: float = 0.7
    miss: float = 0.4
    low: float = 0.1192
    high: float = 0.971

    def ours(self) -> rayvox.SensorModel:
        return rayvox.SensorModel(p_hit=self.hit, p_miss=self.miss, p_clamp_min=self.low, p_clamp_max=self.high)

    def octomap(self, resolution_m: float = 1.0) -> Any:
        import pyoctomap

        tree = pyoctomap.OcTree(resolution_m)
        tree.setProbHit(self.hit)
        tree.setProbMiss(self.miss)
        tree.setClampingThresMin(self.low)
        tree.setClampingThresMax(self.high)
        return tree


class ExactUpdates:
    """The same updates of many voxels in integers: float32 log-odds are multiples of 2^-60 in this project's range."""

    def __init__(self, model: rayvox.SensorModel, count: int) -> None:
        native = model.native
        constants = (native.hit_log_odds, native.miss_log_odds, native.clamp_min_log_odds, native.clamp_max_log_odds)
        exponent = max(Fraction(value).denominator.bit_length() - 1 for value in constants)
        self._unit = 2.0**-exponent
        self._hit, self._miss, self._low, self._high = (int(Fraction(v) * 2**exponent) for v in constants)
        assert max(abs(self._low), abs(self._high)) < 2**61
        self._values = np.zeros(count, dtype=np.int64)
        self.since_bound = np.zeros(count, dtype=np.int64)
        self.longest_since_bound = 0

    def apply(self, hits: NDArray[np.bool_]) -> None:
        self._values += np.where(hits, self._hit, self._miss)
        outside = (self._values <= self._low) | (self._values >= self._high)
        np.clip(self._values, self._low, self._high, out=self._values)
        self.since_bound = np.where(outside, 0, self.since_bound + 1)
        self.longest_since_bound = max(self.longest_since_bound, int(self.since_bound.max()))

    def log_odds(self) -> NDArray[np.longdouble]:
        return self._values.astype(np.longdouble) * np.longdouble(self._unit)


def _after_repeats(model: Model, updates: int) -> tuple[float, float]:
    """Log-odds of a voxel after so many hits and of another after as many misses, through the map."""
    threads = rayvox.thread_count()
    rayvox.set_thread_count(1)  # nothing to share
    occupancy_map = rayvox.OccupancyMap(1.0, depth=4, sensor_model=model.ours())
    hit, missed = [0.5, 0.5, 0.5], [0.5, 1.5, 0.5]
    scan = occupancy_map.prepare_scan([hit], origin=missed, no_return=[[0.0, 1.0, 0.0]])
    for _ in range(updates):
        occupancy_map.insert_prepared(scan, "dda")
    rayvox.set_thread_count(threads)
    up, down = occupancy_map.log_odds_at([hit, missed]).tolist()
    return up, down


def _saturated(updates: int) -> Outcome:
    """Hits, and as many misses, end at the bounds."""
    native = Model().ours().native
    up, down = _after_repeats(Model(), updates)
    return Outcome(2, (up != native.clamp_max_log_odds) + (down != native.clamp_min_log_odds))


# Bounds that a hundred thousand updates do not reach: every one of them is rounded.
_WEAK = Model(hit=0.50002, miss=0.49998, low=0.0001, high=0.9999)


def _unclamped(updates: int) -> Outcome:
    native = _WEAK.ours().native
    found = _after_repeats(_WEAK, updates)
    exact = [Fraction(step) * updates for step in (native.hit_log_odds, native.miss_log_odds)]
    assert exact[0] < native.clamp_max_log_odds
    return Outcome(2, 0, max(float(abs(Fraction(f) - e)) for f, e in zip(found, exact, strict=True)))


def _octomap_unclamped(updates: int) -> PeerOutcome:
    """The same in OctoMap, whose rounding is the same."""
    tree = _WEAK.octomap()
    for _ in range(updates):
        tree.updateNode([0.5, 0.5, 0.5], True)
    exact = Fraction(_WEAK.ours().native.hit_log_odds) * updates
    return Outcome(1, 0, float(abs(Fraction(tree.search([0.5, 0.5, 0.5]).getLogOdds()) - exact)))


_SIDE, _SCANS, _DISTANCE = 16, 8000, 40.5


def _hits() -> NDArray[np.bool_]:
    """(scans, voxels): whether a scan hits or misses a voxel; rates differ from voxel to voxel."""
    rng = np.random.default_rng(1)
    return rng.random((_SCANS, _SIDE * _SIDE)) < rng.uniform(0.1, 0.6, _SIDE * _SIDE)


@functools.cache
def _mixed_exact() -> ExactUpdates:
    exact = ExactUpdates(Model().ours(), _SIDE * _SIDE)
    for row in _hits():
        exact.apply(row)
    return exact


def _mixed() -> Outcome:
    """A wall of voxels seen from afar: a ray ends in its voxel or passes it and ends in the one behind."""
    y, z = np.divmod(np.arange(_SIDE * _SIDE), _SIDE) - np.array([_SIDE // 2]) + 0.5
    wall = np.stack([np.full(len(y), _DISTANCE), y, z], axis=1)
    behind = wall * ((_DISTANCE + 1) / _DISTANCE)
    occupancy_map = rayvox.OccupancyMap(1.0, sensor_model=Model().ours())
    for row in _hits():
        occupancy_map.insert_scan(np.where(row[:, None], wall, behind), engine="dda")
    found = occupancy_map.log_odds_at(wall)
    return Outcome(len(wall), int(np.isnan(found).sum()), float(np.abs(found - _mixed_exact().log_odds()).max()))


def _octomap_mixed() -> PeerOutcome:
    """OctoMap's update of the same voxels, in its own tree."""
    tree, voxels = Model().octomap(), 32
    places = [[float(i) + 0.5, 0.5, 0.5] for i in range(voxels)]
    for row in _hits()[:, :voxels].tolist():
        for place, hit in zip(places, row, strict=True):
            tree.updateNode(place, hit)
    found = np.array([tree.search(place).getLogOdds() for place in places])
    error = np.abs(found - _mixed_exact().log_odds()[:voxels]).max()
    return Outcome(voxels, int(error > _mixed_bound()), float(error))


def _ulp(log_odds: float) -> float:
    return float(np.spacing(np.float32(log_odds)))


def _mixed_bound() -> float:
    """Half a unit in the last place of the larger bound an update, for the longest time a voxel was at neither."""
    return _mixed_exact().longest_since_bound * _ulp(Model().ours().native.clamp_max_log_odds) / 2


def _exact_log_odds(probability: float) -> Decimal:
    with localcontext() as context:
        context.prec = 60
        p = Decimal(probability)
        return (p / (1 - p)).ln()


_PROBABILITIES = [
    *(_SMALLEST, 1e-300, 1e-16, 1e-6, 0.01, 0.3, 0.5 - 1e-6, _HALF_DOWN, 0.5),
    *(_HALF_UP, 0.5 + 1e-12, 0.5 + 1e-6, 0.7, 0.99, 1 - 1e-6, 1 - 1e-15, _LARGEST),
]


def _constants() -> Outcome:
    """Error of float32 log-odds of probabilities, relative to max(|log-odds|, 2^-28)."""
    worst = 0.0
    for p in _PROBABILITIES:
        if p >= 0.5:
            found = rayvox.SensorModel(p_hit=p).native.hit_log_odds
        else:
            found = rayvox.SensorModel(p_miss=p).native.miss_log_odds
        exact = _exact_log_odds(p)
        worst = max(worst, float(abs(Decimal(found) - exact) / max(abs(exact), Decimal(2) ** -28)))
    return Outcome(len(_PROBABILITIES), 0, worst)


def _refused() -> Outcome:
    """Probabilities that are no model: an error each."""
    bad: list[dict[str, float]] = [
        *({"p_hit": v} for v in (1.0, _HALF_DOWN, 0.0, -0.1, math.nan, math.inf)),
        *({"p_miss": v} for v in (0.0, -_SMALLEST, _HALF_UP, 1.0, math.nan)),
        *({"p_clamp_min": v} for v in (0.0, 1.0, math.nan)),
        *({"p_clamp_max": v} for v in (1.0, 0.1192, math.nan)),
        *({"p_occupied": v} for v in (0.0, 1.0, math.nan)),
    ]
    wrong = 0
    for arguments in bad:
        try:
            rayvox.SensorModel(**arguments)
            wrong += 1
        except rayvox.InvalidInputError:
            pass
    return Outcome(len(bad), wrong)


_MODELS = [
    Model(hit=0.5, miss=0.5),
    Model(hit=_HALF_UP, miss=_HALF_DOWN),
    Model(hit=_LARGEST, miss=_SMALLEST),
    Model(hit=_LARGEST, miss=_SMALLEST, low=_SMALLEST, high=_LARGEST),
    Model(hit=0.9999999, miss=1e-7, low=1e-9, high=1 - 1e-9),
    Model(low=_HALF_DOWN, high=_HALF_UP),
    Model(low=0.4999999, high=0.5000001),
    Model(low=0.6, high=0.9),
    Model(low=0.1, high=0.2),
]


def _model_updates() -> NDArray[np.bool_]:
    return np.random.default_rng(3).random(60) < 0.5


def _expected(model: Model, hits: NDArray[np.bool_]) -> np.float32:
    """OctoMap's update in numpy's float32."""
    native = model.ours().native
    names = ("hit_log_odds", "miss_log_odds", "clamp_min_log_odds", "clamp_max_log_odds")
    up, down, low, high = (np.float32(getattr(native, name)) for name in names)
    value, known = np.float32(0), False
    for hit in hits:
        step = up if hit else down
        at_bound = value >= high if step >= 0 else value <= low
        if not (known and at_bound):
            value = min(max(value + step, low), high)
        known = True
    return value


def _models() -> Outcome:
    """Extreme models updated through the map: the float32 arithmetic that OctoMap defines, bit for bit."""
    worst = 0.0
    spot, beside, hits = np.array([[0.5, 0.5, 0.5]]), np.array([[1.5, 0.5, 0.5]]), _model_updates()
    for model in _MODELS:
        occupancy_map = rayvox.OccupancyMap(1.0, sensor_model=model.ours())
        for hit in hits:
            occupancy_map.insert_scan(spot if hit else beside, origin=(0.5, 0.5, 0.5))
        worst = max(worst, float(abs(occupancy_map.log_odds_at(spot)[0] - _expected(model, hits))))
    return Outcome(len(_MODELS), 0, worst)


def _octomap_models() -> PeerOutcome:
    wrong, worst, hits = 0, 0.0, _model_updates()
    for model in _MODELS:
        tree = model.octomap()
        for hit in hits:
            tree.updateNode([0.5, 0.5, 0.5], bool(hit))
        error = float(abs(tree.search([0.5, 0.5, 0.5]).getLogOdds() - _expected(model, hits)))
        wrong, worst = wrong + (error != 0), max(worst, error)
    return Outcome(len(_MODELS), wrong, worst)


def cases(updates: int = 1_000_000) -> list[Case]:
    """Log-odds and sensor models."""
    return [
        Case(
            "log-odds",
            f"{updates:,} hits and misses",
            "the clamping bounds, exactly",
            lambda: _saturated(updates),
            takes_seconds=True,
        ),
        Case(
            "log-odds",
            f"{updates // 10:,} weak hits and misses, unclamped",
            "within half a float32 unit in the last place of the bound per update",
            lambda: _unclamped(updates // 10),
            bound=_octomap_bound(updates // 10),
            unit="log-odds",
            peers={"OctoMap": lambda: _octomap_unclamped(updates // 10)},
            takes_seconds=True,
        ),
        Case(
            "log-odds",
            f"{_SCANS * _SIDE * _SIDE:,} mixed updates of {_SIDE * _SIDE} voxels",
            "within half a float32 unit in the last place per update since the voxel was last at a bound",
            _mixed,
            bound=_mixed_bound(),
            unit="log-odds",
            peers={"OctoMap": _octomap_mixed},
            takes_seconds=True,
        ),
        Case(
            "sensor model",
            "probabilities from 5e-324 to 1 - 2^-53",
            "log-odds rounded to float32 (absolute error 2^-52 near 0.5)",
            _constants,
            bound=2.0**-23,
            unit="of the log-odds",
        ),
        Case("sensor model", "0, 1, NaN, the wrong side of 0.5", "InvalidInputError", _refused),
        Case(
            "sensor model",
            "models near 0, 0.5 and 1",
            "OctoMap's float32 arithmetic, bit for bit",
            _models,
            unit="log-odds",
            peers={"OctoMap": _octomap_models},
        ),
    ]


def _octomap_bound(updates: int) -> float:
    """What rounding may take from so many weak hits, below their bound of log-odds."""
    return updates * _ulp(math.log(_WEAK.high / (1 - _WEAK.high))) / 2
