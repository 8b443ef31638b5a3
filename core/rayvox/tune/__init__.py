"""Settings from a need: what every setting costs and loses, measured on the user's scans or on simulated ones."""

from rayvox.tune.budget import Budget, Progress
from rayvox.tune.candidate import MapSettings
from rayvox.tune.recommendation import NothingMeasuredError, Recommendation, Target
from rayvox.tune.scan_input import Part, PosedScan, TuningInput, recorded, simulated
from rayvox.tune.tuning import DEFAULT_BUDGET_S, TuningReport, tune

__all__ = [
    "DEFAULT_BUDGET_S",
    "Budget",
    "MapSettings",
    "NothingMeasuredError",
    "Part",
    "PosedScan",
    "Progress",
    "Recommendation",
    "Target",
    "TuningInput",
    "TuningReport",
    "recorded",
    "simulated",
    "tune",
]
