"""What was measured, as tables of text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rayvox.tune.candidate import MapSettings
from rayvox.tune.figures import UNKNOWN_POLICIES, CandidateSummary
from rayvox.tune.tuning import TuningReport


@dataclass(frozen=True)
class Table:
    """note: what the columns mean. strong: rows to be set off."""

    title: str
    note: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    strong: frozenset[int] = frozenset()

    def markdown(self) -> str:
        lines = [self.header, ("---",) * len(self.header), *self.rows]
        shown = [
            tuple(f"**{cell}**" if i - 2 in self.strong and cell else cell for cell in line)
            for i, line in enumerate(lines)
        ]
        return "\n".join("| " + " | ".join(line) + " |" for line in shown)


def report_tables(report: TuningReport) -> list[Table]:
    """Those that have rows, the Pareto front first."""
    tables = [
        _front(report),
        _resolutions(report),
        _factors(report),
        _policies(report),
        _dominated(report),
        _same_leaves(report),
        _details(report),
        _storage(report),
        _encodings(report),
        _hierarchies(report),
    ]
    return [table for table in tables if table.rows]


_MAP_HEADER = (
    "settings", "error mean / 95 % / max, cm", "95 % at most, cm", "precision", "recall", "free recall", "ms a scan",
    "map MiB", "kB a scan",
)  # fmt: skip
_ROBOT_HEADER = ("us a pose", "false free", "false collision", "lost free")


def _front(report: TuningReport) -> Table:
    front = [s for s, by in zip(report.maps, report.dominated_by, strict=True) if by is None]
    front.sort(key=lambda s: s.scan_s)
    note = (
        "Settings that no others beat in error, free space kept, time a scan and time a query at once. Error: distance "
        "between the map's occupied voxels and true surfaces, the worse of both directions. At most: what the 95 % "
        "error of the next scene stays below (99 % prediction). Precision: occupied voxels that hold something; "
        "recall: seen surface in occupied voxels; free recall: seen free space that the map calls free."
    )
    return _map_table("The Pareto front", note, front, report)


def _resolutions(report: TuningReport) -> Table:
    ladder = [s for s in report.maps if _is_plain(s.settings)]
    return _map_table("Resolution alone", "Every ray, no cut.", ladder, report)


def _factors(report: TuningReport) -> Table:
    base = report.base
    varied = [s for s in report.maps if s.settings.resolution_m == base.resolution_m and _changes(s.settings) <= 1]
    note = "Each factor by itself, at the coarsest resolution that keeps the target."
    return _map_table("One factor at a time", note, varied, report)


def _map_table(title: str, note: str, summaries: Sequence[CandidateSummary], report: TuningReport) -> Table:
    chosen = report.recommendation.summary.settings
    robots = bool(summaries) and all(s.robot for s in summaries)
    return Table(
        title,
        note + (" The robot's columns are for unknown space taken for free." if robots else ""),
        _MAP_HEADER + (_ROBOT_HEADER if robots else ()),
        tuple(_map_row(s) + (_robot_cells(s, "free") if robots else ()) for s in summaries),
        frozenset(i for i, s in enumerate(summaries) if s.settings == chosen),
    )


def _map_row(summary: CandidateSummary) -> tuple[str, ...]:
    a = summary.accuracy
    assert a is not None
    bound = "" if summary.error_bound_m is None else _cm(summary.error_bound_m)
    return (
        str(summary.settings),
        f"{_cm(a.error_mean_m)} / {_cm(a.error_p95_m)} / {_cm(a.error_max_m)}",
        bound,
        f"{a.occupied_precision:.3f}",
        f"{a.occupied_recall:.3f}",
        f"{a.free_recall:.3f}",
        f"{1e3 * summary.scan_s:.3g}",
        f"{summary.memory_bytes / 2**20:.3g}",
        f"{summary.scan_bytes / 1e3:.0f}",
    )


def _robot_cells(summary: CandidateSummary, policy: str) -> tuple[str, ...]:
    robot = summary.robot[policy]
    shares = (robot.false_free, robot.false_collision, robot.lost_free)
    return (f"{1e6 * robot.query_s:.3g}", *(_percent(share) for share in shares))


def _policies(report: TuningReport) -> Table:
    plain = [s for s in report.maps if s.robot and (_is_plain(s.settings) or s is report.recommendation.summary)]
    chosen = (report.recommendation.summary.settings, report.recommendation.unknown)
    keys = [(s, policy) for s in plain for policy in UNKNOWN_POLICIES]
    return Table(
        "What unknown space is",
        "False free: poses that collide in truth and are called free. False collision: free ones called occupied. Lost "
        "free: free ones that a planner cannot use, unknown space included.",
        ("settings", "unknown is", *_ROBOT_HEADER),
        tuple((str(s.settings), policy, *_robot_cells(s, policy)) for s, policy in keys),
        frozenset(i for i, (s, policy) in enumerate(keys) if (s.settings, policy) == chosen),
    )


def _dominated(report: TuningReport) -> Table:
    pairs = [(s, report.maps[by]) for s, by in zip(report.maps, report.dominated_by, strict=True) if by is not None]
    return Table(
        "Dominated",
        "Settings for which others are nowhere worse and somewhere better: use those.",
        ("settings", "error 95 %, cm", "ms a scan", "dominated by", "error 95 %, cm", "ms a scan"),
        tuple((*_short(s), *_short(better)) for s, better in pairs),
    )


def _short(summary: CandidateSummary) -> tuple[str, str, str]:
    assert summary.accuracy is not None
    return str(summary.settings), _cm(summary.accuracy.error_p95_m), f"{1e3 * summary.scan_s:.3g}"


def _same_leaves(report: TuningReport) -> Table:
    rows = [report.recommendation.summary, *report.same_leaves]
    return Table(
        "Engines and levels",
        "The same leaves as the recommended settings', so that only time and memory differ.",
        ("settings", "ms a scan", "map MiB"),
        tuple((str(s.settings), f"{1e3 * s.scan_s:.3g}", f"{s.memory_bytes / 2**20:.3g}") for s in rows)
        if report.same_leaves
        else (),
        frozenset(i for i, s in enumerate(rows) if s.settings == report.recommendation.settings),
    )


def _details(report: TuningReport) -> Table:
    return Table(
        "Level of detail of the robot",
        "Links simplified to a proven error, which is added as padding; unknown space is free.",
        ("error at most, mm", *_ROBOT_HEADER),
        tuple(
            (
                f"{1e3 * error_m:g}",
                f"{1e6 * f.query_s:.3g}",
                *(_percent(share) for share in (f.false_free, f.false_collision, f.lost_free)),
            )
            for error_m, f in report.details.items()
        ),
    )


def _storage(report: TuningReport) -> Table:
    return Table(
        "The map as it is stored and sent",
        "Stored halfway, read back, and gone on with: how much of the map is then in another state.",
        ("form", "kB", "volume in another state", "largest change of log-odds"),
        tuple(
            (name, f"{f.bytes_per_map / 1e3:.0f}", _percent(f.changed_states), f"{f.log_odds_error:.2g}")
            for name, f in report.storage.items()
        ),
    )


def _encodings(report: TuningReport) -> Table:
    return Table(
        "A scan on the wire",
        "Points as the client can send them; a frame adds some 300 bytes.",
        ("form", "kB a scan", "ms to encode", "rounding, mm"),
        tuple(
            (
                name,
                f"{f.bytes_per_scan / 1e3:.0f}",
                f"{1e3 * f.encode_s:.2g}",
                "out of range" if np.isnan(f.rounding_m) else f"{1e3 * f.rounding_m:.2g}",
            )
            for name, f in report.encodings.items()
        ),
    )


def _hierarchies(report: TuningReport) -> Table:
    return Table(
        "Hierarchies of k-DOPs",
        "The robot against a copy of itself: the same verdicts, so that only time and memory differ.",
        ("hierarchy", "us a pose", "kB"),
        tuple((name, f"{1e6 * f.query_s:.3g}", f"{f.nbytes / 1e3:.0f}") for name, f in report.hierarchies.items()),
    )


def _is_plain(settings: MapSettings) -> bool:
    return _changes(settings) == 0


def _changes(settings: MapSettings) -> int:
    """Factors beside the resolution that are not as they come."""
    return (settings.ray_share < 1) + (settings.max_range_m is not None) + settings.discretize


def _cm(metres: float) -> str:
    return f"{100 * metres:.2g}" if metres < 0.1 else f"{100 * metres:.0f}"


def _percent(share: float) -> str:
    return "-" if np.isnan(share) else f"{100 * share:.1f} %"
