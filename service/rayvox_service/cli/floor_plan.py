"""A map seen from above, in characters."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from rayvox_client import Client

SLICE_M = (0.4, 1.0)
"""Heights between which the map is looked at: table tops and chair backs, but not the floor."""
CHARACTER_ASPECT = 2.0
"""A character is about twice as high as it is wide."""

_SYMBOLS = {"unknown": " ", "free": ".", "occupied": "#", "path": "o"}
_UNICODE_SYMBOLS = {"unknown": " ", "free": "·", "occupied": "█", "path": "•"}


def floor_plan(
    client: Client,
    name: str,
    lo: tuple[float, float],
    hi: tuple[float, float],
    path: NDArray[np.float64],
    *,
    columns: int = 76,
    encoding: str | None = None,
) -> list[str]:
    """Lines of characters, north up, of the map between the corners `lo` and `hi` (x, y in metres).

    path: (n,2) float64 metres, drawn over free space. One box query per character.
    """
    symbols = _UNICODE_SYMBOLS if (encoding or "").lower().replace("-", "") == "utf8" else _SYMBOLS
    width = (hi[0] - lo[0]) / columns
    height = width * CHARACTER_ASPECT
    rows = int(np.ceil((hi[1] - lo[1]) / height))
    row, column = (index.ravel() for index in np.mgrid[0:rows, 0:columns])
    west, south = lo[0] + column * width, lo[1] + row * height
    bottom = np.column_stack([west, south, np.full(west.size, SLICE_M[0])])
    top = np.column_stack([west + width, south + height, np.full(west.size, SLICE_M[1])])
    states = client.boxes(name, bottom, top).states.reshape(rows, columns)
    picture = np.array([symbols["unknown"], symbols["free"], symbols["occupied"]])[states]
    x = ((path[:, 0] - lo[0]) / width).astype(int)
    y = ((path[:, 1] - lo[1]) / height).astype(int)
    inside = (x >= 0) & (x < columns) & (y >= 0) & (y < rows)
    x, y = x[inside], y[inside]
    passed = states[y, x] != 2
    picture[y[passed], x[passed]] = symbols["path"]
    return "\n".join("".join(line).rstrip() for line in picture[::-1]).strip("\n").split("\n")
