"""Accelerometer and gyroscope: what a body feels, and how fast it turns, along its own axes."""

import dataclasses
import math

import torch
from torch import Tensor

from drone_rl.config.dynamics import GRAVITY
from drone_rl.config.sensors import ImuSettings, MagnetometerSettings
from drone_rl.sim.coordinates import HOME, GeoPoint, body_from_world, geo_from_world
from drone_rl.sim.dynamics.state import BodyState
from drone_rl.sim.sensors.sensor import Samples, Sampling, normal, random_walk_step
from drone_rl.utils.batch import Batch

STANDARD_GRAVITY = 9.80665
"""Metres a second squared, in whose parts accelerometers' errors are given."""
_MILLI_G, _MICRO_G = 1e-3 * STANDARD_GRAVITY, 1e-6 * STANDARD_GRAVITY
_DEGREES_PER_HOUR = math.radians(1.0) / 3600.0
_DEGREES_PER_ROOT_HOUR = math.radians(1.0) / 60.0


@dataclasses.dataclass
class ImuReading(Batch):
    """What the sensors of `num_worlds` drones read. Body frame: x forward, y left, z up."""

    time: Tensor  # (num_worlds,) float64
    """When it was taken, seconds; minus infinity before the first."""
    specific_force: Tensor  # (num_worlds, 3) float64
    """Acceleration without gravity's share, metres a second squared: 9.81 up at rest."""
    angular_velocity: Tensor  # (num_worlds, 3) float64
    """Radians a second about the body's axes."""
    attitude: Tensor  # (num_worlds, 4) float64
    """The true one, as AirSim has it: quaternion (w, x, y, z) from body to world."""


@dataclasses.dataclass
class ImuState(Batch):
    """The sensors of `num_worlds` drones."""

    samples: Samples
    """Readings."""
    time: Tensor  # (num_worlds,) float64
    """Of the last reading, seconds."""
    velocity: Tensor  # (num_worlds, 3) float64
    """The drone's then, metres a second, world frame."""
    gyro_bias: Tensor  # (num_worlds, 3) float64
    """Radians a second, body frame."""
    accel_bias: Tensor  # (num_worlds, 3) float64
    """Metres a second squared, body frame."""


def specific_force(attitude: Tensor, before: Tensor, after: Tensor, seconds: Tensor) -> Tensor:
    """What an accelerometer feels on average from one time to another.

    Args:
        attitude: Quaternions (w, x, y, z) from body to world. Shape: (num_worlds, 4).
        before: Velocity at the first time, metres a second, world frame. Shape: (num_worlds, 3).
        after: At the second.
        seconds: Between them, more than 0. Shape: (num_worlds,).

    Returns:
        Metres a second squared, body frame. Shape: (num_worlds, 3).
    """
    acceleration = (after - before) / seconds[:, None]
    return body_from_world(attitude, acceleration + acceleration.new_tensor((0.0, 0.0, GRAVITY)))


class Imu:
    """Both sensors; see `ImuSettings`."""

    def __init__(self, settings: ImuSettings | None = None) -> None:
        """Makes the sensors.

        Args:
            settings: AirSim's by default.
        """
        self.settings = settings or ImuSettings()
        self.sampling = Sampling(rate=self.settings.rate)

    def start(self, body: BodyState, time: Tensor, generator: torch.Generator) -> ImuState:
        """Sensors that are turned on; the first reading, that of a body that is carried, is taken.

        Args:
            body: The drones.
            time: Now, seconds. Shape: (num_worlds,), float64.
            generator: Of the noise.
        """
        own = self.settings
        still = torch.zeros_like(body.velocity)
        gyro = own.noise * own.gyro_turn_on_bias * _DEGREES_PER_HOUR * normal(still, generator)
        accel = own.noise * own.accel_turn_on_bias * _MILLI_G * normal(still, generator)
        samples = self.sampling.start(time, 10)
        before = time - 1.0 / own.rate
        state = ImuState(samples, before, body.velocity.clone(), gyro, accel)
        return self.update(state, body, time, generator)

    def update(
        self, state: ImuState, body: BodyState, time: Tensor, generator: torch.Generator
    ) -> ImuState:
        """The same sensors at a later time; a reading is taken where one is due.

        Args:
            state: Before; it stays as it is.
            body: The drones now.
            time: Now, seconds. Shape: (num_worlds,), float64.
            generator: Of the noise, drawn for all drones where a reading of any is due.
        """
        own, is_due = self.settings, self.sampling.due(state.samples, time)
        if not is_due.any():
            return state
        seconds = torch.where(is_due, time - state.time, 1.0)
        felt = specific_force(body.attitude, state.velocity, body.velocity, seconds)
        root = seconds.sqrt()[:, None]
        gyro_noise = own.noise * own.gyro_random_walk * _DEGREES_PER_ROOT_HOUR / root
        accel_noise = own.noise * own.accel_random_walk * _MILLI_G / root
        turning = body.angular_velocity + state.gyro_bias
        turning = turning + gyro_noise * normal(turning, generator)
        felt = felt + state.accel_bias + accel_noise * normal(felt, generator)
        gyro_step = own.noise * own.gyro_bias_stability * _DEGREES_PER_HOUR
        accel_step = own.noise * own.accel_bias_stability * _MICRO_G
        gyro = random_walk_step(state.gyro_bias, gyro_step, own.gyro_bias_time, seconds, generator)
        accel = random_walk_step(
            state.accel_bias, accel_step, own.accel_bias_time, seconds, generator
        )
        rows = torch.cat([felt, turning, body.attitude], 1)
        due = is_due[:, None]
        return ImuState(
            self.sampling.take(state.samples, time, rows),
            torch.where(is_due, time, state.time),
            torch.where(due, body.velocity, state.velocity),
            torch.where(due, gyro, state.gyro_bias),
            torch.where(due, accel, state.accel_bias),
        )

    def read(self, state: ImuState, time: Tensor) -> ImuReading:
        """What the sensors read at a time (seconds, shape (num_worlds,))."""
        taken, rows = self.sampling.read(state.samples, time)
        return ImuReading(taken, rows[:, :3], rows[:, 3:6], rows[:, 6:])


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
    """What the magnetometers of `num_worlds` drones read."""

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
        """What the magnetometers read at a time (seconds, shape (num_worlds,))."""
        return MagnetometerReading(*self.sampling.read(state.samples, time))

    def field(self, position: Tensor) -> Tensor:
        """Earth's field at places of the world, gauss, world frame. Shape: (num_worlds, 3)."""
        if self.settings.field == "constant":
            return position.new_tensor(CONSTANT).expand(len(position), 3)
        return dipole_field(geo_from_world(position, self.home))
