"""Where a receiver says that it was: late, and at first with a great stated error."""

import dataclasses
import enum

import torch
from torch import Tensor

from drone_rl.config.sensors import GpsSettings
from drone_rl.sim.dynamics.body import BodyState
from drone_rl.sim.geodesy import HOME, GeoPoint, geo_from_world
from drone_rl.sim.sensors.noise import normal
from drone_rl.sim.sensors.sampling import Samples, Sampling
from drone_rl.utils.batch import Batch


class Fix(enum.IntEnum):
    """What a receiver knows, by AirSim's numbers."""

    NONE = 0
    TIME = 1
    TWO_D = 2
    THREE_D = 3


@dataclasses.dataclass
class GpsReading(Batch):
    """What the receivers of `num_worlds` drones tell."""

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
        """What the receivers tell at a time (seconds, shape (num_worlds,))."""
        taken, rows = self.sampling.tell(state.samples, time)
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
