"""All sensors of a drone together."""

import dataclasses

import torch
from torch import Tensor

from drone_rl.config.sensors import SensorSettings
from drone_rl.sim.coordinates import HOME, GeoPoint
from drone_rl.sim.dynamics.state import GROUND, NOTHING, BodyState, Contact, FlightState
from drone_rl.sim.sensors.inertial import (
    Imu,
    ImuReading,
    ImuState,
    Magnetometer,
    MagnetometerReading,
    MagnetometerState,
)
from drone_rl.sim.sensors.position import (
    Barometer,
    BarometerReading,
    BarometerState,
    Gps,
    GpsReading,
    GpsState,
)
from drone_rl.utils.batch import Batch
from drone_rl.utils.seeding import Stream, torch_generator


@dataclasses.dataclass
class CollisionState(Batch):
    """What `num_worlds` drones remember. World frame, SI units."""

    has_collided: Tensor  # (num_worlds,) bool
    """Whether there was a contact that nobody has read of yet."""
    contact: Contact
    """The last one; it stays when it has been read."""
    position: Tensor  # (num_worlds, 3) float64
    """Where the drone was then, metres."""


def start(position: Tensor) -> CollisionState:
    """Drones that were never touched.

    Args:
        position: Metres, world frame. Shape: (num_worlds, 3), float64.
    """
    untouched = torch.zeros(len(position), dtype=torch.bool, device=position.device)
    numbers, zeros = torch.full_like(untouched, NOTHING, dtype=torch.int64), position.new_zeros
    nowhere, flat = zeros(position.shape), zeros(len(position))
    nothing = Contact(numbers, nowhere, nowhere.clone(), flat, flat.clone())
    return CollisionState(untouched, nothing, nowhere.clone())


def update(state: CollisionState, contact: Contact, position: Tensor) -> CollisionState:
    """The same drones later.

    Args:
        state: Before; it stays as it is.
        contact: What each last touched, with the time of it: a touch is news where its time, or the
            thing, is another than that of the one remembered. A drone that rests on something
            touches it at every tick.
        position: Of the drones now, metres, world frame. Shape: (num_worlds, 3).
    """
    known = state.contact
    is_other = (contact.thing != known.thing) | (contact.time != known.time)
    is_news = (contact.thing != NOTHING) & is_other
    own = {k: _where(is_news, v, getattr(known, k)) for k, v in vars(contact).items()}
    return CollisionState(
        state.has_collided | is_news, Contact(**own), _where(is_news, position, state.position)
    )


def read(
    state: CollisionState, worlds: Tensor | None = None
) -> tuple[CollisionState, CollisionState]:
    """What is known, and the same with the flag cleared, as AirSim clears it by telling it.

    Args:
        state: Before; it stays as it is.
        worlds: Indices of the drones that are asked; all by default. Shape: (k,).

    Returns:
        What to read of the drones that were asked, and what all of them remember from now on.
    """
    worlds = torch.arange(len(state), device=state.position.device) if worlds is None else worlds
    flag = state.has_collided.clone()
    flag[worlds] = False
    return state[worlds], dataclasses.replace(state, has_collided=flag)


def thing_name(thing: int, kind: str = "obstacle") -> str:
    """Name of a thing by its number in `Contact`; empty for nothing.

    Args:
        thing: The number.
        kind: What the task's things are called.
    """
    if thing == NOTHING:
        return ""
    return "ground" if thing == GROUND else f"{kind}_{thing}"


def _where(condition: Tensor, chosen: Tensor, other: Tensor) -> Tensor:
    return torch.where(condition.view(-1, *[1] * (chosen.ndim - 1)), chosen, other)


@dataclasses.dataclass
class SensorSuiteState(Batch):
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


class SensorSuite:
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

    def start(self, body: BodyState) -> SensorSuiteState:
        """Sensors that are turned on now; their time begins at 0.

        Args:
            body: The drones, at the start of their episodes. `states[worlds] = start(body[worlds])`
                begins some of them anew.
        """
        time = torch.zeros_like(body.position[:, 0])
        imu, barometer, magnetometer, gps = self._streams
        state = SensorSuiteState(
            time,
            self.imu.start(body, time, imu),
            self.barometer.start(body, time, barometer),
            self.magnetometer.start(body, time, magnetometer),
            self.gps.start(body, time, gps),
            start(body.position),
        )
        return dataclasses.replace(state, collision=_touched(state.collision, body))

    def update(self, state: SensorSuiteState, body: BodyState, seconds: float) -> SensorSuiteState:
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
        return SensorSuiteState(
            time,
            self.imu.update(state.imu, body, time, imu),
            self.barometer.update(state.barometer, body, time, barometer),
            self.magnetometer.update(state.magnetometer, body, time, magnetometer),
            self.gps.update(state.gps, body, time, gps),
            _touched(state.collision, body),
        )

    def read_imu(self, state: SensorSuiteState) -> ImuReading:
        """What accelerometers and gyroscopes read."""
        return self.imu.read(state.imu, state.time)

    def read_barometer(self, state: SensorSuiteState) -> BarometerReading:
        """What barometers read."""
        return self.barometer.read(state.barometer, state.time)

    def read_magnetometer(self, state: SensorSuiteState) -> MagnetometerReading:
        """What magnetometers read."""
        return self.magnetometer.read(state.magnetometer, state.time)

    def read_gps(self, state: SensorSuiteState) -> GpsReading:
        """What receivers read."""
        return self.gps.read(state.gps, state.time)

    def read_collision(
        self, state: SensorSuiteState, worlds: Tensor | None = None
    ) -> tuple[CollisionState, SensorSuiteState]:
        """What drones were touched by, and the sensors after they have told it; see `read`.

        Args:
            state: Before; it stays as it is.
            worlds: Indices of the drones that are asked; all by default. Shape: (k,).
        """
        told, after = read(state.collision, worlds)
        return told, dataclasses.replace(state, collision=after)


def _touched(state: CollisionState, body: BodyState) -> CollisionState:
    if not isinstance(body, FlightState):
        return state
    return update(state, body.contact, body.position)
