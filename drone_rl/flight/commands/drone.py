"""A single simulated drone: physics, arming, sensors, and the runner of its commands."""

import math

import torch
from torch import Tensor

from drone_rl.config.sensors import SensorSettings
from drone_rl.flight.commands.command import Command, FlightFuture, hold, period_ticks
from drone_rl.flight.commands.movement import GoHomeCommand, Land
from drone_rl.flight.commands.state import (
    LandedState,
    PilotState,
    Trajectory,
    attitude_of,
    collision_of,
    triple,
)
from drone_rl.sim.dynamics import FlightState, Goals, Obstacles, Quadrotor
from drone_rl.sim.dynamics.control import rotor_goals
from drone_rl.sim.dynamics.state import CLIMB, NOTHING, TICKS
from drone_rl.sim.sensors import (
    BarometerReading,
    CollisionState,
    GpsReading,
    ImuReading,
    MagnetometerReading,
    SensorSuite,
)

COASTING = 0.06
"""Seconds for which the last goals hold after a command that sets no position."""
_IDLE = 0.1
"""Thrust of idle rotors as a fraction of the hover thrust."""
_LEAST_THRUST = 0.1
"""Mean thrust fraction above which a drone that moves vertically is flying."""
_CLIMBS = 0.01
"""Vertical speed that counts as moving, m/s."""
_AT_REST = 0.08
"""Speed in m/s, and turn rate in rad/s, below which a drone on the ground has landed."""


class Sensors:
    """IMU, barometer, magnetometer, GPS and collision sensor of one drone.

    Readings have batch shape (1, *). They are sampled in each control period, seven ticks by
    default, even if a sensor's rate is higher.
    """

    def __init__(self, body: FlightState, settings: SensorSettings, seed: int = 0) -> None:
        """Turn the sensors on.

        Args:
            body: State of one drone now.
            settings: Rates, latencies and noise.
            seed: Seed of the noise.
        """
        self._senses = SensorSuite(settings, seed=seed)
        self._state = self._senses.start(body)

    @property
    def settings(self) -> SensorSettings:
        """Rates, latencies and noise."""
        return self._senses.settings

    @property
    def time(self) -> float:
        """Simulated seconds since the sensors were turned on; the clock of the readings."""
        return float(self._state.time[0])

    def update(self, body: FlightState, seconds: float) -> None:
        """Advance the sensors to the state `body`, some seconds later."""
        self._state = self._senses.update(self._state, body, seconds)

    def imu(self) -> ImuReading:
        """Return specific force, angular rates and attitude."""
        return self._senses.read_imu(self._state)

    def barometer(self) -> BarometerReading:
        """Return pressure and the corresponding altitude above the sea."""
        return self._senses.read_barometer(self._state)

    def magnetometer(self) -> MagnetometerReading:
        """Return Earth's magnetic field."""
        return self._senses.read_magnetometer(self._state)

    def gps(self) -> GpsReading:
        """Return place on Earth and velocity; invalid until the receiver has a fix."""
        return self._senses.read_gps(self._state)

    def collision(self) -> CollisionState:
        """Return the last contact, and whether it is new since the last call."""
        reading, self._state = self._senses.read_collision(self._state)
        return reading


class Drone:
    """Vehicle state, arming and clock of one drone, without commands."""

    def __init__(self, quadrotor: Quadrotor, start: Tensor, heading: float, seed: int) -> None:
        """Put a disarmed drone on the ground.

        Args:
            quadrotor: Vehicle dynamics.
            start: Centre of the drone, metres. Shape: (3,), float64.
            heading: Radians to the left of the world's x axis.
            seed: Seed of the gusts.
        """
        self.quadrotor, self.home = quadrotor, start
        turned = [math.cos(0.5 * heading), 0.0, 0.0, math.sin(0.5 * heading)]
        attitude = torch.tensor([turned], dtype=torch.float64)
        self.body = FlightState.at_rest(start[None], attitude, torch.tensor([seed]))
        self.obstacles: Obstacles | None = None
        self.sensors: Sensors | None = None
        self.armed = False
        self.landed = LandedState.LANDED
        self.period = period_ticks(quadrotor.settings)
        self.trajectory = Trajectory()
        self.trajectory.append(self.time, self.body)

    @property
    def tick(self) -> float:
        """Physics time step, seconds."""
        return self.quadrotor.settings.tick

    @property
    def time(self) -> float:
        """Simulated seconds."""
        return int(self.body.ticks[0]) * self.tick

    @property
    def speed(self) -> float:
        """Metres per second."""
        return float(self.body.velocity.norm())

    @property
    def is_flying(self) -> bool:
        """Whether the drone is in the air."""
        return self.landed == LandedState.FLYING

    @property
    def is_lost(self) -> bool:
        """Whether the simulation has diverged."""
        return bool(self.body.is_lost[0])

    @property
    def state(self) -> PilotState:
        """The state as users read it."""
        body = self.body
        w, x, y, z = body.attitude[0].tolist()
        return PilotState(
            time=self.time,
            position=triple(body.position),
            velocity=triple(body.velocity),
            attitude=attitude_of((w, x, y, z)),
            landed=self.landed,
            armed=self.armed,
            lost=self.is_lost,
            collision=collision_of(body),
        )

    def ticks_of(self, seconds: float) -> int:
        """Return the fewest ticks that last so long."""
        return math.ceil(seconds / self.tick - 1e-9)

    def fly(self, goals: Goals | None, ticks: int) -> None:
        """Advance simulated time.

        Args:
            goals: Goals of the controller; idle rotors if None.
            ticks: Duration.
        """
        if not self.armed:
            goals = _all_rotors(0.0)
        elif goals is None:
            goals = _all_rotors(_IDLE * self.quadrotor.settings.hover_throttle)
        if not self.is_lost:
            self.body = self.quadrotor.fly(self.body, goals, ticks, self.obstacles)
        if self.is_lost:  # the drone stays at its last valid state
            self.body.numbers[:, TICKS] += ticks
        self.trajectory.append(self.time, self.body)
        if self.sensors is not None:
            self.sensors.update(self.body, ticks * self.tick)
        self._update_landed()

    def settle(self) -> None:
        """Mark the drone as landed and reset the climb controller."""
        self.landed = LandedState.LANDED
        self.body.numbers[:, CLIMB] = 2.0 * self.quadrotor.settings.hover_throttle - 1.0

    def here(self) -> Tensor:
        """Return the current pose, as in `FlightState.reference`. Shape: (1, 4)."""
        return self.body.settled().reference.clone()

    def _update_landed(self) -> None:
        """Detect take-off and landing."""
        body = self.body
        pushes = float(body.rotors.mean()) > _LEAST_THRUST
        if not self.is_flying:
            if pushes and abs(float(body.velocity[0, 2])) > _CLIMBS:
                self.landed = LandedState.FLYING
            return
        contact = body.contact
        touches = int(contact.thing[0]) != NOTHING
        touches = touches and float(contact.time[0]) > self.time - 2.5 * self.tick
        turns = float(body.angular_velocity.norm())
        if touches and not pushes and max(self.speed, turns) < _AT_REST:
            self.settle()


class Runner:
    """Advances a drone under its running command and lets it hover afterwards.

    A new command replaces the running one.
    """

    def __init__(self, drone: Drone) -> None:
        """Take the drone."""
        self.drone = drone
        self.running: FlightFuture | None = None
        self._goals: Goals | None = None
        """Goals of the current control period."""
        self._left = 0
        """Remaining ticks of the period."""
        self._coasting = 0
        """Ticks for which the last goals hold after a command that set no position."""
        self._place: Tensor | None = None
        """Pose to hold without a command."""

    def start(self, name: str, command: Command) -> FlightFuture:
        """Start a command; `name` is for messages."""
        self.cancel()
        future = FlightFuture(name, command, self.finish)
        command.begin(self.drone.body)
        self.running, self._left = future, 0
        if command.limit <= 0.0:
            self._end(command.succeeds_at_limit)
        return future

    def cancel(self) -> None:
        """Cancel the running command, if any."""
        if self.running is not None:
            self.running.cancel()
            self._end(None)

    def finish(self, future: FlightFuture) -> None:
        """Advance simulated time until a command ends."""
        while not future.done:
            self.advance(self._left or self.drone.period)

    def advance(self, ticks: int) -> None:
        """Advance simulated time."""
        while ticks > 0:
            if self._left == 0:
                self._goals, self._left = self._next_goals(), self.drone.period
            now = min(ticks, self._left)
            self.drone.fly(self._goals, now)
            ticks, self._left = ticks - now, self._left - now
            self._coasting = max(0, self._coasting - now)
            if self.running is not None:
                self.running.elapsed += now * self.drone.tick
                if self._left == 0:
                    self._check(self.running)

    def reset(self) -> None:
        """Cancel the running command and hold no position, as after disarming."""
        self.cancel()
        self._place, self._coasting, self._left = None, 0, 0

    def _next_goals(self) -> Goals | None:
        drone = self.drone
        if self.running is not None:
            return self.running.command.goals(drone.body)
        if self._coasting > 0:
            return self._goals
        if not drone.is_flying:
            self._place = None
            return None
        if self._place is None:
            self._place = drone.here()
        return hold(self._place)

    def _check(self, future: FlightFuture) -> None:
        """End the command if it is complete, over time, or the drone is lost."""
        command = future.command
        if self.drone.is_lost:
            self._end(False)
        elif bool(command.is_complete(self.drone.body)[0]):
            self._end(True)
        elif future.elapsed >= command.limit - 1e-9:
            self._end(command.succeeds_at_limit)

    def _end(self, success: bool | None) -> None:
        """End the running command (None: cancelled) and choose the pose to hold afterwards."""
        future, self.running = self.running, None
        assert future is not None
        command, self._left = future.command, 0
        self._place = None
        self._coasting = self.drone.ticks_of(COASTING)
        if success is None:
            return
        future.finish(success)
        if success:
            self._place = command.rest(self.drone.body)
        if success and isinstance(command, Land | GoHomeCommand):
            self.drone.settle()
        if self._place is not None:
            self.drone.body.reference[:] = self._place
        if self._place is not None or not self.drone.is_flying:
            self._coasting = 0


def _all_rotors(share: float) -> Goals:
    return rotor_goals(torch.full((1, 4), share, dtype=torch.float64))
