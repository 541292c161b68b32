"""The sensors: accelerometer and gyroscope, magnetometer, GPS receiver and barometer."""

import dataclasses
import enum
import math

import torch
from torch import Generator, Tensor

from drone_rl.config.dynamics import GRAVITY
from drone_rl.config.sensors import (
    BarometerSettings,
    GpsSettings,
    ImuSettings,
    MagnetometerSettings,
)
from drone_rl.sim.coordinates import HOME, GeoPoint, body_from_world, geo_from_world
from drone_rl.sim.dynamics.state import BodyState
from drone_rl.sim.sensors.sensor import (
    Sampling,
    Sensor,
    SensorState,
    gauss_markov_step,
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
EQUATOR_FIELD, EARTH_RADIUS = 0.312, 6371000.0
"""Of the dipole: the field at its equator, gauss; the radius of Earth's sphere, metres."""
POLE = (80.31, -72.62)
"""Latitude and longitude of the dipole's northern pole, degrees."""
SEA_LEVEL_TEMPERATURE, _LAPSE, _TOP = 288.15, 0.0065, 11_000.0
"""Of the standard atmosphere: kelvin, kelvin per metre, and the metres up to which this holds."""
SEA_LEVEL_PRESSURE = 101_325.0
"""Of the standard atmosphere, pascals."""
_EXPONENT, _ATMOSPHERE_RADIUS = 5.255877, 6356766.0
"""Of pressure as a power of temperature; Earth's radius for heights under constant gravity."""


@dataclasses.dataclass
class ImuReading(Batch):
    """Readings of `num_envs` drones. Body frame: x forward, y left, z up."""

    time: Tensor  # (num_envs,) float64
    """When it was taken, seconds; minus infinity before the first."""
    specific_force: Tensor  # (num_envs, 3) float64
    """Acceleration minus gravity, metres per second squared: 9.81 up at rest."""
    angular_velocity: Tensor  # (num_envs, 3) float64
    """Radians per second about the body's axes."""
    attitude: Tensor  # (num_envs, 4) float64
    """The true attitude, as in AirSim: quaternion (w, x, y, z) from body to world."""


@dataclasses.dataclass
class ImuState(SensorState):
    """State of `num_envs` drones' accelerometers and gyroscopes."""

    time: Tensor  # (num_envs,) float64
    """Of the last reading, seconds."""
    velocity: Tensor  # (num_envs, 3) float64
    """Of the drone at that time, metres per second, world frame."""
    gyro_bias: Tensor  # (num_envs, 3) float64
    """Radians per second, body frame."""
    accel_bias: Tensor  # (num_envs, 3) float64
    """Metres per second squared, body frame."""


class Imu(Sensor[ImuState, ImuReading]):
    """Accelerometer and gyroscope; see `ImuSettings`."""

    def __init__(self, settings: ImuSettings | None = None) -> None:
        self.settings = settings or ImuSettings()
        self.sampling = Sampling(rate=self.settings.rate)

    def _initial(self, body: BodyState, time: Tensor, generator: Generator) -> ImuState:
        """The velocity was constant before: the first reading has no acceleration but gravity's."""
        settings = self.settings
        still = torch.zeros_like(body.velocity)
        turn_on = settings.noise * settings.gyro_turn_on_bias * _DEGREES_PER_HOUR
        gyro = turn_on * normal(still, generator)
        accel = settings.noise * settings.accel_turn_on_bias * _MILLI_G * normal(still, generator)
        before = time - 1.0 / settings.rate
        return ImuState(self.sampling.start(time, 10), before, body.velocity.clone(), gyro, accel)

    def _sample(
        self, state: ImuState, body: BodyState, time: Tensor, generator: Generator
    ) -> ImuState:
        settings, is_due = self.settings, self.sampling.due(state.samples, time)
        seconds = torch.where(is_due, time - state.time, 1.0)
        force = specific_force(body.attitude, state.velocity, body.velocity, seconds)
        root = seconds.sqrt()[:, None]
        gyro_noise = settings.noise * settings.gyro_random_walk * _DEGREES_PER_ROOT_HOUR / root
        accel_noise = settings.noise * settings.accel_random_walk * _MILLI_G / root
        rates = body.angular_velocity + state.gyro_bias
        rates = rates + gyro_noise * normal(rates, generator)
        force = force + state.accel_bias + accel_noise * normal(force, generator)
        gyro_step = settings.noise * settings.gyro_bias_stability * _DEGREES_PER_HOUR
        accel_step = settings.noise * settings.accel_bias_stability * _MICRO_G
        gyro = random_walk_step(
            state.gyro_bias, gyro_step, settings.gyro_bias_time, seconds, generator
        )
        accel = random_walk_step(
            state.accel_bias, accel_step, settings.accel_bias_time, seconds, generator
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
    """Return the mean specific force, m/s^2, body frame, while velocities changed.

    Attitudes are quaternions (w, x, y, z), shape (num_envs, 4). Velocities `before` and `after`
    some seconds, more than 0, are in m/s, world frame, shape (num_envs, 3).
    """
    acceleration = (after - before) / seconds[:, None]
    return body_from_world(attitude, acceleration + acceleration.new_tensor((0.0, 0.0, GRAVITY)))


@dataclasses.dataclass
class MagnetometerReading(Batch):
    """Readings of `num_envs` drones."""

    time: Tensor  # (num_envs,) float64
    """When it was taken, seconds; minus infinity before the first."""
    field: Tensor  # (num_envs, 3) float64
    """Gauss, body frame: x forward, y left, z up."""


@dataclasses.dataclass
class MagnetometerState(SensorState):
    """State of `num_envs` drones' magnetometers."""

    bias: Tensor  # (num_envs, 3) float64
    """Gauss, body frame."""


class Magnetometer(Sensor[MagnetometerState, MagnetometerReading]):
    """A magnetometer; see `MagnetometerSettings`."""

    def __init__(self, settings: MagnetometerSettings | None = None, home: GeoPoint = HOME) -> None:
        self.settings, self.home = settings or MagnetometerSettings(), home
        self.sampling = Sampling(rate=self.settings.rate, latency=self.settings.latency)

    def _initial(self, body: BodyState, time: Tensor, generator: Generator) -> MagnetometerState:
        shape, device = body.position.shape, generator.device
        sampled = torch.rand(shape, dtype=torch.float64, generator=generator, device=device)
        bias = self.settings.noise * self.settings.bias * (2 * sampled - 1).to(time.device)
        return MagnetometerState(self.sampling.start(time, 3), bias)

    def _sample(
        self, state: MagnetometerState, body: BodyState, time: Tensor, generator: Generator
    ) -> MagnetometerState:
        settings = self.settings
        field = settings.scale * body_from_world(body.attitude, self.field(body.position))
        rows = field + state.bias + settings.noise * settings.white_noise * normal(field, generator)
        return MagnetometerState(self.sampling.take(state.samples, time, rows), state.bias)

    def _reading(self, time: Tensor, rows: Tensor) -> MagnetometerReading:
        return MagnetometerReading(time, rows)

    def field(self, position: Tensor) -> Tensor:
        """Return Earth's field at world positions, gauss, world frame. Shape: (num_envs, 3)."""
        if self.settings.field == "constant":
            return position.new_tensor(CONSTANT).expand(len(position), 3)
        return dipole_field(geo_from_world(position, self.home))


def dipole_field(place: Tensor) -> Tensor:
    """Return the field of Earth's dipole, gauss, north, west, up, at `GeoPoint`s. (*, 3)."""
    latitude, longitude = torch.deg2rad(place[..., 0]), torch.deg2rad(place[..., 1])
    pole_latitude, pole_longitude = (math.radians(angle) for angle in POLE)
    apart = longitude - pole_longitude
    high, wide = math.sin(pole_latitude), math.cos(pole_latitude)
    north = latitude.cos() * high - latitude.sin() * wide * apart.cos()
    west = wide * apart.sin()
    up = latitude.sin() * high + latitude.cos() * wide * apart.cos()
    strength = EQUATOR_FIELD * (EARTH_RADIUS / (EARTH_RADIUS + place[..., 2])) ** 3
    return strength[..., None] * torch.stack([north, west, -2 * up], -1)


class Fix(enum.IntEnum):
    """Kind of a GPS fix, with AirSim's numbers."""

    NONE = 0
    TIME = 1
    TWO_D = 2
    THREE_D = 3


@dataclasses.dataclass
class GpsReading(Batch):
    """Readings of `num_envs` drones."""

    time: Tensor  # (num_envs,) float64
    """When it was taken, seconds; minus infinity before the first."""
    place: Tensor  # (num_envs, 3) float64
    """Latitude and longitude in degrees, altitude in metres."""
    velocity: Tensor  # (num_envs, 3) float64
    """Metres per second, world frame."""
    error: Tensor  # (num_envs,) float64
    """Stated horizontal and vertical error (eph and epv), metres."""
    fix: Tensor  # (num_envs,) int64
    """One of `Fix`, by the stated error; `Fix.NONE` before the first reading."""
    is_valid: Tensor  # (num_envs,) bool
    """Whether there is a reading yet."""


class Gps(Sensor[SensorState, GpsReading]):
    """A GPS receiver with latency, whose stated error shrinks after the start."""

    def __init__(self, settings: GpsSettings | None = None, home: GeoPoint = HOME) -> None:
        self.settings = settings = settings or GpsSettings()
        self.home = home
        self.sampling = Sampling(
            rate=settings.rate, latency=settings.latency, startup=settings.startup
        )

    def _initial(self, body: BodyState, time: Tensor, generator: Generator) -> SensorState:
        return SensorState(self.sampling.start(time, 7))

    def _sample(
        self, state: SensorState, body: BodyState, time: Tensor, generator: Generator
    ) -> SensorState:
        settings = self.settings
        side = settings.noise * settings.horizontal_noise
        up = settings.noise * settings.vertical_noise
        deviations = body.position.new_tensor((side, side, up))
        position = body.position + deviations * normal(body.position, generator)
        fast = settings.noise * settings.velocity_noise * normal(body.velocity, generator)
        place = geo_from_world(position, self.home)
        error = self.stated_error(time - state.samples.began)
        rows = torch.cat([place, body.velocity + fast, error[:, None]], 1)
        return SensorState(self.sampling.take(state.samples, time, rows))

    def _reading(self, time: Tensor, rows: Tensor) -> GpsReading:
        error, is_valid = rows[:, 6], time.isfinite()
        fix = torch.full_like(time, Fix.NONE, dtype=torch.int64)
        fix[is_valid & (error <= self.settings.error_2d)] = Fix.TWO_D
        fix[is_valid & (error <= self.settings.error_3d)] = Fix.THREE_D
        return GpsReading(time, rows[:, :3], rows[:, 3:6], error, fix, is_valid)

    def stated_error(self, seconds: Tensor) -> Tensor:
        """Return the stated error in metres, some seconds after the start. Shape: (num_envs,)."""
        settings = self.settings
        left = torch.exp(-seconds / settings.error_time)
        return settings.last_error + (settings.first_error - settings.last_error) * left


@dataclasses.dataclass
class BarometerReading(Batch):
    """Readings of `num_envs` drones."""

    time: Tensor  # (num_envs,) float64
    """When it was taken, seconds; minus infinity before the first."""
    pressure: Tensor  # (num_envs,) float64
    """Pascals."""
    altitude: Tensor  # (num_envs,) float64
    """Metres above sea level, from the pressure and that at sea level."""


@dataclasses.dataclass
class BarometerState(SensorState):
    """State of `num_envs` drones' barometers."""

    time: Tensor  # (num_envs,) float64
    """Of the last reading, seconds."""
    drift: Tensor  # (num_envs, 1) float64
    """Relative excess of pressure over the standard atmosphere's."""


class Barometer(Sensor[BarometerState, BarometerReading]):
    """A barometer; see `BarometerSettings`."""

    def __init__(self, settings: BarometerSettings | None = None, home: GeoPoint = HOME) -> None:
        self.settings, self.home = settings or BarometerSettings(), home
        self.sampling = Sampling(rate=self.settings.rate, latency=self.settings.latency)

    def _initial(self, body: BodyState, time: Tensor, generator: Generator) -> BarometerState:
        drift = torch.zeros_like(time)[:, None]
        return BarometerState(self.sampling.start(time, 2), time.clone(), drift)

    def _sample(
        self, state: BarometerState, body: BodyState, time: Tensor, generator: Generator
    ) -> BarometerState:
        settings, is_due = self.settings, self.sampling.due(state.samples, time)
        strength, seconds = settings.noise * settings.drift, time - state.time
        drift = gauss_markov_step(state.drift, strength, settings.drift_time, seconds, generator)
        at_sea = 100.0 * settings.sea_level_pressure
        exact = at_sea * pressure_ratio(self.home.altitude + body.position[:, 2])
        noise = settings.noise * settings.white_noise * normal(exact, generator)
        pressure = exact * (1 + drift[:, 0]) + noise
        altitude = altitude_from_pressure_ratio(pressure.clamp(min=1.0) / at_sea)
        return BarometerState(
            self.sampling.take(state.samples, time, torch.stack([pressure, altitude], 1)),
            torch.where(is_due, time, state.time),
            select(is_due, drift, state.drift),
        )

    def _reading(self, time: Tensor, rows: Tensor) -> BarometerReading:
        return BarometerReading(time, rows[:, 0], rows[:, 1])


def pressure_ratio(altitude: Tensor) -> Tensor:
    """Return the ratio of the pressure at an altitude in metres to that at sea level.

    It is constant from 11 km on.
    """
    height = (_ATMOSPHERE_RADIUS * altitude / (_ATMOSPHERE_RADIUS + altitude)).clamp(max=_TOP)
    return (1 - _LAPSE * height / SEA_LEVEL_TEMPERATURE) ** _EXPONENT


def standard_pressure(altitude: float) -> float:
    """Return the pressure of the standard atmosphere at an altitude in metres, pascals."""
    return SEA_LEVEL_PRESSURE * float(pressure_ratio(torch.tensor(altitude, dtype=torch.float64)))


def altitude_from_pressure_ratio(ratio: Tensor) -> Tensor:
    """Invert `pressure_ratio`: return metres above sea level. Shape: (*)."""
    height = SEA_LEVEL_TEMPERATURE / _LAPSE * (1 - ratio ** (1 / _EXPONENT))
    return _ATMOSPHERE_RADIUS * height / (_ATMOSPHERE_RADIUS - height)
