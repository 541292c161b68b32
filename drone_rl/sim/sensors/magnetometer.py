"""Earth's magnetic field along the body's axes."""

import dataclasses
import math

import torch
from torch import Tensor

from drone_rl.config.sensors import MagnetometerSettings
from drone_rl.sim.dynamics.body import BodyState
from drone_rl.sim.frames import body_from_world
from drone_rl.sim.geodesy import HOME, GeoPoint, geo_from_world
from drone_rl.sim.sensors.noise import normal
from drone_rl.sim.sensors.sampling import Samples, Sampling
from drone_rl.utils.batch import Batch

CONSTANT = (0.34252, -0.09805, -0.93438)
"""AirSim's field of Seattle, gauss, world frame: north, west, up."""
EQUATOR_FIELD = 0.312
"""The dipole's at its equator, gauss."""
POLE = (80.31, -72.62)
"""Latitude and longitude of its pole in the north, degrees."""
EARTH_RADIUS = 6371000.0
"""Of the ball in whose middle it sits, metres."""


def dipole_field(place: Tensor) -> Tensor:
    """The field of a dipole in the middle of Earth.

    Args:
        place: Latitude and longitude in degrees, altitude in metres. Shape: (*, 3).

    Returns:
        Gauss along north, west and up. Shape: (*, 3).
    """
    latitude, longitude = torch.deg2rad(place[..., 0]), torch.deg2rad(place[..., 1])
    pole_latitude, pole_longitude = (math.radians(angle) for angle in POLE)
    apart = longitude - pole_longitude
    high, wide = math.sin(pole_latitude), math.cos(pole_latitude)
    north = latitude.cos() * high - latitude.sin() * wide * apart.cos()
    west = wide * apart.sin()
    up = latitude.sin() * high + latitude.cos() * wide * apart.cos()
    strength = EQUATOR_FIELD * (EARTH_RADIUS / (EARTH_RADIUS + place[..., 2])) ** 3
    return strength[..., None] * torch.stack([north, west, -2 * up], -1)


@dataclasses.dataclass
class MagnetometerReading(Batch):
    """What the magnetometers of `num_worlds` drones tell."""

    time: Tensor  # (num_worlds,) float64
    """When it was taken, seconds; minus infinity before the first."""
    field: Tensor  # (num_worlds, 3) float64
    """Gauss, body frame: x forward, y left, z up."""


@dataclasses.dataclass
class MagnetometerState(Batch):
    """The magnetometers of `num_worlds` drones."""

    samples: Samples
    """Readings."""
    bias: Tensor  # (num_worlds, 3) float64
    """Gauss, body frame."""


class Magnetometer:
    """A magnetometer; see `MagnetometerSettings`."""

    def __init__(self, settings: MagnetometerSettings | None = None, home: GeoPoint = HOME) -> None:
        """Makes it.

        Args:
            settings: AirSim's by default.
            home: The world's origin.
        """
        self.settings, self.home = settings or MagnetometerSettings(), home
        self.sampling = Sampling(rate=self.settings.rate, latency=self.settings.latency)

    def start(self, body: BodyState, time: Tensor, generator: torch.Generator) -> MagnetometerState:
        """Magnetometers that are turned on; their bias is drawn, the first reading is taken.

        Args:
            body: The drones.
            time: Now, seconds. Shape: (num_worlds,), float64.
            generator: Of the noise.
        """
        shape, device = body.position.shape, generator.device
        drawn = torch.rand(shape, dtype=torch.float64, generator=generator, device=device)
        bias = self.settings.noise * self.settings.bias * (2 * drawn - 1).to(time.device)
        state = MagnetometerState(self.sampling.start(time, 3), bias)
        return self.update(state, body, time, generator)

    def update(
        self, state: MagnetometerState, body: BodyState, time: Tensor, generator: torch.Generator
    ) -> MagnetometerState:
        """The same magnetometers at a later time; a reading is taken where one is due.

        Args:
            state: Before; it stays as it is.
            body: The drones now.
            time: Now, seconds. Shape: (num_worlds,), float64.
            generator: Of the noise, drawn for all drones where a reading of any is due.
        """
        if not self.sampling.due(state.samples, time).any():
            return state
        own = self.settings
        field = own.scale * body_from_world(body.attitude, self.field(body.position))
        rows = field + state.bias + own.noise * own.white_noise * normal(field, generator)
        return MagnetometerState(self.sampling.take(state.samples, time, rows), state.bias)

    def read(self, state: MagnetometerState, time: Tensor) -> MagnetometerReading:
        """What the magnetometers tell at a time (seconds, shape (num_worlds,))."""
        return MagnetometerReading(*self.sampling.tell(state.samples, time))

    def field(self, position: Tensor) -> Tensor:
        """Earth's field at places of the world, gauss, world frame. Shape: (num_worlds, 3)."""
        if self.settings.field == "constant":
            return position.new_tensor(CONSTANT).expand(len(position), 3)
        return dipole_field(geo_from_world(position, self.home))
