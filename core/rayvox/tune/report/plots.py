"""Plots of a tuning report, by matplotlib where it is installed."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from rayvox.tune.figures import UNKNOWN_POLICIES, CandidateSummary
from rayvox.tune.tuning import TuningReport

_TARGET, _CHOSEN = "#c05a1c", "#3a7d44"


@dataclass(frozen=True, slots=True)
class Plot:
    """A picture as bytes."""

    title: str
    png: bytes
    svg: bytes


def draw_plots(report: TuningReport) -> dict[str, Plot]:
    """By file name; empty where matplotlib is not installed."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        return {}
    drawings: dict[str, tuple[str, Callable[[Any, TuningReport], None]]] = {
        "front": ("Error against time: the Pareto front", _front),
        "resolutions": ("What resolution costs and gives", _resolutions),
        "factors": ("One factor at a time", _factors),
    }
    if report.robot is not None:
        drawings["robot"] = ("What a planner gets", _robot)
    plots = {}
    for name, (title, draw) in drawings.items():
        figure = Figure(figsize=(10, 4.6), layout="constrained")
        draw(figure, report)
        plots[name] = Plot(title, _bytes(figure, "png"), _bytes(figure, "svg"))
    return plots


def _bytes(figure: Any, kind: str) -> bytes:
    import matplotlib

    out = io.BytesIO()
    # Without a date and with fixed names the same numbers make the same file.
    with matplotlib.rc_context({"svg.hashsalt": "rayvox"}):
        figure.savefig(out, format=kind, dpi=110, metadata={"Date": None} if kind == "svg" else None)
    return out.getvalue()


def _front(figure: Any, report: TuningReport) -> None:
    import matplotlib

    axes = figure.subplots()
    resolutions = sorted({s.settings.resolution_m for s in report.maps})
    colours = matplotlib.colormaps["viridis"]
    front = sorted(
        (s for s, by in zip(report.maps, report.dominated_by, strict=True) if by is None), key=lambda s: s.scan_s
    )
    for i, resolution_m in enumerate(resolutions):
        here = [s for s in report.maps if s.settings.resolution_m == resolution_m]
        colour = colours(i / max(1, len(resolutions) - 1))
        for chosen, alpha, edge in ((front, 1.0, "black"), (None, 0.45, "none")):
            shown = [s for s in here if (s in front) == (chosen is not None)]
            label = f"{100 * resolution_m:.3g} cm" if chosen is not None or not any(s in front for s in here) else None
            axes.scatter(_ms(shown), _error_cm(shown), 46, [colour], alpha=alpha, edgecolors=edge, label=label)
    best = report.recommendation.summary
    axes.scatter(_ms([best]), _error_cm([best]), 260, "none", edgecolors=_CHOSEN, linewidths=2.5, label="recommended")
    axes.axhline(100 * report.target.max_error_m, color=_TARGET, linestyle="--", linewidth=1, label="error allowed")
    axes.set(xscale="log", yscale="log", xlabel="ms per scan", ylabel="95 % surface error, cm")
    axes.set_title("Error against time; black edge: on the Pareto front (with free space and query time)")
    _plain_ticks(axes)
    axes.legend(fontsize=8, ncols=2)


def _resolutions(figure: Any, report: TuningReport) -> None:
    plain = [s for s in report.maps if s.settings.ray_share == 1 and not s.settings.discretize]
    ladder = sorted((s for s in plain if s.settings.max_range_m is None), key=lambda s: s.settings.resolution_m)
    x = [100 * s.settings.resolution_m for s in ladder]
    accuracy = [s.accuracy for s in ladder if s.accuracy is not None]
    errors, shares, costs = figure.subplots(1, 3)
    for name, label in (("error_mean_m", "mean"), ("error_p95_m", "95 %"), ("error_max_m", "max")):
        errors.plot(x, [100 * getattr(a, name) for a in accuracy], "o-", label=label)
    errors.axhline(100 * report.target.max_error_m, color=_TARGET, linestyle="--", linewidth=1)
    errors.set(yscale="log", title="surface error, cm")
    for name, label in (
        ("occupied_precision", "occupied precision"),
        ("occupied_recall", "occupied recall"),
        ("free_recall", "free recall"),
    ):
        shares.plot(x, [getattr(a, name) for a in accuracy], "o-", label=label)
    shares.set(title="share")
    costs.plot(x, [1e3 * s.scan_s for s in ladder], "o-", label="ms per scan")
    costs.plot(x, [s.memory_bytes / 2**20 for s in ladder], "o-", label="map, MiB")
    if all(s.robot for s in ladder):
        costs.plot(x, [1e6 * s.robot["free"].query_s for s in ladder], "o-", label="us per pose")
    costs.set(yscale="log", title="cost")
    for axes in (errors, shares, costs):
        axes.set(xscale="log", xlabel="resolution, cm")
        axes.legend(fontsize=8)
        _plain_ticks(axes)


def _factors(figure: Any, report: TuningReport) -> None:
    """Ratios to the base, one group of bars per factor."""
    base = next(s for s in report.maps if s.settings == report.base)
    varied = [s for s in report.maps if s.settings != report.base and _one_change(s, base)]
    axes = figure.subplots()
    bars: Sequence[tuple[str, Callable[[CandidateSummary], float]]] = (
        ("ms per scan", lambda s: s.scan_s),
        ("95 % error", lambda s: s.accuracy.error_p95_m if s.accuracy else 1.0),
        ("free space lost", lambda s: 1 - s.accuracy.free_recall if s.accuracy else 1.0),
        ("map memory", lambda s: s.memory_bytes),
    )
    for place, (label, value) in enumerate(bars):
        reference = value(base)
        ratios = [value(s) / reference if reference > 0 else 1.0 for s in varied]
        axes.bar([i + 0.2 * (place - 1.5) for i in range(len(varied))], ratios, 0.19, label=label)
    axes.axhline(1.0, color="black", linewidth=0.8)
    axes.set_xticks(range(len(varied)), [str(s.settings).partition(", ")[2] for s in varied])
    axes.set(yscale="log", ylabel="times the base", title=f"One factor at a time, against {report.base}")
    _plain_ticks(axes, "y")
    axes.legend(fontsize=8)


def _robot(figure: Any, report: TuningReport) -> None:
    ladder = [s for s in report.maps if s.robot and _one_change(s, s)]
    wrong, lost = figure.subplots(1, 2)
    for policy in UNKNOWN_POLICIES:
        x = [100 * s.settings.resolution_m for s in ladder]
        wrong.plot(x, [100 * s.robot[policy].false_free for s in ladder], "o-", label=f"unknown is {policy}")
        lost.plot(x, [100 * s.robot[policy].lost_free for s in ladder], "o-", label=f"unknown is {policy}")
    wrong.set(title="colliding poses called free, %")
    lost.set(title="free poses that a planner loses, %", ylim=(0, None))
    for axes in (wrong, lost):
        axes.set(xscale="log", xlabel="resolution, cm")
        axes.legend(fontsize=8)
        _plain_ticks(axes, "x")


def _one_change(summary: CandidateSummary, base: CandidateSummary) -> bool:
    """At the base's resolution, with at most one factor as it does not come; for a summary itself: with none."""
    settings = summary.settings
    changes = (settings.ray_share < 1) + (settings.max_range_m is not None) + settings.discretize
    return settings.resolution_m == base.settings.resolution_m and changes <= (0 if summary is base else 1)


def _ms(summaries: Sequence[CandidateSummary]) -> list[float]:
    return [1e3 * s.scan_s for s in summaries]


def _error_cm(summaries: Sequence[CandidateSummary]) -> list[float]:
    return [100 * s.accuracy.error_p95_m for s in summaries if s.accuracy is not None]


def _plain_ticks(axes: Any, which: str = "both") -> None:
    """10 and 20 rather than 10^1 and 2 x 10^1."""
    from matplotlib.ticker import LogLocator, NullFormatter, ScalarFormatter

    for axis, name in ((axes.xaxis, "x"), (axes.yaxis, "y")):
        if which in ("both", name) and axis.get_scale() == "log":
            axis.set_major_locator(LogLocator(subs=(1, 1.5, 2, 3, 5, 7)))
            formatter = ScalarFormatter()
            formatter.set_scientific(False)
            axis.set_major_formatter(formatter)
            axis.set_minor_formatter(NullFormatter())
