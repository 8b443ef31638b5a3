"""What all queries share: a JSON or frame body in, the work in query threads, an answer in the same form out."""

from __future__ import annotations

from typing import Annotated

from fastapi import Query as Parameter
from fastapi import Request
from fastapi.responses import Response
from rayvox import CancellationToken

from rayvox_service import frame
from rayvox_service.answers import FrameAnswer, JsonAnswer
from rayvox_service.disconnection import while_connected
from rayvox_service.request_body import JSON, RequestBody
from rayvox_service.service import map_of, service_of
from rayvox_service.steps import Steps

MinRevision = Annotated[int | None, Parameter(ge=0, lt=1 << 62, description="wait until the map is that new")]
Timeout = Annotated[float | None, Parameter(gt=0, allow_inf_nan=False, description="seconds to wait for it")]


async def answer_query(
    request: Request, min_revision: int | None, timeout_s: float | None, of_frame: FrameAnswer, of_json: JsonAnswer
) -> Response:
    """Raises Problem for a body of another type, too large or too slow, and for a revision that does not come."""
    service, hosted = service_of(request), map_of(request)
    settings, incoming = service.settings, RequestBody(request.scope, request.receive)
    media = incoming.media_type((JSON, frame.MEDIA_TYPE))
    max_bytes = settings.max_json_bytes if media == JSON else settings.max_body_bytes
    body = await incoming.read(max_bytes, settings.body_timeout_s)

    # Parsing belongs to the first step: it may not hold up the event loop either.
    def steps(cancellation: CancellationToken) -> Steps[bytes]:
        if media == JSON:
            return (yield from of_json(service, hosted, body, cancellation))
        question = frame.decode_frame(body, settings.frame_limits)
        return (yield from of_frame(service, hosted, question, cancellation))

    async def answer() -> bytes:
        await service.await_revision(hosted, min_revision, timeout_s)
        return await service.query_in_steps(steps)

    return Response(await while_connected(request.receive, answer()), media_type=media)
