"""What a pilot sits in: switches, instruments, and a clock of simulated time."""

import math
from collections.abc import Sequence
from types import TracebackType
from typing import Any, Self

import torch

from drone_rl.config import DynamicsSettings
from drone_rl.config.sensors import SensorSettings
from drone_rl.flight.commands import checks
from drone_rl.flight.commands.command import Command
from drone_rl.flight.commands.drone import Drone
from drone_rl.flight.commands.errors import PilotError
from drone_rl.flight.commands.future import FlightFuture
from drone_rl.flight.commands.runner import Runner
from drone_rl.flight.commands.sensing import Sensors
from drone_rl.flight.commands.showing import shown
from drone_rl.flight.commands.state import PilotState
from drone_rl.flight.commands.sticks import Sticks
from drone_rl.flight.commands.trajectory import Trajectory
from drone_rl.sim.dynamics import Obstacles, Quadrotor
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Whole


class Cockpit:
    """A drone that can be switched on and off and watched; see `Pilot`."""

    def __init__(
        self,
        dynamics: DynamicsSettings | Quadrotor | None = None,
        *,
        start: Sequence[float] = (0.0, 0.0),
        yaw: float = 0.0,
        seed: int = 0,
        obstacles: Obstacles | None = None,
        worlds: Worlds | None = None,
        sensors: SensorSettings | None = None,
        **changes: Any,
    ) -> None:
        """Puts a drone on the ground.

        Args:
            dynamics: Drone and air; by default those of `worlds` if they fly, and else AirSim's
                generic drone in still air.
            start: Where, x and y, metres.
            yaw: How it is turned, degrees to the left of the world's x.
            seed: Of gusts and of sensors' noise, a whole number.
            obstacles: What it may touch besides the ground, in one world; what stands in `worlds`
                now by default.
            worlds: A single world, of which it takes pictures.
            sensors: Of which kind its sensors are, which are then turned on from the start.
            changes: Settings of dynamics, such as wind=[5, 0, 0].

        Raises:
            InputError: A setting can't be.
        """
        if worlds is not None:
            if worlds.num_worlds != 1:
                raise InputError(f"worlds has {worlds.num_worlds} of them; give Worlds(1, ...)")
            if dynamics is None and isinstance(worlds.dynamics, Quadrotor):
                dynamics = worlds.dynamics.settings
            if obstacles is None:
                obstacles = worlds.task.obstacles(worlds.state)
        quadrotor = _quadrotor(dynamics, changes)
        x, y = checks.numbers(start, "start", 2, -checks.FARTHEST, checks.FARTHEST)
        place = torch.tensor([x, y, quadrotor.settings.radius], dtype=torch.float64)
        heading = math.radians(checks.real(yaw, "yaw", unit="degrees"))
        self._seed = Whole(0, 2**31 - 1).read(seed, "seed")
        self._drone = Drone(quadrotor, place, heading, self._seed)
        self._drone.obstacles = obstacles
        self._runner = Runner(self._drone)
        self.worlds = worlds
        if sensors is not None:
            self._drone.sensors = Sensors(self._drone.body, sensors, self._seed)
        self.sticks = Sticks()
        """Where the sticks stand, for `move_by_manual`; to be replaced at any time."""

    def __enter__(self) -> Self:
        """Returns itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Ends the running command."""
        self._runner.cancel()

    @property
    def state(self) -> PilotState:
        """Where the drone is, how fast, how turned; whether it is armed, flies, has touched."""
        return self._drone.state

    @property
    def time(self) -> float:
        """Simulated seconds since it was put down."""
        return self._drone.time

    @property
    def trajectory(self) -> Trajectory:
        """Where it has been, for plots."""
        return self._drone.trajectory

    @property
    def sensors(self) -> Sensors:
        """What it reads beside pictures.

        Where no sensors were asked for, AirSim's are turned on when this is first looked at: until
        then they cost nothing.
        """
        drone = self._drone
        if drone.sensors is None:
            drone.sensors = Sensors(drone.body, SensorSettings(), self._seed)
        return drone.sensors

    @property
    def settings(self) -> DynamicsSettings:
        """Of drone and air."""
        return self._drone.quadrotor.settings

    @property
    def running(self) -> FlightFuture | None:
        """The command that it obeys now, if any."""
        return self._runner.running

    def advance(self, seconds: float) -> PilotState:
        """Lets simulated time pass, whatever the drone is told. Returns its state then.

        Raises:
            InputError: Time does not go back.
        """
        self._runner.advance(self._drone.ticks_of(checks.duration(seconds)))
        return self.state

    def cancel(self) -> None:
        """Ends the running command; the drone stays where it is."""
        self._runner.cancel()

    def arm(self) -> None:
        """Lets the rotors turn.

        Raises:
            PilotError: It is in the air.
        """
        if self._drone.is_flying and not self._drone.armed:
            raise PilotError("can't arm in the air; wait until the drone lies on the ground")
        self._drone.armed = True

    def disarm(self, *, force: bool = False) -> None:
        """Stops the rotors.

        Args:
            force: Even in the air, from where it falls.

        Raises:
            PilotError: It is in the air.
        """
        if self._drone.is_flying and not force:
            raise PilotError("can't disarm in the air; land first, or let it fall by force=True")
        self._drone.armed = False
        self._runner.switched_off()

    def _needs_arms(self, name: str) -> None:
        """Refuses what only rotors that turn can do.

        Raises:
            PilotError: They don't, or the drone is lost.
        """
        if self._drone.is_lost:
            raise PilotError(f"{name}: the drone's motion has diverged; make a new Pilot")
        if not self._drone.armed:
            raise PilotError(f"{name}: the drone isn't armed; call arm() first")

    def _fly(self, name: str, command: Command, wait: bool) -> bool | FlightFuture:
        """Tells the drone something that only those obey who fly.

        Raises:
            PilotError: It isn't armed, or stands on the ground.
        """
        self._needs_arms(name)
        if not self._drone.is_flying:
            raise PilotError(f"{name}: the drone stands on the ground; call take_off() first")
        return self._tell(name, command, wait)

    def _tell(self, name: str, command: Command, wait: bool) -> bool | FlightFuture:
        """Tells the drone something, and waits for it if that is wanted."""
        future = self._runner.start(name, command)
        return future.result() if wait else future

    def _repr_html_(self) -> str:
        return shown(self.state, self.trajectory)


def limit_of(timeout: float | None, length: float, speed: float) -> float:
    """Seconds after which a way has not been done.

    Args:
        timeout: What was asked for; three times what it should take and 10 s by default.
        length: Of the way, metres.
        speed: Metres a second.

    Raises:
        InputError: Time does not go back.
    """
    if timeout is None:
        return 10.0 + 3.0 * length / speed
    return checks.real(timeout, "timeout", 0.0, unit="s")


def radians(value: Any, name: str, limit: float = 3600.0) -> float:
    """An angle, or a rate, that was given in degrees.

    Raises:
        InputError: It is beyond the limit, or no number.
    """
    return math.radians(checks.real(value, name, -limit, limit, unit="degrees"))


def _quadrotor(dynamics: DynamicsSettings | Quadrotor | None, changes: dict[str, Any]) -> Quadrotor:
    if isinstance(dynamics, Quadrotor):
        if changes:
            raise InputError(f"{', '.join(changes)} and a Quadrotor are given; give settings alone")
        return dynamics
    return Quadrotor((dynamics or DynamicsSettings()).replace(mode="simple_flight", **changes))
