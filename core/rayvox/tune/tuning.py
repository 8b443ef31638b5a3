"""From scans and a need to settings: the top of `rayvox tune`."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from rayvox._native import thread_count
from rayvox.robot import Robot
from rayvox.tune.budget import Budget, Progress
from rayvox.tune.candidate import (
    OCTOMAP_DEPTH,
    MapSettings,
    interacting_factors,
    one_factor_at_a_time,
    range_cuts,
    resolution_ladder,
    with_same_leaves,
)
from rayvox.tune.figures import CandidateSummary, mean_robot_figures, summarise
from rayvox.tune.mesh_hierarchies import HIERARCHIES, HierarchyFigures, HierarchyProbe
from rayvox.tune.pareto import coarse, dominators
from rayvox.tune.recommendation import NothingMeasuredError, Recommendation, Target, costs, recommend
from rayvox.tune.results_file import ResultsFile
from rayvox.tune.robot_queries import RobotFigures
from rayvox.tune.scan_encoding import ENCODINGS, EncodingFigures, measure_encoding
from rayvox.tune.scan_input import TuningInput
from rayvox.tune.storage import STORAGE_FORMS, StorageFigures, measure_storage
from rayvox.tune.study import Study

DEFAULT_BUDGET_S = 300.0
# Shares of the budget at which each stage of maps ends, so that the next one gets some.
_LADDER_UNTIL, _FACTORS_UNTIL, _PRODUCTS_UNTIL = 0.45, 0.6, 0.75
_DETAILS_M = (0.0, 0.001, 0.003, 0.01, 0.03)


@dataclass(frozen=True)
class TuningReport:
    """What was measured and what follows from it.

    maps: settings whose accuracy was measured; dominated_by[i]: None where maps[i] is on the Pareto front, else the
    position of one that is nowhere worse. same_leaves: settings that make the recommended map, measured for time.
    base: the settings that factors were varied about. truth: what errors are measured against. details: by the error
    that a simplified robot may have. reference_s: the machine's speed that times are for (machine_speed.py).
    not_measured: for want of time.
    """

    target: Target
    parts: tuple[str, ...]
    truth: str
    robot: str | None
    base: MapSettings
    maps: tuple[CandidateSummary, ...]
    dominated_by: tuple[int | None, ...]
    same_leaves: tuple[CandidateSummary, ...]
    storage: dict[str, StorageFigures]
    encodings: dict[str, EncodingFigures]
    hierarchies: dict[str, HierarchyFigures]
    details: dict[float, RobotFigures]
    reference_s: float
    recommendation: Recommendation
    not_measured: tuple[str, ...]
    spent_s: float


def tune(
    scans: TuningInput,
    target: Target,
    results_path: Path,
    robot: Robot | None = None,
    budget_s: float = DEFAULT_BUDGET_S,
    resolutions_m: Sequence[float] | None = None,
    progress: Progress | None = None,
) -> TuningReport:
    """Measures what settings cost and lose on these scans, and recommends one choice.

    results_path: JSON lines, appended after every measurement; a run on the same input takes up what stands there.
    budget_s: no measurement is begun that is expected to end later; progress should be made with the same limit.
    resolutions_m: those to try, by default around the target's error. Raises NothingMeasuredError, InvalidInputError.
    """
    budget = Budget(budget_s)
    results = ResultsFile(results_path, _fingerprint(scans, target, robot))
    study = Study(scans.parts, robot, target.max_error_m, results, budget, progress or Progress(budget))
    try:
        maps = _measure_resolutions(study, target, resolutions_m)
        base = _coarsest_that_keeps(maps, target)
        encodings, hierarchies = _measure_encodings(study), _measure_hierarchies(study)
        maps = _measure_factors(study, maps, base)
        summaries = [summary for summary in maps.values() if summary.accuracy is not None]
        chosen = recommend(summaries, (), target).settings
        storage, details = _measure_storage(study, chosen), _measure_details(study, chosen)
        same_leaves = _measure_same_leaves(study, chosen)
        return TuningReport(
            target=target,
            parts=tuple(part.name for part in scans.parts),
            truth=_describe_truth(study),
            robot=None if robot is None else robot.name,
            base=base,
            maps=tuple(summaries),
            dominated_by=tuple(dominators(np.array([costs(summary) for summary in summaries]))),
            same_leaves=same_leaves,
            storage=storage,
            encodings=encodings,
            hierarchies=hierarchies,
            details=details,
            reference_s=study.reference_s,
            recommendation=recommend(summaries, same_leaves, target),
            not_measured=tuple(study.not_measured),
            spent_s=budget.spent_s,
        )
    finally:
        study.end()
        results.close()


_Maps = dict[MapSettings, CandidateSummary]


def _measure_resolutions(study: Study, target: Target, resolutions_m: Sequence[float] | None) -> _Maps:
    return _summaries(study, resolution_ladder(target.max_error_m, study.parts, resolutions_m), _LADDER_UNTIL)


def _measure_factors(study: Study, maps: _Maps, base: MapSettings) -> _Maps:
    """One factor at a time about the base, then what gained by itself in all combinations, there and one resolution
    either way."""
    cuts = range_cuts(study.parts)
    found = _summaries(study, one_factor_at_a_time(base, cuts), _FACTORS_UNTIL)
    useful = [settings for settings, summary in found.items() if _gains(summary, maps[base])]
    ladder = list(maps)
    middle = ladder.index(base)
    neighbours = [base, *ladder[middle + 1 : middle + 2], *ladder[max(0, middle - 1) : middle]]
    return maps | found | _summaries(study, interacting_factors(neighbours, useful), _PRODUCTS_UNTIL)


def _gains(summary: CandidateSummary, base: CandidateSummary) -> bool:
    """Whether it is faster than the base, or nearer to the truth."""
    if summary.accuracy is None or base.accuracy is None:
        return False
    return (
        coarse(summary.scan_s) < coarse(base.scan_s) or summary.accuracy.error_p95_m < 0.95 * base.accuracy.error_p95_m
    )


def _summaries(study: Study, candidates: Sequence[MapSettings], until: float) -> _Maps:
    measured = {settings: study.measure_maps(settings, until) for settings in candidates}
    return {settings: summarise(settings, figures) for settings, figures in measured.items() if figures}


def _coarsest_that_keeps(maps: _Maps, target: Target) -> MapSettings:
    """maps: coarse to fine. The finest where none keeps the target. Raises NothingMeasuredError."""
    if not maps:
        raise NothingMeasuredError("nothing was measured: give a larger budget")
    for settings, summary in maps.items():
        if summary.error_bound_m is not None and summary.error_bound_m <= target.max_error_m:
            return settings
    return list(maps)[-1]


def _measure_same_leaves(study: Study, chosen: MapSettings) -> tuple[CandidateSummary, ...]:
    candidates = with_same_leaves(chosen, study.parts)
    measured = [(settings, study.measure_maps(settings, accuracy=False)) for settings in candidates]
    return tuple(summarise(settings, figures) for settings, figures in measured if len(figures) == len(study.parts))


def _measure_storage(study: Study, chosen: MapSettings) -> dict[str, StorageFigures]:
    forms = STORAGE_FORMS if chosen.depth == OCTOMAP_DEPTH else STORAGE_FORMS[:1]
    part = study.parts[0]
    measured = {
        form.name: study.once(
            f"storage {form.name}: {part.name} {chosen!r}",
            partial(measure_storage, part, chosen, form),
            StorageFigures,
            chosen,
        )
        for form in forms
    }
    return {name: figures for name, figures in measured.items() if figures is not None}


def _measure_encodings(study: Study) -> dict[str, EncodingFigures]:
    part = study.parts[0]
    measured = {
        name: study.once(f"encoding {name}: {part.name}", partial(measure_encoding, part.scans, name), EncodingFigures)
        for name in ENCODINGS
    }
    return {name: figures for name, figures in measured.items() if figures is not None}


def _measure_hierarchies(study: Study) -> dict[str, HierarchyFigures]:
    if study.robot is None:
        return {}
    probe = HierarchyProbe(study.robot)
    measured = {
        str(hierarchy): study.once(f"hierarchy {hierarchy}", partial(probe.figures, hierarchy), HierarchyFigures)
        for hierarchy in HIERARCHIES
    }
    return {name: figures for name, figures in measured.items() if figures is not None}


def _measure_details(study: Study, chosen: MapSettings) -> dict[float, RobotFigures]:
    if study.robot is None:
        return {}
    measured = {error_m: study.measure_detail(chosen, error_m) for error_m in _DETAILS_M}
    return {error_m: mean_robot_figures(figures) for error_m, figures in measured.items() if figures}


def _describe_truth(study: Study) -> str:
    if study.parts[0].make_scene is not None:
        return "the simulated scene's true geometry"
    return f"a reference map of the same scans at {100 * study.reference_resolution_m():.3g} cm, every ray inserted"


def _fingerprint(scans: TuningInput, target: Target, robot: Robot | None) -> str:
    digest = hashlib.sha256()
    for link in () if robot is None else robot.links:
        digest.update(link.name.encode() + link.mesh.vertices.tobytes() + link.mesh.triangles.tobytes())
    return f"{scans.fingerprint} {target.max_error_m} {digest.hexdigest()[:16]} {thread_count()}"
