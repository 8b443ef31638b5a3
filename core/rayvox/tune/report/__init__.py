"""A tuning report as files: settings for the service, one page, plots."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rayvox.tune.report.page import html_page
from rayvox.tune.report.plots import draw_plots
from rayvox.tune.report.settings_file import settings_toml
from rayvox.tune.report.tables import Table, report_tables
from rayvox.tune.tuning import TuningReport

__all__ = ["Table", "WrittenReport", "draw_plots", "html_page", "report_tables", "settings_toml", "write_report"]


@dataclass(frozen=True, slots=True)
class WrittenReport:
    """What write_report wrote. plots: empty without matplotlib."""

    settings: Path
    page: Path
    plots: tuple[Path, ...]


def write_report(report: TuningReport, folder: Path) -> WrittenReport:
    """settings.toml, index.html and a PNG of every plot, into the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    plots = draw_plots(report)
    written = WrittenReport(
        folder / "settings.toml", folder / "index.html", tuple(folder / f"{name}.png" for name in plots)
    )
    written.settings.write_text(settings_toml(report), encoding="utf-8")
    written.page.write_text(html_page(report, plots), encoding="utf-8")
    for path, plot in zip(written.plots, plots.values(), strict=True):
        path.write_bytes(plot.png)
    return written
