"""The state of a drone as users read it, its trajectory, and their display in notebooks."""

import dataclasses
import enum
import html
import math

import numpy as np

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

Triple = tuple[float, float, float]
_MAP_SIZE = 160.0
"""Width and height of the map in a notebook, pixels."""
_MAP_POINTS = 400
"""Greatest number of trajectory points on the map."""


class LandedState(enum.StrEnum):
    """Whether the drone stands on something."""

    LANDED = "landed"
    FLYING = "flying"


@dataclasses.dataclass(frozen=True)
class Attitude:
    """Orientation in degrees, applied in the order yaw, pitch, roll."""

    roll: float
    """Positive with the right side down."""
    pitch: float
    """Positive with the nose down."""
    yaw: float
    """Positive to the left of the world's x axis."""


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


@dataclasses.dataclass(frozen=True)
class PilotState:
    """State of a drone at one time. World frame: x forward, y left, z up."""

    time: float
    """Simulated seconds."""
    position: Triple
    """Centre of the drone, metres; above the ground when it has landed."""
    velocity: Triple
    """Metres per second."""
    attitude: Attitude
    """Degrees."""
    landed: LandedState
    """Whether the drone stands on something."""
    armed: bool
    """Whether the rotors turn."""
    lost: bool
    """Whether the simulation has diverged; the other values are then the last valid ones."""
    collision: Collision | None
    """The last contact, with the ground or an obstacle; None before the first."""

    @property
    def speed(self) -> float:
        """Metres per second."""
        return math.hypot(*self.velocity)


def attitude_of(quaternion: tuple[float, float, float, float]) -> Attitude:
    """Convert a unit quaternion (w, x, y, z)."""
    w, x, y, z = quaternion
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(min(max(2.0 * (w * y - z * x), -1.0), 1.0))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return Attitude(*np.degrees([roll, pitch, yaw]).tolist())


def collision_of(body: FlightState) -> Collision | None:
    """Return the last contact of a single drone."""
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
    """Return the first row of a tensor of shape (1, 3)."""
    x, y, z = np.asarray(rows)[0].tolist()
    return x, y, z


class Trajectory:
    """States recorded in each control period. World frame, SI units."""

    def __init__(self) -> None:
        """Create an empty trajectory."""
        self._times: list[float] = []
        self._rows: list[np.ndarray] = []

    def __len__(self) -> int:
        """Return the number of recorded times."""
        return len(self._times)

    def append(self, time: float, body: FlightState) -> None:
        """Record the state of one drone at a time in seconds."""
        self._times.append(time)
        self._rows.append(body.numbers[0, :REFERENCE].numpy().astype(np.float64))

    @property
    def times(self) -> np.ndarray:
        """Simulated seconds. Shape: (T,)."""
        return np.array(self._times)

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
        return np.array(self._rows).reshape(len(self), REFERENCE)[:, first : first + count]


def state_html(state: PilotState, trajectory: Trajectory) -> str:
    """Return a table of the state and a map of the trajectory as self-contained HTML."""
    rows = "".join(
        f"<tr><td>{name}</td><td>{html.escape(text)}</td></tr>" for name, text in _rows(state)
    )
    table = f"<table>{rows}</table>{trajectory_svg(trajectory)}"
    return f'<div style="display: flex; gap: 1em">{table}</div>'


def trajectory_svg(trajectory: Trajectory) -> str:
    """Return the trajectory from above as SVG: x up, y to the left."""
    step = max(1, len(trajectory) // _MAP_POINTS)
    places = trajectory.positions[::step, :2]
    low, high = places.min(0), places.max(0)
    scale = (_MAP_SIZE - 20.0) / max(float((high - low).max()), 1.0)
    across, up = 10.0 + scale * (high - places).T[::-1]
    points = " ".join(f"{x:.1f},{y:.1f}" for x, y in zip(across, up, strict=True))
    return (
        f'<svg width="{_MAP_SIZE:.0f}" height="{_MAP_SIZE:.0f}"><polyline points="{points}" '
        'fill="none" stroke="currentColor"/></svg>'
    )


def _rows(state: PilotState) -> list[tuple[str, str]]:
    angles = state.attitude
    contact = state.collision
    return [
        ("time", f"{state.time:.2f} s"),
        ("state", f"{state.landed}, {'armed' if state.armed else 'disarmed'}"),
        ("position", "{:.2f}, {:.2f}, {:.2f} m".format(*state.position)),
        ("velocity", "{:.2f}, {:.2f}, {:.2f} m/s".format(*state.velocity)),
        ("roll, pitch, yaw", f"{angles.roll:.1f}, {angles.pitch:.1f}, {angles.yaw:.1f} degrees"),
        ("last contact", f"{contact.thing}, {contact.time:.2f} s" if contact else "none"),
    ]
