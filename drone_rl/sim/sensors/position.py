"""Where a receiver says that it was: late, and at first with a great stated error."""

import dataclasses
import enum

import torch
from torch import Tensor

from drone_rl.config.sensors import BarometerSettings, GpsSettings
from drone_rl.sim.coordinates import HOME, GeoPoint, geo_from_world
from drone_rl.sim.dynamics.state import BodyState
from drone_rl.sim.sensors.sensor import Samples, Sampling, gauss_markov_step, normal
from drone_rl.utils.batch import Batch


class Fix(enum.IntEnum):
    """What a receiver knows, by AirSim's numbers."""

    NONE = 0
    TIME = 1
    TWO_D = 2
    THREE_D = 3


@dataclasses.dataclass
class GpsReading(Batch):
    """What the receivers of `num_worlds` drones read."""

    time: Tensor  # (num_worlds,) float64
    """When it was taken, seconds; minus infinity before the first."""
    place: Tensor  # (num_worlds, 3) float64
    """Latitude and longitude in degrees, altitude in metres."""
    velocity: Tensor  # (num_worlds, 3) float64
    """Metres a second, world frame."""
    error: Tensor  # (num_worlds,) float64
    """Stated, to the side and up alike (eph and epv), metres."""
    fix: Tensor  # (num_worlds,) int64
    """One of `Fix`; none before the first reading."""
    is_valid: Tensor  # (num_worlds,) bool
    """Whether there is a reading yet."""


@dataclasses.dataclass
class GpsState(Batch):
    """The receivers of `num_worlds` drones."""

    samples: Samples
    """Readings."""


class Gps:
    """A receiver; see `GpsSettings`."""

    def __init__(self, settings: GpsSettings | None = None, home: GeoPoint = HOME) -> None:
        """Makes it.

        Args:
            settings: AirSim's by default.
            home: The world's origin.
        """
        self.settings, self.home = settings or GpsSettings(), home
        self.sampling = Sampling(
            rate=self.settings.rate, latency=self.settings.latency, startup=self.settings.startup
        )

    def start(self, body: BodyState, time: Tensor, generator: torch.Generator) -> GpsState:
        """Receivers that are turned on.

        Args:
            body: The drones.
            time: Now, seconds. Shape: (num_worlds,), float64.
            generator: Of the noise.
        """
        return self.update(GpsState(self.sampling.start(time, 7)), body, time, generator)

    def update(
        self, state: GpsState, body: BodyState, time: Tensor, generator: torch.Generator
    ) -> GpsState:
        """The same receivers at a later time; a reading is taken where one is due.

        Args:
            state: Before; it stays as it is.
            body: The drones now.
            time: Now, seconds. Shape: (num_worlds,), float64.
            generator: Of the noise, drawn for all drones where a reading of any is due.
        """
        if not self.sampling.due(state.samples, time).any():
            return state
        own = self.settings
        side, up = own.noise * own.horizontal_noise, own.noise * own.vertical_noise
        deviations = body.position.new_tensor((side, side, up))
        position = body.position + deviations * normal(body.position, generator)
        fast = own.noise * own.velocity_noise * normal(body.velocity, generator)
        place = geo_from_world(position, self.home)
        error = self.stated_error(time - state.samples.began)
        rows = torch.cat([place, body.velocity + fast, error[:, None]], 1)
        return GpsState(self.sampling.take(state.samples, time, rows))

    def read(self, state: GpsState, time: Tensor) -> GpsReading:
        """What the receivers read at a time (seconds, shape (num_worlds,))."""
        taken, rows = self.sampling.read(state.samples, time)
        error, is_valid = rows[:, 6], taken.isfinite()
        fix = torch.full_like(taken, Fix.NONE, dtype=torch.int64)
        fix[is_valid & (error <= self.settings.error_2d)] = Fix.TWO_D
        fix[is_valid & (error <= self.settings.error_3d)] = Fix.THREE_D
        return GpsReading(taken, rows[:, :3], rows[:, 3:6], error, fix, is_valid)

    def stated_error(self, seconds: Tensor) -> Tensor:
        """Metres, so long after the start. Shape: (num_worlds,)."""
        own = self.settings
        left = torch.exp(-seconds / own.error_time)
        return own.last_error + (own.first_error - own.last_error) * left


SEA_LEVEL_TEMPERATURE = 288.15
"""Kelvin."""
_LAPSE = 0.0065
"""Kelvin a metre."""
_EXPONENT = 5.255877
"""Of temperature's share in pressure's: weight of air over gas constant and lapse."""
_EARTH_RADIUS = 6356766.0
"""Metres, of the standard atmosphere, whose heights are those of a constant gravity."""
_TOP = 11_000.0
"""Height of the layer in which this holds, metres."""


def pressure_ratio(altitude: Tensor) -> Tensor:
    """Pressure at an altitude over that at the sea; from 11 km on, that at 11 km.

    Args:
        altitude: Metres above the sea. Shape: (*).
    """
    height = (_EARTH_RADIUS * altitude / (_EARTH_RADIUS + altitude)).clamp(max=_TOP)
    return (1 - _LAPSE * height / SEA_LEVEL_TEMPERATURE) ** _EXPONENT


def altitude_from_pressure_ratio(share: Tensor) -> Tensor:
    """The way back: metres above the sea. Shape: (*)."""
    height = SEA_LEVEL_TEMPERATURE / _LAPSE * (1 - share ** (1 / _EXPONENT))
    return _EARTH_RADIUS * height / (_EARTH_RADIUS - height)


@dataclasses.dataclass
class BarometerReading(Batch):
    """What the barometers of `num_worlds` drones read."""

    time: Tensor  # (num_worlds,) float64
    """When it was taken, seconds; minus infinity before the first."""
    pressure: Tensor  # (num_worlds,) float64
    """Pascals."""
    altitude: Tensor  # (num_worlds,) float64
    """Metres above the sea, of the pressure and the day's at the sea."""


@dataclasses.dataclass
class BarometerState(Batch):
    """The barometers of `num_worlds` drones."""

    samples: Samples
    """Readings."""
    time: Tensor  # (num_worlds,) float64
    """Of the last reading, seconds."""
    drift: Tensor  # (num_worlds, 1) float64
    """Share by which pressure is greater than the standard's."""


class Barometer:
    """A barometer; see `BarometerSettings`."""

    def __init__(self, settings: BarometerSettings | None = None, home: GeoPoint = HOME) -> None:
        """Makes it.

        Args:
            settings: AirSim's by default.
            home: The world's origin.
        """
        self.settings, self.home = settings or BarometerSettings(), home
        self.sampling = Sampling(rate=self.settings.rate, latency=self.settings.latency)

    def start(self, body: BodyState, time: Tensor, generator: torch.Generator) -> BarometerState:
        """Barometers that are turned on and have not drifted; the first reading is taken.

        Args:
            body: The drones.
            time: Now, seconds. Shape: (num_worlds,), float64.
            generator: Of the noise.
        """
        samples = self.sampling.start(time, 2)
        state = BarometerState(samples, time.clone(), torch.zeros_like(time)[:, None])
        return self.update(state, body, time, generator)

    def update(
        self, state: BarometerState, body: BodyState, time: Tensor, generator: torch.Generator
    ) -> BarometerState:
        """The same barometers at a later time; a reading is taken where one is due.

        Args:
            state: Before; it stays as it is.
            body: The drones now.
            time: Now, seconds. Shape: (num_worlds,), float64.
            generator: Of the noise, drawn for all drones where a reading of any is due.
        """
        own, is_due = self.settings, self.sampling.due(state.samples, time)
        if not is_due.any():
            return state
        strength = own.noise * own.drift
        drift = gauss_markov_step(
            state.drift, strength, own.drift_time, time - state.time, generator
        )
        at_sea = 100.0 * own.sea_level_pressure
        exact = at_sea * pressure_ratio(self.home.altitude + body.position[:, 2])
        noise = own.noise * own.white_noise * normal(exact, generator)
        pressure = exact * (1 + drift[:, 0]) + noise
        rows = torch.stack(
            [pressure, altitude_from_pressure_ratio(pressure.clamp(min=1.0) / at_sea)], 1
        )
        return BarometerState(
            self.sampling.take(state.samples, time, rows),
            torch.where(is_due, time, state.time),
            torch.where(is_due[:, None], drift, state.drift),
        )

    def read(self, state: BarometerState, time: Tensor) -> BarometerReading:
        """What the barometers read at a time (seconds, shape (num_worlds,))."""
        taken, rows = self.sampling.read(state.samples, time)
        return BarometerReading(taken, rows[:, 0], rows[:, 1])
