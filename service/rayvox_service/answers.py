"""From one decoded question to its answer, whichever way it came: steps for the query threads."""

from __future__ import annotations

from collections.abc import Callable

from rayvox import CancellationToken

from rayvox_service import collision_query, motion_query, queries
from rayvox_service.checked_fields import check_fields, parse_json
from rayvox_service.collision_query import CollisionQuery, JsonCollisionQuery, check_collisions, poses_of_frame
from rayvox_service.frame import Bytes, Frame
from rayvox_service.hosted_map import HostedMap
from rayvox_service.motion_query import JsonMotionQuery, MotionQuery, check_motions, motions_of_frame
from rayvox_service.problems import Problem
from rayvox_service.service import Service
from rayvox_service.steps import Steps

FrameAnswer = Callable[[Service, HostedMap, Frame, CancellationToken], Steps[bytes]]
JsonAnswer = Callable[[Service, HostedMap, Bytes, CancellationToken], Steps[bytes]]


def answer_frame(service: Service, hosted: HostedMap, frame: Frame, cancellation: CancellationToken) -> Steps[bytes]:
    """The answer to a query frame of any kind, as a frame. Raises FrameError, Problem, rayvox errors."""
    answer = _BY_KIND.get(frame.kind)
    if answer is None:
        raise Problem("invalid-input", f"a {frame.kind[:60]!r} frame asks nothing; {', '.join(_BY_KIND)} do")
    return answer(service, hosted, frame, cancellation)


def answer_collisions(
    service: Service, hosted: HostedMap, frame: Frame, cancellation: CancellationToken
) -> Steps[bytes]:
    query = check_fields(frame.fields, CollisionQuery).with_default(service.settings.collision_unknown)
    poses = poses_of_frame(frame, service.settings.max_poses)
    robot = query.variant_of(service.robots.get(query.robot))
    check = yield from check_collisions(query, poses, robot, hosted.snapshot(), cancellation)
    return collision_query.check_as_frame(check)


def answer_json_collisions(
    service: Service, hosted: HostedMap, body: Bytes, cancellation: CancellationToken
) -> Steps[bytes]:
    query = parse_json(body, JsonCollisionQuery).with_default(service.settings.collision_unknown)
    poses = query.poses()
    poses.require_at_most(service.settings.max_poses)
    robot = query.variant_of(service.robots.get(query.robot))
    check = yield from check_collisions(query, poses, robot, hosted.snapshot(), cancellation)
    return collision_query.check_as_json(check)


def answer_motions(service: Service, hosted: HostedMap, frame: Frame, cancellation: CancellationToken) -> Steps[bytes]:
    query = check_fields(frame.fields, MotionQuery).with_default(service.settings.collision_unknown)
    motions = motions_of_frame(frame, service.settings.max_poses)
    robot, snapshot = query.variant_of(service.robots.get(query.robot)), hosted.snapshot()
    check = yield from check_motions(query, motions, robot, snapshot, cancellation)
    return motion_query.check_as_frame(check, snapshot.revision)


def answer_json_motions(
    service: Service, hosted: HostedMap, body: Bytes, cancellation: CancellationToken
) -> Steps[bytes]:
    query = parse_json(body, JsonMotionQuery).with_default(service.settings.collision_unknown)
    motions = query.motions()
    motions.require_at_most(service.settings.max_poses)
    robot, snapshot = query.variant_of(service.robots.get(query.robot)), hosted.snapshot()
    check = yield from check_motions(query, motions, robot, snapshot, cancellation)
    return motion_query.check_as_json(check, snapshot.revision)


def answer_rows(kind: type[queries.Query]) -> FrameAnswer:
    """Points, boxes or rays."""

    def answer(service: Service, hosted: HostedMap, frame: Frame, cancellation: CancellationToken) -> Steps[bytes]:
        rows = queries.rows_of_frame(frame, kind, service.settings.max_points)
        query, snapshot = check_fields(frame.fields, kind), hosted.snapshot()
        yield from ()  # all in one step
        return queries.answer_as_frame(kind.ANSWER, query.run(snapshot, rows), snapshot.revision)

    return answer


def answer_json_rows(kind: type[queries.Query]) -> JsonAnswer:
    def answer(service: Service, hosted: HostedMap, body: Bytes, cancellation: CancellationToken) -> Steps[bytes]:
        query, snapshot = parse_json(body, kind), hosted.snapshot()
        yield from ()  # all in one step
        return queries.answer_as_json(query.run(snapshot, queries.rows_of_json(query)), snapshot.revision)

    return answer


_BY_KIND: dict[str, FrameAnswer] = {
    collision_query.KIND: answer_collisions,
    motion_query.KIND: answer_motions,
    **{kind.KIND: answer_rows(kind) for kind in (queries.PointsQuery, queries.BoxesQuery, queries.RaysQuery)},
}
