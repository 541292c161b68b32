"""Whole flights in many worlds at once, under a condition: the same worlds for every condition."""

import dataclasses
import itertools
from collections.abc import Callable, Sequence
from typing import Any

import torch
from torch import Tensor
from torchrl.envs import Transform

from drone_rl.config import (
    COMPUTER_VISION,
    MINIMAL,
    MOVES_SETTINGS,
    ActionSettings,
    AppearanceSettings,
    BaseTaskSettings,
    CameraSettings,
    DynamicsSettings,
)
from drone_rl.evaluation.metrics import Episodes
from drone_rl.policies import PictureNetwork
from drone_rl.robustness.agents import Agent, BaselineAgent, PolicyAgent, StepContext
from drone_rl.robustness.faults import FaultPipeline
from drone_rl.robustness.perturbations import (
    ONSET_STEP,
    Condition,
    Mode,
    clutter,
    look_of,
    sample_distractors,
    sways,
    task_things,
)
from drone_rl.sim.dynamics import draw_seeds, make_dynamics
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.tasks import State, as_task
from drone_rl.sim.visual_randomization import Appearances
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.seeding import Stream, torch_generator, world_random_state
from drone_rl.utils.settings import below

_CLUTTER = 1000
"""Number of the stream of distractors; those of faults begin at 1."""


@dataclasses.dataclass(frozen=True)
class PolicySpec:
    """A policy, what it flies in and what it sees."""

    network: PictureNetwork
    task: BaseTaskSettings
    camera: CameraSettings
    transforms: Sequence[Transform]
    appearance: AppearanceSettings = MINIMAL
    device: str = "cpu"
    renderer: str = "raytrace"
    dynamics: DynamicsSettings = COMPUTER_VISION
    actions: ActionSettings = MOVES_SETTINGS


@dataclasses.dataclass(frozen=True)
class ConditionResult:
    """How flights went."""

    episodes: Episodes
    """One of each world."""
    trace: Tensor
    """One number a world that sums up all that was seen: equal if nothing differed. (n,)."""


class PairedEvaluator:
    """Worlds to fly a policy and others in, each condition in the same ones."""

    def __init__(self, subject: PolicySpec, episodes: int, seed: int = 0) -> None:
        """Draws the worlds; they are built when they are flown in.

        Args:
            subject: Whose.
            episodes: How many worlds, each of which is flown in once.
            seed: Of their streams.
        """
        self.subject, self.episodes, self.seed = subject, episodes, seed
        task = as_task(subject.task)
        streams = [world_random_state(seed, i, Stream.SHIFTED) for i in range(episodes)]
        self.looks = Appearances(
            subject.appearance, episodes, subject.device, task=task, camera=subject.camera
        )
        self.looks.reset(torch.arange(episodes), streams)
        self._drawn = torch.stack([task.draw(stream) for stream in streams])
        dynamics = make_dynamics(task, subject.dynamics, subject.actions)
        self._seeds = draw_seeds(streams) if dynamics.is_random else None
        self._built: dict[tuple[Any, ...], Worlds] = {}

    def settings(self, condition: Condition) -> tuple[BaseTaskSettings, CameraSettings]:
        """Task and camera under a condition.

        Raises:
            InputError: They can't be so.
        """
        with below("task"):
            task = self.subject.task.replace(**condition.task)
        with below("camera"):
            camera = self.subject.camera.replace(**condition.camera)
        return task, camera

    def worlds(self, condition: Condition) -> Worlds:
        """The worlds of a condition; those of the same task and camera are built once.

        Raises:
            InputError: See `settings`.
        """
        task, camera = self.settings(condition)
        key = (task, camera, condition.clutter)
        if key not in self._built:
            self._built[key] = Worlds(
                self.episodes,
                task,
                camera,
                dynamics=self.subject.dynamics,
                actions=self.subject.actions,
                renderer=self.subject.renderer,
                device=self.subject.device,
                distractors=self.looks.distractors + condition.clutter,
            )
        return self._built[key]

    def fly(
        self, condition: Condition, mode: Mode = Mode.CONSTANT, eyes: Agent | None = None
    ) -> ConditionResult:
        """Flies to the end in every world.

        Args:
            condition: What is different.
            mode: When.
            eyes: Who flies; the policy by default.
        """
        if eyes is None:
            subject = self.subject
            eyes = PolicyAgent(subject.network, subject.transforms, self.episodes)
        stages = [(0, condition)]
        if mode is Mode.ONSET:
            stages = [(0, Condition()), (ONSET_STEP, condition)]
        return _Flight(self, mode, eyes).fly(stages, self._drawn, self._seeds)

    def fly_blindly(self, condition: Condition) -> dict[str, Episodes]:
        """What luck achieves: each of the task's policies that need no eyes, by name."""
        worlds = self.worlds(condition)
        flown = {}
        for name in worlds.task.luck:
            generator = torch_generator(self.seed, Stream.ACTIONS)
            eyes = BaselineAgent(name, worlds.dynamics.actions, generator)
            flown[name] = self.fly(condition, eyes=eyes).episodes
        return flown

    def beside(self) -> Tensor:
        """Where the distractors of a condition stand, see `clutter.sample_distractors`."""
        generator = torch_generator(self.seed, Stream.SHIFTS, number=_CLUTTER)
        places = sample_distractors(task_things(self.subject.task), self.episodes, generator)
        return places.to(self.subject.device)

    def close(self) -> None:
        """Ends what draws the worlds."""
        for worlds in self._built.values():
            worlds.close()


class _Flight:
    """One flight of all worlds."""

    def __init__(self, bed: PairedEvaluator, mode: Mode, eyes: Agent) -> None:
        self._bed, self._mode, self._eyes = bed, mode, eyes

    @torch.no_grad()
    def fly(
        self, stages: Sequence[tuple[int, Condition]], drawn: Tensor, seeds: Tensor | None
    ) -> ConditionResult:
        worlds = self._bed.worlds(stages[0][1])
        now = worlds.start(drawn, seeds)
        flying = torch.arange(len(now), device=worlds.device)
        done, trace = now[flying], torch.zeros(len(now), dtype=torch.float64, device=worlds.device)
        decided: list[Tensor] = []
        see: Callable[[State, Tensor, list[Tensor]], StepContext] | None = None
        delay, begins = 0, dict(stages)
        for step in itertools.count():
            if step in begins:
                condition = begins[step]
                worlds, delay = self._bed.worlds(condition), condition.delay
                see = self._stage(worlds, condition)
            assert see is not None
            due = range(step, step + delay) if decided else ()
            pending = [decided[max(s - delay, 0)][flying] for s in due]
            action, seen = self._eyes.act(see(now, flying, pending))
            if seen is not None:
                trace[flying] += (step + 1) * seen.flatten(1).double().sum(-1)
            decided.append(action.new_zeros(len(done), *action.shape[1:]))
            decided[-1][flying] = action
            now, _ = worlds.advance(now, decided[max(step - delay, 0)][flying])
            done[flying] = now
            on = now.end_reason == 0
            if not on.all():
                now, flying = now[on], flying[on]
            if not len(flying):
                break
        episodes = Episodes.ended(worlds.task, worlds.info(done), done.steps)
        return ConditionResult(episodes, trace.cpu())

    def _stage(
        self, worlds: Worlds, condition: Condition
    ) -> Callable[[State, Tensor, list[Tensor]], StepContext]:
        """What there is to see from now on."""
        bed = self._bed
        generator = torch_generator(bed.seed, Stream.SHIFTS)
        ways = sways(self._mode, condition.dimensions, bed.episodes, generator)
        hiding_only = self._eyes.knows_truth
        spoil = FaultPipeline(condition.faults, bed.episodes, bed.seed, hiding_only=hiding_only)
        plain = look_of(worlds.scene) if condition.looks else None
        beside = bed.beside() if condition.clutter else None
        same = None if bed.looks.varies else bed.looks.middle

        def see(now: State, flying: Tensor, pending: list[Tensor]) -> StepContext:
            way = [part.to(worlds.device)[flying] for part in next(ways)]
            own = bed.looks.drawn(flying) if bed.looks.varies else same
            look = own if plain is None or own is None else own.over(plain)
            appearance = _dress(condition, look or plain, way)
            if beside is not None:
                things, places = task_things(bed.subject.task), beside[flying, : condition.clutter]
                appearance = clutter(appearance, things, places)
            poses = worlds.poses(now, appearance)
            return StepContext(worlds, now, flying, poses, appearance, spoil, pending)

        return see


def _dress(
    condition: Condition, own: Appearance | None, way: Sequence[Tensor]
) -> Appearance | None:
    """How worlds look, through their cameras."""
    appearance, count = own, len(condition.looks)
    for look, sway in zip(condition.looks, way[:count], strict=True):
        assert appearance is not None
        appearance = look(appearance, sway)
    for mount, sway in zip(condition.mounts, way[count:], strict=True):
        appearance = mount(appearance, sway)
    return appearance
