"""A robot on this machine's disk as the bytes of one upload."""

from __future__ import annotations

import io
import os
import re
import zipfile
from dataclasses import dataclass, field
from pathlib import Path

from rayvox_client.errors import InvalidInputError

MEDIA_TYPES = {
    ".zip": "application/zip",
    ".stl": "model/stl",
    ".obj": "model/obj",
    ".ply": "model/vnd.ply",
    ".off": "model/off",
    ".dae": "model/vnd.collada+xml",
    ".glb": "model/gltf-binary",
}
# What of a folder is sent: textures and the like are of no use to the service.
_PACKED = {".urdf", *MEDIA_TYPES} - {".zip"}


@dataclass(frozen=True)
class RobotUpload:
    """name: the file's or folder's, in letters that the service allows. description: the URDF's name in a zip."""

    name: str
    media_type: str
    data: bytes = field(repr=False)
    description: str | None = None

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> RobotUpload:
        """A mesh or zip file as it is; a URDF with its folder, or a folder, as a zip of its meshes and URDFs.

        Raises:
            InvalidInputError: another kind of file.
            OSError: it cannot be read.
        """
        path = Path(path)
        if path.is_dir():
            return cls(_name_of(path.resolve().name), MEDIA_TYPES[".zip"], _packed(path))
        suffix = path.suffix.lower()
        if suffix == ".urdf":
            return cls(_name_of(path.stem), MEDIA_TYPES[".zip"], _packed(path.parent), path.name)
        if suffix not in MEDIA_TYPES:
            raise InvalidInputError(
                f"{path}: a robot is a folder, or a file that ends in .urdf, {', '.join(MEDIA_TYPES)}"
            )
        return cls(_name_of(path.stem), MEDIA_TYPES[suffix], path.read_bytes())


def _packed(folder: Path) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(folder.rglob("*")):
            if path.suffix.lower() in _PACKED and path.is_file():
                # Without its time the same folder gives the same bytes, so that sending it again is no conflict.
                entry = zipfile.ZipInfo(path.relative_to(folder).as_posix())
                entry.compress_type = zipfile.ZIP_DEFLATED
                archive.writestr(entry, path.read_bytes())
    return buffer.getvalue()


def _name_of(stem: str) -> str:
    return re.sub(r"[^A-Za-z0-9_.-]", "_", stem).lstrip("_.-")[:64] or "robot"
