"""Links in an order in which parents come first, and what of it moves together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from rayvox import _native
from rayvox.errors import RobotFormatError
from rayvox.robot.joint import Joint, JointMotion, Mimic
from rayvox.robot.link import Link


class LinkTree:
    """A checked tree. Raises RobotFormatError for links and joints that form none.

    links: parents first. joint_of: per link the joint that holds it, None for the base. parent_of: its parent's index,
    -1 for the base. value_joints: joints with a column in a configuration, in the order given.
    """

    def __init__(self, links: Sequence[Link], joints: Sequence[Joint], source: str) -> None:
        self._source = source
        self._refuse_repeated([link.name for link in links], "link")
        self._refuse_repeated([joint.name for joint in joints], "joint")
        if not links:
            raise RobotFormatError(f"{source}: no links")
        by_child = self._joints_by_child({link.name for link in links}, joints)
        self.links = self._sorted(links, by_child, joints)
        self.index_of = {link.name: i for i, link in enumerate(self.links)}
        self.joint_of = [by_child.get(link.name) for link in self.links]
        self.parent_of = [self.index_of[joint.parent] if joint else -1 for joint in self.joint_of]
        self.joints = tuple(joints)
        self.value_joints = tuple(joint for joint in joints if joint.has_value)
        self._columns = {joint.name: i for i, joint in enumerate(self.value_joints)}
        self._followed = {joint.name: self._follow(joint) for joint in joints if joint.motion is not JointMotion.FIXED}

    def native(self) -> _native.KinematicTree:
        """The kernel's form of it."""
        motions, transforms, axes, columns, mimics = [], [], [], [], []
        for joint in self.joint_of:
            followed = self._followed.get(joint.name) if joint else None
            motions.append(int(joint.motion) if joint else 0)
            transforms.append(joint.T_parent_joint if joint else np.eye(4))
            axes.append(joint.axis if joint else (1.0, 0.0, 0.0))
            columns.append(self._columns[followed.joint] if followed else 0)
            mimics.append((followed.multiplier, followed.offset) if followed else (1.0, 0.0))
        return _native.KinematicTree(
            self.parent_of, motions, np.array(transforms), np.array(axes), columns, np.array(mimics), len(self._columns)
        )

    def adjacent(self) -> npt.NDArray[np.bool_]:
        """(links, links): pairs that are rigidly connected, or that one joint joins.

        Links without geometry between two others are passed over, and so are fixed joints: the links at the two ends
        of one moving joint are adjacent.
        """
        count = len(self.links)
        body = list(range(count))  # the highest link that this one is rigidly connected to
        for i, joint in enumerate(self.joint_of):
            if joint and joint.motion is JointMotion.FIXED:
                body[i] = body[self.parent_of[i]]
        bodies = np.array(body)
        matrix: npt.NDArray[np.bool_] = np.equal.outer(bodies, bodies)
        for i, joint in enumerate(self.joint_of):
            if joint and joint.motion is not JointMotion.FIXED:
                above = self._with_geometry_above(self.parent_of[i])
                for k in self._with_geometry_below(i):
                    matrix[above, k] = matrix[k, above] = True
        return matrix

    def _with_geometry_above(self, i: int) -> int:
        while not self.links[i].geometries and self.parent_of[i] >= 0:
            i = self.parent_of[i]
        return i

    def _with_geometry_below(self, i: int) -> list[int]:
        """The link itself, or where it has no geometry the nearest below it that are fixed to it and have."""
        if self.links[i].geometries:
            return [i]
        below = [i]
        for k in range(i + 1, len(self.links)):
            joint = self.joint_of[k]
            at_end = self.parent_of[k] in below and not self.links[self.parent_of[k]].geometries
            if joint and joint.motion is JointMotion.FIXED and at_end:
                below.append(k)
        return below

    def _joints_by_child(self, names: set[str], joints: Sequence[Joint]) -> dict[str, Joint]:
        by_child: dict[str, Joint] = {}
        for joint in joints:
            for end in (joint.parent, joint.child):
                if end not in names:
                    raise self._wrong(f"joint {joint.name}: there is no link {end[:80]!r}")
            if joint.child in by_child:
                raise self._wrong(f"link {joint.child} hangs on joint {by_child[joint.child].name} and {joint.name}")
            by_child[joint.child] = joint
        return by_child

    def _sorted(self, links: Sequence[Link], by_child: dict[str, Joint], joints: Sequence[Joint]) -> tuple[Link, ...]:
        roots = [link.name for link in links if link.name not in by_child]
        if len(roots) != 1:
            raise self._wrong(f"one link must be the base, these hang on none: {', '.join(roots[:5]) or '(a cycle)'}")
        children: dict[str, list[str]] = {}
        for joint in joints:
            children.setdefault(joint.parent, []).append(joint.child)
        order, waiting = [], roots
        while waiting:
            order.append(waiting.pop())
            waiting.extend(reversed(children.get(order[-1], [])))
        if len(order) != len(links):
            raise self._wrong("its joints form a cycle")
        place = {link.name: i for i, link in enumerate(links)}
        # Kept where it will do: an object attached to a robot comes after the robot's own links.
        if all(place[by_child[link.name].parent] < place[link.name] for link in links if link.name in by_child):
            return tuple(links)
        return tuple(links[place[name]] for name in order)

    def _follow(self, joint: Joint) -> Mimic:
        """Which joint with a value of its own decides this one's, and how."""
        by_name = {other.name: other for other in self.joints}
        followed, seen = Mimic(joint.name), {joint.name}
        while (mimic := by_name[followed.joint].mimic) is not None:
            if mimic.joint not in by_name or by_name[mimic.joint].motion is JointMotion.FIXED:
                raise self._wrong(f"joint {joint.name} mimics {mimic.joint[:80]!r}, which is no moving joint")
            if mimic.joint in seen:
                raise self._wrong(f"joint {joint.name} mimics itself")
            seen.add(mimic.joint)
            offset = followed.multiplier * mimic.offset + followed.offset
            followed = Mimic(mimic.joint, followed.multiplier * mimic.multiplier, offset)
        return followed

    def _refuse_repeated(self, names: list[str], what: str) -> None:
        repeated = next((name for i, name in enumerate(names) if name in names[:i]), None)
        if repeated is not None:
            raise self._wrong(f"two {what}s are called {repeated}")

    def _wrong(self, what: str) -> RobotFormatError:
        return RobotFormatError(f"{self._source}: {what}")
