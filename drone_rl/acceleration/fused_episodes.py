"""Runs complete episodes in one fused kernel, without Python between their steps.

Stepping in Python takes most of the time: a small network is evaluated on a frame in ten
microseconds, and a frame is rendered in as many.
"""

from collections.abc import Iterable, Mapping
from typing import Any, Self

import torch
import warp as wp
from torch import Tensor
from torchrl.envs import CatFrames, Transform
from torchrl.envs.utils import ExplorationType

from drone_rl.acceleration import rollout_kernel
from drone_rl.acceleration.fused_network import ActivationRecorder
from drone_rl.acceleration.packed_layers import PackedNetwork, Reasons, unsupported
from drone_rl.envs import DroneEnv, Observer
from drone_rl.envs.drone_env import Entries
from drone_rl.envs.transforms import CropRows, StandardizePixels
from drone_rl.policies.actor import CategoricalActor
from drone_rl.policies.networks import require_finite
from drone_rl.sim.rendering.devices import WorkerPool, load_kernels
from drone_rl.sim.rendering.raytrace.renderer import Raytracer
from drone_rl.sim.rendering.raytrace.structs_kernel import Images
from drone_rl.sim.tasks import State
from drone_rl.sim.tasks.fused import fused_rules

EPISODE, REWARD = ("collector", "traj_ids"), ("next", "reward")
END_REASON, PAID = ("next", "info", "end_reason"), ("next", "info", "paid")
"""`PAID` are sums of the reward's terms, in the last step of an episode; 0 in others."""
_MAX_STEPS = 64
"""Steps of one launch of the kernel; most episodes end within them."""
_MAX_PIXELS = 2**23
"""Maximum number of pixels of all frames of one launch."""
_MAX_ACTIVATIONS = 2**24
"""Maximum number of recorded activations: 64 MiB."""


class FusedEpisodes:
    """Run complete episodes; renderer, network and task run in one kernel.

    The kernel steps a copy of the environments: their own state stays that of the reset.
    """

    def __init__(
        self,
        env: DroneEnv,
        actor: CategoricalActor,
        keeps_inputs: bool,
        network: PackedNetwork,
        rules: Any,
        num_threads: int,
    ) -> None:
        """Build the kernel; see `try_create`."""
        self._env, self._actor, self._keeps_inputs = env, actor, keeps_inputs
        self._network, self._rules = network, rules
        worlds, view = env.worlds, env.observer.image.view
        count = worlds.num_envs
        self._workers = WorkerPool(count, num_threads)
        raytracer: Any = worlds.renderer
        camera: Any = rollout_kernel.CameraView()
        inputs = raytracer.kernel_inputs(view, self._workers.size)
        camera.view, camera.geoms, camera.materials, camera.scratch = inputs
        camera.poses = rules.poses
        camera.mean, camera.deviation = _mean_and_deviation(env.observer)
        self._camera = camera
        self._visible, self._num_frames = _visible_lines(env.observer), _num_frames(env.observer)
        size = network.offsets.outputs[-1]
        shape = (self._workers.size, int(rollout_kernel.TOGETHER) * size)
        self._workspaces = wp.empty(shape, dtype=float, device="cpu")
        size_of_frames = self._num_frames * view.height * view.width
        self._length = max(1, min(_MAX_STEPS, _MAX_PIXELS // (count * size_of_frames)))
        self._num_rows = rows = count * self._length
        num_actions = worlds.dynamics.actions.num_outputs
        self._buffer = RolloutBuffer(
            {
                "pixels": torch.empty(rows, self._num_frames, view.height, view.width),
                "logits": torch.empty(rows, num_actions),
                "action": torch.empty(rows, dtype=torch.int32),
                "reward": torch.empty(rows),
                "end_reason": torch.empty(rows, dtype=torch.int32),
            }
        )
        self._last_observations = torch.empty(count if self._num_frames > 1 else 0, size_of_frames)
        launches = _MAX_ACTIVATIONS // (rows * size)
        self.activations = ActivationRecorder(launches * rows, size)
        """Of the last batch, for a `FusedNetwork` that learns from it."""
        self._owner = getattr(self._actor.network, "owner", "the policy")
        self._kernel = rollout_kernel.make_kernel(*rules.functions)
        load_kernels(self._kernel.module)

    @classmethod
    def try_create(
        cls, env: DroneEnv, actor: Any, keeps_inputs: bool, num_threads: int
    ) -> Self | Reasons:
        """Return the kernel for an actor, or the reasons why it is not supported.

        Args:
            env: The environments.
            actor: The policy.
            keeps_inputs: Whether batches have what the actor reads and writes.
            num_threads: Threads of the kernel; no result depends on it.
        """
        reasons = [*_not_fused(env), *_not_fused_policy(env, actor)]
        worlds = env.worlds
        rules = fused_rules(worlds.task, worlds.dynamics, worlds.state)
        if rules is None:
            names = f"{type(worlds.task).__name__} with {type(worlds.dynamics).__name__}"
            reasons.append(f"task {names} is not fused")
        if reasons or rules is None:
            return Reasons(reasons)
        lines, view = _visible_lines(env.observer), env.observer.image.view
        hidden = view.height - (lines.stop - lines.start)
        network = PackedNetwork(actor.network, lines.start * view.width, hidden * view.width)
        return cls(env, actor, keeps_inputs, network, rules, num_threads)

    def run(self, started: State) -> Entries | None:
        """Run episodes to their ends, from states of k environments at their starts.

        Returns:
            The steps, one episode after the other: `EPISODE`, 0 to k - 1, `REWARD`, `END_REASON`,
            `PAID` of several terms, the action, and what the actor reads and writes if it is
            kept, (T_total, *). None if actions are chosen otherwise than by sampling or greedily.
        """
        if self._actor.exploration not in (ExplorationType.RANDOM, ExplorationType.DETERMINISTIC):
            return None
        load_kernels(self._kernel.module).result()
        self._rules.begin(started)
        self.activations.recording = None
        self._network.pack()
        count, names = len(started), ["action", "reward", "end_reason"]
        if self._keeps_inputs:
            names += ["pixels", "logits"]
        taken, end_reasons = self._rules.steps[:count], self._rules.end_reasons[:count]
        parts: list[tuple[Tensor, Tensor]] = []
        while not bool(end_reasons.all()):
            before, first = taken.clone(), len(parts) * self._num_rows
            logits = self._launch(count, len(parts), names)
            is_step = torch.arange(self._length) < (taken - before)[:, None]
            envs, times = is_step.nonzero(as_tuple=True)
            rows = envs * self._length + times
            require_finite(logits[rows], self._owner)
            parts.append((envs, first + rows))
        envs, rows = (torch.cat(column) for column in zip(*parts, strict=True))
        order = envs.argsort(stable=True)
        envs, rows = envs[order], rows[order]
        terms, paid = {}, self._rules.paid(count)
        if paid.shape[1] > 1:
            terms[PAID] = paid.new_zeros(len(envs), paid.shape[1])
            terms[PAID][envs.bincount().cumsum(0) - 1] = paid
        logged = self._buffer.read(rows, names)
        if self._keeps_inputs:
            if self._visible != slice(0, self._env.observer.image.view.height):
                logged["pixels"] = logged["pixels"][..., self._visible, :].contiguous()
            self.activations.record(rows, self._network.weights, logged["pixels"])
        return {
            EPISODE: envs,
            REWARD: logged.pop("reward"),
            END_REASON: logged.pop("end_reason").long(),
            **terms,
            **logged,
            "action": logged["action"].long(),
        }

    def close(self) -> None:
        """End the threads."""
        self._workers.close()

    def _launch(self, num_envs: int, part: int, kept: Iterable[str]) -> Tensor:
        """Run up to `_length` steps; return the logits. `kept` are kept beyond the next launch."""
        draws = torch.full((num_envs, self._length), -1.0)  # the most probable action
        if self._actor.exploration == ExplorationType.RANDOM:
            source: Any = self._actor.generator
            draws.uniform_(generator=source)
        opened, frames = self._buffer.open(part, kept), Images()
        pixels = opened["pixels"]
        gray: Any = wp.from_torch(pixels.flatten(2).flatten(0, 1))
        frames.gray = gray
        rollout: Any = rollout_kernel.Rollout()
        rollout.camera, rollout.layers = self._camera, self._network.arrays
        rollout.workspaces, rollout.draws = self._workspaces, wp.from_torch(draws)
        rollout.frames, rollout.num_frames = frames, self._num_frames
        rollout.observations = wp.from_torch(pixels.flatten(1))
        rollout.last_observations = wp.from_torch(self._last_observations)
        rollout.logits = wp.from_torch(opened["logits"])
        rollout.actions = wp.from_torch(opened["action"])
        rollout.rewards = wp.from_torch(opened["reward"])
        rollout.end_reasons = wp.from_torch(opened["end_reason"])
        first, last = part * self._num_rows, (part + 1) * self._num_rows
        rollout.outputs = wp.from_torch(self.activations.outputs[first:last])

        def run_span(member: int, first: int, last: int) -> None:
            inputs = [first, last, member, rollout, self._rules.arrays]
            wp.launch(self._kernel, 1, inputs=inputs, device="cpu")

        self._workers.map_spans(0, num_envs, run_span)
        if len(self._last_observations):
            last_rows = pixels[self._length - 1 :: self._length][:num_envs]
            self._last_observations[:num_envs] = last_rows.flatten(1)
        return opened["logits"]


def _mean_and_deviation(observer: Observer) -> tuple[float, float]:
    """Return what the kernel subtracts from gray pixels, and then divides them by."""
    for transform in observer.image.pipeline.transforms:
        if type(transform) is StandardizePixels:
            return transform.values.mean, transform.values.std
    return 0.0, 1.0


def _visible_lines(observer: Observer) -> slice:
    """Return the rows of rendered frames that the policy sees."""
    for transform in observer.image.pipeline.transforms:
        if type(transform) is CropRows:
            return slice(transform.values.top, transform.values.bottom)
    return slice(0, observer.image.view.height)


def _num_frames(observer: Observer) -> int:
    """Return the number of frames of an observation."""
    return observer.image.pipeline.earlier + 1


def _is_fusable(transform: Transform) -> bool:
    """Return whether the kernel has a transform."""
    if type(transform) is CatFrames:
        return (transform.dim, transform.padding) == (-3, "same")
    return type(transform) in (CropRows, StandardizePixels)


def _not_fused(env: DroneEnv) -> list[str]:
    """Return reasons against fusing the renderer, the appearance or the transforms."""
    worlds, reasons = env.worlds, []
    if type(worlds.renderer) is not Raytracer or worlds.renderer.device.type != "cpu":
        device = worlds.state.end_reason.device.type
        reasons.append(f"renderer {type(worlds.renderer).__name__} on {device} is not fused")
    if type(env) is not DroneEnv:
        reasons.append(f"environment {type(env).__name__} is not fused")
    if not env.observer.sees_pixels:
        return [*reasons, f"inputs {', '.join(env.observer.sources)} are not fused"]
    if env.observer.image.view.modalities != ("gray",):
        reasons.append("frames that are not gray are not fused")
    fused = set[type]()
    for transform in env.observer.image.pipeline.transforms:
        kind = type(transform)
        if kind in fused or not _is_fusable(transform):
            reasons.append(f"transform {kind.__name__} is not fused")
        fused.add(kind)
    if worlds.appearance is not None:
        reasons.append("visual randomization is not fused")
    return reasons


def _not_fused_policy(env: DroneEnv, actor: Any) -> list[str]:
    """Return reasons against fusing the actor."""
    if type(actor) is not CategoricalActor:
        return [f"policy {type(actor).__name__} is not fused"]
    network = actor.network
    if reasons := unsupported(network):
        return reasons
    if not env.observer.sees_pixels:
        return []  # see `_not_fused`
    rows, num_actions = _visible_lines(env.observer), env.worlds.dynamics.actions.num_outputs
    shape = (_num_frames(env.observer), rows.stop - rows.start, env.observer.image.view.width)
    if (network.in_shape, network.num_actions) != (shape, num_actions):
        return [
            f"a network from {network.in_shape} to {network.num_actions} outputs is not fused "
            f"with frames of {shape} and {num_actions} outputs"
        ]
    return []


class RolloutBuffer:
    """Memory for the steps of episodes, in as many parts as the longest episode needs."""

    def __init__(self, part: Mapping[str, Tensor]) -> None:
        self._arrays = dict(part)
        self._num_rows = len(next(iter(self._arrays.values())))

    def open(self, part: int, kept: Iterable[str]) -> dict[str, Tensor]:
        """Return memory of a part, to be written. Shapes: (num_rows, *).

        Entries in `kept` follow those of earlier parts; others overwrite those of the first.
        """
        first, last = part * self._num_rows, (part + 1) * self._num_rows
        opened = {name: array[: self._num_rows] for name, array in self._arrays.items()}
        for name in kept:
            array = self._arrays[name]
            if len(array) < last:
                wider = self._arrays[name] = array.new_empty(2 * last, *array.shape[1:])
                wider[:first] = array[:first]
            opened[name] = self._arrays[name][first:last]
        return opened

    def read(self, rows: Tensor, names: Iterable[str]) -> dict[str, Tensor]:
        """Return copies of rows (k,), counted from the first part's, of the named entries."""
        return {name: self._arrays[name].index_select(0, rows) for name in names}
