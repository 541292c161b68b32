"""All sensors of a drone together."""

import dataclasses

import torch
from torch import Tensor

from drone_rl.config.sensors import SensorSettings
from drone_rl.sim.dynamics.body import BodyState
from drone_rl.sim.dynamics.flight_state import FlightState
from drone_rl.sim.geodesy import HOME, GeoPoint
from drone_rl.sim.sensors import collision
from drone_rl.sim.sensors.barometer import Barometer, BarometerReading, BarometerState
from drone_rl.sim.sensors.collision import CollisionState
from drone_rl.sim.sensors.gps import Gps, GpsReading, GpsState
from drone_rl.sim.sensors.imu import Imu, ImuReading, ImuState
from drone_rl.sim.sensors.magnetometer import Magnetometer, MagnetometerReading, MagnetometerState
from drone_rl.utils.batch import Batch
from drone_rl.utils.seeding import Stream, torch_generator


@dataclasses.dataclass
class SensesState(Batch):
    """What the sensors of `num_worlds` drones hold."""

    time: Tensor  # (num_worlds,) float64
    """Until when they have sensed, seconds."""
    imu: ImuState
    """Of the accelerometers and gyroscopes."""
    barometer: BarometerState
    """Of the barometers."""
    magnetometer: MagnetometerState
    """Of the magnetometers."""
    gps: GpsState
    """Of the receivers."""
    collision: CollisionState
    """What was touched."""


class Senses:
    """All sensors of drones; each draws its noise from a stream of its own."""

    def __init__(
        self,
        settings: SensorSettings | None = None,
        *,
        seed: int = 0,
        number: int = 0,
        home: GeoPoint = HOME,
    ) -> None:
        """Makes the sensors.

        Args:
            settings: AirSim's by default.
            seed: Of the noise.
            number: Tells apart the noise of several batches of drones under one seed.
            home: The world's origin.

        Raises:
            InputError: The seed is not a whole number, 0 or more.
        """
        own = settings or SensorSettings()
        self.settings, self.home = own, home
        self.imu, self.gps = Imu(own.imu), Gps(own.gps, home)
        self.barometer = Barometer(own.barometer, home)
        self.magnetometer = Magnetometer(own.magnetometer, home)
        self._streams = [
            torch_generator(seed, Stream.SENSORS, number=4 * number + i) for i in range(4)
        ]

    def start(self, body: BodyState) -> SensesState:
        """Sensors that are turned on now; their time begins at 0.

        Args:
            body: The drones, at the start of their episodes. `states[worlds] = start(body[worlds])`
                begins some of them anew.
        """
        time = torch.zeros_like(body.position[:, 0])
        imu, barometer, magnetometer, gps = self._streams
        state = SensesState(
            time,
            self.imu.start(body, time, imu),
            self.barometer.start(body, time, barometer),
            self.magnetometer.start(body, time, magnetometer),
            self.gps.start(body, time, gps),
            collision.start(body.position),
        )
        return dataclasses.replace(state, collision=_touched(state.collision, body))

    def update(self, state: SensesState, body: BodyState, seconds: float) -> SensesState:
        """The same sensors later.

        Once a tick, no reading is late by more than that. Less often, the accelerometer tells means
        of the time between, and of several readings that were due one is taken.

        Args:
            state: Before; it stays as it is.
            body: The drones now.
            seconds: From before until now.
        """
        time = state.time + seconds
        imu, barometer, magnetometer, gps = self._streams
        return SensesState(
            time,
            self.imu.update(state.imu, body, time, imu),
            self.barometer.update(state.barometer, body, time, barometer),
            self.magnetometer.update(state.magnetometer, body, time, magnetometer),
            self.gps.update(state.gps, body, time, gps),
            _touched(state.collision, body),
        )

    def read_imu(self, state: SensesState) -> ImuReading:
        """What accelerometers and gyroscopes tell."""
        return self.imu.read(state.imu, state.time)

    def read_barometer(self, state: SensesState) -> BarometerReading:
        """What barometers tell."""
        return self.barometer.read(state.barometer, state.time)

    def read_magnetometer(self, state: SensesState) -> MagnetometerReading:
        """What magnetometers tell."""
        return self.magnetometer.read(state.magnetometer, state.time)

    def read_gps(self, state: SensesState) -> GpsReading:
        """What receivers tell."""
        return self.gps.read(state.gps, state.time)

    def read_collision(
        self, state: SensesState, worlds: Tensor | None = None
    ) -> tuple[CollisionState, SensesState]:
        """What drones were touched by, and the sensors after they have told it; see `read`.

        Args:
            state: Before; it stays as it is.
            worlds: Indices of the drones that are asked; all by default. Shape: (k,).
        """
        told, after = collision.read(state.collision, worlds)
        return told, dataclasses.replace(state, collision=after)


def _touched(state: CollisionState, body: BodyState) -> CollisionState:
    if not isinstance(body, FlightState):
        return state
    return collision.update(state, body.contact, body.position)
