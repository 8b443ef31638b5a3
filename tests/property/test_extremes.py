"""Every row of the extremes table holds, with every instruction set; and the page that quotes it is up to date.

Rows that take long run in benchmarks/extremes.py as they stand, and here with fewer repeats where their number is what
takes long. The other libraries' answers are not asked here.
"""

from __future__ import annotations

import json

import pytest

from benchmarks.extreme_cases import log_odds, meshes, poses, scans, threads, voxels
from benchmarks.extreme_cases.case import Case, holds
from benchmarks.extremes import INSTRUCTION_SETS, PAGE, failures_with, page_with
from benchmarks.report import RESULTS

UPDATES = 50_000
CASES = [
    *scans.cases(),
    *log_odds.cases(UPDATES),
    *meshes.cases(),
    *voxels.cases(),
    *poses.cases(),
    *threads.cases(),
]


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.topic}: {case.name}")
def test_what_must_hold_at_an_extreme_holds(case: Case) -> None:
    outcome = case.run()
    assert holds(case, outcome), f"{case.must_hold}: {outcome}, bound {case.bound} {case.unit}"


@pytest.mark.parametrize("instruction_set", INSTRUCTION_SETS)
def test_every_extreme_holds_with_every_instruction_set(instruction_set: str) -> None:
    outcome = failures_with(instruction_set)
    if outcome is None:
        pytest.skip(f"this processor has no {instruction_set}")
    assert outcome.checked > 1000
    assert outcome.wrong == 0


def test_the_page_quotes_the_committed_results() -> None:
    path = RESULTS / "extremes.json"
    if not path.exists():
        pytest.skip("not measured yet: python -m benchmarks.extremes --write")
    results = json.loads(path.read_text())
    assert all(row["holds"] for row in results["results"])
    page = PAGE.read_text()
    assert page_with(page, results) == page
