"""What is known about one choice of map settings, part by part and all together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from statistics import fmean, median
from typing import Any, get_args

import numpy as np

from rayvox.collision_checker import UnknownPolicy
from rayvox.tune.accuracy import MapAccuracy
from rayvox.tune.candidate import MapSettings
from rayvox.tune.prediction import error_bound
from rayvox.tune.robot_queries import RobotFigures

UNKNOWN_POLICIES: tuple[UnknownPolicy, ...] = get_args(UnknownPolicy)


@dataclass(frozen=True)
class MapFigures:
    """Of one part.

    reference_s: machine_speed.reference_work_s around the measurement. scan_s, scan_bytes: medians over its scans.
    accuracy: None where it is another measurement's, or where there is nothing to measure. robot: by policy for unknown
    space, empty without a robot.
    """

    reference_s: float
    scan_s: float
    scan_bytes: float
    memory_bytes: float
    point_query_s: float
    accuracy: MapAccuracy | None = None
    robot: Mapping[str, RobotFigures] = field(default_factory=dict)

    def at_speed(self, reference_s: float) -> MapFigures:
        """With the times that it would have taken on a machine as fast as that."""
        faster = reference_s / self.reference_s
        robot = {policy: replace(figures, query_s=faster * figures.query_s) for policy, figures in self.robot.items()}
        return replace(
            self,
            reference_s=reference_s,
            scan_s=faster * self.scan_s,
            point_query_s=faster * self.point_query_s,
            robot=robot,
        )

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> MapFigures:
        """From what dataclasses.asdict made of it."""
        accuracy = fields["accuracy"]
        robot = {policy: RobotFigures(**figures) for policy, figures in fields["robot"].items()}
        plain = {name: value for name, value in fields.items() if name not in ("accuracy", "robot")}
        return cls(**plain, accuracy=None if accuracy is None else MapAccuracy(**accuracy), robot=robot)


@dataclass(frozen=True)
class CandidateSummary:
    """All parts together.

    Times, bytes: medians. accuracy: means over the parts, None if it was not measured. error_bound_m: what the 95 %
    error of the next part stays below (prediction.error_bound), None for too few parts. robot: means, by policy.
    """

    settings: MapSettings
    parts: int
    scan_s: float
    scan_bytes: float
    memory_bytes: float
    point_query_s: float
    accuracy: MapAccuracy | None
    error_bound_m: float | None
    robot: Mapping[str, RobotFigures]


def summarise(settings: MapSettings, measured: Sequence[MapFigures]) -> CandidateSummary:
    """measured: one per part, at least one."""
    judged = [figures.accuracy for figures in measured if figures.accuracy is not None]
    policies = [policy for policy in UNKNOWN_POLICIES if all(policy in figures.robot for figures in measured)]
    return CandidateSummary(
        settings=settings,
        parts=len(measured),
        scan_s=median(figures.scan_s for figures in measured),
        scan_bytes=median(figures.scan_bytes for figures in measured),
        memory_bytes=median(figures.memory_bytes for figures in measured),
        point_query_s=median(figures.point_query_s for figures in measured),
        accuracy=_mean_accuracy(judged) if judged else None,
        error_bound_m=error_bound([a.error_p95_m for a in judged], [a.error_p98_m for a in judged]),
        robot={policy: mean_robot_figures([figures.robot[policy] for figures in measured]) for policy in policies},
    )


def mean_robot_figures(measured: Sequence[RobotFigures]) -> RobotFigures:
    """The median time, and mean shares over the parts that had such poses."""
    names = ("false_free", "false_collision", "lost_free")
    shares = {name: _mean_known([getattr(figures, name) for figures in measured]) for name in names}
    return RobotFigures(median(figures.query_s for figures in measured), **shares)


def _mean_accuracy(judged: Sequence[MapAccuracy]) -> MapAccuracy:
    return MapAccuracy(**{name: fmean(getattr(a, name) for a in judged) for name in MapAccuracy.__dataclass_fields__})


def _mean_known(values: Sequence[float]) -> float:
    known = [value for value in values if not np.isnan(value)]
    return fmean(known) if known else float("nan")
