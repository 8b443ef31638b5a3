"""Queries against one snapshot: from JSON or a frame, to an answer in the same form."""

from __future__ import annotations

import json
import math
from abc import abstractmethod
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field
from rayvox import MapSnapshot

from rayvox_service.frame import AnyArray, Frame, FrameTooLargeError, encode_frame
from rayvox_service.problems import Problem

Rows = list[tuple[float, float, float]]


class Query(BaseModel):
    """The JSON form has the payloads as lists of [x, y, z] and the fields beside them."""

    model_config = ConfigDict(extra="forbid", arbitrary_types_allowed=True)
    KIND: ClassVar[str]
    PAYLOADS: ClassVar[tuple[str, ...]]
    ANSWER: ClassVar[str]

    @abstractmethod
    def run(self, snapshot: MapSnapshot, rows: dict[str, AnyArray]) -> dict[str, AnyArray]:
        """Answer arrays; `rows` holds the payloads, each (n, 3)."""


class PointsQuery(Query):
    """States and log-odds at points in metres, optionally as seen at a coarser depth."""

    KIND = "points"
    PAYLOADS = ("points",)
    ANSWER = "occupancy"

    points: Rows = Field(default=[], exclude=True)
    depth: int | None = Field(default=None, ge=0, le=21)

    def run(self, snapshot: MapSnapshot, rows: dict[str, AnyArray]) -> dict[str, AnyArray]:
        return {
            "states": snapshot.states_at(rows["points"], self.depth),
            "log_odds": snapshot.log_odds_at(rows["points"], self.depth),
        }


class BoxesQuery(Query):
    """State of each axis-aligned box, metres."""

    KIND = "boxes"
    PAYLOADS = ("lo", "hi")
    ANSWER = "occupancy"

    lo: Rows = Field(default=[], exclude=True)
    hi: Rows = Field(default=[], exclude=True)

    def run(self, snapshot: MapSnapshot, rows: dict[str, AnyArray]) -> dict[str, AnyArray]:
        return {"states": snapshot.box_states(rows["lo"], rows["hi"])}


class RaysQuery(Query):
    """First occupied voxel (or unknown one, where that counts) on each ray; metres."""

    KIND = "rays"
    PAYLOADS = ("origins", "directions")
    ANSWER = "hits"

    origins: Rows = Field(default=[], exclude=True)
    directions: Rows = Field(default=[], exclude=True)
    max_range_m: float | None = Field(default=None, gt=0.0, allow_inf_nan=False)
    unknown: Literal["free", "occupied"] = "free"

    def run(self, snapshot: MapSnapshot, rows: dict[str, AnyArray]) -> dict[str, AnyArray]:
        hits = snapshot.cast_rays(rows["origins"], rows["directions"], self.max_range_m, self.unknown)
        return {"hit": hits.hit, "t_m": hits.t_m, "voxel": hits.voxel}


def rows_of_json(query: Query) -> dict[str, AnyArray]:
    missing = [name for name in query.PAYLOADS if name not in query.model_fields_set]
    if missing:
        raise Problem("invalid-input", f"{' and '.join(missing)} must be there, as lists of [x, y, z]")
    return _same_length({name: np.array(getattr(query, name), np.float64).reshape(-1, 3) for name in query.PAYLOADS})


def rows_of_frame(frame: Frame, query: type[Query], max_rows: int) -> dict[str, AnyArray]:
    """The frame's (n, 3) payloads, after their counts were checked. Raises FrameError, Problem."""
    if frame.kind != query.KIND or set(frame.payloads) != set(query.PAYLOADS):
        raise Problem("invalid-input", f"a {query.KIND} frame with {', '.join(query.PAYLOADS)} is needed here")
    for name, payload in frame.payloads.items():
        if payload.dtype.str not in ("<f4", "<f8") or len(payload.shape) != 2 or payload.shape[1] != 3:
            raise Problem("invalid-input", f"{name} must be (n, 3) of <f4 or <f8")
        if payload.shape[0] > max_rows:
            raise FrameTooLargeError(f"{name} has {payload.shape[0]} rows, the limit is {max_rows}")
    return _same_length({name: frame.array(name) for name in query.PAYLOADS})


def answer_as_json(arrays: dict[str, AnyArray], revision: int) -> bytes:
    document: dict[str, Any] = {"revision": revision}
    for name, array in arrays.items():
        values = array.tolist()
        # JSON knows no NaN and no infinity: null says that there is no number.
        document[name] = [_finite(value) for value in values] if array.dtype.kind == "f" else values
    return json.dumps(document, separators=(",", ":"), allow_nan=False).encode()


def answer_as_frame(kind: str, arrays: dict[str, AnyArray], revision: int) -> bytes:
    return encode_frame(kind, {"revision": revision}, arrays)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _same_length(rows: dict[str, AnyArray]) -> dict[str, AnyArray]:
    if len({len(array) for array in rows.values()}) > 1:
        raise Problem("invalid-input", f"{' and '.join(rows)} need as many rows each")
    return rows
