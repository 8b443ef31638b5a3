"""Things that a robot holds."""

from __future__ import annotations

from collections.abc import Sequence

from numpy.typing import ArrayLike

from rayvox_client import validation
from rayvox_client.errors import InvalidInputError


class AttachedObject:
    """A box, cylinder or sphere fastened to a link of the robot, for the queries that name it.

    It may touch the link that it is fastened to, and `touch_links`. In contacts it counts as a link, behind the
    robot's own, in the order in which objects are given.

    Args:
        link: the name of the link.
        T_link_object: (4,4) rigid pose of the object's centre in the link's frame; None for identity.
        box: edges x, y, z. cylinder: radius and length along z. sphere: radius. Metres; exactly one of them.
        name: of the object, unlike any link's.
        padding_m: grows the object.

    Raises:
        InvalidInputError: not one shape, sizes that are not above zero, a pose that is not rigid.
    """

    __slots__ = ("T_link_object", "box", "cylinder", "link", "name", "padding_m", "sphere", "touch_links")

    def __init__(
        self,
        link: str,
        T_link_object: ArrayLike | None = None,
        *,
        box: Sequence[float] | None = None,
        cylinder: Sequence[float] | None = None,
        sphere: float | None = None,
        name: str = "attached",
        padding_m: float = 0.0,
        touch_links: Sequence[str] = (),
    ) -> None:
        if [box, cylinder, sphere].count(None) != 2:
            raise InvalidInputError("an attached object is one of box, cylinder and sphere")
        self.link = link
        self.T_link_object = validation.rigid_transform(T_link_object, "T_link_object")
        self.box = None if box is None else [_positive(edge, "box") for edge in box]
        self.cylinder = None if cylinder is None else [_positive(size, "cylinder") for size in cylinder]
        self.sphere = validation.positive_number(sphere, "sphere")
        self.name = name
        self.padding_m = float(padding_m)
        self.touch_links = list(touch_links)

    def to_json(self) -> dict[str, object]:
        """The header's form."""
        shapes = {"box": self.box, "cylinder": self.cylinder, "sphere": self.sphere}
        return {
            "name": self.name,
            "link": self.link,
            "T_link_object": self.T_link_object.ravel().tolist(),
            "padding_m": self.padding_m,
            "touch_links": self.touch_links,
            **{shape: size for shape, size in shapes.items() if size is not None},
        }

    def __repr__(self) -> str:
        return f"AttachedObject({self.name!r} on {self.link!r})"


def _positive(size: float, name: str) -> float:
    validation.positive_number(size, name)
    return float(size)
