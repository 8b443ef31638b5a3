"""The kernel's exceptions: one small tree, so that one `except RayvoxError` catches whatever rayvox refuses."""

from __future__ import annotations


class RayvoxError(Exception):
    """Base of every error that rayvox raises on purpose."""


class InvalidInputError(RayvoxError, ValueError):
    """An argument that cannot be used: wrong shape, NaN, a pose that is not rigid, an empty scan."""


class OutOfRangeError(InvalidInputError):
    """A coordinate beyond what the octree's depth and resolution can address."""


class MapFormatError(RayvoxError, ValueError):
    """A map file or byte string that is corrupt or of an unknown kind."""


class ScanFormatError(RayvoxError, ValueError):
    """A scan, depth image or pose file that is corrupt or of an unknown kind."""


class MeshFormatError(RayvoxError, ValueError):
    """A mesh file that is corrupt, of an unknown kind, or uses what rayvox does not read."""


class RobotFormatError(RayvoxError, ValueError):
    """A robot description that is corrupt, names what is not there, or uses what rayvox does not support."""


class LoadLimitError(RayvoxError, ValueError):
    """A mesh or robot over the limits of bytes, triangles or time that it was read with."""


class EngineUnavailableError(RayvoxError):
    """The ray-shooting engine asked for cannot run here; the message says what to install."""


class QueryCancelledError(RayvoxError):
    """The query's CancellationToken was cancelled before it ended."""


class MissingDependencyError(RayvoxError):
    """An optional package is needed for this; the message says what to install."""
