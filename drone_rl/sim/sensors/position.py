"""Sensors of position: GPS receiver and barometer."""

import dataclasses
import enum

import torch
from torch import Generator, Tensor

from drone_rl.config.sensors import BarometerSettings, GpsSettings
from drone_rl.sim.coordinates import HOME, GeoPoint, geo_from_world
from drone_rl.sim.dynamics.state import BodyState
from drone_rl.sim.sensors.sensor import (
    Samples,
    Sampling,
    Sensor,
    gauss_markov_step,
    normal,
    select,
)
from drone_rl.utils.batch import Batch

SEA_LEVEL_TEMPERATURE = 288.15
"""Of the standard atmosphere, kelvin."""
_LAPSE = 0.0065
"""Kelvin per metre."""
_EXPONENT = 5.255877
"""Of pressure as a power of temperature: weight of air / (gas constant * lapse)."""
_EARTH_RADIUS = 6356766.0
"""Metres, of the standard atmosphere, for heights under constant gravity."""
_TOP = 11_000.0
"""Height of the layer in which this holds, metres."""


class Fix(enum.IntEnum):
    """Kind of a GPS fix, with AirSim's numbers."""

    NONE = 0
    TIME = 1
    TWO_D = 2
    THREE_D = 3


@dataclasses.dataclass
class GpsReading(Batch):
    """Readings of `num_worlds` drones."""

    time: Tensor  # (num_worlds,) float64
    """When it was taken, seconds; minus infinity before the first."""
    place: Tensor  # (num_worlds, 3) float64
    """Latitude and longitude in degrees, altitude in metres."""
    velocity: Tensor  # (num_worlds, 3) float64
    """Metres per second, world frame."""
    error: Tensor  # (num_worlds,) float64
    """Stated horizontal and vertical error (eph and epv), metres."""
    fix: Tensor  # (num_worlds,) int64
    """One of `Fix`; none before the first reading."""
    is_valid: Tensor  # (num_worlds,) bool
    """Whether there is a reading yet."""


@dataclasses.dataclass
class GpsState(Batch):
    """State of `num_worlds` drones' receivers."""

    samples: Samples


class Gps(Sensor[GpsState, GpsReading]):
    """A GPS receiver with latency, whose stated error shrinks after the start."""

    def __init__(self, settings: GpsSettings | None = None, home: GeoPoint = HOME) -> None:
        """Use AirSim's settings by default; `home` is the world's origin."""
        own = settings or GpsSettings()
        self.settings, self.home = own, home
        self.sampling = Sampling(rate=own.rate, latency=own.latency, startup=own.startup)

    def _initial(self, body: BodyState, time: Tensor, generator: Generator) -> GpsState:
        return GpsState(self.sampling.start(time, 7))

    def _sample(
        self, state: GpsState, body: BodyState, time: Tensor, generator: Generator
    ) -> GpsState:
        own = self.settings
        side, up = own.noise * own.horizontal_noise, own.noise * own.vertical_noise
        deviations = body.position.new_tensor((side, side, up))
        position = body.position + deviations * normal(body.position, generator)
        fast = own.noise * own.velocity_noise * normal(body.velocity, generator)
        place = geo_from_world(position, self.home)
        error = self.stated_error(time - state.samples.began)
        rows = torch.cat([place, body.velocity + fast, error[:, None]], 1)
        return GpsState(self.sampling.take(state.samples, time, rows))

    def _reading(self, time: Tensor, rows: Tensor) -> GpsReading:
        error, is_valid = rows[:, 6], time.isfinite()
        fix = torch.full_like(time, Fix.NONE, dtype=torch.int64)
        fix[is_valid & (error <= self.settings.error_2d)] = Fix.TWO_D
        fix[is_valid & (error <= self.settings.error_3d)] = Fix.THREE_D
        return GpsReading(time, rows[:, :3], rows[:, 3:6], error, fix, is_valid)

    def stated_error(self, seconds: Tensor) -> Tensor:
        """Return the stated error in metres, some seconds after the start. Shape: (num_worlds,)."""
        own = self.settings
        left = torch.exp(-seconds / own.error_time)
        return own.last_error + (own.first_error - own.last_error) * left


@dataclasses.dataclass
class BarometerReading(Batch):
    """Readings of `num_worlds` drones."""

    time: Tensor  # (num_worlds,) float64
    """When it was taken, seconds; minus infinity before the first."""
    pressure: Tensor  # (num_worlds,) float64
    """Pascals."""
    altitude: Tensor  # (num_worlds,) float64
    """Metres above sea level, from the pressure and that at sea level."""


@dataclasses.dataclass
class BarometerState(Batch):
    """State of `num_worlds` drones' barometers."""

    samples: Samples
    time: Tensor  # (num_worlds,) float64
    """Of the last reading, seconds."""
    drift: Tensor  # (num_worlds, 1) float64
    """Relative excess of pressure over the standard atmosphere's."""


class Barometer(Sensor[BarometerState, BarometerReading]):
    """A barometer; see `BarometerSettings`."""

    def __init__(self, settings: BarometerSettings | None = None, home: GeoPoint = HOME) -> None:
        """Use AirSim's settings by default; `home` is the world's origin."""
        self.settings, self.home = settings or BarometerSettings(), home
        self.sampling = Sampling(rate=self.settings.rate, latency=self.settings.latency)

    def _initial(self, body: BodyState, time: Tensor, generator: Generator) -> BarometerState:
        drift = torch.zeros_like(time)[:, None]
        return BarometerState(self.sampling.start(time, 2), time.clone(), drift)

    def _sample(
        self, state: BarometerState, body: BodyState, time: Tensor, generator: Generator
    ) -> BarometerState:
        own, is_due = self.settings, self.sampling.due(state.samples, time)
        strength, seconds = own.noise * own.drift, time - state.time
        drift = gauss_markov_step(state.drift, strength, own.drift_time, seconds, generator)
        at_sea = 100.0 * own.sea_level_pressure
        exact = at_sea * pressure_ratio(self.home.altitude + body.position[:, 2])
        noise = own.noise * own.white_noise * normal(exact, generator)
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
    """Return the pressure at an altitude over that at sea level; constant from 11 km on.

    Args:
        altitude: Metres above sea level. Shape: (*).
    """
    height = (_EARTH_RADIUS * altitude / (_EARTH_RADIUS + altitude)).clamp(max=_TOP)
    return (1 - _LAPSE * height / SEA_LEVEL_TEMPERATURE) ** _EXPONENT


def altitude_from_pressure_ratio(ratio: Tensor) -> Tensor:
    """Invert `pressure_ratio`: return metres above sea level. Shape: (*)."""
    height = SEA_LEVEL_TEMPERATURE / _LAPSE * (1 - ratio ** (1 / _EXPONENT))
    return _EARTH_RADIUS * height / (_EARTH_RADIUS - height)
