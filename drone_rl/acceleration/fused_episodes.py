"""Runs complete episodes in one fused kernel, without Python between their steps.

Stepping in Python takes most of the time: a small network is evaluated on a frame in ten
microseconds, and a frame is rendered in as many.
"""

from collections.abc import Iterable, Mapping
from typing import Any, Self

import torch
import warp as wp
from torch import Tensor
from torchrl.envs import CatFrames
from torchrl.envs.utils import ExplorationType

from drone_rl.acceleration import rollout_kernel
from drone_rl.acceleration.fused_network import ActivationRecorder
from drone_rl.acceleration.packed_layers import PackedNetwork, Reasons, unsupported
from drone_rl.envs import DroneEnv, Observer
from drone_rl.envs.camera_faults import Shift
from drone_rl.envs.drone_env import Entries
from drone_rl.envs.transforms import (
    ChromaticityPixels,
    CropRows,
    GrayPixels,
    RgbPixels,
    StandardizePixels,
)
from drone_rl.policies.actor import CategoricalActor, SquashedActor
from drone_rl.policies.networks import require_finite
from drone_rl.sim.rendering.devices import WorkerPool, load_kernels
from drone_rl.sim.rendering.raytrace.renderer import Raytracer, as_images, make_scratch
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
        actor: CategoricalActor | SquashedActor,
        keeps_inputs: bool,
        network: PackedNetwork,
        rules: Any,
        num_threads: int,
        num_steps: int | None = None,
    ) -> None:
        """Build the kernel; see `try_create`.

        A launch has `num_steps`, and observations after the last ones, or as many as fit.
        """
        self._env, self._actor, self._keeps_inputs = env, actor, keeps_inputs
        self._network, self._rules = network, rules
        worlds, view = env.worlds, env.observer.image.view
        count = worlds.num_envs
        self._workers = WorkerPool(count, num_threads)
        transforms = self._transforms = Transforms(env.observer)
        self._camera: Any = rollout_kernel.CameraView()
        transforms.write(self._camera, count, self._workers.size)
        scratch = (view.height * view.width, len(worlds.scene.shown(view.show_drone)))
        self._camera.scratch = make_scratch(self._workers.size, *scratch)
        self._visible, self._num_frames = transforms.visible, transforms.num_frames
        size = network.offsets.outputs[-1]
        shape = (self._workers.size, int(rollout_kernel.TOGETHER) * size)
        self._workspaces = wp.empty(shape, dtype=float, device="cpu")
        channels = transforms.num_frames * transforms.num_channels
        size_of_frames = channels * view.height * view.width
        fitting = max(1, min(_MAX_STEPS, _MAX_PIXELS // (count * size_of_frames)))
        self._length = fitting if num_steps is None else num_steps
        self._num_rows = rows = count * self._length
        actions = worlds.dynamics.actions
        self._is_continuous = _is_continuous(env)
        kind = torch.float32 if self._is_continuous else torch.int32
        self._num_draws = max(1, sum(actions.entry.shape))
        self._buffer = RolloutBuffer(
            {
                "pixels": torch.empty(rows, channels, view.height, view.width),
                "logits": torch.empty(rows, actions.num_outputs),
                "action": torch.empty(rows, *actions.entry.shape, dtype=kind),
                "reward": torch.empty(rows),
                "end_reason": torch.empty(rows, dtype=torch.int32),
            }
        )
        self.last_observations = torch.empty(count if self._num_frames > 1 else 0, size_of_frames)
        launches = _MAX_ACTIVATIONS // (rows * size)
        """Of each environment, if observations have several frames."""
        self.activations = ActivationRecorder(launches * rows, size)
        """Of the last batch, for a `FusedNetwork` that learns from it."""
        self._owner = getattr(self._actor.network, "owner", "the policy")
        is_plain = transforms.is_plain and env.appearances.middle is None
        self._kernel = rollout_kernel.make_kernel(
            *rules.functions,
            rollout_kernel.decide_numbers if self._is_continuous else rollout_kernel.decide_move,
            rollout_kernel.show_plain if is_plain else rollout_kernel.show_any,
            looks_ahead=num_steps is not None,
        )
        load_kernels(self._kernel.module)

    @classmethod
    def try_create(
        cls,
        env: DroneEnv,
        actor: Any,
        keeps_inputs: bool,
        num_threads: int,
        num_steps: int | None = None,
    ) -> Self | Reasons:
        """Return the kernel for an actor, or the reasons why it is not supported.

        Args:
            env: The environments.
            actor: The policy.
            keeps_inputs: Whether batches have what the actor reads and writes.
            num_threads: Threads of the kernel; no result depends on it.
            num_steps: Of each environment in a batch, of `FusedRollouts`.
        """
        reasons = [*_not_fused(env), *_not_fused_policy(env, actor)]
        worlds = env.worlds
        rules = fused_rules(worlds.task, worlds.dynamics, worlds.state)
        if isinstance(rules, str):
            return Reasons([rules, *reasons])
        if reasons:
            return Reasons(reasons)
        lines, view = Transforms(env.observer).visible, env.observer.image.view
        hidden = view.height - (lines.stop - lines.start)
        network = PackedNetwork(actor.network, lines.start * view.width, hidden * view.width)
        return cls(env, actor, keeps_inputs, network, rules, num_threads, num_steps)

    def run(self, started: State) -> Entries | None:
        """Run episodes to their ends, from states of k environments at their starts.

        Returns:
            The steps, one episode after the other: `EPISODE`, 0 to k - 1, `REWARD`, `END_REASON`,
            `PAID` of several terms, the action, and what the actor reads and writes if it is
            kept, (T_total, *). None if actions are chosen otherwise than by sampling or greedily.
        """
        if not self.can_act:
            return None
        self._prepare(started)
        self._transforms.begin(torch.arange(len(started)))
        self.activations.recording = None
        count, names = len(started), ["action", "reward", "end_reason"]
        if self._keeps_inputs:
            names += ["pixels", "logits"]
        taken, end_reasons = self._rules.steps[:count], self._rules.end_reasons[:count]
        parts: list[tuple[Tensor, Tensor]] = []
        while not bool(end_reasons.all()):
            before, first = taken.clone(), len(parts) * self._num_rows
            rollout, opened = self._open(count, len(parts), names)
            self._launch(rollout, count)
            if self._num_frames > 1:
                last_rows = opened["pixels"][self._length - 1 :: self._length][:count]
                self.last_observations[:count] = last_rows.flatten(1)
            is_step = torch.arange(self._length) < (taken - before)[:, None]
            envs, times = is_step.nonzero(as_tuple=True)
            rows = envs * self._length + times
            require_finite(opened["logits"][rows], self._owner)
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
            logged["pixels"] = self._seen(logged["pixels"])
            self.activations.record(rows, self._network.weights, logged["pixels"])
        return {
            EPISODE: envs,
            REWARD: logged.pop("reward"),
            END_REASON: logged.pop("end_reason").long(),
            **terms,
            **logged,
            "action": logged["action"] if self._is_continuous else logged["action"].long(),
        }

    @property
    def can_act(self) -> bool:
        """Whether actions are now chosen by sampling or greedily."""
        return self._actor.exploration in (ExplorationType.RANDOM, ExplorationType.DETERMINISTIC)

    def _prepare(self, state: State) -> None:
        """Take the states of the first environments, their appearance and the weights."""
        load_kernels(self._kernel.module).result()
        self._rules.begin(state)
        self._look(state)
        self._network.pack()
        rollout: Any = rollout_kernel.Rollout()
        rollout.camera, rollout.layers = self._camera, self._network.arrays
        rollout.workspaces, rollout.num_frames = self._workspaces, self._num_frames
        rollout.last_observations = wp.from_torch(self.last_observations)
        rollout.num_steps = self._length
        self._rollout = rollout

    def _seen(self, pixels: Tensor) -> Tensor:
        """Return the rows of frames that the policy sees."""
        if self._visible == slice(0, self._env.observer.image.view.height):
            return pixels
        return pixels[..., self._visible, :].contiguous()

    def _look(self, started: State) -> None:
        """Encode the appearance and the poses of the first environments."""
        env, camera = self._env, self._camera
        worlds = env.worlds
        look = worlds.combine(env.appearances.current(torch.arange(len(started))))
        raytracer: Any = worlds.renderer
        launch = raytracer.encode(env.observer.image.view, worlds.poses(started, look), look)
        camera.view, camera.geoms, camera.poses = launch.view, launch.geoms, launch.poses
        camera.materials, camera.has_effects = launch.materials, launch.effects is not None
        if launch.effects is not None:
            camera.effects = launch.effects

    def close(self) -> None:
        """End the threads."""
        self._workers.close()

    def _open(self, num_envs: int, part: int, kept: Iterable[str]) -> tuple[Any, dict[str, Tensor]]:
        """Return a launch of up to `_length` steps, and what it writes.

        `kept` are kept beyond the next launch.
        """
        greedy = 0.0 if self._is_continuous else -1.0  # the most probable action
        draws = torch.full((num_envs, self._length * self._num_draws), greedy)
        if self._actor.exploration == ExplorationType.RANDOM:
            source: Any = self._actor.generator
            sample = draws.normal_ if self._is_continuous else draws.uniform_
            sample(generator=source)
        opened, frames = self._buffer.open(part, kept), Images()
        pixels = opened["pixels"]
        gray: Any = wp.from_torch(pixels.flatten(2).flatten(0, 1))
        frames.gray = gray
        rollout = self._rollout
        rollout.draws, rollout.frames = wp.from_torch(draws), frames
        rollout.observations = wp.from_torch(pixels.flatten(1))
        rollout.begins = wp.zeros(num_envs, dtype=int, device="cpu")
        rollout.logits = wp.from_torch(opened["logits"])
        if self._is_continuous:
            rollout.numbers = wp.from_torch(opened["action"])
        else:
            rollout.actions = wp.from_torch(opened["action"])
        rollout.rewards = wp.from_torch(opened["reward"])
        rollout.end_reasons = wp.from_torch(opened["end_reason"])
        first, last = part * self._num_rows, (part + 1) * self._num_rows
        rollout.outputs = wp.from_torch(self.activations.outputs[first:last])
        return rollout, opened

    def _launch(self, rollout: Any, num_envs: int) -> None:
        """Run the kernel."""

        def run_span(member: int, first: int, last: int) -> None:
            inputs = [first, last, member, rollout, self._rules.arrays]
            wp.launch(self._kernel, 1, inputs=inputs, device="cpu")

        self._workers.map_spans(0, num_envs, run_span)


def _is_continuous(env: DroneEnv) -> bool:
    """Return whether actions are numbers instead of indices."""
    return env.worlds.dynamics.actions.entry.dtype.is_floating_point


_AFTER: dict[type, tuple[type, ...]] = {
    CropRows: (),
    StandardizePixels: (),
    CatFrames: (),
    Shift: (CropRows,),
    ChromaticityPixels: (StandardizePixels, CatFrames),
}
"""Transforms that the kernel has, each with those that it can't follow."""


class Transforms:
    """The transforms of an observer for the kernel; see `unfused_transforms`."""

    def __init__(self, observer: Observer) -> None:
        """Read the settings of the transforms."""
        self._view, self._pipeline = observer.image.view, observer.image.pipeline
        self._by_type = {
            type(transform): transform for transform in observer.image.pipeline.transforms
        }
        is_rgb = observer.image.view.modalities == ("rgb",)
        self.num_channels = 1 + is_rgb + (is_rgb and ChromaticityPixels not in self._by_type)
        """Of a frame."""
        self.num_frames = observer.image.pipeline.earlier + 1
        """Of an observation."""
        crop: Any = self._by_type.get(CropRows)
        self.visible = slice(0, self._view.height)
        """Rows of rendered frames that the policy sees."""
        if crop is not None:
            self.visible = slice(crop.values.top, crop.values.bottom)
        self.is_plain = not is_rgb and Shift not in self._by_type
        """Whether `show_plain` has them."""
        self._shifts = torch.zeros(0, 2, dtype=torch.int32)

    def write(self, camera: Any, num_envs: int, num_workers: int) -> None:
        """Write what does not change to a `CameraView`."""
        given, view = self._by_type, self._view
        scale: Any = given.get(StandardizePixels)
        camera.mean, camera.deviation = (scale.values.mean, scale.values.std) if scale else (0, 1)
        chromaticity: Any = given.get(ChromaticityPixels)
        camera.floor = chromaticity.values.floor if chromaticity else 0.0
        camera.num_channels = self.num_channels
        self._shifts = torch.zeros(num_envs, 2, dtype=torch.int32)
        camera.shifts = wp.from_torch(self._shifts)
        camera.rendered = as_images(view.new_images(num_workers))

    def begin(self, rows: Tensor) -> None:
        """Sample the shifts of environments, (k,), whose episodes start, as `Observer` does."""
        shift: Any = self._by_type.get(Shift)
        for stage in self._pipeline.stages:
            if shift is not None and stage.model is shift.model:
                if len(rows):
                    stage(torch.zeros(len(rows), 1, 1, 1), rows, True)
                assert stage.memory is not None
                self._shifts[: len(stage.memory)] = stage.memory.int()


def unfused_transforms(observer: Observer) -> list[str]:
    """Return reasons against fusing the transforms."""
    first = next(map(type, observer.image.transforms), None)
    if first not in (GrayPixels, RgbPixels) or observer.image.faults.stages:
        return ["frames that are neither gray nor rgb are not fused"]
    reasons, before = list[str](), set[type]()
    for transform in observer.image.pipeline.transforms:
        kind: Any = type(transform)
        is_known = kind in _AFTER and not before & {kind, *_AFTER[kind]}
        if kind is CatFrames:
            is_known &= (transform.dim, transform.padding) == (-3, "same")
        if not is_known:
            reasons.append(f"transform {kind.__name__} is not fused")
        before.add(kind)
    return reasons


def _not_fused(env: DroneEnv) -> list[str]:
    """Return reasons against fusing the renderer or the transforms."""
    worlds, reasons = env.worlds, []
    if type(worlds.renderer) is not Raytracer or worlds.renderer.device.type != "cpu":
        device = worlds.state.end_reason.device.type
        reasons.append(f"renderer {type(worlds.renderer).__name__} on {device} is not fused")
    if type(env) is not DroneEnv:
        reasons.append(f"environment {type(env).__name__} is not fused")
    if not env.observer.sees_pixels:
        return [*reasons, f"inputs {', '.join(env.observer.sources)} are not fused"]
    return [*reasons, *unfused_transforms(env.observer)]


def _not_fused_policy(env: DroneEnv, actor: Any) -> list[str]:
    """Return reasons against fusing the actor."""
    if type(actor) is not (SquashedActor if _is_continuous(env) else CategoricalActor):
        return [f"policy {type(actor).__name__} is not fused"]
    network = actor.network
    if reasons := unsupported(network):
        return reasons
    if not env.observer.sees_pixels:
        return []  # see `_not_fused`
    transforms, num_actions = Transforms(env.observer), env.worlds.dynamics.actions.num_outputs
    rows, channels = transforms.visible, transforms.num_frames * transforms.num_channels
    shape = (channels, rows.stop - rows.start, env.observer.image.view.width)
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
