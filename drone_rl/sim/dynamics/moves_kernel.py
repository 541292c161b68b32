"""The chapter's moves flown by a quadrotor, for kernels that fly whole episodes.

The same numbers, bit for bit, as `Quadrotor.step` gives.
"""

import torch
import warp as wp

from drone_rl.sim.dynamics import state as fs
from drone_rl.sim.dynamics.control import Moves
from drone_rl.sim.dynamics.flight_kernel import command
from drone_rl.sim.dynamics.quadrotor import Quadrotor
from drone_rl.sim.dynamics.rigid_body_kernel import Airframe
from drone_rl.sim.dynamics.state import NUMBERS, FlightState

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

_PLACE = wp.constant(fs.POSITION.first)
_ATTITUDE = wp.constant(fs.ATTITUDE.first)
_REFERENCE = wp.constant(fs.REFERENCE.first)
_LOST = wp.constant(fs.LOST.first)


@wp.struct
class Fleet:
    """Drones in flight, and how they are flown."""

    frame: Airframe
    ticks: int
    """Of a move."""
    modes: wp.vec4i
    lead: wp.float64
    """See `ActionSettings.move_lead`."""
    is_gimballed: int
    """Whether cameras are kept level."""
    moves: wp.array2d[wp.float64]
    """How fast the place where a drone is wanted shifts, one row an action."""
    goals: wp.array2d[wp.float64]
    drifts: wp.array2d[wp.float64]
    centers: wp.array2d[wp.vec3d]
    half_sizes: wp.vec3
    numbers: wp.array2d[wp.float64]
    """See `FlightState`; no rows where drones are in computer-vision mode."""


@wp.func
def is_flying(fleet: Fleet) -> bool:
    """Whether there are drones in flight at all."""
    return fleet.numbers.shape[0] > 0


@wp.func
def fly_move(fleet: Fleet, world: int, action: int) -> wp.vec3d:
    """Flies a drone through a move. Returns where it is then, metres."""
    for axis in range(4):
        wanted = fleet.numbers[world, _REFERENCE + axis]
        if axis < 2:
            place = fleet.numbers[world, _PLACE + axis]
            wanted = place + wp.clamp(wanted - place, -fleet.lead, fleet.lead)
        fleet.goals[world, axis] = wanted
        fleet.drifts[world, axis] = fleet.moves[action, axis]
    command(
        fleet.frame,
        fleet.ticks,
        fleet.modes,
        fleet.goals,
        fleet.drifts,
        fleet.centers,
        fleet.half_sizes,
        fleet.numbers,
        fleet.numbers,
        world,
    )
    return place_of(fleet, world)


@wp.func
def place_of(fleet: Fleet, world: int) -> wp.vec3d:
    """Where a drone is, metres."""
    numbers = fleet.numbers[world]
    return wp.vec3d(numbers[_PLACE], numbers[_PLACE + 1], numbers[_PLACE + 2])


@wp.func
def camera_attitude(fleet: Fleet, world: int) -> wp.vec4:
    """How a drone's cameras are turned: as its body, or as `heading_only` has it."""
    numbers = fleet.numbers[world]
    w = numbers[_ATTITUDE]
    x = numbers[_ATTITUDE + 1]
    y = numbers[_ATTITUDE + 2]
    z = numbers[_ATTITUDE + 3]
    if fleet.is_gimballed == 1:
        length = wp.sqrt(w * w + z * z)
        if length == wp.float64(0.0):
            return wp.vec4(1.0, 0.0, 0.0, 0.0)
        return wp.vec4(float(w / length), 0.0, 0.0, float(z / length))
    return wp.vec4(float(w), float(x), float(y), float(z))


@wp.func
def is_lost(fleet: Fleet, world: int) -> bool:
    """Whether a drone's motion has diverged."""
    return fleet.numbers[world, _LOST] != wp.float64(0.0)


class FlyingFleet:
    """Arrays for as many drones, written anew with each batch of episodes."""

    def __init__(self, num_worlds: int, quadrotor: Quadrotor | None) -> None:
        """Makes room.

        Args:
            num_worlds: How many there may be.
            quadrotor: What they are; none for no drones in flight.
        """
        count = num_worlds if quadrotor else 0
        self._numbers = torch.zeros(count, NUMBERS, dtype=torch.float64)
        self.fleet = fleet = Fleet()
        fleet.numbers = wp.from_torch(self._numbers)
        fleet.goals, fleet.drifts = (wp.zeros((count, 4), dtype=wp.float64) for _ in range(2))
        fleet.centers = wp.zeros((count, 0), dtype=wp.vec3d)
        if quadrotor is not None:
            steering = quadrotor.steering
            assert isinstance(steering, Moves)
            fleet.frame = quadrotor.frame
            fleet.ticks = quadrotor.settings.control_ticks
            fleet.modes = wp.vec4i(*(int(mode) for mode in steering.MODES))
            fleet.lead = steering.lead
            fleet.is_gimballed = int(quadrotor.mount == "gimbal")
            fleet.moves = wp.from_torch(steering.drifts.contiguous())

    @classmethod
    def knows(cls, quadrotor: Quadrotor) -> bool:
        """Whether kernels fly all that the drones can be told."""
        return isinstance(quadrotor.steering, Moves)

    def begin(self, state: FlightState) -> None:
        """Takes drones over at the start of episodes; the state itself stays as it is."""
        self._numbers[: len(state)] = state.numbers
