"""Continuous actions in kernels: what their numbers mean, and flight at these rates."""

import torch
import warp as wp
from torch import Tensor

from drone_rl.sim.continuous_actions import ContinuousActions
from drone_rl.sim.dynamics import state as fs
from drone_rl.sim.dynamics.control import Mode
from drone_rl.sim.dynamics.flight_kernel import run
from drone_rl.sim.dynamics.moves_kernel import Fleet
from drone_rl.sim.rendering.devices import on_torch_stream, start_warp

wp.set_module_options({"enable_backward": False, "fuse_fp": False})


@wp.struct
class Rates:
    """What the numbers of an action mean; see `ContinuousActions`."""

    most: wp.vec4d
    """Greatest rates forward, to the left, of yaw to the left and up, as in `to_rates`."""
    range: wp.float64
    """Of forward fractions: 1, and more if drones fly backward."""
    backward: wp.float64


def make_rates(actions: ContinuousActions) -> Rates:
    """Return the meaning of actions."""
    rates = Rates()
    rates.most = wp.vec4d(*actions.speeds)
    rates.backward, rates.range = actions.backward, 1.0 + actions.backward
    return rates


@wp.func
def speeds_of(rates: Rates, action: wp.array[float]) -> wp.vec4:
    """Return `Actions.speeds_of` an action."""
    ahead = (wp.clamp(action[0], -1.0, 1.0) + 1.0) / 2.0
    up = float(0.0)
    if action.shape[0] > 3:
        up = wp.clamp(action[3], -1.0, 1.0)
    return wp.vec4(
        ahead * float(rates.range) - float(rates.backward),
        wp.clamp(action[1], -1.0, 1.0),
        up,
        wp.clamp(action[2], -1.0, 1.0),
    )


@wp.func
def rates_of(rates: Rates, action: wp.array[float]) -> wp.vec4d:
    """Return `ContinuousActions.to_rates` of an action, and 0 for rates that it lacks."""
    found = wp.vec4d()
    for i in range(action.shape[0]):
        found[i] = wp.float64(wp.clamp(action[i], -1.0, 1.0))
    one = wp.float64(1.0)
    found[0] = (found[0] + one) / wp.float64(2.0) * rates.range - rates.backward
    return wp.cw_mul(found, rates.most)


@wp.func
def fly_at(fleet: Fleet, world: int, rates: wp.vec4d) -> None:
    """Fly a drone at rates for a step, as `Quadrotor.step` does."""
    for axis in range(4):
        goal = rates[axis]
        if fleet.command.modes[axis] == Mode.POSITION:
            goal = fleet.numbers[world, fs.REFERENCE + axis]
        fleet.command.goals[world, axis] = goal
    run(fleet.command, fleet.numbers, fleet.numbers, world)


@wp.struct
class Glide:
    """A drone without inertia. SI units, world frame."""

    position: wp.vec3d
    attitude: wp.vec4d
    velocity: wp.vec3d


@wp.func
def glide(position: wp.vec3d, attitude: wp.vec4d, rates: wp.vec4d, seconds: wp.float64) -> Glide:
    """Return a level drone after it has flown at rates, and then turned."""
    one = wp.float64(1.0)
    two = wp.float64(2.0)
    w = attitude[0]
    x = attitude[1]
    y = attitude[2]
    z = attitude[3]
    heading = wp.atan2(two * (w * z + x * y), one - two * (y * y + z * z))
    cos = wp.cos(heading)
    sin = wp.sin(heading)
    after = Glide()
    after.velocity = wp.vec3d(
        cos * rates[0] - sin * rates[1], sin * rates[0] + cos * rates[1], rates[3]
    )
    after.position = position + after.velocity * seconds
    half = (heading + rates[2] * seconds) / two
    zero = wp.float64(0.0)
    after.attitude = wp.vec4d(wp.cos(half), zero, zero, wp.sin(half))
    return after


@wp.kernel
def _glide_all(
    positions: wp.array[wp.vec3d],
    attitudes: wp.array[wp.vec4d],
    rates: wp.array2d[wp.float64],
    seconds: wp.float64,
    after: wp.array2d[wp.vec3d],
    turned: wp.array[wp.vec4d],
) -> None:
    """Glide drones, a thread each; `after` are positions and velocities."""
    i = wp.tid()
    flown = wp.vec4d()
    for axis in range(rates.shape[1]):
        flown[axis] = rates[i, axis]
    drone = glide(positions[i], attitudes[i], flown, seconds)
    after[0, i] = drone.position
    after[1, i] = drone.velocity
    turned[i] = drone.attitude


def glide_all(
    position: Tensor, attitude: Tensor, rates: Tensor, seconds: float
) -> tuple[Tensor, Tensor, Tensor]:
    """Return positions, attitudes and velocities of drones that fly at rates, (N, 3 or 4)."""
    device = position.device
    start_warp(str(device))
    after, turned = position.new_empty(2, *position.shape), torch.empty_like(attitude)
    inputs = [
        wp.from_torch(position.contiguous(), dtype=wp.vec3d),
        wp.from_torch(attitude.contiguous(), dtype=wp.vec4d),
        wp.from_torch(rates.contiguous()),
        seconds,
        wp.from_torch(after, dtype=wp.vec3d),
        wp.from_torch(turned, dtype=wp.vec4d),
    ]
    with on_torch_stream(device):
        wp.launch(_glide_all, len(position), inputs=inputs, device=str(device))
    return after[0], turned, after[1]
