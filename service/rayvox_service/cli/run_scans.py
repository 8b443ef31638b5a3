"""A simulated robot run as the client sends it."""

from __future__ import annotations

import uuid
from collections.abc import Iterator
from pathlib import Path

from rayvox.scan_io import Recording
from rayvox.simulation import RobotRun
from rayvox_client import Scan


class RunScans:
    """The scans of `run`, simulated as they are asked for; written to the folder `record` as well, if one is given."""

    def __init__(self, run: RobotRun, record: Path | None = None) -> None:
        self._run = run
        self._record = record

    def __len__(self) -> int:
        return len(self._run)

    def __iter__(self) -> Iterator[Scan]:
        recording = Recording(self._record) if self._record is not None else None
        try:
            for scan in self._run.scans():
                if recording is not None:
                    recording.write(scan.points, scan.T_map_sensor, scan.stamp_s)
                yield Scan(
                    scan.points,
                    scan.T_map_sensor,
                    max_range_m=scan.max_range_m,
                    no_return=scan.no_return,
                    scan_id=uuid.uuid4(),
                    stamp_s=scan.stamp_s,
                )
        finally:
            if recording is not None:
                recording.close()
