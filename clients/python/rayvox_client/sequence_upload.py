"""The two ways in which a sequence of scans goes up."""

from __future__ import annotations

from collections.abc import AsyncGenerator, AsyncIterable, Iterable
from contextlib import aclosing
from typing import TYPE_CHECKING

from rayvox_client.errors import ConflictError, RefusedInputError, TooLargeError
from rayvox_client.frame import Compression
from rayvox_client.receipt import RefusedScan
from rayvox_client.scan import PosedScan
from rayvox_client.sequence import Progress, SequenceReport

if TYPE_CHECKING:
    from rayvox_client.async_client import AsyncClient

Scans = Iterable[PosedScan] | AsyncIterable[PosedScan]


class SequenceUpload:
    """One upload; with `skip_refused` a scan that the service refuses is noted and the rest goes on."""

    def __init__(
        self, client: AsyncClient, map: str, scans: Scans, progress: bool, compression: Compression, skip_refused: bool
    ) -> None:
        self._client = client
        self._map = map
        self._scans = scans
        self._compression = compression
        self._skip_refused = skip_refused
        self._refused: list[RefusedScan] = []
        self._acknowledged = 0
        self._duplicates = 0
        self._last_sequence: int | None = None
        self._progress = Progress(scans, map, progress)

    async def by_stream(self) -> None:
        """All scans through one stream, several in flight."""
        async with (
            self._client.stream(self._map, compression=self._compression) as stream,
            aclosing(_each(self._scans)) as scans,
        ):
            async for scan in scans:
                await stream.push_scan(scan)
                self._progress.count(scan)
                if stream.has_refused and not self._skip_refused:
                    break
            await stream.settle()
            if self._skip_refused:
                self._refused = stream.take_refused()
        self._acknowledged, self._duplicates = stream.acknowledged, stream.duplicates
        self._last_sequence = stream.last_sequence

    async def by_http(self) -> None:
        """One request per scan, one after the other."""
        async with aclosing(_each(self._scans)) as scans:
            async for scan in scans:
                try:
                    receipt = await self._client.insert(
                        self._map, scan, wait="journaled", compression=self._compression
                    )
                except (RefusedInputError, ConflictError, TooLargeError) as error:
                    if not self._skip_refused:
                        raise
                    self._refused.append(RefusedScan(scan.scan_id, error))
                else:
                    self._acknowledged += 1
                    self._duplicates += receipt.duplicate
                    self._last_sequence = receipt.sequence
                self._progress.count(scan)

    def report(self) -> SequenceReport:
        """What became of it until now."""
        return SequenceReport(
            scans=self._acknowledged,
            duplicates=self._duplicates,
            points=self._progress.points,
            seconds=self._progress.elapsed_s,
            last_sequence=self._last_sequence,
            refused=tuple(self._refused),
        )

    def close(self) -> None:
        """End the progress bar."""
        self._progress.close()


async def _each(scans: Scans) -> AsyncGenerator[PosedScan, None]:
    if isinstance(scans, AsyncIterable):
        async for scan in scans:
            yield scan
    else:
        for scan in scans:
            yield scan
