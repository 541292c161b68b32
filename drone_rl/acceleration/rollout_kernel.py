"""Whole episodes in one kernel on a CPU: rendering, forward pass, action, step and rules.

The kernel is built for the rules of a task, which `fused_rules` gives. A few environments take
each step together, so that the weights of linear layers are read once for all of them.
"""

import functools
from typing import Any

import warp as wp

from drone_rl.acceleration.layers_kernel import Layers, copy, row_size, run_branches, run_trunk
from drone_rl.acceleration.vectors_kernel import Vectors, measure_nothing
from drone_rl.policies.actor import MAX_ACTION
from drone_rl.sim.continuous_actions import LEAST_LOG, MOST_LOG, MOST_MEAN, SHIFT
from drone_rl.sim.rendering.raytrace.effects_kernel import render_image_with_effects
from drone_rl.sim.rendering.raytrace.plain_kernel import find_visible, render_image
from drone_rl.sim.rendering.raytrace.projection_kernel import start_job
from drone_rl.sim.rendering.raytrace.structs_kernel import (
    DEPTH,
    NO_GEOM,
    RGB,
    Effects,
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
    """What is needed to render a frame of an image and standardize it."""

    view: ViewArrays
    geoms: Geoms
    materials: Materials
    scratch: Scratch
    poses: PoseArrays
    has_effects: bool
    effects: Effects
    rendered: Images
    """An image a worker, before `develop_gray` or `develop_rgb`."""
    shifts: wp.array2d[int]
    """Pixels down and to the right of each environment, see `fault_models.shift`."""
    num_channels: int
    """1 for gray and depth, 2 for chromaticities, 3 for colors."""
    newest: int
    """Index of the newest frame in an observation."""
    maximum: float
    """Depth that becomes 1, metres."""
    floor: float
    """See `ChromaticityPixels`."""
    mean: float
    """Subtracted from each number."""
    deviation: float
    """Each number is divided by it."""


@wp.struct
class Rollout:
    """Inputs and outputs of one launch; environment i writes rows i * num_steps + t."""

    camera: CameraView
    """Of `show_plain`."""
    cameras: wp.array[CameraView]
    """Of each image, for `show_any`."""
    poses: PoseArrays
    vectors: Vectors
    layers: Layers
    workspaces: wp.array2d[float]
    """Outputs of all layers for `TOGETHER` frames, one a worker."""
    num_steps: int
    begins: wp.array[int]
    """The first step t of each environment; `num_steps` to leave it as it is."""
    draws: wp.array2d[float]
    """Samples for actions, see `choose` and `squash`. Shape: (num_envs, steps * numbers)."""
    frames: Images
    """For `show_plain`, the memory of `observations` as gray frames, `num_frames` a row."""
    num_frames: int
    """Most frames of an image."""
    stacks: wp.array2d[int]
    """Of each image, index of its oldest frame, size and number of its frames."""
    observations: wp.array2d[float]
    """A row an observation: the frames of each image, oldest first, then vectors."""
    last_observations: wp.array2d[float]
    """Of each environment, before step 0."""
    next_frames: Images
    next_observations: wp.array2d[float]
    """Observations after the last steps of episodes and of environments, if they are kept."""
    logits: wp.array2d[float]
    actions: wp.array[int]
    numbers: wp.array2d[float]
    """Continuous actions."""
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


@wp.func_native("""
#pragma clang fp contract(off)
for (int y = 0; y < height; ++y) {
    const int from = wp::clamp(y - down, 0, height - 1) * width;
    float* to = target.data + first + y * width;
    for (int x = 0; x < width; ++x) {
        const int at = from + wp::clamp(x - right, 0, width - 1);
        to[x] = (source.data[at] - mean) / deviation;
    }
}""")
def develop_gray(
    source: wp.array[float],
    width: int,
    height: int,
    down: int,
    right: int,
    mean: float,
    deviation: float,
    target: wp.array[float],
    first: int,
) -> None:
    """Write a gray image to `target` from index `first` on, shifted and standardized."""
    ...


@wp.func_native("""
#pragma clang fp contract(off)
const int size = width * height;
for (int y = 0; y < height; ++y) {
    const int from = wp::clamp(y - down, 0, height - 1) * width;
    float* to = target.data + first + y * width;
    for (int x = 0; x < width; ++x) {
        const auto color = source.data[from + wp::clamp(x - right, 0, width - 1)];
        float red = color[0] / 255.0f, green = color[1] / 255.0f, blue = color[2] / 255.0f;
        if (channels == 2) {
            const float total = red + green + blue, third = total / 3.0f;
            red = (red - third) / (total + floor);
            blue = (blue - third) / (total + floor);
        } else {
            to[size + x] = (green - mean) / deviation;
        }
        to[x] = (red - mean) / deviation;
        to[(channels - 1) * size + x] = (blue - mean) / deviation;
    }
}""")
def develop_rgb(
    source: wp.array[wp.vec3ub],
    width: int,
    height: int,
    down: int,
    right: int,
    channels: int,
    floor: float,
    mean: float,
    deviation: float,
    target: wp.array[float],
    first: int,
) -> None:
    """Write the same of an image in color, or of its chromaticities if there are two channels."""
    ...


@wp.func_native("""
#pragma clang fp contract(off)
for (int y = 0; y < height; ++y) {
    const int from = wp::clamp(y - down, 0, height - 1) * width;
    float* to = target.data + first + y * width;
    for (int x = 0; x < width; ++x) {
        const int at = from + wp::clamp(x - right, 0, width - 1);
        const float along = nearest.data[at] * cosines.data[at];
        const bool is_far = owner.data[at] == none || along == 0.0f || along > maximum;
        to[x] = ((is_far ? maximum : along) / maximum - mean) / deviation;
    }
}""")
def develop_depth(
    nearest: wp.array[float],
    owner: wp.array[int],
    cosines: wp.array[float],
    none: int,
    width: int,
    height: int,
    down: int,
    right: int,
    maximum: float,
    mean: float,
    deviation: float,
    target: wp.array[float],
    first: int,
) -> None:
    """Write depth as a fraction of `maximum`, shifted and standardized, `none` for the sky."""
    ...


@wp.func
def show_plain(
    rollout: Rollout,
    frames: Images,
    observations: wp.array2d[float],
    env: int,
    row: int,
    worker: int,
) -> None:
    """Render gray without effects, and standardize: the newest frame of observation `row`.

    `frames` and `observations` are views of the same memory, see `Rollout`.
    """
    camera = rollout.camera
    newest = (row + 1) * rollout.num_frames - 1
    render_image(
        camera.view,
        0,
        camera.geoms,
        camera.poses,
        env,
        camera.materials,
        camera.scratch,
        worker,
        frames,
        newest,
    )
    frame = frames.gray[newest]
    standardise(frame, frame.shape[0], camera.mean, camera.deviation)


@wp.func
def show_any(
    rollout: Rollout,
    frames: Images,
    observations: wp.array2d[float],
    env: int,
    row: int,
    worker: int,
) -> None:
    """Do the same for all images, with all effects, mountings and transforms."""
    for i in range(rollout.cameras.shape[0]):
        show_image(rollout.cameras[i], observations[row], env, worker)


@wp.func
def show_image(camera: CameraView, target: wp.array[float], env: int, worker: int) -> None:
    """Write the newest frame of an image."""
    view = camera.view
    mounted = env % view.cameras.shape[0]
    first = camera.newest
    down = camera.shifts[env, 0]
    right = camera.shifts[env, 1]
    if view.what == DEPTH:
        job = start_job(view, camera.poses, camera.scratch, worker, mounted, env, worker)
        find_visible(job, camera.geoms, camera.poses)
        develop_depth(
            job.nearest,
            job.owner,
            job.cosines,
            NO_GEOM,
            view.width,
            view.height,
            down,
            right,
            camera.maximum,
            camera.mean,
            camera.deviation,
            target,
            first,
        )
        return
    if camera.has_effects:
        render_image_with_effects(
            view,
            mounted,
            camera.geoms,
            camera.poses,
            env,
            camera.materials,
            camera.scratch,
            worker,
            camera.rendered,
            worker,
            camera.effects,
        )
    else:
        render_image(
            view,
            mounted,
            camera.geoms,
            camera.poses,
            env,
            camera.materials,
            camera.scratch,
            worker,
            camera.rendered,
            worker,
        )
    if (view.what & RGB) != 0:
        develop_rgb(
            camera.rendered.rgb[worker],
            view.width,
            view.height,
            down,
            right,
            camera.num_channels,
            camera.floor,
            camera.mean,
            camera.deviation,
            target,
            first,
        )
    else:
        develop_gray(
            camera.rendered.gray[worker],
            view.width,
            view.height,
            down,
            right,
            camera.mean,
            camera.deviation,
            target,
            first,
        )


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
def squash(mean: float, log: float, draw: float) -> float:
    """Return a number of a continuous action from a standard normal sample; see `normal_of`."""
    share = 1.0 / (1.0 + wp.exp(-(log + SHIFT)))
    deviation = wp.exp(LEAST_LOG + (MOST_LOG - LEAST_LOG) * share)
    number = MOST_MEAN * wp.tanh(mean / MOST_MEAN) + deviation * draw
    return wp.clamp(wp.tanh(number), -MAX_ACTION, MAX_ACTION)


@wp.func
def decide_move(
    rollout: Rollout, outputs: wp.array[float], at: int, env: int, step: int, row: int
) -> int:
    """Choose a discrete action from outputs of the network that begin at `at`, and record it."""
    action = choose(outputs, at, rollout.logits.shape[1], rollout.draws[env, step])
    rollout.actions[row] = action
    return action


@wp.func
def decide_numbers(  # noqa: ANN201 (an array)
    rollout: Rollout, outputs: wp.array[float], at: int, env: int, step: int, row: int
):
    """Sample a continuous action; see `decide_move`."""
    numbers = rollout.numbers[row]
    count = numbers.shape[0]
    for i in range(count):
        draw = rollout.draws[env, step * count + i]
        numbers[i] = squash(outputs[at + i], outputs[at + count + i], draw)
    return numbers


@wp.func
def keep_frames(rollout: Rollout, before: wp.array[float], after: wp.array[float]) -> None:
    """Write the earlier frames of an observation, given the one before."""
    for i in range(rollout.stacks.shape[0]):
        first, size, count = rollout.stacks[i, 0], rollout.stacks[i, 1], rollout.stacks[i, 2]
        copy(before, first + size, after, first, (count - 1) * size)


@wp.func
def stack(rollout: Rollout, env: int, step: int, row: int, is_start: bool) -> None:
    """Write the earlier frames of an observation; at an episode's start all are the newest."""
    seen = rollout.observations[row]
    if is_start:
        for i in range(rollout.stacks.shape[0]):
            first, size, count = rollout.stacks[i, 0], rollout.stacks[i, 1], rollout.stacks[i, 2]
            for frame in range(count - 1):
                copy(seen, first + (count - 1) * size, seen, first + frame * size, size)
    elif step == 0:
        keep_frames(rollout, rollout.last_observations[env], seen)
    else:
        keep_frames(rollout, rollout.observations[row - 1], seen)


@functools.cache
def make_kernel(  # noqa: C901 (functions that Warp compiles)
    states: Any,
    place: Any,
    move: Any,
    decide: Any,
    show: Any,
    measure: Any = measure_nothing,
    *,
    looks_ahead: bool = False,
) -> Any:
    """Return the kernel for the rules of a task; see `drone_rl.sim.tasks.fused.fused_rules`.

    Args:
        states: Warp structure of the environments, with "steps" and "end_reasons".
        place: Writes the poses that are rendered: (states, env, poses).
        move: Steps an environment: (states, env, action). Returns the reward.
        decide: `decide_move` or `decide_numbers`.
        show: `show_plain` or `show_any`.
        measure: `measure` or `measure_nothing` of `vectors_kernel`.
        looks_ahead: Whether to write `Rollout.next_observations`.
    """

    @wp.func
    def is_running(rollout: Rollout, envs: states, env: int, step: int) -> bool:
        """Return whether an environment takes the launch's step number `step`."""
        return envs.end_reasons[env] == 0 and rollout.begins[env] + step < rollout.num_steps

    @wp.func
    def observe(
        first: int, last: int, step: int, worker: int, rollout: Rollout, envs: states
    ) -> int:
        """Observe running environments, compute the features; return how many are running."""
        running = int(0)
        for env in range(first, last):
            if is_running(rollout, envs, env, step):
                now = rollout.begins[env] + step
                row = env * rollout.num_steps + now
                place(envs, env, rollout.poses)
                show(rollout, rollout.frames, rollout.observations, env, row, worker)
                if rollout.num_frames > 1:
                    stack(rollout, env, now, row, envs.steps[env] == 0)
                seen = rollout.observations[row]
                measure(rollout.vectors, envs, env, seen)
                run_branches(rollout.layers, seen, rollout.workspaces[worker], running)
                running += 1
        return running

    @wp.func
    def look_ahead(rollout: Rollout, env: int, row: int, worker: int, envs: states) -> None:
        """Observe an environment after its last step."""
        place(envs, env, rollout.poses)
        show(rollout, rollout.next_frames, rollout.next_observations, env, row, worker)
        seen = rollout.next_observations[row]
        measure(rollout.vectors, envs, env, seen)
        keep_frames(rollout, rollout.observations[row], seen)

    @wp.func
    def look_nowhere(rollout: Rollout, env: int, row: int, worker: int, envs: states) -> None:
        return

    conclude = look_ahead if looks_ahead else look_nowhere

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
            if is_running(rollout, envs, env, step):
                now = rollout.begins[env] + step
                row = env * rollout.num_steps + now
                at = running * size + logits_offset
                for i in range(num_actions):
                    rollout.logits[row, i] = workspace[at + i]
                action = decide(rollout, workspace, at, env, now, row)
                rollout.rewards[row] = move(envs, env, action)
                rollout.end_reasons[row] = envs.end_reasons[env]
                if rollout.outputs.shape[0] > 0:
                    copy(workspace, running * size, rollout.outputs[row], 0, size)
                if envs.end_reasons[env] != 0 or now + 1 == rollout.num_steps:
                    conclude(rollout, env, row, worker, envs)
                running += 1

    @wp.kernel(module="unique", module_options=_OPTIONS)
    def run_episodes(first: int, last: int, worker: int, rollout: Rollout, envs: states) -> None:
        """Run environments `first` to `last` - 1 until their episodes end, or all steps are taken.

        `worker` selects the buffers: launch with a dimension of 1.
        """
        for group in range(first, last, TOGETHER):
            end = wp.min(group + TOGETHER, last)
            step = int(0)
            running = int(1)
            while running > 0:
                running = observe(group, end, step, worker, rollout, envs)
                run_trunk(rollout.layers, rollout.workspaces[worker], 0, running)
                act(group, end, step, worker, rollout, envs)
                step += 1

    return run_episodes
