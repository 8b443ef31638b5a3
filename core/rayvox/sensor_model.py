"""The inverse sensor model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from rayvox import _native


@dataclass(frozen=True)
class SensorModel:
    """OctoMap's sensor model and defaults; all log-odds are float32, as OctoMap computes them.

    p_hit, p_miss: probability that a voxel is occupied given that a ray ended in it / passed it.
    p_clamp_min, p_clamp_max: bounds beyond which no evidence accumulates.
    p_occupied: threshold from which on a voxel counts as occupied.

    Raises InvalidInputError unless 0.5 <= p_hit < 1, 0 < p_miss <= 0.5, 0 < p_clamp_min < p_clamp_max < 1 and
    0 < p_occupied < 1.
    """

    p_hit: float = 0.7
    p_miss: float = 0.4
    p_clamp_min: float = 0.1192
    p_clamp_max: float = 0.971
    p_occupied: float = 0.5

    def __post_init__(self) -> None:
        _ = self.native

    @cached_property
    def native(self) -> _native.SensorModel:
        """The kernel's form, which also names the model's five log-odds."""
        return _native.SensorModel(self.p_hit, self.p_miss, self.p_clamp_min, self.p_clamp_max, self.p_occupied)
