"""Runs complete episodes in one fused kernel, without Python between their steps.

Stepping in Python takes most of the time: a small network is evaluated on a frame in ten
microseconds, and a frame is rendered in as many.
"""

import sys
from collections.abc import Iterable, Mapping
from typing import Any, Self

import numpy as np
import torch
import warp as wp
from torch import Tensor
from torchrl.envs.utils import ExplorationType

from drone_rl.acceleration import rollout_kernel, vectors_kernel
from drone_rl.acceleration.fused_inputs import FusedInputs, unfused_inputs
from drone_rl.acceleration.fused_network import ActivationRecorder
from drone_rl.acceleration.packed_layers import PackedNetwork, Reasons, unsupported
from drone_rl.envs import DroneEnv
from drone_rl.envs.drone_env import Entries
from drone_rl.policies.actor import CategoricalActor, SquashedActor
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
_MAX_NUMBERS = 2**23
"""Maximum number of pixels and other numbers that policies see in one launch."""
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
        worlds = env.worlds
        count = worlds.num_envs
        self._workers = WorkerPool(count, num_threads)
        inputs = self._inputs = FusedInputs(env.observer)
        self._rollout: Any = rollout_kernel.Rollout()
        geoms = len(worlds.scene.shown(env.observer.image.view.show_drone))
        inputs.write(self._rollout, count, self._workers.size, geoms)
        size = network.offsets.outputs[-1]
        shape = (self._workers.size, int(rollout_kernel.TOGETHER) * size)
        self._rollout.workspaces = wp.empty(shape, dtype=float, device="cpu")
        self._rollout.layers = network.arrays
        fitting = max(1, min(_MAX_STEPS, _MAX_NUMBERS // (count * inputs.size)))
        self._length = fitting if num_steps is None else num_steps
        self._num_rows = rows = count * self._length
        actions = worlds.dynamics.actions
        self._is_continuous = _is_continuous(env)
        self._begins = wp.zeros(count, dtype=int, device="cpu")
        self._num_shown = 0
        """Environments whose appearance and poses the kernel has."""
        kind = torch.float32 if self._is_continuous else torch.int32
        self._num_draws = max(1, sum(actions.entry.shape))
        self._buffer = RolloutBuffer(
            {
                "observations": torch.empty(rows, inputs.size),
                "logits": torch.empty(rows, actions.num_outputs),
                "action": torch.empty(rows, *actions.entry.shape, dtype=kind),
                "reward": torch.empty(rows),
                "end_reason": torch.empty(rows, dtype=torch.int32),
            }
        )
        self.last_observations = torch.empty(count if inputs.num_frames > 1 else 0, inputs.size)
        """Of each environment, if images have several frames."""
        self._rollout.last_observations = wp.from_torch(self.last_observations)
        self._rollout.num_steps = self._length
        launches = _MAX_ACTIVATIONS // (rows * size)
        self.activations = ActivationRecorder(launches * rows, size)
        """Of the last batch, for a `FusedNetwork` that learns from it."""
        self._owner = getattr(self._actor.network, "owner", "the policy")
        inputs.is_plain &= env.appearances.middle is None
        self._kernel = rollout_kernel.make_kernel(
            *rules.functions,
            rollout_kernel.decide_numbers if self._is_continuous else rollout_kernel.decide_move,
            rollout_kernel.show_plain if inputs.is_plain else rollout_kernel.show_any,
            vectors_kernel.measure if inputs.has_vectors else vectors_kernel.measure_nothing,
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
        network = PackedNetwork(actor.network, FusedInputs(env.observer).places)
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
        self._inputs.begin(torch.arange(len(started)))
        self.activations.recording = None
        count, names = len(started), ["action", "reward", "end_reason"]
        if self._keeps_inputs:
            names += ["observations", "logits"]
        taken, end_reasons = self._rules.steps[:count], self._rules.end_reasons[:count]
        parts: list[tuple[Tensor, Tensor]] = []
        while not bool(end_reasons.all()):
            before, first = taken.clone(), len(parts) * self._num_rows
            rollout, opened = self._open(count, len(parts), names)
            self._launch(rollout, count)
            if self._inputs.num_frames > 1:
                last_rows = opened["observations"][self._length - 1 :: self._length]
                self.last_observations[:count] = last_rows[:count]
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
            seen = self._inputs.seen(logged.pop("observations"))
            self.activations.record(rows, self._network.weights, seen)
            logged |= self._inputs.by_name(seen)
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
        """Take the states of the first environments, their appearance and the weights.

        Without randomization the kernel's own poses follow their states.
        """
        load_kernels(self._kernel.module).result()
        self._rules.begin(state)
        if self._env.appearances.varies or self._num_shown != len(state):
            self._inputs.look(self._rollout, self._env, state)
            self._num_shown = len(state)
        self._network.pack()

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
        opened, rollout = self._buffer.open(part, kept), self._rollout
        rollout.draws = wp.from_torch(draws)
        rollout.frames = self._frames(opened["observations"])
        rollout.observations = wp.from_torch(opened["observations"])
        rollout.begins = self._begins
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

    def _frames(self, observations: Tensor) -> Any:
        """Return the memory of observations as gray frames, for `show_plain`."""
        frames: Any = Images()
        if self._inputs.is_plain:
            frames.gray = wp.from_torch(
                observations.view(-1, observations.shape[1] // self._inputs.num_frames)
            )
        return frames

    def _launch(self, rollout: Any, num_envs: int) -> None:
        """Run the kernel."""

        def run_span(member: int, first: int, last: int) -> None:
            inputs = [first, last, member, rollout, self._rules.arrays]
            wp.launch(self._kernel, 1, inputs=inputs, device="cpu")

        self._workers.map_spans(0, num_envs, run_span)


def _is_continuous(env: DroneEnv) -> bool:
    """Return whether actions are numbers instead of indices."""
    return env.worlds.dynamics.actions.entry.dtype.is_floating_point


def _not_fused(env: DroneEnv) -> list[str]:
    """Return reasons against fusing the renderer or the transforms."""
    worlds, reasons = env.worlds, []
    if type(worlds.renderer) is not Raytracer or worlds.renderer.device.type != "cpu":
        device = worlds.state.end_reason.device.type
        reasons.append(f"renderer {type(worlds.renderer).__name__} on {device} is not fused")
    if type(env) is not DroneEnv:
        reasons.append(f"environment {type(env).__name__} is not fused")
    if not env.observer.images:
        reasons.append("a policy without images is not fused")
    return [*reasons, *unfused_inputs(env)]


def _not_fused_policy(env: DroneEnv, actor: Any) -> list[str]:
    """Return reasons against fusing the actor."""
    if type(actor) is not (SquashedActor if _is_continuous(env) else CategoricalActor):
        return [f"policy {type(actor).__name__} is not fused"]
    network = actor.network
    if reasons := unsupported(network):
        return reasons
    shapes, num_actions = FusedInputs(env.observer).shapes, env.worlds.dynamics.actions.num_outputs
    taken: Any = getattr(network, "in_shapes", {"pixels": network.in_shape})
    if ([*taken.items()], network.num_actions) != ([*shapes.items()], num_actions):
        given, seen = (", ".join(map(str, of.values())) for of in (taken, shapes))
        return [
            f"a network from {given} to {network.num_actions} outputs is not fused with frames of "
            f"{seen} and {num_actions} outputs"
        ]
    return []


class RolloutBuffer:
    """Memory for the steps of episodes, in as many parts as the longest episode needs."""

    def __init__(self, part: Mapping[str, Tensor]) -> None:
        self._arrays = dict(part)
        self._copies: dict[str, list[np.ndarray]] = {}
        """Memory of copies, also of earlier batches."""
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
        copies = {}
        for name in names:
            array = self._arrays[name]
            out = self._unused(name, len(rows)) if array.is_floating_point() else None
            copies[name] = torch.index_select(array, 0, rows, out=out)
        return copies

    def _unused(self, name: str, count: int) -> Tensor:
        """Return memory, (count, *), that no batch uses: new pages take longer than copies do."""
        memory = self._copies.setdefault(name, [])
        for array in memory:
            # one reference of the list, of the loop and of the call; tensors have one, too
            if len(array) >= count and sys.getrefcount(array) == 3:
                return torch.from_numpy(array)[:count]
        shape = self._arrays[name].shape[1:]
        memory[:] = [np.empty((count + count // 4, *shape), np.float32), *memory[:2]]
        return torch.from_numpy(memory[0])[:count]
