"""Finds the Embree library that the `embreex` distribution ships, without importing embreex."""

from __future__ import annotations

from functools import cache
from importlib.metadata import PackageNotFoundError, files

from rayvox import _native


def shipped_libraries() -> list[str]:
    """Paths of the libembree4 that embreex installed; empty without embreex."""
    try:
        installed = files("embreex") or []
    except PackageNotFoundError:
        return []
    return [str(file.locate()) for file in installed if "libembree4" in file.name]


@cache
def load_embree() -> str:
    """Makes Embree 4 available to the kernel and returns its version.

    Taken is embreex's library, else a libembree4.so.4 that the system's loader finds. Raises EngineUnavailableError,
    saying what to install, if there is none or it is not usable.
    """
    _native.load_embree(shipped_libraries())
    return _native.embree_version()
