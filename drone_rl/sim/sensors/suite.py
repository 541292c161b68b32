"""All sensors of a drone together, and its memory of collisions."""

import dataclasses

import torch
from torch import Tensor

from drone_rl.config.sensors import SensorSettings
from drone_rl.sim.coordinates import HOME, GeoPoint
from drone_rl.sim.dynamics.state import NOTHING, BodyState, Contact, FlightState
from drone_rl.sim.sensors import instruments
from drone_rl.sim.sensors.sensor import SensorState, select
from drone_rl.utils.batch import Batch
from drone_rl.utils.seeding import Stream, torch_generator


@dataclasses.dataclass
class CollisionState(Batch):
    """The last collision of `num_envs` drones. World frame, SI units."""

    has_collided: Tensor  # (num_envs,) bool
    """Whether there was a contact that has not been read yet."""
    contact: Contact
    """The last one; reading does not clear it."""
    position: Tensor  # (num_envs, 3) float64
    """Of the drone at that time, metres."""


@dataclasses.dataclass
class SensorSuiteState(Batch):
    """State of `num_envs` drones' sensors."""

    time: Tensor  # (num_envs,) float64
    """Of the last update, seconds."""
    imu: instruments.ImuState
    barometer: instruments.BarometerState
    magnetometer: instruments.MagnetometerState
    gps: SensorState
    collision: CollisionState


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
        collision = _touched(start_collisions(body.position), body)
        return SensorSuiteState(time=time, **states, collision=collision)

    def update(self, state: SensorSuiteState, body: BodyState, seconds: float) -> SensorSuiteState:
        """Return the sensors some seconds after the last update; each takes at most one reading."""
        time = state.time + seconds
        states = {
            name: getattr(self, name).update(getattr(state, name), body, time, stream)
            for name, stream in self._streams.items()
        }
        collision = _touched(state.collision, body)
        return SensorSuiteState(time=time, **states, collision=collision)

    def read_collision(
        self, state: SensorSuiteState, env_ids: Tensor | None = None
    ) -> tuple[CollisionState, SensorSuiteState]:
        """Return the last collisions, and the sensors with the flag cleared."""
        reading, after = read_collisions(state.collision, env_ids)
        return reading, dataclasses.replace(state, collision=after)


def start_collisions(position: Tensor) -> CollisionState:
    """Return the state of drones that have never collided. Shape: (num_envs, 3), float64."""
    untouched = torch.zeros(len(position), dtype=torch.bool, device=position.device)
    numbers, zeros = torch.full_like(untouched, NOTHING, dtype=torch.int64), position.new_zeros
    nowhere, flat = zeros(position.shape), zeros(len(position))
    nothing = Contact(numbers, nowhere, nowhere.clone(), flat, flat.clone())
    return CollisionState(untouched, nothing, nowhere.clone())


def update_collisions(state: CollisionState, contact: Contact, position: Tensor) -> CollisionState:
    """Record contacts, at positions in metres, that differ from the last in time or object."""
    last = state.contact
    is_other = (contact.thing != last.thing) | (contact.time != last.time)
    is_new = (contact.thing != NOTHING) & is_other
    changed = {k: select(is_new, v, getattr(last, k)) for k, v in vars(contact).items()}
    return CollisionState(
        state.has_collided | is_new, Contact(**changed), select(is_new, position, state.position)
    )


def read_collisions(
    state: CollisionState, env_ids: Tensor | None = None
) -> tuple[CollisionState, CollisionState]:
    """Return the last collisions of drones by index, (k,), and the state with the flag cleared."""
    env_ids = torch.arange(len(state), device=state.position.device) if env_ids is None else env_ids
    flag = state.has_collided.clone()
    flag[env_ids] = False
    return state[env_ids], dataclasses.replace(state, has_collided=flag)


def _touched(state: CollisionState, body: BodyState) -> CollisionState:
    if not isinstance(body, FlightState):
        return state
    return update_collisions(state, body.contact, body.position)
