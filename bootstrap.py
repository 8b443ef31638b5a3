#!/usr/bin/env python3
"""Set rayvox up in ./.venv and run it. Needs Python >= 3.11, a C++20 compiler and, the first time, PyPI.

    python3 bootstrap.py demo       build, start the service, map a simulated robot run, leave the service up
    python3 bootstrap.py test       build, then lint, C++ tests and Python tests
    python3 bootstrap.py lint       ruff, mypy and clang-format
    python3 bootstrap.py sanitize   the C++ tests under AddressSanitizer and UndefinedBehaviorSanitizer
    python3 bootstrap.py install    build only; then `.venv/bin/rayvox --help`

What follows the command goes to the program that it runs: `demo --exit`, `test -k journal`.
"""

import hashlib
import os
import shutil
import subprocess
import sys
import sysconfig
import time
from pathlib import Path

if sys.version_info < (3, 11):  # noqa: UP036 - this file is what a too old Python is pointed at
    sys.exit(
        f"rayvox needs Python 3.11 or newer; this is {sys.version_info[0]}.{sys.version_info[1]}. "
        "Install one, e.g. `apt install python3.11 python3.11-venv`, and run it on this file."
    )

ROOT = Path(__file__).resolve().parent
VENV = ROOT / ".venv"
BIN = VENV / "bin"
PYTHON = BIN / "python"
LOG = ROOT / "build" / "bootstrap.log"
BUILT_FROM = ("pyproject.toml", "core/CMakeLists.txt", "core/cpp", "core/bindings", "clients/python/pyproject.toml")
CXX20_PROBE = "#include <concepts>\n#include <span>\n#include <bit>\nint main() { return std::popcount(0u); }\n"


class SetUpError(Exception):
    """Set-up cannot go on; the message is the one line to show."""


def main(arguments: list[str]) -> int:
    """Run one command; returns the exit status."""
    commands = {"demo": demo, "test": test, "lint": lint, "sanitize": sanitize, "install": install_only}
    if not arguments or arguments[0] not in commands:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        return commands[arguments[0]](arguments[1:])
    except SetUpError as error:
        print(f"rayvox: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130


def demo(rest: list[str]) -> int:
    """The main job on a simulated robot run."""
    install("runtime")
    # Replaced, not started as a child, so that Ctrl-C and signals reach the demo alone.
    sys.stdout.flush()
    os.execv(PYTHON, [str(PYTHON), "-m", "rayvox_service.cli", "demo", *rest])


def test(rest: list[str]) -> int:
    """All checks; every one runs even where an earlier one failed."""
    install("dev")
    failed = [name for name, check in (("lint", lint), ("C++ tests", cpp_tests)) if check([]) != 0]
    print("== Python tests", flush=True)
    if run([PYTHON, "-m", "pytest", *rest]) != 0:
        failed.append("Python tests")
    print(f"rayvox: failed: {', '.join(failed)}" if failed else "rayvox: all checks passed")
    return 1 if failed else 0


def lint(rest: list[str]) -> int:
    """Ruff, mypy and clang-format."""
    install("dev")
    print("== ruff, mypy and clang-format", flush=True)
    paths = rest or ["."]
    checks = (["ruff", "check", *paths], ["ruff", "format", "--check", *paths], ["mypy"])
    cpp = sorted(file for folder in ("core", "tests/cpp") for file in (ROOT / folder).rglob("*.[ch]pp"))
    clang_format: list[str | Path] = [BIN / "clang-format", "--dry-run", "-Werror", *cpp]
    return max([run([PYTHON, "-m", *check]) for check in checks] + [run(clang_format)])


def sanitize(rest: list[str]) -> int:
    """The C++ tests with ASan and UBSan."""
    return cpp_tests(rest, "sanitize", "-DRAYVOX_SANITIZE=ON")


def cpp_tests(rest: list[str], folder: str = "tests", *options: str) -> int:
    """Configure, build and run the C++ tests in build/<folder>."""
    install("dev")
    print("== C++ tests" if not options else "== C++ tests, ASan + UBSan", flush=True)
    build = ROOT / "build" / folder
    tools = {"PATH": f"{BIN}{os.pathsep}{os.environ.get('PATH', '')}", **compiler_environment()}
    embree = next(VENV.glob("lib/*/site-packages/embreex.libs/libembree4*"), None)
    if embree is not None:
        tools["RAYVOX_EMBREE"] = str(embree)
    configure: list[str | Path] = ["cmake", "-S", ROOT / "core", "-B", build, "-G", "Ninja", "-DRAYVOX_BUILD_TESTS=ON"]
    steps: tuple[list[str | Path], ...] = (
        [*configure, "-DRAYVOX_BUILD_PYTHON=OFF", "-DRAYVOX_WARNINGS_AS_ERRORS=ON", *options],
        ["cmake", "--build", build],
        ["ctest", "--test-dir", build, "--output-on-failure", *rest],
    )
    return next((status for status in (run(step, tools) for step in steps) if status != 0), 0)


def install_only(_: list[str]) -> int:
    """Build without running anything."""
    install("runtime")
    print(f"rayvox is installed: {BIN / 'rayvox'} --help")
    return 0


def install(extra: str) -> None:
    """Build and install kernel, service and client into ./.venv, unless that was done from the same sources.

    extra: "runtime", or "dev" for the tools and peers that the tests need as well.
    """
    stamp = VENV / f"rayvox-{extra}.stamp"
    wanted = fingerprint()
    stamps = {stamp, VENV / "rayvox-dev.stamp"}
    if PYTHON.exists() and any(file.exists() and file.read_text() == wanted for file in stamps):
        return
    environment = compiler_environment()
    headers = Path(sysconfig.get_path("include")) / "Python.h"
    if not headers.exists():
        raise SetUpError(f"Python's C headers are missing ({headers}). Install them, e.g.: apt install python3-dev")
    make_venv()
    target = f"{ROOT}[dev]" if extra == "dev" else str(ROOT)
    pip: list[str | Path] = [
        PYTHON,
        "-m",
        "pip",
        "install",
        "--disable-pip-version-check",
        "-e",
        ROOT / "clients/python",
        "-e",
        target,
    ]
    logged(pip, "fetching packages and building the kernel (minutes the first time)", environment)
    stamp.write_text(wanted)


def make_venv() -> None:
    """Create ./.venv with pip in it."""
    if PYTHON.exists() and subprocess.run([PYTHON, "-m", "pip", "--version"], capture_output=True).returncode == 0:
        return
    VENV.mkdir(exist_ok=True)
    try:
        logged([sys.executable, "-m", "venv", "--clear", VENV], "creating ./.venv")
    except SetUpError:
        shutil.rmtree(VENV, ignore_errors=True)
        raise SetUpError("python3 -m venv does not work here. Install it, e.g.: apt install python3-venv") from None


def compiler_environment() -> dict[str, str]:
    """The compiler, behind ccache where that is installed: another clone then compiles only what differs."""
    environment = {"CXX": compiler()}
    ccache = shutil.which("ccache")
    if ccache is not None:
        environment |= {"CMAKE_CXX_COMPILER_LAUNCHER": ccache, "CCACHE_BASEDIR": str(ROOT), "CCACHE_NOHASHDIR": "1"}
    return environment


def compiler() -> str:
    """A compiler that understands C++20: $CXX, else the first of c++, g++, clang++ that does."""
    chosen = os.environ.get("CXX")
    names = [chosen] if chosen else ["c++", "g++", "clang++"]
    found = [path for path in map(shutil.which, names) if path is not None]
    for path in found:
        probe = [path, "-std=c++20", "-fsyntax-only", "-x", "c++", "-"]
        if subprocess.run(probe, input=CXX20_PROBE, text=True, capture_output=True).returncode == 0:
            return path
    if found:
        raise SetUpError(
            f"{found[0]} does not understand C++20. Install a newer compiler, e.g.: apt install g++ (>= 11)"
        )
    raise SetUpError(f"no C++ compiler found (looked for {', '.join(names)}). Install one, e.g.: apt install g++")


def fingerprint() -> str:
    """Hash of everything that an installation is built from; Python sources are used in place."""
    digest = hashlib.sha256()
    for name in BUILT_FROM:
        path = ROOT / name
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            if file.is_file() and "__pycache__" not in file.parts:
                digest.update(str(file.relative_to(ROOT)).encode())
                digest.update(file.read_bytes())
    return digest.hexdigest()


def run(command: list[str | Path], environment: dict[str, str] | None = None) -> int:
    """Run a command in the repository's root; returns its exit status."""
    return subprocess.run(command, cwd=ROOT, env={**os.environ, **(environment or {})}, check=False).returncode


def logged(command: list[str | Path], what: str, environment: dict[str, str] | None = None) -> None:
    """Run a command quietly, its output in build/bootstrap.log; on failure show the end of it."""
    LOG.parent.mkdir(exist_ok=True)
    started = time.monotonic()
    with LOG.open("wb") as log:
        process = subprocess.Popen(
            command, cwd=ROOT, env={**os.environ, **(environment or {})}, stdout=log, stderr=subprocess.STDOUT
        )
        if not sys.stdout.isatty():
            print(f"rayvox: {what} ...", flush=True)
        while process.poll() is None:
            if sys.stdout.isatty():
                print(f"\rrayvox: {what} ... {time.monotonic() - started:.0f} s", end="", flush=True)
            time.sleep(0.2)
    print("" if sys.stdout.isatty() else f"rayvox: {time.monotonic() - started:.0f} s", flush=True)
    if process.returncode != 0:
        print("\n".join(LOG.read_text(errors="replace").splitlines()[-30:]), file=sys.stderr)
        raise SetUpError(f"{what} failed; the whole output is in {LOG.relative_to(ROOT)}")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
