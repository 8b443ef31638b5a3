"""Map names: also directory names, so nothing in them may lead out of the data directory."""

from __future__ import annotations

import re

from rayvox_service.problems import Problem

NAME_PATTERN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}", re.ASCII)


def check_map_name(name: str) -> str:
    """The name itself. Raises Problem invalid-map-name."""
    if not NAME_PATTERN.fullmatch(name):
        raise Problem(
            "invalid-map-name",
            f"{name[:80]!r}: a map name is 1 to 64 letters, digits, '_', '-' or '.', starting with a letter or a digit",
        )
    return name
