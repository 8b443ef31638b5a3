"""One choice of settings from the need."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from rayvox.collision_checker import UnknownPolicy
from rayvox.errors import RayvoxError
from rayvox.tune.candidate import MapSettings
from rayvox.tune.figures import CandidateSummary
from rayvox.tune.pareto import coarse
from rayvox.tune.robot_queries import RobotFigures

# Engines are told apart by more than this share of their time.
_NOTICEABLE = 0.1


class NothingMeasuredError(RayvoxError):
    """No settings were measured on enough parts to recommend one; the message says what would help."""


@dataclass(frozen=True, slots=True)
class Target:
    """max_error_m: of 95 % of the map's surface.

    max_lost_free: share of the free space that may be lost beyond what the best settings lose; the same for the policy
    for unknown space, beyond what "free" loses.
    """

    max_error_m: float
    max_lost_free: float = 0.1


@dataclass(frozen=True)
class Recommendation:
    """settings and what is predicted for them on a scene that was not measured.

    reached: whether error_bound_m is within the target. query: "pose" of the robot, or "point" without one.
    """

    settings: MapSettings
    unknown: UnknownPolicy
    target: Target
    reached: bool
    error_bound_m: float
    scan_s: float
    query_s: float
    query: str
    summary: CandidateSummary

    def sentence(self) -> str:
        target_cm = f"{100 * self.target.max_error_m:.3g} cm"
        costs = f"{1e3 * self.scan_s:.3g} ms per scan, {1e6 * self.query_s:.3g} us per {self.query}"
        error = f"{100 * self.error_bound_m:.2g} cm"
        if not self.reached:
            closest = f"closest is {self.settings}: at most {error}, {costs}."
            return f"Nothing measured keeps the error below {target_cm}; {closest}"
        policy = f" and unknown space taken for {self.unknown}" if self.query == "pose" else ""
        return f"For at most {target_cm} of error, use {self.settings}{policy}: at most {error}, {costs}."


def recommend(
    summaries: Sequence[CandidateSummary], same_leaves: Sequence[CandidateSummary], target: Target
) -> Recommendation:
    """The fastest insertion among the settings that keep the target, or the smallest error if none does.

    same_leaves: engines and depths, measured for their times. Raises NothingMeasuredError.
    """
    judged = [s for s in summaries if s.error_bound_m is not None and s.accuracy is not None]
    if not judged:
        raise NothingMeasuredError(
            "nothing was measured on three parts of the scans: give more scans, or a larger budget"
        )
    most_free = max(_free_recall(s) for s in judged)
    usable = [s for s in judged if _free_recall(s) >= most_free - target.max_lost_free]
    kept = [s for s in usable if _bound_m(s) <= target.max_error_m]
    # By time first, then what else is a cost, so that the choice is on the Pareto front.
    chosen = min(kept, key=lambda s: (coarse(s.scan_s), *costs(s))) if kept else min(usable, key=_bound_m)
    fastest = _fastest_engine(chosen, same_leaves)
    unknown = choose_policy(chosen.robot, target)
    return Recommendation(
        settings=fastest.settings,
        unknown=unknown,
        target=target,
        reached=bool(kept),
        error_bound_m=_bound_m(chosen),
        scan_s=fastest.scan_s,
        query_s=chosen.robot[unknown].query_s if chosen.robot else chosen.point_query_s,
        query="pose" if chosen.robot else "point",
        summary=chosen,
    )


def costs(summary: CandidateSummary) -> list[float]:
    """What is to be small: error (its bound where there is one), free space lost, time a scan, and a robot's query."""
    accuracy = summary.accuracy
    assert accuracy is not None
    error_m = accuracy.error_p95_m if summary.error_bound_m is None else summary.error_bound_m
    queries = [float(coarse(summary.robot["occupied"].query_s))] if summary.robot else []
    return [float(f"{error_m:.2g}"), round(1 - accuracy.free_recall, 2), coarse(summary.scan_s), *queries]


def choose_policy(robot: Mapping[str, RobotFigures], target: Target) -> UnknownPolicy:
    """Unknown space is occupied, which is safe, unless that loses more free space than the target allows."""
    if not robot:
        return "free"
    lost_more = robot["occupied"].lost_free - robot["free"].lost_free
    return "occupied" if lost_more <= target.max_lost_free else "free"


def _fastest_engine(chosen: CandidateSummary, same_leaves: Sequence[CandidateSummary]) -> CandidateSummary:
    """Another engine only where it is noticeably faster than the one that chooses by itself; depths are not a matter of
    speed."""
    others = [s for s in same_leaves if replace(s.settings, engine=chosen.settings.engine) == chosen.settings]
    fastest = min([chosen, *others], key=lambda s: s.scan_s)
    return fastest if fastest.scan_s < (1 - _NOTICEABLE) * chosen.scan_s else chosen


def _bound_m(summary: CandidateSummary) -> float:
    assert summary.error_bound_m is not None
    return summary.error_bound_m


def _free_recall(summary: CandidateSummary) -> float:
    assert summary.accuracy is not None
    return summary.accuracy.free_recall
