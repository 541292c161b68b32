"""What is known of a drone, in the words of people: degrees, names of things."""

import dataclasses
import enum
import math

import numpy as np

from drone_rl.sim.dynamics import FlightState
from drone_rl.sim.dynamics.state import GROUND, NOTHING

Triple = tuple[float, float, float]


class LandedState(enum.StrEnum):
    """Whether something carries the drone."""

    LANDED = "landed"
    FLYING = "flying"


@dataclasses.dataclass(frozen=True)
class Attitude:
    """How a drone is turned, degrees: first yaw, then pitch, then roll."""

    roll: float
    """Positive with the right side down."""
    pitch: float
    """Positive with the nose down."""
    yaw: float
    """Positive to the left of the world's x."""


@dataclasses.dataclass(frozen=True)
class Collision:
    """What a drone last touched. World frame."""

    thing: str
    """ground, or obstacle and its number."""
    normal: Triple
    """Unit vector out of the thing."""
    point: Triple
    """Where, metres."""
    depth: float
    """How far the ball around the drone reached into it, metres."""
    time: float
    """When, in simulated seconds."""


@dataclasses.dataclass(frozen=True)
class PilotState:
    """A drone at a moment. World frame: x forward, y left, z up."""

    time: float
    """Simulated seconds."""
    position: Triple
    """Metres; of its middle, which stands above the ground when it has landed."""
    velocity: Triple
    """Metres a second."""
    attitude: Attitude
    """Degrees."""
    landed: LandedState
    """Whether something carries it."""
    armed: bool
    """Whether its rotors turn."""
    lost: bool
    """Whether its motion has diverged: then nothing more is known of it."""
    collision: Collision | None
    """The last contact, the ground's included; None before the first."""

    @property
    def speed(self) -> float:
        """Metres a second."""
        return math.hypot(*self.velocity)


def attitude_of(quaternion: tuple[float, float, float, float]) -> Attitude:
    """Angles of a unit quaternion (w, x, y, z)."""
    w, x, y, z = quaternion
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(min(max(2.0 * (w * y - z * x), -1.0), 1.0))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return Attitude(*np.degrees([roll, pitch, yaw]).tolist())


def collision_of(body: FlightState) -> Collision | None:
    """The last one of a single drone."""
    contact = body.contact
    thing = int(contact.thing[0])
    if thing == NOTHING:
        return None
    return Collision(
        "ground" if thing == GROUND else f"obstacle {thing}",
        triple(contact.normal),
        triple(contact.point),
        float(contact.depth[0]),
        float(contact.time[0]),
    )


def triple(rows: object) -> Triple:
    """The first row of a tensor of shape (1, 3)."""
    x, y, z = np.asarray(rows)[0].tolist()
    return x, y, z
