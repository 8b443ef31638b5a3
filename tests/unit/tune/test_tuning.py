"""From scans to a recommendation, on small inputs."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from rayvox.robot import Link, LinkGeometry, Robot
from rayvox.robot.primitives import box_mesh
from rayvox.scan_io import PosedFile, Recording
from rayvox.tune import NothingMeasuredError, PosedScan, Target, TuningReport, recorded, tune
from rayvox.tune.budget import Budget, Progress
from rayvox.tune.candidate import MapSettings, fewest_levels, interacting_factors, one_factor_at_a_time
from rayvox.tune.figures import CandidateSummary
from rayvox.tune.recommendation import recommend
from rayvox.tune.report import report_tables, settings_toml, write_report
from rayvox.tune.robot_queries import RobotFigures

from tests.support.tuning_input import small_input, small_part

BOX = Robot("box", [Link("body", (LinkGeometry("mesh", box_mesh((0.5, 0.4, 0.6))),))], [])
RESOLUTIONS_M = (0.4, 0.2)


def run(folder: Path, robot: Robot | None = BOX, with_truth: bool = True) -> TuningReport:
    scans = small_input(with_truth=with_truth)
    return tune(scans, Target(0.3, 0.2), folder / "results.jsonl", robot, 1e6, RESOLUTIONS_M)


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> TuningReport:
    return run(tmp_path_factory.mktemp("tuning"))


def test_a_report_has_every_factor_and_a_recommendation_that_keeps_the_target(report: TuningReport) -> None:
    settings = [s.settings for s in report.maps]
    assert {s.resolution_m for s in settings} >= set(RESOLUTIONS_M)
    assert any(s.ray_share < 1 for s in settings)
    assert any(s.max_range_m for s in settings)
    assert any(s.discretize for s in settings)
    assert {s.settings.engine for s in report.same_leaves} == {"auto", "dda", "beam", "embree"}
    assert len(report.storage) == 4
    assert len(report.encodings) == 4
    assert len(report.hierarchies) > 10
    assert 0.0 in report.details
    assert report.recommendation.reached
    assert report.recommendation.error_bound_m <= 0.3
    assert report.not_measured == ()


def test_dominated_settings_name_better_ones(report: TuningReport) -> None:
    assert None in report.dominated_by
    for by in report.dominated_by:
        assert by is None or report.dominated_by[by] is None


def test_what_was_measured_is_not_measured_again(tmp_path: Path) -> None:
    first = run(tmp_path, None)
    lines = (tmp_path / "results.jsonl").read_bytes()
    again = run(tmp_path, None)
    assert (tmp_path / "results.jsonl").read_bytes() == lines
    assert again.recommendation.sentence() == first.recommendation.sentence()


def test_an_interrupted_run_goes_on_where_it_was(tmp_path: Path) -> None:
    run(tmp_path, None)
    path = tmp_path / "results.jsonl"
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:7]) + lines[7][:20])
    run(tmp_path, None)
    after = path.read_bytes().splitlines()
    assert after[:7] == [line.rstrip(b"\n") for line in lines[:7]]
    keys = [json.loads(line)["key"] for line in [*after[:7], *after[8:]]]
    assert len(keys) == len(set(keys))


def test_a_budget_that_is_spent_ends_the_measurements(tmp_path: Path) -> None:
    with pytest.raises(NothingMeasuredError, match="larger budget"):
        tune(small_input(), Target(0.3), tmp_path / "results.jsonl", None, 1e-6, RESOLUTIONS_M)
    assert (tmp_path / "results.jsonl").read_bytes() == b""
    assert Budget(10.0).affords(5.0)
    assert not Budget(10.0).affords(11.0)


def test_recorded_scans_are_judged_by_a_finer_map(tmp_path: Path) -> None:
    report = run(tmp_path, None, with_truth=False)
    assert report.truth.startswith("a reference map of the same scans at ")
    assert report.recommendation.query == "point"
    assert report.details == report.hierarchies == {}
    errors = [s.accuracy.error_p95_m for s in report.maps if s.accuracy is not None and s.settings.ray_share == 1]
    assert min(errors) > 0


def test_a_sequence_is_measured_in_stretches(tmp_path: Path) -> None:
    scans = small_part(1, stations=6).scans
    with Recording(tmp_path) as recording:
        for index, scan in enumerate(scans):
            recording.write(scan.points, scan.T_map_sensor, float(index))
    files = [
        PosedFile(path, s.T_map_sensor, None) for path, s in zip(sorted(tmp_path.glob("*.npy")), scans, strict=True)
    ]
    found = recorded(files, lambda file: PosedScan(np.load(file.path), file.T_map_sensor))
    together = [scan for part in found.parts for scan in part.scans]
    assert len(found.parts) == len(files) // 2
    assert [len(scan.points) for scan in together] == [len(scan.points) for scan in scans]
    assert all(len(part.scans) >= 2 for part in found.parts)
    assert recorded(files, lambda _: scans[0], "other").fingerprint != found.fingerprint


def test_the_report_is_written_as_page_settings_and_pictures(report: TuningReport, tmp_path: Path) -> None:
    written = write_report(report, tmp_path / "out")
    page = written.page.read_text()
    for table in report_tables(report):
        assert f"<h2>{table.title}</h2>" in page
        assert all(len(row) == len(table.header) for row in table.rows)
        assert table.markdown().count("\n") == len(table.rows) + 1
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert written.settings.read_text() == settings_toml(report)
    pytest.importorskip("matplotlib")
    assert [path.name for path in written.plots] == ["front.png", "resolutions.png", "factors.png", "robot.png"]
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in written.plots)


def summary(resolution_m: float, scan_s: float, bound_m: float, free: float, **settings: object) -> CandidateSummary:
    from rayvox.tune.accuracy import MapAccuracy

    accuracy = MapAccuracy(1.0, 1.0, free, bound_m / 3, bound_m / 2, bound_m / 2, bound_m, bound_m / 2, bound_m / 2)
    robot = {"free": RobotFigures(1e-5, 0.1, 0.1, 0.1), "occupied": RobotFigures(2e-5, 0.0, 0.1, 0.15)}
    chosen = MapSettings(resolution_m, **settings)  # type: ignore[arg-type]
    return CandidateSummary(chosen, 6, scan_s, 1e6, 1e6, 1e-7, accuracy, bound_m, robot)


def test_the_fastest_settings_within_the_target_are_recommended() -> None:
    candidates = [summary(0.2, 1e-3, 0.12, 0.8), summary(0.1, 2e-3, 0.06, 0.85), summary(0.05, 8e-3, 0.03, 0.9)]
    assert recommend(candidates, (), Target(0.1)).settings.resolution_m == 0.1
    assert recommend(candidates, (), Target(0.1, 0.01)).settings.resolution_m == 0.05
    missed = recommend(candidates, (), Target(0.01))
    assert (missed.settings.resolution_m, missed.reached) == (0.05, False)
    assert missed.sentence().startswith("Nothing measured keeps the error below 1 cm")


def test_another_engine_is_recommended_only_where_it_is_noticeably_faster() -> None:
    chosen = summary(0.1, 10e-3, 0.06, 0.9)
    a_little = summary(0.1, 9.5e-3, 0.06, 0.9, engine="dda")
    clearly = summary(0.1, 5e-3, 0.06, 0.9, engine="beam")
    assert recommend([chosen], [a_little], Target(0.1)).settings.engine == "auto"
    faster = recommend([chosen], [a_little, clearly], Target(0.1))
    assert (faster.settings.engine, faster.scan_s) == ("beam", 5e-3)


def test_unknown_space_is_occupied_unless_that_loses_too_much() -> None:
    assert recommend([summary(0.1, 1e-3, 0.06, 0.9)], (), Target(0.1, 0.1)).unknown == "occupied"
    assert recommend([summary(0.1, 1e-3, 0.06, 0.9)], (), Target(0.1, 0.01)).unknown == "free"


def test_only_factors_that_gained_something_are_combined() -> None:
    base = MapSettings(0.1)
    factors = one_factor_at_a_time(base, [None, 8.0, 5.0])
    assert {(s.ray_share, s.max_range_m, s.discretize) for s in factors} == {
        (0.5, None, False), (0.25, None, False), (1.0, 8.0, False), (1.0, 5.0, False), (1.0, None, True),
    }  # fmt: skip
    combined = interacting_factors([base], [factors[0], factors[3]])
    assert {(s.ray_share, s.max_range_m, s.discretize) for s in combined} == {
        (1.0, None, False), (0.5, None, False), (1.0, 5.0, False), (0.5, 5.0, False),
    }  # fmt: skip


def test_an_octree_of_the_fewest_levels_holds_every_ray() -> None:
    from rayvox.tune.map_run import build_map

    part = small_part(1)
    levels = fewest_levels(0.05, [part])
    assert levels < 16
    direct = build_map(part.scans, MapSettings(0.05)).occupancy_map
    shallow = build_map(part.scans, MapSettings(0.05, depth=levels)).occupancy_map
    assert shallow.statistics().occupied_leaves == direct.statistics().occupied_leaves
    assert shallow.statistics().free_volume_m3 == direct.statistics().free_volume_m3


def test_progress_says_how_much_of_the_budget_is_spent(capsys: pytest.CaptureFixture[str]) -> None:
    import sys

    progress = Progress(Budget(100.0), sys.stderr, every_s=0.0)
    progress.measured("map floor 1")
    line = capsys.readouterr().err
    assert "of 100 s" in line
    assert "1 measured  map floor 1" in line
    Progress(Budget(100.0)).measured("nothing is said")
    assert capsys.readouterr().err == ""
