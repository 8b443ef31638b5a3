"""Inputs at the edge of what numbers can hold, each with what must hold there (benchmarks/extremes.py)."""

from __future__ import annotations

from benchmarks.extreme_cases import log_odds, meshes, poses, scans, threads, voxels
from benchmarks.extreme_cases.case import Case


def all_cases() -> list[Case]:
    """Every case, in the order of the table."""
    return [case for module in (scans, log_odds, meshes, voxels, poses, threads) for case in module.cases()]
