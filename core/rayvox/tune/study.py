"""Measurements, made once each and in a bounded time."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import partial
from statistics import median
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from rayvox.robot import Robot
from rayvox.tune.accuracy import map_accuracy
from rayvox.tune.budget import Budget, Progress
from rayvox.tune.candidate import MapSettings
from rayvox.tune.figures import UNKNOWN_POLICIES, MapFigures
from rayvox.tune.ground_truth import GroundTruth
from rayvox.tune.machine_speed import reference_work_s
from rayvox.tune.map_run import build_map
from rayvox.tune.map_truth import MapTruth
from rayvox.tune.prediction import FEWEST_PARTS
from rayvox.tune.results_file import ResultsFile
from rayvox.tune.robot_queries import RobotFigures, RobotProbe, point_query_s, robot_probe, with_detail
from rayvox.tune.scan_input import Part
from rayvox.tune.scene_truth import SceneTruth

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Figures = TypeVar("Figures", bound="DataclassInstance")
MOST_MAP_BYTES = 2 << 30
_SPEED_SAMPLES = 5
_PASSES = 3  # over the scans, each into a new map; a scan's time is the least, as the reference work's is
_REFERENCE_SHARE = 0.25  # of the budget
# Time and memory grow so with one over the resolution, at most.
_TIME_EXPONENT, _MEMORY_EXPONENT = 2.5, 3.0


class Study:
    """Parts, a robot or none, and what is known of them already. max_error_m: what the user allows."""

    def __init__(
        self,
        parts: Sequence[Part],
        robot: Robot | None,
        max_error_m: float,
        results: ResultsFile,
        budget: Budget,
        progress: Progress,
    ) -> None:
        self.parts, self.robot, self.budget = parts, robot, budget
        self.not_measured: list[str] = []
        self._max_error_m, self._results, self._progress = max_error_m, results, progress
        self._truths: dict[str, GroundTruth] = {}
        self._probes: dict[str, RobotProbe] = {}
        self._costs: dict[float, tuple[float, float]] = {}  # by resolution: seconds and bytes of a map, all told

    def measure_maps(self, settings: MapSettings, until: float = 1.0, accuracy: bool = True) -> list[MapFigures]:
        """Of every part; fewer where that share of the budget is spent, or where maps would not fit into memory.

        accuracy: not for settings whose leaves are those of others that were measured.
        """
        found = []
        for part in self.parts:
            key = f"map {'' if accuracy else 'times '}{part.name}: {settings!r}"
            figures = self._known_or(
                key, partial(self._map_figures, part, settings, accuracy), self.expected_s(settings.resolution_m), until
            )
            if figures is not None:
                found.append(MapFigures.from_json(figures).at_speed(self.reference_s))
        if len(found) < len(self.parts):
            self.not_measured.append(f"{settings} ({len(found)} of {len(self.parts)} parts)")
        return found

    def measure_detail(self, settings: MapSettings, error_m: float) -> list[RobotFigures]:
        """A robot simplified to this error, in maps of these settings, unknown space free; of three parts."""
        assert self.robot is not None
        work = partial(self._detail_figures, with_detail(self.robot, error_m), settings)
        found = [
            self.once(f"detail {part.name}: {error_m!r} {settings!r}", partial(work, part), RobotFigures, settings)
            for part in self.parts[:FEWEST_PARTS]
        ]
        return [figures for figures in found if figures is not None]

    def once(
        self, key: str, work: Callable[[], Figures], kind: type[Figures], settings: MapSettings | None = None
    ) -> Figures | None:
        """The figures of this key: known ones, or those of `work`; None where too little of the budget is left.

        settings: of a map that is built for it.
        """
        expected_s = 0.0 if settings is None else self.expected_s(settings.resolution_m)
        figures = self._known_or(key, work, expected_s)
        return None if figures is None else kind(**figures)

    @property
    def reference_s(self) -> float:
        """The machine's speed that all times of maps are brought to: the one it had when the study began."""
        known = self._results.get("machine")
        if known is None:
            known = {"reference_s": median(reference_work_s() for _ in range(_SPEED_SAMPLES))}
            self._results.add("machine", known)
        return float(known["reference_s"])

    def end(self) -> None:
        """Nothing more is measured."""
        self._progress.end()

    def truth(self, part: Part) -> GroundTruth:
        """The scene where it is known, else a reference map."""
        if part.name not in self._truths:
            scene = part.scene
            if scene is not None:
                self._truths[part.name] = SceneTruth(scene, part.scans, self._max_error_m / 2)
            else:
                reference = build_map(part.scans, MapSettings(self.reference_resolution_m()))
                self._truths[part.name] = MapTruth(reference.occupancy_map.snapshot())
        return self._truths[part.name]

    def probe(self, part: Part) -> RobotProbe:
        """Poses of the robot in this part."""
        assert self.robot is not None
        if part.name not in self._probes:
            self._probes[part.name] = robot_probe(self.robot, self.truth(part))
        return self._probes[part.name]

    def reference_resolution_m(self) -> float:
        """The finest that fits: reference maps of all parts in a quarter of the budget and in 2 GiB."""
        known = self._results.get("reference")
        if known is None:
            known = {"resolution_m": self._finest_that_fits()}
            self._results.add("reference", known)
        return float(known["resolution_m"])

    def _finest_that_fits(self) -> float:
        coarse_m = self._max_error_m
        started = time.monotonic()
        tried = build_map(self.parts[0].scans, MapSettings(coarse_m)).occupancy_map.snapshot()
        MapTruth(tried)
        cost_s = (time.monotonic() - started) * len(self.parts)
        bytes_held = tried.nbytes * len(self.parts)
        finer = [
            2.0**halvings
            for halvings in np.arange(0, 3.01, 0.5)
            if cost_s * 2.0 ** (halvings * _TIME_EXPONENT) <= _REFERENCE_SHARE * self.budget.limit_s
            and bytes_held * 2.0 ** (halvings * _MEMORY_EXPONENT) <= MOST_MAP_BYTES
        ]
        return float(f"{coarse_m / max(finer, default=1.0):.3g}")

    def _map_figures(self, part: Part, settings: MapSettings, accuracy: bool) -> MapFigures:
        started, references = time.monotonic(), [reference_work_s()]
        runs = [build_map(part.scans, settings) for _ in range(_PASSES)]
        references.append(reference_work_s())
        octree = runs[-1].occupancy_map.snapshot()
        truth = self.truth(part)
        robot: dict[str, RobotFigures] = {}
        if accuracy and self.robot is not None:
            robot = {policy: self.probe(part).figures(octree, policy) for policy in UNKNOWN_POLICIES}
        references.append(reference_work_s())
        figures = MapFigures(
            reference_s=median(references),
            scan_s=float(np.median(np.min([run.scan_s for run in runs], axis=0))),
            scan_bytes=float(np.median(runs[0].scan_bytes)),
            memory_bytes=float(octree.nbytes),
            point_query_s=point_query_s(octree, truth),
            accuracy=map_accuracy(octree, truth) if accuracy else None,
            robot=robot,
        )
        self._costs[settings.resolution_m] = (time.monotonic() - started, figures.memory_bytes)
        return figures

    def _detail_figures(self, robot: Robot, settings: MapSettings, part: Part) -> RobotFigures:
        octree = build_map(part.scans, settings).occupancy_map.snapshot()
        return self.probe(part).figures(octree, "free", robot)

    def _known_or(
        self, key: str, work: Callable[[], DataclassInstance], expected_s: float = 0.0, until: float = 1.0
    ) -> dict[str, Any] | None:
        """until: share of the budget that may be spent when it is done."""
        known = self._results.get(key)
        if known is not None:
            return known
        held_back_s = (1 - until) * self.budget.limit_s
        if not self.budget.affords(expected_s + held_back_s):
            return None
        figures = asdict(work())
        self._results.add(key, figures)
        self._progress.measured(key.partition(": ")[0])
        return figures

    def expected_s(self, resolution_m: float) -> float:
        """What a map and its accuracy take, from the last measurement at the nearest resolution.

        Infinity for a map that would be too large.
        """
        if not self._costs:
            return 0.0
        nearest_m = min(self._costs, key=lambda measured_m: abs(math.log(measured_m / resolution_m)))
        cost_s, nbytes = self._costs[nearest_m]
        finer = max(1.0, nearest_m / resolution_m)
        return cost_s * finer**_TIME_EXPONENT if nbytes * finer**_MEMORY_EXPONENT <= MOST_MAP_BYTES else math.inf
