"""Uploading a whole sequence of scans: its report and its progress bar."""

from __future__ import annotations

import importlib
import time
from collections.abc import AsyncIterable, Iterable, Sized
from dataclasses import dataclass, field
from typing import Any, Literal

from rayvox_client.receipt import RefusedScan
from rayvox_client.scan import PosedScan

Via = Literal["stream", "http"]


@dataclass(frozen=True)
class SequenceReport:
    """What became of an uploaded sequence.

    Attributes:
        scans: acknowledged scans, on the service's disk. duplicates: those of them that it had before.
        points: measured points in all scans that were sent.
        seconds: from the first scan to the last acknowledgement (to the last one applied, where asked for).
        last_sequence: journal number of the last acknowledged scan.
        refused: scans that the service refused, with the typed error of each.
    """

    scans: int
    duplicates: int
    points: int
    seconds: float
    last_sequence: int | None
    refused: tuple[RefusedScan, ...] = field(default=())

    @property
    def points_per_s(self) -> float:
        """Points per second over the whole upload."""
        return self.points / self.seconds if self.seconds > 0 else 0.0

    def __str__(self) -> str:
        notes = f", {self.duplicates} there already" if self.duplicates else ""
        notes += f", {len(self.refused)} refused" if self.refused else ""
        return (
            f"{self.scans} scans, {self.points:,} points in {self.seconds:.2f} s "
            f"({self.points_per_s:,.0f} points/s){notes}"
        )


class Progress:
    """A tqdm bar that counts scans and shows points per second; silent when not wanted."""

    def __init__(self, scans: Iterable[object] | AsyncIterable[object], map_name: str, shown: bool) -> None:
        self.points = 0
        self.started_s = time.perf_counter()
        self._bar: Any = None
        if shown:
            total = len(scans) if isinstance(scans, Sized) else None
            self._bar = importlib.import_module("tqdm").tqdm(total=total, desc=map_name, unit="scan")

    def count(self, scan: PosedScan) -> None:
        """One more scan was sent."""
        self.points += scan.point_count
        if self._bar is not None:
            elapsed_s = max(time.perf_counter() - self.started_s, 1e-9)
            self._bar.set_postfix_str(f"{self.points / elapsed_s / 1e6:.2f} M points/s", refresh=False)
            self._bar.update()

    def close(self) -> None:
        """Leave the bar as it stands."""
        if self._bar is not None:
            self._bar.close()

    @property
    def elapsed_s(self) -> float:
        """Seconds since the start."""
        return time.perf_counter() - self.started_s
