"""The rules of cube collection: the Warp function `step`.

The rule of contact, half of the edges of cube and drone along every axis, is here for steps, in
`common.first_contact` for paths without steps, and on purpose again in the prover.
"""

import enum
import functools
from types import SimpleNamespace
from typing import Any

import torch
import warp as wp
from torch import Tensor

from drone_rl.config import TaskSettings
from drone_rl.sim.dynamics import ComputerVision, Dynamics, FlightState, Quadrotor
from drone_rl.sim.dynamics.control import Moves
from drone_rl.sim.dynamics.moves_kernel import (
    Fleet,
    camera_attitude,
    fly_move,
    is_flying,
    is_lost,
    make_fleet,
)
from drone_rl.sim.dynamics.state import LEVEL, NUMBERS
from drone_rl.sim.rendering.devices import on_torch_stream, start_warp
from drone_rl.sim.rendering.raytrace.structs_kernel import DRONE_FRAME, PoseArrays
from drone_rl.sim.tasks.common import HIDDEN_DEPTH, Side


class CubesEnd(enum.IntEnum):
    """Why an episode ended."""

    RUNNING = 0
    ALL_CUBES = 1
    FRONT_BOUNDARY = 2
    SIDE_BOUNDARY = 3  # left, right, above or below
    STEP_LIMIT = 4
    LOST_CONTROL = 5


wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.struct
class Bounds:
    """Those of `TaskSettings`. Metres."""

    touch_distance: wp.float64
    front_bound: wp.float64
    side_bound: wp.float64
    height_bound: wp.float64
    altitude: wp.float64
    step_limit: int


@wp.struct
class Cubes:
    """Cubes of environments, as in `WorldState`. Metres."""

    bounds: Bounds
    places: wp.array2d[wp.vec3d]
    collected: wp.array2d[wp.bool]
    passed: wp.array2d[wp.bool]
    side: wp.array2d[wp.int64]
    lateral: wp.array2d[wp.float64]


@wp.struct
class StepOutcome:
    """Result of a step."""

    reward: wp.float64
    end_reason: int


@wp.func
def step(cubes: Cubes, env: int, drone: wp.vec3d, steps: int, is_lost: bool) -> StepOutcome:
    """Apply Algorithms 1 and 3 after a drone has moved, and write `cubes`.

    A touched cube is collected and worth 1; a cube left behind vanishes; the episode ends when all
    cubes are collected, when the drone is out of bounds, or at the step limit, in this order; a
    drone whose motion has diverged ends it before all these. `steps` includes this one.
    """
    outcome = StepOutcome()
    num_collected = int(0)
    for cube in range(cubes.places.shape[1]):
        if is_present(cubes, env, cube):
            place = cubes.places[env, cube]
            if wp.max(wp.abs(drone - place)) <= cubes.bounds.touch_distance:
                cubes.collected[env, cube] = True
                outcome.reward += wp.float64(1.0)
            elif drone[0] > place[0]:
                cubes.passed[env, cube] = True
        if cubes.collected[env, cube]:
            num_collected += 1
    note_sides(cubes, env, drone)
    outcome.end_reason = _end_reason(cubes, drone, num_collected, steps, is_lost)
    return outcome


@wp.func
def is_present(cubes: Cubes, env: int, cube: int) -> bool:
    """Return whether a cube still stands."""
    return not (cubes.collected[env, cube] or cubes.passed[env, cube])


@wp.func
def note_sides(cubes: Cubes, env: int, drone: wp.vec3d) -> None:
    """Record side and lateral offset of each cube up to the next one, once."""
    is_next_found = bool(False)
    for cube in range(cubes.places.shape[1]):
        if not is_next_found and cubes.side[env, cube] < wp.int64(0):
            lateral = cubes.places[env, cube][1] - drone[1]
            cubes.side[env, cube] = wp.int64(Side.AHEAD)
            if lateral > cubes.bounds.touch_distance:
                cubes.side[env, cube] = wp.int64(Side.LEFT)
            if lateral < -cubes.bounds.touch_distance:
                cubes.side[env, cube] = wp.int64(Side.RIGHT)
            cubes.lateral[env, cube] = lateral
        if is_present(cubes, env, cube):
            is_next_found = True


@wp.func
def _end_reason(
    cubes: Cubes, drone: wp.vec3d, num_collected: int, steps: int, is_lost: bool
) -> int:
    """Return the first reason that holds, in the order of Algorithm 3; a lost drone before all."""
    if is_lost:
        return CubesEnd.LOST_CONTROL
    if num_collected == cubes.places.shape[1]:
        return CubesEnd.ALL_CUBES
    if drone[0] > cubes.bounds.front_bound:
        return CubesEnd.FRONT_BOUNDARY
    if wp.abs(drone[1]) > cubes.bounds.side_bound:
        return CubesEnd.SIDE_BOUNDARY
    if wp.abs(drone[2] - cubes.bounds.altitude) > cubes.bounds.height_bound:
        return CubesEnd.SIDE_BOUNDARY
    if steps >= cubes.bounds.step_limit:
        return CubesEnd.STEP_LIMIT
    return CubesEnd.RUNNING


@wp.kernel
def step_all(
    bounds: Bounds,
    drones: wp.array[wp.vec3d],
    places: wp.array2d[wp.vec3d],
    collected: wp.array2d[wp.bool],
    passed: wp.array2d[wp.bool],
    side: wp.array2d[wp.int64],
    lateral: wp.array2d[wp.float64],
    is_lost: wp.array[wp.bool],
    steps: wp.array[wp.int64],
    end_reasons: wp.array[wp.int64],
    rewards: wp.array[wp.float64],
) -> None:
    """Apply the rules to environments, a thread each."""
    env = wp.tid()
    cubes = Cubes(bounds, places, collected, passed, side, lateral)
    outcome = step(cubes, env, drones[env], int(steps[env]), is_lost[env])
    end_reasons[env] = wp.int64(outcome.end_reason)
    rewards[env] = outcome.reward


@wp.kernel
def start_all(
    bounds: Bounds,
    drones: wp.array[wp.vec3d],
    places: wp.array2d[wp.vec3d],
    collected: wp.array2d[wp.bool],
    passed: wp.array2d[wp.bool],
    side: wp.array2d[wp.int64],
    lateral: wp.array2d[wp.float64],
) -> None:
    """Record the sides of cubes at the start of episodes, a thread each."""
    env = wp.tid()
    note_sides(Cubes(bounds, places, collected, passed, side, lateral), env, drones[env])


@functools.cache
def make_bounds(settings: TaskSettings) -> Bounds:
    """Return the bounds for kernels."""
    bounds = Bounds()
    for name in Bounds.vars:
        setattr(bounds, name, getattr(settings, name))
    return bounds


def launch(kernel: Any, settings: TaskSettings, state: Any, *others: Tensor) -> None:
    """Run `step_all` or `start_all`, with its `others`, (N,), and write a `WorldState`."""
    device = state.cubes.device
    start_warp(str(device))
    vectors = [
        wp.from_torch(tensor.double().contiguous(), dtype=wp.vec3d, return_ctype=True)
        for tensor in (state.drone, state.cubes)
    ]
    written = (state.collected, state.passed, state.side, state.lateral, *others)
    arrays = [wp.from_torch(tensor, return_ctype=True) for tensor in written]
    inputs = [make_bounds(settings), *vectors, *arrays]
    with on_torch_stream(device):
        wp.launch(kernel, len(state), inputs=inputs, device=str(device))


# The fused episode kernel


@wp.struct
class EnvArrays:
    """Arrays of environments for the fused episode kernel. Metres, world frame."""

    drones: wp.array[wp.vec3d]
    cubes: Cubes
    steps: wp.array[int]
    end_reasons: wp.array[int]
    moves: wp.array[wp.vec3d]
    """One an action, in computer-vision mode."""
    fleet: Fleet


@wp.func
def place(envs: EnvArrays, env: int, poses: PoseArrays) -> None:
    """Write the poses of drone and cubes for the renderer; only flying drones have attitudes."""
    poses.positions[env, DRONE_FRAME] = wp.vec3(envs.drones[env])
    if is_flying(envs.fleet):
        poses.attitudes[env] = camera_attitude(envs.fleet, env)
    for cube in range(envs.cubes.places.shape[1]):
        at = envs.cubes.places[env, cube]
        if not is_present(envs.cubes, env, cube):
            at[2] = at[2] - wp.float64(HIDDEN_DEPTH)
        poses.positions[env, DRONE_FRAME + 1 + cube] = wp.vec3(at)


@wp.func
def move(envs: EnvArrays, env: int, action: int) -> float:
    """Move a drone by its dynamics and apply the rules. Returns the reward."""
    drone = envs.drones[env]
    lost = bool(False)
    if is_flying(envs.fleet):
        drone = fly_move(envs.fleet, env, action)
        lost = is_lost(envs.fleet, env)
    else:
        drone = drone + envs.moves[action]
    envs.drones[env] = drone
    envs.steps[env] = envs.steps[env] + 1
    outcome = step(envs.cubes, env, drone, envs.steps[env], lost)
    envs.end_reasons[env] = outcome.end_reason
    return float(outcome.reward)


class FusedCubes:
    """State of environments for the fused kernel: `arrays`, `poses`, `steps` and `end_reasons`."""

    functions = (EnvArrays, place, move)
    """Warp structure of the states; functions that write poses and that step an environment."""

    def __init__(self, settings: TaskSettings, dynamics: Dynamics, num_envs: int) -> None:
        """Allocate the arrays of at most `num_envs` environments; see `supports`."""
        shape = (num_envs, settings.num_cubes)
        self._drones = torch.zeros(num_envs, 3, dtype=torch.float64)
        self.steps = torch.zeros(num_envs, dtype=torch.int32)
        self.end_reasons = torch.zeros(num_envs, dtype=torch.int32)
        cubes, self.arrays, self.poses = Cubes(), EnvArrays(), PoseArrays()
        cubes.bounds = make_bounds(settings)
        self.state = SimpleNamespace(cubes=torch.zeros(*shape, 3, dtype=torch.float64))
        """The cubes, named as in `WorldState`."""
        cubes.places = wp.from_torch(self.state.cubes, dtype=wp.vec3d)
        kinds = {"collected": torch.bool, "passed": torch.bool, "side": torch.int64}
        for name, kind in {**kinds, "lateral": torch.float64}.items():
            values = torch.zeros(shape, dtype=kind)
            setattr(self.state, name, values)
            setattr(cubes, name, wp.from_torch(values))
        self.arrays.cubes = cubes
        self.arrays.drones = wp.from_torch(self._drones, dtype=wp.vec3d)
        self.arrays.steps = wp.from_torch(self.steps)
        self.arrays.end_reasons = wp.from_torch(self.end_reasons)
        if isinstance(dynamics, ComputerVision):
            self.arrays.moves = wp.from_torch(dynamics.moves.contiguous(), dtype=wp.vec3d)
        quadrotor = dynamics if isinstance(dynamics, Quadrotor) else None
        self._numbers = torch.zeros(num_envs if quadrotor else 0, NUMBERS, dtype=torch.float64)
        self.arrays.fleet = make_fleet(quadrotor, self._numbers)
        places = torch.zeros(num_envs, 1 + DRONE_FRAME + settings.num_cubes, 3)
        self.poses.positions = wp.from_torch(places, dtype=wp.vec3)
        attitudes = torch.tensor(LEVEL).repeat(num_envs, 1)
        self.poses.attitudes = wp.from_torch(attitudes, dtype=wp.vec4)

    @staticmethod
    def supports(dynamics: Dynamics) -> bool:
        """Return whether the kernel implements these dynamics."""
        is_flown = type(dynamics) is Quadrotor and isinstance(dynamics.steering, Moves)
        return is_flown or type(dynamics) is ComputerVision

    def begin(self, state: Any) -> None:
        """Copy states at the start of episodes."""
        count = len(state)
        self._drones[:count] = state.drone
        for name, values in vars(self.state).items():
            values[:count] = getattr(state, name)
        if isinstance(state.body, FlightState):
            self._numbers[:count] = state.body.numbers
        for values in (self.steps, self.end_reasons):
            values[:count] = 0
