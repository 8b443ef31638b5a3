"""What was measured, on disk: one JSON line each, appended as it comes, so that an interrupted run can be taken up."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

# Counts what figures mean: those of another meaning are measured again.
_VERSION = 5


class ResultsFile:
    """Figures by key, of one input. Lines of another input are left in the file and ignored, as is a torn last line."""

    def __init__(self, path: Path, fingerprint: str) -> None:
        self._path = path
        self._fingerprint = f"{_VERSION} {fingerprint}"
        self._known: dict[str, dict[str, Any]] = {}
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = path.read_bytes().splitlines() if path.exists() else []
        for line in lines:
            self._remember(line)
        self._file = path.open("ab")
        if path.stat().st_size and not path.read_bytes().endswith(b"\n"):
            self._file.write(b"\n")

    def __len__(self) -> int:
        """Figures known of this input."""
        return len(self._known)

    def get(self, key: str) -> dict[str, Any] | None:
        return self._known.get(key)

    def add(self, key: str, figures: Mapping[str, Any]) -> None:
        """On its way to the disk when this returns."""
        line = {"input": self._fingerprint, "key": key, "figures": dict(figures)}
        self._file.write(json.dumps(line).encode() + b"\n")
        self._file.flush()
        self._known[key] = dict(figures)

    def close(self) -> None:
        self._file.close()

    def _remember(self, line: bytes) -> None:
        try:
            found = json.loads(line)
            if found["input"] == self._fingerprint:
                self._known[found["key"]] = found["figures"]
        except (ValueError, KeyError, TypeError):
            return
