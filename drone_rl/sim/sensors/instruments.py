"""The sensors: accelerometer and gyroscope, magnetometer, GPS receiver and barometer.

Times of readings are seconds, minus infinity before the first. Vectors are float64, shape (3,).
"""

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
from drone_rl.sim.sensors.sensor import Sensor, gauss_markov_step, normal, random_walk_step

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


_ZERO, _NO_ATTITUDE = (torch.zeros(size, dtype=torch.float64) for size in (3, 4))


@dataclasses.dataclass(frozen=True)
class ImuReading:
    """Body frame: x forward, y left, z up."""

    time: float = -math.inf
    specific_force: Tensor = _ZERO
    """Acceleration minus gravity, metres per second squared: 9.81 up at rest."""
    angular_velocity: Tensor = _ZERO
    """Radians per second about the body's axes."""
    attitude: Tensor = _NO_ATTITUDE
    """The true attitude, as in AirSim: quaternion (w, x, y, z) from body to world."""


class Imu(Sensor[ImuReading]):
    """Accelerometer and gyroscope; see `ImuSettings`."""

    def __init__(self, settings: ImuSettings, body: BodyState, generator: Generator) -> None:
        """Switch it on; the velocity was constant before."""
        super().__init__(ImuReading(), settings.rate)
        self.settings, self._generator = settings, generator
        gyro = settings.noise * settings.gyro_turn_on_bias * _DEGREES_PER_HOUR
        accel = settings.noise * settings.accel_turn_on_bias * _MILLI_G
        self.gyro_bias = gyro * normal(_ZERO, generator)
        """Radians per second, body frame."""
        self.accel_bias = accel * normal(_ZERO, generator)
        """Metres per second squared, body frame."""
        self._last = -1.0 / settings.rate, body.velocity[0].clone()
        """Time of the last reading, and the drone's velocity then."""

    def _sample(self, body: BodyState, time: float) -> ImuReading:
        settings, generator, (last, before) = self.settings, self._generator, self._last
        attitude, velocity = body.attitude[0].clone(), body.velocity[0].clone()
        self._last, seconds = (time, velocity), time - last
        white = settings.noise / math.sqrt(seconds)
        rates = body.angular_velocity[0] + self.gyro_bias
        rates = rates + white * settings.gyro_random_walk * _DEGREES_PER_ROOT_HOUR * normal(
            rates, generator
        )
        force = specific_force(attitude, before, velocity, seconds) + self.accel_bias
        force = force + white * settings.accel_random_walk * _MILLI_G * normal(force, generator)
        gyro = settings.noise * settings.gyro_bias_stability * _DEGREES_PER_HOUR
        accel = settings.noise * settings.accel_bias_stability * _MICRO_G
        self.gyro_bias = random_walk_step(
            self.gyro_bias, gyro, settings.gyro_bias_time, seconds, generator
        )
        self.accel_bias = random_walk_step(
            self.accel_bias, accel, settings.accel_bias_time, seconds, generator
        )
        return ImuReading(time, force, rates, attitude)


def specific_force(attitude: Tensor, before: Tensor, after: Tensor, seconds: float) -> Tensor:
    """Return the mean specific force, m/s^2, body frame, while the velocity changed. Shape: (3,).

    The attitude is a quaternion (w, x, y, z). Velocities `before` and `after` some seconds are in
    m/s, world frame.
    """
    gravity = before.new_tensor((0.0, 0.0, GRAVITY))
    return body_from_world(attitude, (after - before) / seconds + gravity)


@dataclasses.dataclass(frozen=True)
class MagnetometerReading:
    """Earth's field along the axes of the body."""

    time: float = -math.inf
    field: Tensor = _ZERO
    """Gauss, body frame: x forward, y left, z up."""


class Magnetometer(Sensor[MagnetometerReading]):
    """A magnetometer; see `MagnetometerSettings`."""

    def __init__(
        self, settings: MagnetometerSettings, generator: Generator, home: GeoPoint = HOME
    ) -> None:
        """Switch it on; `home` is the place on Earth of the world's origin."""
        super().__init__(MagnetometerReading(), settings.rate, latency=settings.latency)
        self.settings, self.home, self._generator = settings, home, generator
        sampled = torch.rand(3, dtype=torch.float64, generator=generator)
        self._bias = settings.noise * settings.bias * (2 * sampled - 1)

    def _sample(self, body: BodyState, time: float) -> MagnetometerReading:
        settings, field = self.settings, _ZERO.new_tensor(CONSTANT)
        if settings.field == "dipole":
            field = dipole_field(geo_from_world(body.position[0], self.home))
        field = settings.scale * body_from_world(body.attitude[0], field) + self._bias
        white = settings.noise * settings.white_noise * normal(field, self._generator)
        return MagnetometerReading(time, field + white)


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


@dataclasses.dataclass(frozen=True)
class GpsReading:
    """Place on Earth and velocity."""

    time: float = -math.inf
    place: Tensor = _ZERO
    """Latitude and longitude in degrees, altitude in metres."""
    velocity: Tensor = _ZERO
    """Metres per second, world frame."""
    error: float = 0.0
    """Stated horizontal and vertical error (eph and epv), metres."""
    fix: Fix = Fix.NONE
    """By the stated error; `Fix.NONE` before the first reading."""

    @property
    def is_valid(self) -> bool:
        """Whether there is a reading yet."""
        return math.isfinite(self.time)


class Gps(Sensor[GpsReading]):
    """A GPS receiver with latency, whose stated error shrinks after the start."""

    def __init__(self, settings: GpsSettings, generator: Generator, home: GeoPoint = HOME) -> None:
        """Switch it on; `home` is the place on Earth of the world's origin."""
        super().__init__(
            GpsReading(), settings.rate, latency=settings.latency, startup=settings.startup
        )
        self.settings, self.home, self._generator = settings, home, generator

    def _sample(self, body: BodyState, time: float) -> GpsReading:
        settings, generator = self.settings, self._generator
        deviations = (*[settings.horizontal_noise] * 2, settings.vertical_noise)
        off = settings.noise * _ZERO.new_tensor(deviations) * normal(_ZERO, generator)
        fast = settings.noise * settings.velocity_noise * normal(_ZERO, generator)
        error = self.stated_error(time)
        fix = Fix.TWO_D if error <= settings.error_2d else Fix.NONE
        fix = Fix.THREE_D if error <= settings.error_3d else fix
        place = geo_from_world(body.position[0] + off, self.home)
        return GpsReading(time, place, body.velocity[0] + fast, error, fix)

    def stated_error(self, seconds: float) -> float:
        """Return the stated error in metres, some seconds after the start."""
        settings = self.settings
        left = math.exp(-seconds / settings.error_time)
        return settings.last_error + (settings.first_error - settings.last_error) * left


@dataclasses.dataclass(frozen=True)
class BarometerReading:
    """Pressure and altitude."""

    time: float = -math.inf
    pressure: float = 0.0
    """Pascals."""
    altitude: float = 0.0
    """Metres above sea level, from the pressure and that at sea level."""


class Barometer(Sensor[BarometerReading]):
    """A barometer; see `BarometerSettings`."""

    def __init__(
        self, settings: BarometerSettings, generator: Generator, home: GeoPoint = HOME
    ) -> None:
        """Switch it on; `home` is the place on Earth of the world's origin."""
        super().__init__(BarometerReading(), settings.rate, latency=settings.latency)
        self.settings, self.home, self._generator = settings, home, generator
        self._last, self._drift = 0.0, _ZERO[0]
        """Time of the last reading; relative excess of pressure over the standard atmosphere's."""

    def _sample(self, body: BodyState, time: float) -> BarometerReading:
        settings, generator = self.settings, self._generator
        strength, seconds = settings.noise * settings.drift, time - self._last
        self._last, self._drift = (
            time,
            gauss_markov_step(self._drift, strength, settings.drift_time, seconds, generator),
        )
        at_sea = 100.0 * settings.sea_level_pressure
        exact = at_sea * pressure_ratio(self.home.altitude + body.position[0, 2])
        white = settings.noise * settings.white_noise * normal(exact, generator)
        pressure = exact * (1 + self._drift) + white
        altitude = altitude_from_pressure_ratio(pressure.clamp(min=1.0) / at_sea)
        return BarometerReading(time, float(pressure), float(altitude))


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
