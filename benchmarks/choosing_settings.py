"""The measurements and plots of docs/choosing_settings.md, by one command:

    python -m benchmarks.choosing_settings [--budget 300] [--folder FOLDER]

`rayvox tune` on six simulated floors with a simulated robot; the plots go to docs/images, the tables between the marks
in the page. FOLDER keeps what was measured: an interrupted run goes on.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path

import rayvox
from rayvox.tune import Budget, Target, TuningReport, simulated, tune
from rayvox.tune.budget import standard_progress
from rayvox.tune.report import draw_plots, report_tables, settings_toml, write_report

from benchmarks.random_robot import random_robot
from benchmarks.report import REPOSITORY, provenance

PAGE = REPOSITORY / "docs" / "choosing_settings.md"
IMAGES = REPOSITORY / "docs" / "images"
SEEDS = range(1, 7)
MAX_ERROR_M = 0.08


def filled(page: str, name: str, content: str) -> str:
    """The page with what stands between the marks of this name replaced."""
    marks = re.compile(rf"(<!-- begin {re.escape(name)} -->\n).*?(<!-- end {re.escape(name)} -->)", re.DOTALL)
    page, count = marks.subn(lambda found: f"{found[1]}{content}\n{found[2]}", page)
    if count != 1:
        raise ValueError(f"the page has {count} places for {name}")
    return page


def fill_page(page: str, report: TuningReport, header: dict[str, object]) -> str:
    """The page with this report's tables."""
    how = (
        f"`{header['command']}`, commit {header['commit']}, {header['processor']} ({header['instruction_set']}), one "
        f"thread, Python {header['python']}; {', '.join(report.parts)}, 15 scans each, robot {report.robot}."
    )
    page = filled(page, "provenance", how)
    page = filled(page, "answer", f"> {report.recommendation.sentence()}\n\n```toml\n{settings_toml(report)}```")
    tables = {table.title: table for table in report_tables(report)}
    for title in re.findall(r"<!-- begin table (.*?) -->", page):
        table = tables.get(title)
        text = "(no such settings)" if table is None else f"{table.note}\n\n{table.markdown()}"
        page = filled(page, f"table {title}", text)
    return page


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Measures, and writes docs/choosing_settings.md.")
    parser.add_argument("--budget", type=float, default=300.0, help="seconds (default %(default)s)")
    parser.add_argument("--folder", type=Path, default=Path("build/choosing_settings"), help="keeps what was measured")
    arguments = parser.parse_args()
    rayvox.set_thread_count(1)
    header = provenance()
    report = tune(
        simulated(SEEDS),
        Target(MAX_ERROR_M),
        arguments.folder / "results.jsonl",
        random_robot(1),
        arguments.budget,
        progress=standard_progress(Budget(arguments.budget)),
    )
    write_report(report, arguments.folder)
    IMAGES.mkdir(exist_ok=True)
    for name, plot in draw_plots(report).items():
        (IMAGES / f"settings_{name}.png").write_bytes(plot.png)
    PAGE.write_text(fill_page(PAGE.read_text(encoding="utf-8"), report, header), encoding="utf-8")
    print(report.recommendation.sentence())
    for text in report.not_measured:
        print("not measured:", text)


if __name__ == "__main__":
    main()
