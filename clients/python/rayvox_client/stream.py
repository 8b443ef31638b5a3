"""The scan stream with calls that block."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import Self, Unpack

from numpy.typing import ArrayLike

from rayvox_client.async_stream import AsyncScanStream
from rayvox_client.map_changes import MapChanges
from rayvox_client.receipt import RefusedScan, ScanAck
from rayvox_client.scan import PosedScan, Scan, ScanOptions
from rayvox_client.transport import run_blocking


class ScanStream:
    """Scans into one map over a WebSocket, each acknowledged once it is on the service's disk.

        with client.stream("lab") as s:
            for points, T_map_sensor in robot:
                s.push(points, T_map_sensor)

    Leaving the block waits for all acknowledgements. A broken connection is opened again and everything
    unacknowledged is sent again under its scan_id, so that nothing is lost or doubled. One thread at a time.
    """

    def __init__(self, stream: AsyncScanStream) -> None:
        self._stream = stream

    def push(self, points: ArrayLike, T_map_sensor: ArrayLike | None = None, **options: Unpack[ScanOptions]) -> str:
        """Send one scan and return its scan_id. The arguments are those of `Scan`; the arrays are free after.

        Blocks while as many scans as the service allows are unacknowledged. Does not raise for a scan that the
        service refuses: `flush` does.

        Raises:
            InvalidInputError: the scan is wrong; nothing was sent.
            ConnectionFailedError, OverloadedError: the retries are used up; the unacknowledged scans are kept, and
                the next `push` or `flush` tries again.
        """
        return self.push_scan(Scan(points, T_map_sensor, **options))

    def push_scan(self, scan: PosedScan) -> str:
        """Send a `Scan` or `DepthScan` and return its scan_id; otherwise as `push`."""
        return run_blocking(self._stream.push_scan(scan))

    def flush(self) -> None:
        """Wait until every scan is acknowledged or refused.

        Raises:
            ServiceError: the typed error of the first refused scan since the last flush; its note names the scan.
            ConnectionFailedError, OverloadedError: the retries are used up; call again to go on.
        """
        run_blocking(self._stream.flush())

    def settle(self) -> None:
        """Wait until every scan is acknowledged or refused, without raising for the refused ones."""
        run_blocking(self._stream.settle())

    def next_change(self, timeout_s: float | None = None) -> MapChanges | None:
        """The next change of the map on a stream with `subscribe=True`; None when none came within `timeout_s`.

        None as timeout waits for ever. Changes that arrive during `push` and `flush` are kept for this.
        """
        return run_blocking(self._stream.next_change(timeout_s))

    def __iter__(self) -> Iterator[MapChanges]:
        while (change := self.next_change()) is not None:
            yield change

    def open(self) -> None:
        """Connect now, so that a missing map or a wrong key shows here; entering the `with` block does this."""
        run_blocking(self._stream.open())

    def close(self) -> None:
        """Close without waiting for acknowledgements; unacknowledged scans may or may not have arrived."""
        run_blocking(self._stream.close())

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(
        self, exc_type: type[BaseException] | None, exc: BaseException | None, traceback: TracebackType | None
    ) -> None:
        run_blocking(self._stream.__aexit__(exc_type, exc, traceback))

    @property
    def acks(self) -> Sequence[ScanAck]:
        """The most recent acknowledgements (up to 1,024), oldest first."""
        return self._stream.acks

    @property
    def acknowledged(self) -> int:
        """Scans acknowledged on this stream."""
        return self._stream.acknowledged

    @property
    def duplicates(self) -> int:
        """Acknowledged scans that the service had already."""
        return self._stream.duplicates

    @property
    def unacknowledged(self) -> tuple[str, ...]:
        """scan_ids that are on their way, oldest first."""
        return self._stream.unacknowledged

    @property
    def max_in_flight(self) -> int:
        """How many unacknowledged scans the service allows."""
        return self._stream.max_in_flight

    @property
    def last_sequence(self) -> int | None:
        """Journal number of the last acknowledged scan; None before the first."""
        return self._stream.last_sequence

    @property
    def has_refused(self) -> bool:
        """Whether scans were refused since the last `take_refused` or `flush`."""
        return self._stream.has_refused

    def take_refused(self) -> list[RefusedScan]:
        """Scans refused since the last call or `flush`; a `flush` after this does not raise for them."""
        return self._stream.take_refused()

    def __repr__(self) -> str:
        return repr(self._stream).replace("Async", "", 1)
