"""The recommendation as a settings file of the service."""

from __future__ import annotations

import json
import textwrap

from rayvox.tune.tuning import TuningReport


def settings_toml(report: TuningReport) -> str:
    """TOML with the names of the service's settings; `rayvox serve --settings FILE` takes it."""
    chosen = report.recommendation
    settings = chosen.settings
    values: dict[str, object] = {
        "engine": settings.engine,
        "map_resolution_m": settings.resolution_m,
        "map_depth": settings.depth,
        "map_ray_share": settings.ray_share,
        "map_discretize": settings.discretize,
    }
    if settings.max_range_m is not None:
        values["map_max_range_m"] = settings.max_range_m
    if report.robot is not None:
        values["collision_unknown"] = chosen.unknown
    why = [
        chosen.sentence(),
        f"Measured on {', '.join(report.parts)}, against {report.truth}.",
        "map_* are defaults of new maps; maps that exist already stay as they are.",
    ]
    comments = [f"# {line}" for text in why for line in textwrap.wrap(text, 110)]
    # Strings, numbers and booleans are written in TOML as in JSON.
    return "\n".join([*comments, "", *(f"{name} = {json.dumps(value)}" for name, value in values.items()), ""])
