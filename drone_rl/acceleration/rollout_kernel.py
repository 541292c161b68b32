"""Whole episodes in one kernel on a CPU: rendering, forward pass, action, step and rules.

The kernel is built for the rules of a task, which `Task.fused_rules` gives. A few environments take
each step together, so that the weights of linear layers are read once for all of them.
"""

import functools
from typing import Any

import warp as wp

from drone_rl.acceleration.layers_kernel import Layers, decide, keep, look
from drone_rl.sim.rendering.raytrace.plain_kernel import render_image
from drone_rl.sim.rendering.raytrace.structs_kernel import (
    Geoms,
    Images,
    Materials,
    Poses,
    Scratch,
    View,
)

TOGETHER = wp.constant(16)
"""Worlds that take a step together."""

_OPTIONS = {"enable_backward": False, "fuse_fp": False}
wp.set_module_options(_OPTIONS)


@wp.struct
class CameraView:
    """What draws, and what becomes of a frame before the network sees it."""

    view: View
    geoms: Geoms
    materials: Materials
    scratch: Scratch
    mean: float
    """Is taken away from each pixel."""
    deviation: float
    """Divides it then."""


@wp.struct
class RolloutLog:
    """What is written down, a row a step; each world has as many rows as there may be steps."""

    pictures: Images
    """As the network saw them."""
    logits: wp.array2d[float]
    actions: wp.array[int]
    rewards: wp.array[float]
    end_reasons: wp.array[int]
    """0 where the flight goes on."""
    outputs: wp.array2d[float]
    """Of all layers; or of shape (0, 0)."""


@wp.func_native("""
#pragma clang fp contract(off)
for (int i = 0; i < count; ++i) values.data[i] = (values.data[i] - mean) / deviation;""")
def standardise(values: wp.array[float], count: int, mean: float, deviation: float) -> None:
    """Shifts and scales numbers."""
    ...


@wp.func
def choose(room: wp.array[float], at: int, count: int, draw: float) -> int:
    """An action by its logits.

    Args:
        room: Holds the logits.
        at: Where they begin.
        count: How many.
        draw: A number from 0 to 1 to draw by; the most probable action is taken below 0.
    """
    best = int(0)
    for action in range(1, count):
        if room[at + action] > room[at + best]:
            best = action
    if draw < 0.0:
        return best
    total = float(0.0)
    for action in range(count):
        total += wp.exp(room[at + action] - room[at + best])
    chosen = int(0)
    so_far = float(0.0)
    for action in range(count - 1):
        so_far += wp.exp(room[at + action] - room[at + best])
        if draw * total > so_far:
            chosen = action + 1
    return chosen


@functools.cache
def make_kernel(states: Any, place: Any, move: Any) -> Any:  # noqa: C901 (functions that Warp compiles)
    """Return the kernel for the rules of a task; see `Task.fused_rules`.

    Args:
        states: Warp structure of the environments, with "end_reasons".
        place: Writes the poses that are rendered: (states, env, poses).
        move: Steps an environment: (states, env, action). Returns the reward.
    """

    @wp.func
    def see(
        first: int,
        last: int,
        step: int,
        member: int,
        eye: CameraView,
        layers: Layers,
        room: wp.array[float],
        flights: states,
        poses: Poses,
        steps: int,
        log: RolloutLog,
    ) -> int:
        """Render running environments and start the forward pass. Returns their number."""
        going = int(0)
        for world in range(first, last):
            if flights.end_reasons[world] == 0:
                row = world * steps + step
                place(flights, world, poses)
                render_image(
                    eye.view,
                    0,
                    eye.geoms,
                    poses,
                    world,
                    eye.materials,
                    eye.scratch,
                    member,
                    log.pictures,
                    row,
                )
                picture = log.pictures.gray[row]
                standardise(picture, picture.shape[0], eye.mean, eye.deviation)
                look(layers, picture, room, going)
                if log.outputs.shape[0] > 0:
                    keep(layers, 0, layers.num_convolutions, room, going, log.outputs[row])
                going += 1
        return going

    @wp.func
    def act(
        first: int,
        last: int,
        step: int,
        layers: Layers,
        room: wp.array[float],
        flights: states,
        draws: wp.array2d[float],
        log: RolloutLog,
    ) -> None:
        """Sample actions, and step the same environments."""
        at = int(layers.logits_at)
        count = int(0)
        for world in range(first, last):
            if flights.end_reasons[world] == 0:
                row = world * draws.shape[1] + step
                for action in range(log.logits.shape[1]):
                    log.logits[row, action] = room[at + action]
                chosen = choose(room, at, log.logits.shape[1], draws[world, step])
                log.actions[row] = chosen
                log.rewards[row] = move(flights, world, chosen)
                log.end_reasons[row] = flights.end_reasons[world]
                if log.outputs.shape[0] > 0:
                    num_layers = layers.steps.shape[0]
                    keep(layers, layers.num_convolutions, num_layers, room, count, log.outputs[row])
                at += layers.num_outs
                count += 1

    @wp.kernel(module="unique", module_options=_OPTIONS)
    def fly(
        first: int,
        last: int,
        member: int,
        eye: CameraView,
        layers: Layers,
        rooms: wp.array2d[float],
        flights: states,
        poses: Poses,
        draws: wp.array2d[float],
        log: RolloutLog,
    ) -> None:
        """Run environments to the ends of their episodes, or for as many steps as the log has rows.

        Args:
            first: The first environment.
            last: The one after the last.
            member: Which of the scratch buffers to use: launch with a dimension of 1.
            eye: Camera and standardization.
            layers: The network's.
            rooms: Buffers for activations, one a member.
            flights: The environments.
            poses: Where they are rendered.
            draws: Uniform samples for actions, or below 0 for the most probable. Shape: (N, T).
            log: Is written.
        """
        room = rooms[member]
        steps = draws.shape[1]
        for group in range(first, last, TOGETHER):
            end = wp.min(group + TOGETHER, last)
            step = int(0)
            going = int(1)
            while step < steps and going > 0:
                going = see(group, end, step, member, eye, layers, room, flights, poses, steps, log)
                decide(layers, room, going)
                act(group, end, step, layers, room, flights, draws, log)
                step += 1

    return fly
