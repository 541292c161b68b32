"""Whole episodes in one kernel on a CPU: rendering, forward pass, action, step and rules.

The kernel is built for the rules of a task, which `fused_rules` gives. A few environments take
each step together, so that the weights of linear layers are read once for all of them.
"""

import functools
from typing import Any

import warp as wp

from drone_rl.acceleration.layers_kernel import Layers, copy, row_size, run_convolutions, run_linear
from drone_rl.sim.rendering.raytrace.plain_kernel import render_image
from drone_rl.sim.rendering.raytrace.structs_kernel import (
    Geoms,
    Images,
    Materials,
    PoseArrays,
    Scratch,
    ViewArrays,
)

TOGETHER = wp.constant(16)
"""Environments that take a step together."""

_OPTIONS = {"enable_backward": False, "fuse_fp": False}
wp.set_module_options(_OPTIONS)


@wp.struct
class CameraView:
    """What is needed to render a frame and standardize it."""

    view: ViewArrays
    geoms: Geoms
    materials: Materials
    scratch: Scratch
    poses: PoseArrays
    mean: float
    """Subtracted from each pixel."""
    deviation: float
    """Each pixel is divided by it."""


@wp.struct
class Rollout:
    """Inputs and outputs of one launch; environment i writes rows i * steps + t."""

    camera: CameraView
    layers: Layers
    workspaces: wp.array2d[float]
    """Outputs of all layers for `TOGETHER` frames, one a worker."""
    draws: wp.array2d[float]
    """Uniform samples for actions; below 0 for the most probable one. Shape: (num_envs, steps)."""
    frames: Images
    """Frames, `num_frames` a row: those of an observation, oldest first."""
    num_frames: int
    observations: wp.array2d[float]
    """The same memory, a row an observation."""
    last_observations: wp.array2d[float]
    """Of each environment, before the first step of the launch."""
    logits: wp.array2d[float]
    actions: wp.array[int]
    rewards: wp.array[float]
    end_reasons: wp.array[int]
    """0 while the episode goes on."""
    outputs: wp.array2d[float]
    """Outputs of all layers; of shape (0, 0) if they are not saved."""


@wp.func_native("""
#pragma clang fp contract(off)
for (int i = 0; i < count; ++i) values.data[i] = (values.data[i] - mean) / deviation;""")
def standardise(values: wp.array[float], count: int, mean: float, deviation: float) -> None:
    """Subtract the mean and divide by the deviation."""
    ...


@wp.func
def choose(logits: wp.array[float], at: int, count: int, draw: float) -> int:
    """Return the action that a uniform sample `draw` selects; the most probable one if it is < 0.

    The logits begin at index `at`.
    """
    best = int(0)
    for action in range(1, count):
        if logits[at + action] > logits[at + best]:
            best = action
    if draw < 0.0:
        return best
    total = float(0.0)
    for action in range(count):
        total += wp.exp(logits[at + action] - logits[at + best])
    chosen = int(0)
    so_far = float(0.0)
    for action in range(count - 1):
        so_far += wp.exp(logits[at + action] - logits[at + best])
        if draw * total > so_far:
            chosen = action + 1
    return chosen


@wp.func
def stack(rollout: Rollout, env: int, step: int, row: int, is_start: bool) -> None:
    """Write the earlier frames of an observation; at an episode's start all are the newest."""
    seen = rollout.observations[row]
    size = seen.shape[0] // rollout.num_frames
    earlier = seen.shape[0] - size
    if is_start:
        for frame in range(rollout.num_frames - 1):
            copy(seen, earlier, seen, frame * size, size)
    elif step == 0:
        copy(rollout.last_observations[env], size, seen, 0, earlier)
    else:
        copy(rollout.observations[row - 1], size, seen, 0, earlier)


@functools.cache
def make_kernel(states: Any, place: Any, move: Any) -> Any:  # noqa: C901 (functions that Warp compiles)
    """Return the kernel for the rules of a task; see `drone_rl.sim.tasks.fused.fused_rules`.

    Args:
        states: Warp structure of the environments, with "steps" and "end_reasons".
        place: Writes the poses that are rendered: (states, env, poses).
        move: Steps an environment: (states, env, action). Returns the reward.
    """

    @wp.func
    def observe(
        first: int, last: int, step: int, worker: int, rollout: Rollout, envs: states
    ) -> int:
        """Render running environments, compute the convolutions; return how many are running."""
        camera = rollout.camera
        newest = rollout.num_frames - 1
        running = int(0)
        for env in range(first, last):
            if envs.end_reasons[env] == 0:
                row = env * rollout.draws.shape[1] + step
                place(envs, env, camera.poses)
                render_image(
                    camera.view,
                    0,
                    camera.geoms,
                    camera.poses,
                    env,
                    camera.materials,
                    camera.scratch,
                    worker,
                    rollout.frames,
                    row * rollout.num_frames + newest,
                )
                frame = rollout.frames.gray[row * rollout.num_frames + newest]
                standardise(frame, frame.shape[0], camera.mean, camera.deviation)
                if newest > 0:
                    stack(rollout, env, step, row, envs.steps[env] == 0)
                seen = rollout.observations[row]
                run_convolutions(rollout.layers, seen, rollout.workspaces[worker], running)
                running += 1
        return running

    @wp.func
    def act(first: int, last: int, step: int, worker: int, rollout: Rollout, envs: states) -> None:
        """Sample actions, and step the same environments."""
        layers = rollout.layers
        workspace = rollout.workspaces[worker]
        num_actions = rollout.logits.shape[1]
        size = row_size(layers)
        logits_offset = layers.output_offsets[layers.geometries.shape[0] - 1]
        running = int(0)
        for env in range(first, last):
            if envs.end_reasons[env] == 0:
                row = env * rollout.draws.shape[1] + step
                at = running * size + logits_offset
                for i in range(num_actions):
                    rollout.logits[row, i] = workspace[at + i]
                action = choose(workspace, at, num_actions, rollout.draws[env, step])
                rollout.actions[row] = action
                rollout.rewards[row] = move(envs, env, action)
                rollout.end_reasons[row] = envs.end_reasons[env]
                if rollout.outputs.shape[0] > 0:
                    copy(workspace, running * size, rollout.outputs[row], 0, size)
                running += 1

    @wp.kernel(module="unique", module_options=_OPTIONS)
    def run_episodes(first: int, last: int, worker: int, rollout: Rollout, envs: states) -> None:
        """Run environments `first` to `last` - 1 until their episodes or their random samples end.

        `worker` selects the buffers: launch with a dimension of 1.
        """
        for group in range(first, last, TOGETHER):
            end = wp.min(group + TOGETHER, last)
            step = int(0)
            running = int(1)
            while step < rollout.draws.shape[1] and running > 0:
                running = observe(group, end, step, worker, rollout, envs)
                run_linear(rollout.layers, rollout.workspaces[worker], 0, running)
                act(group, end, step, worker, rollout, envs)
                step += 1

    return run_episodes
