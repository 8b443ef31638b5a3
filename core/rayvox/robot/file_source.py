"""Where a robot description finds its meshes: inside one folder or one archive, nowhere else."""

from __future__ import annotations

import io
import posixpath
import re
import stat
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Protocol

from rayvox.errors import RobotFormatError
from rayvox.mesh_io import LoadBudget

MOST_ARCHIVE_ENTRIES = 10_000
_CENTRAL_SIGNATURE = b"PK\x01\x02"
_COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")


class FileSource(Protocol):
    """Files under names like `meshes/arm.stl`."""

    def has(self, name: str) -> bool: ...

    def read(self, name: str, budget: LoadBudget) -> bytes:
        """Raises RobotFormatError, LoadLimitError, OSError."""


class FolderSource:
    """A folder. Links that lead out of it are refused."""

    def __init__(self, root: Path) -> None:
        self._root = root.resolve()

    def has(self, name: str) -> bool:
        path = (self._root / name).resolve()
        return path.is_relative_to(self._root) and path.is_file()

    def read(self, name: str, budget: LoadBudget) -> bytes:
        path = (self._root / name).resolve()
        if not path.is_relative_to(self._root):
            raise RobotFormatError(f"{name[:120]}: outside of {self._root}")
        budget.take_bytes(path.stat().st_size, name[:120])
        return path.read_bytes()


class ZipSource:
    """A zip file in memory; nothing is ever unpacked to disk."""

    def __init__(self, data: bytes) -> None:
        """Raises RobotFormatError for what is no zip file, or has too many entries."""
        # zipfile makes an object of every entry before it can be asked how many there are.
        if data.count(_CENTRAL_SIGNATURE) > MOST_ARCHIVE_ENTRIES:
            raise RobotFormatError(f"archive: more than {MOST_ARCHIVE_ENTRIES} entries")
        try:
            self._zip = zipfile.ZipFile(io.BytesIO(data))
        except (zipfile.BadZipFile, ValueError, NotImplementedError, OverflowError, EOFError) as error:
            raise RobotFormatError(f"archive: not a zip file: {error}") from None
        self._entries = {info.filename.replace("\\", "/"): info for info in self._zip.infolist() if not info.is_dir()}

    def names(self) -> list[str]:
        return list(self._entries)

    def has(self, name: str) -> bool:
        return name in self._entries

    def read(self, name: str, budget: LoadBudget) -> bytes:
        info, where = self._entries[name], f"archive entry {name[:120]}"
        if stat.S_ISLNK(info.external_attr >> 16):
            raise RobotFormatError(f"{where}: symbolic links are not followed")
        if info.flag_bits & 1 or info.compress_type not in _COMPRESSIONS:
            raise RobotFormatError(f"{where}: encrypted, or neither stored nor deflated")
        # zipfile gives no more than the size that the entry claims, and the budget is for that.
        budget.take_bytes(info.file_size, where)
        try:
            return self._zip.read(info)
        except (zipfile.BadZipFile, zlib.error, ValueError, NotImplementedError, OverflowError, EOFError) as error:
            raise RobotFormatError(f"{where}: cannot be unpacked: {error}") from None


def resolve_reference(reference: str, description: str, files: FileSource) -> str:
    """The name of the file that a description refers to.

    `package://name/rest` (or `model://`) is looked up as `name/rest` and as `rest`, and a relative name as it is, each
    in the description's folder and in those above it, within the source. Raises RobotFormatError.
    """
    reference = reference.replace("\\", "/")
    package = re.fullmatch(r"(?:package|model)://([^/]+)/(.+)", reference)
    if package is not None:
        wanted = [f"{package[1]}/{package[2]}", package[2]]
    elif _SCHEME.match(reference) or reference.startswith("/"):
        raise RobotFormatError(f"{reference[:120]!r}: only package:// and relative names are read")
    else:
        wanted = [reference]
    escapes = True
    for folder in _folders_of(description):
        for name in wanted:
            candidate = posixpath.normpath(posixpath.join(folder, name))
            if candidate.startswith(("..", "/")):
                continue
            escapes = False
            if files.has(candidate):
                return candidate
    fault = "leads out of the upload" if escapes else "is not there"
    raise RobotFormatError(f"{description}: the mesh {reference[:120]!r} {fault}")


def _folders_of(name: str) -> Iterator[str]:
    folder = posixpath.dirname(name)
    while folder:
        yield folder
        folder = posixpath.dirname(folder)
    yield ""
