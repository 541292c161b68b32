"""A drone's state and trajectory as users read them."""

import dataclasses
import enum
import math
from collections import deque
from typing import Self

import numpy as np
from torch import Tensor

from drone_rl.sim.coordinates import Attitude
from drone_rl.sim.dynamics import FlightState
from drone_rl.sim.dynamics.state import (
    ATTITUDE,
    GROUND,
    NOTHING,
    POSITION,
    REFERENCE,
    ROTORS,
    VELOCITY,
)
from drone_rl.utils.display import table

Triple = tuple[float, float, float]


class LandedState(enum.StrEnum):
    """Whether the drone stands on something."""

    LANDED = "landed"
    FLYING = "flying"


@dataclasses.dataclass(frozen=True)
class Collision:
    """The last contact. World frame."""

    thing: str
    """"ground", or "obstacle" and its number."""
    normal: Triple
    """Unit vector out of the thing."""
    point: Triple
    """Contact point, metres."""
    depth: float
    """Penetration of the drone's bounding sphere, metres."""
    time: float
    """Simulated seconds."""

    @classmethod
    def of(cls, body: FlightState) -> Self | None:
        """Return the last contact of a single drone."""
        contact = body.contact
        thing = int(contact.thing[0])
        if thing == NOTHING:
            return None
        return cls(
            "ground" if thing == GROUND else f"obstacle {thing}",
            _triple(contact.normal),
            _triple(contact.point),
            float(contact.depth[0]),
            float(contact.time[0]),
        )


@dataclasses.dataclass(frozen=True)
class PilotState:
    """State of a drone at one time. World frame: x forward, y left, z up."""

    time: float
    """Simulated seconds."""
    position: Triple
    """Centre of the drone, metres; z is the drone's radius when it stands on the ground."""
    velocity: Triple
    """Metres per second."""
    attitude: Attitude
    """Degrees."""
    landed: LandedState
    """Whether the drone stands on something."""
    armed: bool
    """Whether the rotors turn."""
    lost: bool
    """Whether the simulation has diverged: pose and contact are then the last valid ones, the
    velocity is 0, and time goes on."""
    collision: Collision | None
    """The last contact, with the ground or an obstacle; None before the first."""

    @classmethod
    def of(cls, body: FlightState, time: float, landed: LandedState, armed: bool) -> Self:
        """Return the state of a single drone."""
        return cls(
            time=time,
            position=_triple(body.position),
            velocity=_triple(body.velocity),
            attitude=Attitude.of(body.attitude[0].tolist()),
            landed=landed,
            armed=armed,
            lost=bool(body.is_lost[0]),
            collision=Collision.of(body),
        )

    @property
    def speed(self) -> float:
        """Metres per second."""
        return math.hypot(*self.velocity)

    def _repr_html_(self) -> str:
        angles, contact = dataclasses.astuple(self.attitude), self.collision
        rows = {
            "time": f"{self.time:.2f} s",
            "state": f"{self.landed}, {'armed' if self.armed else 'disarmed'}",
            "position": "{:.2f}, {:.2f}, {:.2f} m".format(*self.position),
            "velocity": "{:.2f}, {:.2f}, {:.2f} m/s".format(*self.velocity),
            "roll, pitch, yaw": "{:.1f}, {:.1f}, {:.1f} degrees".format(*angles),
            "last contact": f"{contact.thing}, {contact.time:.2f} s" if contact else "none",
        }
        return table(["drone", ""], list(rows.items()))


def _triple(rows: Tensor) -> Triple:
    """Return the first row of a tensor of shape (1, 3)."""
    x, y, z = rows[0].tolist()
    return x, y, z


class Trajectory:
    """States recorded in each control period. World frame, SI units."""

    def __init__(self, most: int | None = None) -> None:
        """Create an empty trajectory that keeps the last `most` states, by default all."""
        self._times: deque[float] = deque(maxlen=most)
        self._rows: deque[np.ndarray] = deque(maxlen=most)

    def __len__(self) -> int:
        """Return the number of recorded times."""
        return len(self._times)

    def append(self, time: float, body: FlightState) -> None:
        """Record the state of one drone at a time in seconds."""
        self._times.append(time)
        self._rows.append(body.numbers.numpy()[0, :REFERENCE].copy())

    @property
    def times(self) -> np.ndarray:
        """Simulated seconds. Shape: (T,)."""
        return np.array(list(self._times))

    @property
    def positions(self) -> np.ndarray:
        """Metres. Shape: (T, 3)."""
        return self._part(POSITION, 3)

    @property
    def attitudes(self) -> np.ndarray:
        """Unit quaternions (w, x, y, z). Shape: (T, 4)."""
        return self._part(ATTITUDE, 4)

    @property
    def velocities(self) -> np.ndarray:
        """Metres per second. Shape: (T, 3)."""
        return self._part(VELOCITY, 3)

    @property
    def rotors(self) -> np.ndarray:
        """Fractions of the maximum thrust, as in `FlightState.rotors`. Shape: (T, 4)."""
        return self._part(ROTORS, 4)

    def _part(self, first: int, count: int) -> np.ndarray:
        return np.array(list(self._rows)).reshape(len(self), REFERENCE)[:, first : first + count]
