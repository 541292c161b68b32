"""Collisions of a vehicle: which contacts are new, and which a client has not read yet."""

import math
from collections.abc import Collection, Sequence
from typing import NamedTuple, Self

import torch
from torch import Tensor

from drone_rl.flight.airsim import messages
from drone_rl.flight.airsim.messages import Map, to_world

GAP = 0.05
"""Simulated seconds, over two control periods, after which a contact has ended."""
_APART = 0.005
"""Metres before an obstacle at which a straight move stops."""
_PARTS, _ROUNDS = 64, 6
"""Parts of a straight move that are tested at a time, and times that the search is narrowed."""


class VehicleCollision(NamedTuple):
    """A contact of a vehicle. World frame, metres."""

    name: str
    """Of the object."""
    position: Sequence[float]
    """The vehicle's."""
    point: Sequence[float]
    """On the object, nearest to the vehicle."""
    normal: Sequence[float]
    """Unit vector out of the object."""
    depth: float
    """Penetration of the vehicle's bounding sphere."""
    time: float
    """Seconds of the vehicle."""
    is_event: bool = False
    """Whether it is over before a client can ask: with a cube, which vanishes, or of a teleport."""

    @classmethod
    def event(cls, name: str, position: Tensor, point: Tensor, radius: float, time: float) -> Self:
        """Return an event at the nearest point of an object. Shapes: (3,)."""
        away = position - point
        distance = float(away.norm())
        normal = (away / distance).tolist() if distance > 0.0 else (0.0, 0.0, 1.0)
        depth = max(0.0, radius - distance)
        return cls(name, position.tolist(), point.tolist(), normal, depth, time, is_event=True)


def collision_info(
    collision: VehicleCollision | None,
    *,
    has_collided: bool,
    home: Sequence[float],
    time_stamp: int,
    number: int,
) -> Map:
    """Return a CollisionInfo, relative to the start position `home`, of an object's number."""
    if collision is None:
        collision = VehicleCollision("", home, home, (0.0, 0.0, 0.0), 0.0, 0.0)
    point, place = (
        messages.vector(to_world([a - b for a, b in zip(value, home, strict=True)]))
        for value in (collision.point, collision.position)
    )
    return {
        "has_collided": has_collided,
        "penetration_depth": collision.depth,
        "time_stamp": time_stamp,
        "normal": messages.vector(to_world(collision.normal)),
        "impact_point": point,
        "position": place,
        "object_name": collision.name,
        "object_id": number,
    }


class CollisionRecord:
    """Collisions of one vehicle.

    A collision is new if it is an event, or if the vehicle has not touched the object for `GAP`. It
    is kept until a client has read it; of each object, the latest one.
    """

    def __init__(self) -> None:
        """Create an empty record."""
        self._contacts: dict[str, VehicleCollision] = {}
        """Last contact with each object."""
        self._unread: dict[str, VehicleCollision] = {}
        self.forget()

    def forget(self) -> None:
        """Drop all collisions but events, as at take-off.

        A contact that lasts does not become new by that.
        """
        self._last: VehicleCollision | None = None
        self._unread = {name: one for name, one in self._unread.items() if one.is_event}

    def move(self, touched: Collection[str], now: float) -> None:
        """Note that the vehicle was put elsewhere, where it touches the named objects.

        Contacts with other objects have ended; those that lasted go on. `now` is in seconds.
        """
        self._contacts = {
            name: one._replace(time=now)
            for name, one in self._contacts.items()
            if name in touched and now - one.time <= GAP
        }

    def add(self, contact: VehicleCollision) -> None:
        """Note a contact."""
        earlier = self._contacts.get(contact.name)
        self._contacts[contact.name] = contact
        lasts = earlier is not None and contact.time - earlier.time <= GAP
        if contact.is_event or not lasts:
            self._last = self._unread[contact.name] = contact

    def read(self, *, clear: bool = True) -> tuple[VehicleCollision | None, bool]:
        """Return an unread collision, else the last one, and whether it was unread.

        With `clear` it is then read.
        """
        collision, is_unread = next(iter(self._unread.values()), self._last), bool(self._unread)
        if clear and collision is not None:
            self._unread.pop(collision.name, None)
        return collision, is_unread

    def read_current(self, now: float) -> tuple[VehicleCollision | None, bool]:
        """Return an unread event, else a contact that lasts at the vehicle's time `now`, seconds.

        See `read`; this is what clients of AirSim 1.1 expect.
        """
        event = next((one for one in self._unread.values() if one.is_event), None)
        if event is not None:
            return self._unread.pop(event.name), True
        lasting = (one for one in self._contacts.values() if now - one.time <= GAP)
        contact = next((one for one in lasting if not one.is_event), None)
        return contact or self._last, contact is not None


class Solids(NamedTuple):
    """Axis-aligned boxes with a margin around them, which stop vehicles. Metres."""

    names: Sequence[str]
    centers: Tensor
    """Shape: (S, 3)."""
    half_sizes: Tensor
    """Shape: (S, 3)."""
    margins: Tensor
    """Distances from a box up to which it is solid. Shape: (S,)."""

    def gaps(self, places: Tensor, radius: float) -> Tensor:
        """Return the distances from balls to the solids; places (*, S, 3) or (3,), gaps (*, S)."""
        apart = ((places - self.centers).abs() - self.half_sizes).clamp(min=0.0)
        return apart.norm(dim=-1) - self.margins - radius

    def sweep(
        self, here: Tensor, there: Tensor, radius: float
    ) -> tuple[Tensor, tuple[str, Tensor] | None]:
        """Move a ball of a radius on a straight line, up to the first solid that it gets into.

        Returns:
            Its last free position, (3,); name of what stops it, and the point of that nearest to
            the ball, (3,), or None if nothing does.
        """
        way = there - here
        start = torch.zeros(len(self.names), dtype=here.dtype)
        deepest = self.gaps(here, radius).clamp(max=0.0) - 1e-9
        low, high = start, start + 1.0
        parts = torch.linspace(0.0, 1.0, _PARTS + 1, dtype=here.dtype)[:, None]

        def gaps(shares: Tensor) -> Tensor:
            return self.gaps(here + shares[..., None] * way, radius)

        for _ in range(_ROUNDS):  # the gap is convex: its least value is next to the least of some
            shares = low + parts * (high - low)
            least = gaps(shares).argmin(0, keepdim=True)
            low, high = (shares.gather(0, (least + side).clamp(0, _PARTS))[0] for side in (-1, 1))
        hits = gaps(high) < deepest
        if not bool(hits.any()):
            return there, None
        low = start
        for _ in range(_ROUNDS):  # before its least value the gap falls
            shares = low + parts * (high - low)
            first = (gaps(shares) < deepest).long().argmax(0, keepdim=True).clamp(min=1)
            low, high = (shares.gather(0, first - before)[0] for before in (1, 0))
        hit = int(torch.where(hits, low, math.inf).argmin())
        place = here + way * (low[hit] - _APART / way.norm()).clamp(min=0.0)
        point = nearest(place, self.centers[hit], self.half_sizes[hit])
        away = place - point
        point = point + away * (self.margins[hit] / away.norm().clamp(min=1e-9))
        return place, (self.names[hit], point)


def nearest(place: Tensor, center: Tensor, half_sizes: Tensor) -> Tensor:
    """Return the point of an axis-aligned box that is nearest to a place. Shapes: (3,)."""
    return torch.minimum(torch.maximum(place, center - half_sizes), center + half_sizes)
