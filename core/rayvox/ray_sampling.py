"""Which rays of a scan are kept where not all are wanted."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

# 2**64 over the golden ratio: multiples of it modulo 2**64 are spread evenly (Knuth, The Art of Computer Programming,
# vol. 3, Sec. 6.4), over every run of consecutive rays alike and in no step with a sensor's rows or rings.
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_HALF = np.uint64(32)


def kept_rays(count: int, share: float) -> npt.NDArray[np.bool_]:
    """Whether each of `count` rays, in the order of the scan, is among the `share` (0 to 1) kept: (count,) bool.

    The same for the same arguments, on every machine and for ever: journals are replayed with it. The first ray stays.
    """
    place = (np.arange(count, dtype=np.uint64) * _GOLDEN) >> _HALF
    kept: npt.NDArray[np.bool_] = place < np.uint64(max(1, round(share * 2.0**32)))
    return kept
