"""Names of maps and robots: also directory names, so nothing in them may lead out of the data directory."""

from __future__ import annotations

import re
from typing import Literal

from rayvox_service.problems import Problem

_PATTERN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}", re.ASCII)


def check_name(kind: Literal["map", "robot"], name: str) -> str:
    """The name itself. Raises Problem invalid-map-name, invalid-robot-name."""
    if not _PATTERN.fullmatch(name):
        raise Problem(
            f"invalid-{kind}-name",
            f"{name[:80]!r}: a {kind} name is 1 to 64 letters, digits, '_', '-' or '.', the first a letter or a digit",
        )
    return name
