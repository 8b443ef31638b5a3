"""Measurements, made once each and in a bounded time."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from rayvox.robot import Robot
from rayvox.tune.accuracy import map_accuracy
from rayvox.tune.budget import Budget, Progress
from rayvox.tune.candidate import MapSettings
from rayvox.tune.figures import UNKNOWN_POLICIES, MapFigures
from rayvox.tune.ground_truth import GroundTruth
from rayvox.tune.map_run import build_map
from rayvox.tune.map_truth import MapTruth
from rayvox.tune.results_file import ResultsFile
from rayvox.tune.robot_queries import RobotFigures, RobotProbe, point_query_s, robot_probe, with_detail
from rayvox.tune.scan_input import Part
from rayvox.tune.scene_truth import SceneTruth

MOST_REFERENCE_BYTES = 2 << 30
_PASSES = 3  # over the scans, each into a new map; a scan's time is its median
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
        self._cost_s: dict[float, float] = {}  # of one map and its accuracy, by resolution

    def measure_maps(self, settings: MapSettings, until: float = 1.0, accuracy: bool = True) -> list[MapFigures]:
        """Of every part; fewer where that share of the budget is spent.

        accuracy: not for settings whose leaves are those of others that were measured.
        """
        found = []
        for part in self.parts:
            figures = self._once(
                f"map {'' if accuracy else 'times '}{part.name}: {settings!r}",
                lambda part=part: self._map_figures(part, settings, accuracy).to_json(),  # type: ignore[misc]
                self._expected_s(settings.resolution_m),
                until,
                settings.resolution_m,
            )
            if figures is not None:
                found.append(MapFigures.from_json(figures))
        if len(found) < len(self.parts):
            self.not_measured.append(f"{settings} ({len(found)} of {len(self.parts)} parts)")
        return found

    def measure_detail(self, settings: MapSettings, error_m: float) -> list[RobotFigures]:
        """A robot simplified to this error, in maps of these settings, unknown space free."""
        robot = self.robot
        assert robot is not None
        model = with_detail(robot, error_m)

        def figures(part: Part) -> dict[str, Any]:
            octree = build_map(part.scans, settings).occupancy_map.snapshot()
            return asdict(self.probe(part).figures(octree, "free", model))

        expected_s = self._expected_s(settings.resolution_m)
        found = [
            self._once(f"detail {p.name}: {error_m!r} {settings!r}", lambda p=p: figures(p), expected_s)  # type: ignore[misc]
            for p in self.parts
        ]
        return [RobotFigures(**one) for one in found if one is not None]

    def once(self, key: str, work: Callable[[], dict[str, Any]]) -> dict[str, Any] | None:
        """The figures of this key: known ones, or those of `work`; None once the budget is spent."""
        return self._once(key, work)

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
            and bytes_held * 2.0 ** (halvings * _MEMORY_EXPONENT) <= MOST_REFERENCE_BYTES
        ]
        return float(f"{coarse_m / max(finer, default=1.0):.3g}")

    def _map_figures(self, part: Part, settings: MapSettings, accuracy: bool) -> MapFigures:
        runs = [build_map(part.scans, settings) for _ in range(_PASSES)]
        octree = runs[-1].occupancy_map.snapshot()
        truth = self.truth(part)
        robot: dict[str, RobotFigures] = {}
        if accuracy and self.robot is not None:
            robot = {policy: self.probe(part).figures(octree, policy) for policy in UNKNOWN_POLICIES}
        return MapFigures(
            scan_s=float(np.median(np.median([run.scan_s for run in runs], axis=0))),
            scan_bytes=float(np.median(runs[0].scan_bytes)),
            memory_bytes=float(octree.nbytes),
            point_query_s=point_query_s(octree, truth),
            accuracy=map_accuracy(octree, truth) if accuracy else None,
            robot=robot,
        )

    def _once(
        self,
        key: str,
        work: Callable[[], dict[str, Any]],
        expected_s: float = 0.0,
        until: float = 1.0,
        resolution_m: float | None = None,
    ) -> dict[str, Any] | None:
        known = self._results.get(key)
        if known is not None:
            return known
        held_back_s = (1 - until) * self.budget.limit_s
        if not self.budget.affords(expected_s + held_back_s):
            return None
        started = time.monotonic()
        figures = work()
        if resolution_m is not None:
            self._cost_s[resolution_m] = time.monotonic() - started
        self._results.add(key, figures)
        self._progress.measured(key.partition(": ")[0])
        return figures

    def _expected_s(self, resolution_m: float) -> float:
        """From the last measurement at the nearest resolution."""
        known = sorted(self._cost_s.items(), key=lambda item: abs(np.log(item[0] / resolution_m)))
        if not known:
            return 0.0
        measured_m, cost_s = known[0]
        return float(cost_s * max(1.0, measured_m / resolution_m) ** _TIME_EXPONENT)
