"""The committed stub is what the bindings say."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]


def test_the_committed_stub_equals_the_generated_one(tmp_path: Path) -> None:
    generated = tmp_path / "_native.pyi"
    pattern = ROOT / "core/bindings/stub_pattern.txt"
    command = [
        sys.executable,
        "-m",
        "nanobind.stubgen",
        "-m",
        "rayvox._native",
        "-p",
        str(pattern),
        "-o",
        str(generated),
    ]
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    assert generated.read_text() == (ROOT / "core/rayvox/_native.pyi").read_text()
