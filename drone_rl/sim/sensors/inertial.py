"""Sensors of the body's own motion and heading: accelerometer and gyroscope, magnetometer."""

import dataclasses
import math

import torch
from torch import Generator, Tensor

from drone_rl.config.dynamics import GRAVITY
from drone_rl.config.sensors import ImuSettings, MagnetometerSettings
from drone_rl.sim.coordinates import HOME, GeoPoint, body_from_world, geo_from_world
from drone_rl.sim.dynamics.state import BodyState
from drone_rl.sim.sensors.sensor import (
    Samples,
    Sampling,
    Sensor,
    normal,
    random_walk_step,
    select,
)
from drone_rl.utils.batch import Batch

STANDARD_GRAVITY = 9.80665
"""Metres per second squared, the unit of accelerometer errors."""
_MILLI_G, _MICRO_G = 1e-3 * STANDARD_GRAVITY, 1e-6 * STANDARD_GRAVITY
_DEGREES_PER_HOUR = math.radians(1.0) / 3600.0
_DEGREES_PER_ROOT_HOUR = math.radians(1.0) / 60.0
CONSTANT = (0.34252, -0.09805, -0.93438)
"""AirSim's magnetic field, that of Seattle, gauss, world frame: north, west, up."""
EQUATOR_FIELD = 0.312
"""The dipole's field at its equator, gauss."""
POLE = (80.31, -72.62)
"""Latitude and longitude of its northern pole, degrees."""
EARTH_RADIUS = 6371000.0
"""Of the sphere around the dipole, metres."""


@dataclasses.dataclass
class ImuReading(Batch):
    """Readings of `num_worlds` drones. Body frame: x forward, y left, z up."""

    time: Tensor  # (num_worlds,) float64
    """When it was taken, seconds; minus infinity before the first."""
    specific_force: Tensor  # (num_worlds, 3) float64
    """Acceleration minus gravity, metres per second squared: 9.81 up at rest."""
    angular_velocity: Tensor  # (num_worlds, 3) float64
    """Radians per second about the body's axes."""
    attitude: Tensor  # (num_worlds, 4) float64
    """The true attitude, as in AirSim: quaternion (w, x, y, z) from body to world."""


@dataclasses.dataclass
class ImuState(Batch):
    """State of `num_worlds` drones' accelerometers and gyroscopes."""

    samples: Samples
    time: Tensor  # (num_worlds,) float64
    """Of the last reading, seconds."""
    velocity: Tensor  # (num_worlds, 3) float64
    """Of the drone at that time, metres per second, world frame."""
    gyro_bias: Tensor  # (num_worlds, 3) float64
    """Radians per second, body frame."""
    accel_bias: Tensor  # (num_worlds, 3) float64
    """Metres per second squared, body frame."""


class Imu(Sensor[ImuState, ImuReading]):
    """Accelerometer and gyroscope; see `ImuSettings`."""

    def __init__(self, settings: ImuSettings | None = None) -> None:
        """Use AirSim's settings by default."""
        self.settings = settings or ImuSettings()
        self.sampling = Sampling(rate=self.settings.rate)

    def _initial(self, body: BodyState, time: Tensor, generator: Generator) -> ImuState:
        """The body was at rest before: its first reading is that of a body that is carried."""
        own = self.settings
        still = torch.zeros_like(body.velocity)
        gyro = own.noise * own.gyro_turn_on_bias * _DEGREES_PER_HOUR * normal(still, generator)
        accel = own.noise * own.accel_turn_on_bias * _MILLI_G * normal(still, generator)
        before = time - 1.0 / own.rate
        return ImuState(self.sampling.start(time, 10), before, body.velocity.clone(), gyro, accel)

    def _sample(
        self, state: ImuState, body: BodyState, time: Tensor, generator: Generator
    ) -> ImuState:
        own, is_due = self.settings, self.sampling.due(state.samples, time)
        seconds = torch.where(is_due, time - state.time, 1.0)
        force = specific_force(body.attitude, state.velocity, body.velocity, seconds)
        root = seconds.sqrt()[:, None]
        gyro_noise = own.noise * own.gyro_random_walk * _DEGREES_PER_ROOT_HOUR / root
        accel_noise = own.noise * own.accel_random_walk * _MILLI_G / root
        rates = body.angular_velocity + state.gyro_bias
        rates = rates + gyro_noise * normal(rates, generator)
        force = force + state.accel_bias + accel_noise * normal(force, generator)
        gyro_step = own.noise * own.gyro_bias_stability * _DEGREES_PER_HOUR
        accel_step = own.noise * own.accel_bias_stability * _MICRO_G
        gyro = random_walk_step(state.gyro_bias, gyro_step, own.gyro_bias_time, seconds, generator)
        accel = random_walk_step(
            state.accel_bias, accel_step, own.accel_bias_time, seconds, generator
        )
        return ImuState(
            self.sampling.take(state.samples, time, torch.cat([force, rates, body.attitude], 1)),
            torch.where(is_due, time, state.time),
            select(is_due, body.velocity, state.velocity),
            select(is_due, gyro, state.gyro_bias),
            select(is_due, accel, state.accel_bias),
        )

    def _reading(self, time: Tensor, rows: Tensor) -> ImuReading:
        return ImuReading(time, rows[:, :3], rows[:, 3:6], rows[:, 6:])


def specific_force(attitude: Tensor, before: Tensor, after: Tensor, seconds: Tensor) -> Tensor:
    """Return the mean specific force between two times.

    Args:
        attitude: Quaternions (w, x, y, z) from body to world. Shape: (num_worlds, 4).
        before: Velocity at the first time, metres per second, world frame. Shape: (num_worlds, 3).
        after: At the second.
        seconds: Between them, more than 0. Shape: (num_worlds,).

    Returns:
        Metres per second squared, body frame. Shape: (num_worlds, 3).
    """
    acceleration = (after - before) / seconds[:, None]
    return body_from_world(attitude, acceleration + acceleration.new_tensor((0.0, 0.0, GRAVITY)))


@dataclasses.dataclass
class MagnetometerReading(Batch):
    """Readings of `num_worlds` drones."""

    time: Tensor  # (num_worlds,) float64
    """When it was taken, seconds; minus infinity before the first."""
    field: Tensor  # (num_worlds, 3) float64
    """Gauss, body frame: x forward, y left, z up."""


@dataclasses.dataclass
class MagnetometerState(Batch):
    """State of `num_worlds` drones' magnetometers."""

    samples: Samples
    bias: Tensor  # (num_worlds, 3) float64
    """Gauss, body frame."""


class Magnetometer(Sensor[MagnetometerState, MagnetometerReading]):
    """A magnetometer; see `MagnetometerSettings`."""

    def __init__(self, settings: MagnetometerSettings | None = None, home: GeoPoint = HOME) -> None:
        """Use AirSim's settings by default; `home` is the world's origin."""
        self.settings, self.home = settings or MagnetometerSettings(), home
        self.sampling = Sampling(rate=self.settings.rate, latency=self.settings.latency)

    def _initial(self, body: BodyState, time: Tensor, generator: Generator) -> MagnetometerState:
        shape, device = body.position.shape, generator.device
        drawn = torch.rand(shape, dtype=torch.float64, generator=generator, device=device)
        bias = self.settings.noise * self.settings.bias * (2 * drawn - 1).to(time.device)
        return MagnetometerState(self.sampling.start(time, 3), bias)

    def _sample(
        self, state: MagnetometerState, body: BodyState, time: Tensor, generator: Generator
    ) -> MagnetometerState:
        own = self.settings
        field = own.scale * body_from_world(body.attitude, self.field(body.position))
        rows = field + state.bias + own.noise * own.white_noise * normal(field, generator)
        return MagnetometerState(self.sampling.take(state.samples, time, rows), state.bias)

    def _reading(self, time: Tensor, rows: Tensor) -> MagnetometerReading:
        return MagnetometerReading(time, rows)

    def field(self, position: Tensor) -> Tensor:
        """Return Earth's field at world positions, gauss, world frame. Shape: (num_worlds, 3)."""
        if self.settings.field == "constant":
            return position.new_tensor(CONSTANT).expand(len(position), 3)
        return dipole_field(geo_from_world(position, self.home))


def dipole_field(place: Tensor) -> Tensor:
    """Return the field of a dipole at Earth's centre.

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
