"""All sensors of a drone together."""

import dataclasses

import torch
from torch import Tensor

from drone_rl.config.sensors import SensorSettings
from drone_rl.sim.coordinates import HOME, GeoPoint
from drone_rl.sim.dynamics.state import BodyState
from drone_rl.sim.sensors import instruments
from drone_rl.sim.sensors.sensor import SensorState
from drone_rl.utils.batch import Batch
from drone_rl.utils.seeding import Stream, torch_generator


@dataclasses.dataclass
class SensorSuiteState(Batch):
    """State of `num_envs` drones' sensors."""

    time: Tensor  # (num_envs,) float64
    """Of the last update, seconds."""
    imu: instruments.ImuState
    barometer: instruments.BarometerState
    magnetometer: instruments.MagnetometerState
    gps: SensorState


class SensorSuite:
    """All sensors of drones, each with a random stream: `suite.imu.read(state.imu, state.time)`."""

    def __init__(
        self,
        settings: SensorSettings | None = None,
        *,
        seed: int = 0,
        number: int = 0,
        home: GeoPoint = HOME,
    ) -> None:
        """Make the sensors, with AirSim's settings by default.

        `number` distinguishes the noise of several batches of drones under one seed; `home` is the
        world's origin. Raises an `InputError` if the seed is not a whole number, 0 or more.
        """
        self.settings = settings = settings or SensorSettings()
        self.home = home
        self.imu, self.gps = instruments.Imu(settings.imu), instruments.Gps(settings.gps, home)
        self.barometer = instruments.Barometer(settings.barometer, home)
        self.magnetometer = instruments.Magnetometer(settings.magnetometer, home)
        names = ("imu", "barometer", "magnetometer", "gps")
        self._streams = {
            name: torch_generator(seed, Stream.SENSORS, number=4 * number + i)
            for i, name in enumerate(names)
        }

    def start(self, body: BodyState) -> SensorSuiteState:
        """Switch all sensors on at time 0. To restart some drones, assign to their rows."""
        time = torch.zeros_like(body.position[:, 0])
        states = {
            name: getattr(self, name).start(body, time, stream)
            for name, stream in self._streams.items()
        }
        return SensorSuiteState(time=time, **states)

    def update(self, state: SensorSuiteState, body: BodyState, seconds: float) -> SensorSuiteState:
        """Return the sensors some seconds after the last update; each takes at most one reading."""
        time = state.time + seconds
        states = {
            name: getattr(self, name).update(getattr(state, name), body, time, stream)
            for name, stream in self._streams.items()
        }
        return SensorSuiteState(time=time, **states)
