"""Set-up on machines where something is missing. Each runs a copy of bootstrap.py in a folder of its own."""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

BOOTSTRAP = Path(__file__).resolve().parents[2] / "bootstrap.py"


@pytest.fixture
def house(tmp_path: Path) -> Path:
    """A repository with one kernel source, never installed."""
    root = tmp_path / "house"
    (root / "core" / "cpp").mkdir(parents=True)
    (root / "pyproject.toml").write_text("[project]\n")
    (root / "core" / "cpp" / "kernel.cpp").write_text("int kernel;\n")
    shutil.copy(BOOTSTRAP, root)
    return root


@pytest.fixture
def tools(tmp_path: Path) -> Path:
    """A folder of programs that is the whole PATH."""
    folder = tmp_path / "tools"
    folder.mkdir()
    return folder


def bootstrap(house: Path, tools: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PATH": str(tools)}
    environment.pop("CXX", None)
    command = [sys.executable, str(house / "bootstrap.py"), *arguments]
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False)


def fake_program(path: Path, script: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)


def pretend_installed(house: Path) -> None:
    fake_program(house / ".venv" / "bin" / "python", 'echo "ran: $*"')
    code = "import bootstrap; (bootstrap.VENV / 'rayvox-runtime.stamp').write_text(bootstrap.fingerprint())"
    subprocess.run([sys.executable, "-c", code], cwd=house, check=True)


@pytest.mark.parametrize("command", ["demo", "test", "lint", "sanitize", "install"])
def test_a_missing_compiler_is_one_line_that_says_what_to_install(house: Path, tools: Path, command: str) -> None:
    result = bootstrap(house, tools, command)
    assert result.returncode == 1
    assert result.stderr.splitlines() == [
        "rayvox: no C++ compiler found (looked for c++, g++, clang++). Install one, e.g.: apt install g++"
    ]
    assert not (house / ".venv").exists()


def test_a_compiler_that_is_too_old_is_one_line(house: Path, tools: Path) -> None:
    fake_program(tools / "g++", "exit 1")
    result = bootstrap(house, tools, "demo")
    assert result.returncode == 1
    assert len(result.stderr.splitlines()) == 1
    assert "does not understand C++20" in result.stderr


def test_nothing_is_installed_again_when_nothing_changed(house: Path, tools: Path) -> None:
    pretend_installed(house)
    result = bootstrap(house, tools, "demo", "--exit")
    assert result.stdout == "ran: -m rayvox_service.cli demo --exit\n"
    assert result.returncode == 0


def test_a_changed_kernel_source_is_built_again(house: Path, tools: Path) -> None:
    pretend_installed(house)
    (house / "core" / "cpp" / "kernel.cpp").write_text("int other_kernel;\n")
    result = bootstrap(house, tools, "demo")
    assert result.returncode == 1
    assert "no C++ compiler" in result.stderr, "it went on to build"


def test_a_venv_whose_python_is_gone_is_made_again(house: Path, tools: Path) -> None:
    pretend_installed(house)
    (house / ".venv" / "bin" / "python").unlink()
    assert "no C++ compiler" in bootstrap(house, tools, "install").stderr


def test_the_demo_installs_no_test_tools_and_the_tests_do(house: Path, tools: Path) -> None:
    fake_program(tools / "c++", "exit 0")
    fake_program(house / ".venv" / "bin" / "python", f'echo "$*" >> "{house}/calls"')
    for command in ("install", "lint"):
        bootstrap(house, tools, command)
    installs = [line for line in (house / "calls").read_text().splitlines() if "pip install" in line]
    assert [line.endswith("[dev]") for line in installs] == [False, True]
    assert all(str(house / "clients" / "python") in line for line in installs)


def test_a_failing_installation_shows_the_end_of_its_output(house: Path, tools: Path) -> None:
    fake_program(tools / "c++", "exit 0")
    fake_program(house / ".venv" / "bin" / "python", 'case "$*" in *install*) echo "no route to PyPI"; exit 1;; esac')
    result = bootstrap(house, tools, "install")
    assert result.returncode == 1
    assert "no route to PyPI" in result.stderr
    assert result.stderr.splitlines()[-1].endswith("the whole output is in build/bootstrap.log")


def test_an_unknown_command_shows_the_usage(house: Path, tools: Path) -> None:
    for arguments in ([], ["deploy"]):
        result = bootstrap(house, tools, *arguments)
        assert result.returncode == 2
        assert "python3 bootstrap.py demo" in result.stderr


def test_an_old_python_is_told_so_in_one_line() -> None:
    ast.parse(BOOTSTRAP.read_text(), feature_version=(3, 7))
    code = f"import sys, runpy; sys.version_info = (3, 9, 2); runpy.run_path({str(BOOTSTRAP)!r}, run_name='__main__')"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert result.returncode == 1
    assert len(result.stderr.splitlines()) == 1
    assert "needs Python 3.11 or newer; this is 3.9" in result.stderr
