"""The report as one HTML page that needs nothing else."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from html import escape

from rayvox.tune.report.plots import Plot
from rayvox.tune.report.settings_file import settings_toml
from rayvox.tune.report.tables import Table, report_tables
from rayvox.tune.tuning import TuningReport

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 76rem; margin: 2rem auto; padding: 0 1rem; color: #1c1c1c; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin: 2.2rem 0 .3rem; }
.answer { font-size: 1.15rem; background: #eef4ec; border-left: 5px solid #3a7d44; padding: .8rem 1rem; }
.missed { background: #fbefe6; border-color: #c05a1c; }
.note { color: #555; max-width: 60rem; margin: .2rem 0 .6rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .88rem; }
th, td { padding: .25rem .6rem; border-bottom: 1px solid #ddd; text-align: right; white-space: nowrap; }
th { white-space: normal; vertical-align: bottom; }
th:first-child, td:first-child { text-align: left; }
tr.strong td { font-weight: 600; background: #eef4ec; }
pre { background: #f6f6f6; padding: .8rem 1rem; overflow-x: auto; }
img { max-width: 100%; }
"""


def html_page(report: TuningReport, plots: Mapping[str, Plot]) -> str:
    """Answer first, then the settings file, plots and every table."""
    answer = report.recommendation
    state = "answer" if answer.reached else "answer missed"
    measured = f"{len(report.maps)} settings on {', '.join(report.parts)}, against {report.truth}"
    robot = "" if report.robot is None else f"; robot: {report.robot}"
    sections = [
        f'<p class="{state}">{escape(answer.sentence())}</p>',
        f'<p class="note">Measured: {escape(measured + robot)}; {report.spent_s:.0f} s.</p>',
        f"<pre>{escape(settings_toml(report))}</pre>",
        *(_image(plot) for plot in plots.values()),
        *(_table(table) for table in report_tables(report)),
        _not_measured(report),
    ]
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>rayvox: settings from measurements</title>'
        f"<style>{_STYLE}</style></head><body>\n<h1>Settings from measurements</h1>\n"
        + "\n".join(section for section in sections if section)
        + "\n</body></html>\n"
    )


def _image(plot: Plot) -> str:
    data = base64.b64encode(plot.svg).decode()
    return f'<figure><img alt="{escape(plot.title)}" src="data:image/svg+xml;base64,{data}"></figure>'


def _table(table: Table) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in table.header)
    rows = "\n".join(
        ('<tr class="strong">' if i in table.strong else "<tr>")
        + "".join(f"<td>{escape(cell)}</td>" for cell in row)
        + "</tr>"
        for i, row in enumerate(table.rows)
    )
    return (
        f'<h2>{escape(table.title)}</h2><p class="note">{escape(table.note)}</p>'
        f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>\n{rows}\n</tbody></table></div>'
    )


def _not_measured(report: TuningReport) -> str:
    if not report.not_measured:
        return ""
    items = "".join(f"<li>{escape(text)}</li>" for text in report.not_measured)
    note = "The time was over; the same command goes on."
    return f'<h2>Not measured, or not on all parts</h2><p class="note">{note}</p><ul>{items}</ul>'
