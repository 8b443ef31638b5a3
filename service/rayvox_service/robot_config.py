"""What a robot was uploaded as, kept in its directory as robot.json beside the uploaded bytes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from rayvox import LoadLimits, Robot

from rayvox_service.durable_files import write_file
from rayvox_service.frame import Bytes

FILE_NAME = "robot.json"
CONTENT_NAME = "content"
ROBOT_TYPES = {
    "application/zip": "zip",
    "model/stl": "stl",
    "model/obj": "obj",
    "model/vnd.ply": "ply",
    "model/ply": "ply",
    "model/off": "off",
    "model/vnd.collada+xml": "dae",
    "model/gltf-binary": "glb",
}
Format = Literal["zip", "stl", "obj", "ply", "off", "dae", "glb"]


class RobotConfig(BaseModel):
    """How the bytes of an upload are to be read. A zip holds a URDF; everything else is one rigid mesh."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    format: Format
    sha256: str
    nbytes: int
    scale: float = Field(default=1.0, gt=0.0, allow_inf_nan=False)
    geometry: Literal["collision", "visual"] = "collision"
    description: str | None = Field(default=None, max_length=1000)

    def load(self, data: Bytes, limits: LoadLimits) -> Robot:
        """Raises rayvox.MeshFormatError, RobotFormatError, LoadLimitError, InvalidInputError."""
        if self.format == "zip":
            return Robot.from_archive(bytes(data), self.description, self.geometry, limits)
        return Robot.from_mesh_bytes(bytes(data), self.format, self.name, self.scale, limits)


class RobotFile(BaseModel):
    """robot.json: the configuration under a version of the directory's layout."""

    layout: Literal[1] = 1
    robot: RobotConfig


def write_robot(directory: Path, config: RobotConfig, data: Bytes) -> None:
    write_file(directory / CONTENT_NAME, [data])
    write_file(directory / FILE_NAME, [RobotFile(robot=config).model_dump_json(indent=2).encode()])


def read_robot(directory: Path) -> tuple[RobotConfig, bytes]:
    """Raises OSError or ValueError naming the file."""
    path = directory / FILE_NAME
    try:
        config = RobotFile.model_validate(json.loads(path.read_bytes())).robot
    except (ValidationError, json.JSONDecodeError) as error:
        raise ValueError(f"{path} is not a robot configuration: {error}") from error
    return config, (directory / CONTENT_NAME).read_bytes()
