"""Is the recommendation of `rayvox tune` honest on scenes and robots that it was not tuned on?

    python -m benchmarks.tune_honesty [--held-out 20] [--folder FOLDER] [--write NAME]

Tunes on simulated floors with one robot, for several targets, then measures the recommended settings on floors of other
seeds, each with a robot of its own: in how many cases the 95 % surface error stays below the predicted bound, and times
within 30 % of the predicted ones, at equal speed of the machine (rayvox.tune.machine_speed). FOLDER keeps what was
measured: an interrupted run goes on.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import rayvox
from rayvox.tune import Budget, Part, Progress, Recommendation, Target, TuningReport, simulated, tune
from rayvox.tune.budget import standard_progress
from rayvox.tune.results_file import ResultsFile
from rayvox.tune.study import Study

from benchmarks.random_robot import random_robot
from benchmarks.report import print_table, provenance, write_results

TUNED_SEEDS = range(1, 7)
STATIONS = 8
FIRST_HELD_OUT = 101
TARGETS_M = (0.1, 0.05)
TIME_TOLERANCE = 0.3
COLUMNS = ("target", "recommended", "error at most", "kept", "measured / bound, median / max", "ms a scan",
           "within 30 % (median ratio)", "us a pose", "within 30 %", "scans, speed not corrected")  # fmt: skip


@dataclass(frozen=True)
class Case:
    """One held-out floor and robot: what was measured over what had been predicted."""

    error: float
    scan_time: float
    query_time: float
    scan_time_as_measured: float


@cache
def held_out(seed: int) -> Part:
    """A floor that nothing was tuned on."""
    return simulated([seed], STATIONS).parts[0]


def measure(report: TuningReport, seed: int, folder: Path) -> Case:
    """The recommended settings on the floor and the robot of this seed."""
    recommendation = report.recommendation
    budget = Budget(1e9)
    part = held_out(seed)
    target = recommendation.target
    results = ResultsFile(folder / "held_out.jsonl", f"{seed} {target}")
    study = Study([part], random_robot(seed), target.max_error_m, results, budget, Progress(budget))
    (measured,) = study.measure_maps(recommendation.settings)
    results.close()
    figures = measured.at_speed(report.reference_s)
    assert figures.accuracy is not None
    return Case(
        figures.accuracy.error_p95_m / recommendation.error_bound_m,
        figures.scan_s / recommendation.scan_s,
        figures.robot[recommendation.unknown].query_s / recommendation.query_s,
        measured.scan_s / recommendation.scan_s,
    )


def summary(recommendation: Recommendation, cases: list[Case]) -> list[object]:
    """One row."""
    kept = np.mean([case.error <= 1.0 for case in cases])
    row: list[object] = [
        f"{100 * recommendation.target.max_error_m:g} cm",
        str(recommendation.settings),
        f"{100 * recommendation.error_bound_m:.2g} cm",
        f"{100 * kept:.0f} %",
        f"{np.median([c.error for c in cases]):.2f} / {max(c.error for c in cases):.2f}",
    ]
    for name, predicted in (
        ("scan_time", f"{1e3 * recommendation.scan_s:.3g}"),
        ("query_time", f"{1e6 * recommendation.query_s:.3g}"),
        ("scan_time_as_measured", ""),
    ):
        ratios = np.array([getattr(case, name) for case in cases])
        within = f"{100 * np.mean(np.abs(ratios - 1) <= TIME_TOLERANCE):.0f} % ({np.median(ratios):.2f})"
        row += [predicted, within] if predicted else [within]
    return row


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Predictions of rayvox tune on scenes and robots not tuned on.")
    parser.add_argument("--held-out", type=int, default=20, help="floors and robots (default %(default)s)")
    parser.add_argument("--targets", type=float, nargs="+", default=TARGETS_M, metavar="M", help="errors allowed")
    parser.add_argument("--budget", type=float, default=400.0, help="seconds of tuning per target")
    parser.add_argument("--folder", type=Path, default=Path("build/tune_honesty"), help="keeps what was measured")
    parser.add_argument("--write", metavar="NAME", help="write benchmarks/results/NAME.json")
    arguments = parser.parse_args()
    rayvox.set_thread_count(1)
    header, rows = provenance(), []
    floors = simulated(TUNED_SEEDS, STATIONS)
    for part in floors.parts:
        assert part.scans  # made now, so that the budget is for measuring
    for target_m in arguments.targets:
        results_path = arguments.folder / f"tuning_{target_m:g}.jsonl"
        progress = standard_progress(Budget(arguments.budget))
        report = tune(
            floors,
            Target(target_m),
            results_path,
            random_robot(1),
            arguments.budget,
            progress=progress,
        )
        seeds = range(FIRST_HELD_OUT, FIRST_HELD_OUT + arguments.held_out)
        cases = [measure(report, seed, arguments.folder) for seed in seeds]
        rows.append(summary(report.recommendation, cases))
        print_table(COLUMNS, rows)
        if arguments.write:
            print("written:", write_results(arguments.write, header, {"columns": COLUMNS, "rows": rows}))


if __name__ == "__main__":
    main()
