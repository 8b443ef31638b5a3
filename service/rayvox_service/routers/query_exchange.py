"""What all queries share: a JSON or frame body in, the work in a query thread, an answer in the same form out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated

from fastapi import Query as Parameter
from fastapi import Request
from fastapi.responses import Response

from rayvox_service import frame
from rayvox_service.frame import Bytes
from rayvox_service.hosted_map import HostedMap
from rayvox_service.request_body import JSON, RequestBody
from rayvox_service.service import Service, map_of, service_of

MinRevision = Annotated[int | None, Parameter(ge=0, lt=1 << 62, description="wait until the map is that new")]
Timeout = Annotated[float | None, Parameter(gt=0, allow_inf_nan=False, description="seconds to wait for it")]
# Parses the body of this media type and answers it from the map; runs in a query thread, for neither parsing nor
# answering may hold up the event loop.
Compute = Callable[[Service, HostedMap, str, Bytes], bytes]


async def answer_query(
    request: Request, min_revision: int | None, timeout_s: float | None, compute: Compute
) -> Response:
    """Raises Problem for a body of another type, too large or too slow, and for a revision that does not come."""
    service, hosted = service_of(request), map_of(request)
    settings, incoming = service.settings, RequestBody(request.scope, request.receive)
    media = incoming.media_type((JSON, frame.MEDIA_TYPE))
    max_bytes = settings.max_json_bytes if media == JSON else settings.max_body_bytes
    body = await incoming.read(max_bytes, settings.body_timeout_s)
    await service.await_revision(hosted, min_revision, timeout_s)
    content = await service.query(lambda: compute(service, hosted, media, body))
    return Response(content, media_type=media)
