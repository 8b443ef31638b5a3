"""File operations that are on disk when they return."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

from rayvox_service.frame import Bytes

_IOV_MAX = 512


def write_all(descriptor: int, parts: list[Bytes], offset: int) -> int:
    """Write the parts one after the other at `offset`; returns the offset behind them. Raises OSError."""
    views = [memoryview(part).cast("B") for part in parts if len(part)]
    while views:
        written = os.pwritev(descriptor, views[:_IOV_MAX], offset)
        offset += written
        while views and written >= len(views[0]):
            written -= len(views.pop(0))
        if views and written:
            views[0] = views[0][written:]
    return offset


def sync_directory(directory: Path) -> None:
    descriptor = os.open(directory, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def write_file(path: Path, parts: Iterable[Bytes]) -> None:
    """Replace or create `path` at once: after a crash it holds the old bytes or all the new ones."""
    temporary = path.with_name(f".{path.name}.tmp")
    descriptor = os.open(temporary, os.O_CREAT | os.O_TRUNC | os.O_WRONLY, 0o644)
    try:
        try:
            write_all(descriptor, list(parts), 0)
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
        temporary.rename(path)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
    sync_directory(path.parent)
