"""Data flows one way: the kernel knows nothing above it, service and client meet only in bytes."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

# Package folder -> our packages it may import from.
ALLOWED = {
    "core/rayvox": {"rayvox"},
    "clients/python/rayvox_client": {"rayvox_client"},
    "service/rayvox_service": {"rayvox", "rayvox_service"},
}
OURS = {"rayvox", "rayvox_client", "rayvox_service"}
# The command line is the one place where both ends meet.
CLI = ROOT / "service/rayvox_service/cli"

# Kernel folders, top first: each may include from itself and from what stands after it.
KERNEL_LAYERS = ["", "robot", "map_collision", "collision", "ray_shooting", "octree", "simd", "parallel", "geometry"]


def imported_packages(file: Path) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            names.add(node.module.split(".")[0])
    return names


@pytest.mark.parametrize("folder", ALLOWED)
def test_a_package_imports_only_what_lies_below_it(folder: str) -> None:
    files = [file for file in (ROOT / folder).rglob("*.py") if not file.is_relative_to(CLI)]
    assert files
    for file in files:
        assert imported_packages(file) & OURS <= ALLOWED[folder], file


def test_importing_rayvox_and_its_service_does_not_import_open3d() -> None:
    code = "import sys, rayvox, rayvox.scan_io, rayvox_service.app, rayvox_client; sys.exit('open3d' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], timeout=60).returncode == 0


def test_kernel_folders_include_only_downwards() -> None:
    kernel = ROOT / "core/cpp/rayvox"
    # The kernels' translation units are instantiated from sources of the layers above, and share their plain
    # structs.
    exempt = {"simd"}
    for file in [*kernel.rglob("*.hpp"), *kernel.rglob("*.cpp")]:
        layer = file.parent.relative_to(kernel).as_posix().replace(".", "")
        if layer in exempt:
            continue
        for included in re.findall(r'#include "rayvox/([^"]+)"', file.read_text()):
            below = str(Path(included).parent).replace(".", "")
            if below == "" and included == "error.hpp":
                continue
            assert KERNEL_LAYERS.index(below) >= KERNEL_LAYERS.index(layer), f"{file}: {included}"
