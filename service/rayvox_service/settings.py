"""What the service can be told: keyword arguments, else RAYVOX_* environment variables, else a settings file."""

from __future__ import annotations

import ipaddress
import os
from pathlib import Path
from typing import Literal

from pydantic import Field, SecretStr, model_validator
from pydantic_settings import (
    BaseSettings,
    InitSettingsSource,
    PydanticBaseSettingsSource,
    SettingsConfigDict,
    TomlConfigSettingsSource,
)
from rayvox import Engine

from rayvox_service.frame import FrameLimits
from rayvox_service.map_config import InsertionConfig

MIB = 1 << 20


class Settings(BaseSettings):
    """Settings of one service process. Sizes are bytes.

    Raises pydantic.ValidationError for what cannot work, OSError or tomllib.TOMLDecodeError for a settings file that
    cannot be read.
    """

    model_config = SettingsConfigDict(env_prefix="RAYVOX_", frozen=True)

    settings: Path | None = Field(default=None, description="TOML file of settings, as `rayvox tune` writes it")
    host: str = "127.0.0.1"
    port: int = Field(default=8080, ge=0, le=65535, description="0 takes any free port")
    data_dir: Path = Path("rayvox-data")
    api_key: SecretStr | None = Field(
        default=None, description="needed by every request, and for any address but loopback"
    )

    max_body_bytes: int = Field(default=64 * MIB, gt=0)
    max_expanded_bytes: int = Field(default=128 * MIB, gt=0, description="a frame's payloads once decompressed")
    max_points: int = Field(default=2_000_000, gt=0, description="points of a scan, or items of a query")
    max_poses: int = Field(default=200_000, gt=0, description="poses of a collision query")
    max_json_bytes: int = Field(default=1 * MIB, gt=0, description="JSON is for small queries; large ones are frames")

    engine: Engine = Field(
        default="auto", description="how scans are inserted: auto, dda, beam or embree; the map is the same"
    )
    queue_bytes: int = Field(default=256 * MIB, gt=0, description="scans of one map that wait to be applied")
    max_in_flight: int = Field(default=8, gt=0, le=1024, description="unacknowledged scans per stream")
    snapshot_every_bytes: int = Field(default=256 * MIB, gt=0, description="journal written between two snapshots")
    fsync: bool = Field(
        default=True, description="false gives up durability on power loss, not on a crash of the process"
    )

    max_robot_expanded_bytes: int = Field(default=256 * MIB, gt=0, description="files of a robot once unpacked")
    max_robot_triangles: int = Field(default=4_000_000, gt=0)
    max_robot_parse_s: float = Field(default=20.0, gt=0, description="longest time that reading a robot may take")

    wait_s: float = Field(default=30.0, gt=0, description="longest wait for a scan to be applied or a revision to come")
    body_timeout_s: float = Field(default=300.0, gt=0, description="longest time that one request body may take")
    query_threads: int = Field(default=4, gt=0, le=256)

    map_resolution_m: float = Field(
        default=0.05, gt=0, allow_inf_nan=False, description="of new maps whose creator does not say"
    )
    map_depth: int = Field(default=16, ge=4, le=21, description="levels of new maps whose creator does not say")
    map_max_range_m: float | None = Field(
        default=None, gt=0, allow_inf_nan=False, description="longer rays into new maps are cut there"
    )
    map_ray_share: float = Field(default=1.0, gt=0, le=1, description="share of the rays that new maps take")
    map_discretize: bool = Field(default=False, description="new maps take one ray per end-point voxel")
    collision_unknown: Literal["free", "occupied"] = Field(
        default="free", description="what unknown space is to collision queries that do not say"
    )

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,
        file_secret_settings: PydanticBaseSettingsSource,
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        given = init_settings.init_kwargs if isinstance(init_settings, InitSettingsSource) else {}
        path = given.get("settings") or os.environ.get("RAYVOX_SETTINGS")
        if not path:
            return init_settings, env_settings
        # What is not there would be passed over in silence.
        if not Path(path).is_file():
            raise FileNotFoundError(f"{path}: no such settings file")
        return init_settings, env_settings, TomlConfigSettingsSource(settings_cls, toml_file=path)

    @property
    def insertion(self) -> InsertionConfig:
        """What a new map does with its scans unless its creator says otherwise."""
        return InsertionConfig(
            max_range_m=self.map_max_range_m, ray_share=self.map_ray_share, discretize=self.map_discretize
        )

    @model_validator(mode="after")
    def _refuse_an_open_door(self) -> Settings:
        if self.api_key is not None and not self.api_key.get_secret_value():
            raise ValueError("api_key is empty: leave it out or give a real one")
        if self.api_key is None and not _is_loopback(self.host):
            raise ValueError(
                f"host {self.host} can be reached from other machines: set an API key (RAYVOX_API_KEY) or use 127.0.0.1"
            )
        return self

    @property
    def frame_limits(self) -> FrameLimits:
        return FrameLimits(self.max_body_bytes, self.max_expanded_bytes)


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False
