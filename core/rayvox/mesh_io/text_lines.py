"""Lines of text files, one at a time: a file never becomes a list of all its words."""

from __future__ import annotations

import io
from collections.abc import Iterator

from rayvox.mesh_io.load_limits import LoadBudget

_LINES_PER_CHECK = 1 << 14


def text_lines(data: bytes, budget: LoadBudget, source: str) -> Iterator[tuple[int, bytes]]:
    """Numbered lines, from 1. Raises LoadLimitError."""
    if b"\n" not in data:
        data = data.replace(b"\r", b"\n")
    for number, line in enumerate(io.BytesIO(data), 1):
        if number % _LINES_PER_CHECK == 0:
            budget.check_time(source)
        yield number, line
