"""JSON documents and frame headers as models."""

from __future__ import annotations

from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from rayvox_service.frame import Bytes
from rayvox_service.problems import Problem

M = TypeVar("M", bound=BaseModel)


def parse_json(body: Bytes, model: type[M]) -> M:
    """Raises Problem invalid-input."""
    try:
        return model.model_validate_json(bytes(body))
    except ValidationError as error:
        raise _invalid(error) from None


def check_fields(fields: dict[str, Any], model: type[M]) -> M:
    """A frame's header fields as `model`. Raises Problem invalid-input."""
    try:
        return model.model_validate(fields)
    except ValidationError as error:
        raise _invalid(error) from None


def _invalid(error: ValidationError) -> Problem:
    errors = [{"at": "/".join(map(str, e["loc"])), "message": e["msg"]} for e in error.errors()[:20]]
    detail = "; ".join(f"{e['at'] or 'body'}: {e['message']}" for e in errors[:5])
    return Problem("invalid-input", detail, errors=errors)
