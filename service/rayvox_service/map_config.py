"""What a map was created with; fixed for its life and kept in its directory as map.json."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError
from rayvox import OccupancyMap, SensorModel

from rayvox_service.durable_files import write_file

FILE_NAME = "map.json"


class SensorModelConfig(BaseModel):
    """OctoMap's sensor model as probabilities; the defaults are OctoMap's."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    p_hit: float = Field(default=0.7, gt=0.0, lt=1.0)
    p_miss: float = Field(default=0.4, gt=0.0, lt=1.0)
    p_clamp_min: float = Field(default=0.1192, gt=0.0, lt=1.0)
    p_clamp_max: float = Field(default=0.971, gt=0.0, lt=1.0)
    p_occupied: float = Field(default=0.5, gt=0.0, lt=1.0)

    def to_kernel(self) -> SensorModel:
        return SensorModel(self.p_hit, self.p_miss, self.p_clamp_min, self.p_clamp_max, self.p_occupied)


class InsertionConfig(BaseModel):
    """What a map does with its scans: speed for accuracy, as `rayvox tune` measures it.

    max_range_m: longer rays are cut there, and mark no end point. ray_share: share of a scan's rays that is inserted
    (rayvox.ray_sampling). discretize: one ray per end-point voxel, also for scans that do not ask for it.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    max_range_m: float | None = Field(default=None, gt=0.0, allow_inf_nan=False)
    ray_share: float = Field(default=1.0, gt=0.0, le=1.0)
    discretize: bool = False


class MapConfig(BaseModel):
    """Name, leaf edge in metres, levels, sensor model and treatment of scans of one map."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    resolution_m: float = Field(gt=0.0, allow_inf_nan=False)
    depth: int = Field(default=16, ge=1, le=21)
    sensor_model: SensorModelConfig = SensorModelConfig()
    insertion: InsertionConfig = InsertionConfig()

    def new_map(self) -> OccupancyMap:
        """An empty kernel map. Raises rayvox.InvalidInputError for values that the kernel refuses."""
        return OccupancyMap(self.resolution_m, self.depth, self.sensor_model.to_kernel())

    def restore_map(self, state: bytes, revision: int) -> OccupancyMap:
        return OccupancyMap.from_bytes(state, self.resolution_m, self.depth, self.sensor_model.to_kernel(), revision)


class NewMap(MapConfig):
    """What the creator of a map says of it; the service's settings say the rest."""

    # May be left out; with_defaults never takes the value that stands here for that.
    resolution_m: float = Field(default=1.0, gt=0.0, allow_inf_nan=False)

    def with_defaults(self, resolution_m: float, depth: int, insertion: InsertionConfig) -> MapConfig:
        """With these for what was not said."""
        said = {name: getattr(self, name) for name in self.model_fields_set}
        return MapConfig(**{"resolution_m": resolution_m, "depth": depth, "insertion": insertion} | said)


class MapFile(BaseModel):
    """map.json: the configuration under a version of the directory's layout."""

    layout: Literal[1] = 1
    map: MapConfig


def write_map_config(directory: Path, config: MapConfig) -> None:
    write_file(directory / FILE_NAME, [MapFile(map=config).model_dump_json(indent=2).encode()])


def read_map_config(directory: Path) -> MapConfig:
    """Raises OSError or ValueError naming the file."""
    path = directory / FILE_NAME
    try:
        return MapFile.model_validate(json.loads(path.read_bytes())).map
    except (ValidationError, json.JSONDecodeError) as error:
        raise ValueError(f"{path} is not a map configuration: {error}") from error
