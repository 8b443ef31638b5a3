"""A map's numbers, for people."""

from __future__ import annotations

from collections.abc import Mapping

_UNITS = ("B", "KiB", "MiB", "GiB")


def byte_text(count: float) -> str:
    """A size with a fitting unit: 1536 -> "1.5 KiB"."""
    unit = 0
    while count >= 1024 and unit < len(_UNITS) - 1:
        count, unit = count / 1024, unit + 1
    return f"{count:.0f} {_UNITS[unit]}" if unit == 0 else f"{count:.1f} {_UNITS[unit]}"


def statistics_lines(statistics: Mapping[str, object]) -> list[str]:
    """One line per group of a map's statistics, as the kernel names them; what is absent is left out."""
    lines = []
    for state in ("occupied", "free"):
        leaves, volume = statistics.get(f"{state}_leaves"), statistics.get(f"{state}_volume_m3")
        if isinstance(leaves, int) and isinstance(volume, int | float):
            lines.append(f"{state:<10}{leaves:>12,} leaves {volume:>12,.2f} m3")
    nodes, size = statistics.get("nodes"), statistics.get("nbytes")
    if isinstance(nodes, int):
        memory = f" {byte_text(size)} of memory" if isinstance(size, int | float) else ""
        lines.append(f"{'octree':<10}{nodes:>12,} nodes {memory:>12}")
    low, high = statistics.get("bounds_lo_m"), statistics.get("bounds_hi_m")
    if isinstance(low, list | tuple) and isinstance(high, list | tuple):
        extent = " x ".join(f"{upper - lower:.2f}" for lower, upper in zip(low, high, strict=True))
        corner = ", ".join(f"{value:.2f}" for value in low)
        lines.append(f"{'extent':<10}{extent} m from ({corner})")
    return lines
