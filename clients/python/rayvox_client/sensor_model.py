"""The log-odds sensor model of a map."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from rayvox_client.errors import InvalidInputError
from rayvox_client.fields import Fields


@dataclass(frozen=True)
class SensorModel:
    """OctoMap's sensor model, as probabilities.

    Attributes:
        p_hit, p_miss: what one measurement of a voxel as occupied / as free says.
        p_clamp_min, p_clamp_max: where a voxel's probability stops.
        p_occupied: a voxel at or above this is occupied.
    """

    p_hit: float = 0.7
    p_miss: float = 0.4
    p_clamp_min: float = 0.1192
    p_clamp_max: float = 0.971
    p_occupied: float = 0.5

    def __post_init__(self) -> None:
        for name, value in asdict(self).items():
            if not 0.0 < value < 1.0:
                raise InvalidInputError(f"sensor model: {name} = {value!r} is not between 0 and 1")

    def to_json(self) -> dict[str, float]:
        """The API's `sensor_model` object."""
        return {name: float(value) for name, value in asdict(self).items()}

    @classmethod
    def from_fields(cls, fields: Fields) -> SensorModel:
        """Read the API's `sensor_model` object."""
        return cls(*(fields.number(name) for name in cls.__dataclass_fields__))
