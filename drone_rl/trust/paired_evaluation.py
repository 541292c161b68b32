"""Run a policy under conditions, from the same initial states in each of them."""

import dataclasses
import itertools
from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor
from torchrl.envs import Transform

from drone_rl.collectors.complete_episodes import CompleteEpisodes
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
from drone_rl.policies import ImageNetwork
from drone_rl.sim.dynamics import draw_seeds, make_dynamics
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.tasks import State, as_task
from drone_rl.sim.visual_randomization import AppearanceSampler
from drone_rl.sim.worlds import Worlds
from drone_rl.trust.agents import Agent, BaselineAgent, PolicyAgent, StepContext
from drone_rl.trust.perturbations import (
    ONSET_STEP,
    Condition,
    FaultPipeline,
    PerturbationMode,
    clutter,
    sample_distractors,
    scene_appearance,
    task_region,
    variations,
)
from drone_rl.utils.seeding import Stream, torch_generator, world_random_state
from drone_rl.utils.settings import prefixed_errors

_CLUTTER = 1000
"""Number of the distractors' random stream; those of faults begin at 1."""


@dataclasses.dataclass(frozen=True)
class EvaluatedPolicy:
    """A policy with its task, camera, transforms and dynamics."""

    network: ImageNetwork
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
    """Episodes under a condition."""

    episodes: CompleteEpisodes
    """One of each environment."""
    trace: Tensor
    """A checksum of all images of each episode. Shape: (n,)."""


class PairedEvaluator:
    """Runs agents under conditions; episode i starts in the same state under each of them."""

    def __init__(self, subject: EvaluatedPolicy, episodes: int, seed: int = 0) -> None:
        """Sample the initial states of so many environments, one episode each."""
        self.subject, self.episodes, self.seed = subject, episodes, seed
        task = as_task(subject.task)
        streams = [world_random_state(seed, i, Stream.SHIFTED) for i in range(episodes)]
        self.appearances = AppearanceSampler(
            subject.appearance, episodes, subject.device, task=task, camera=subject.camera
        )
        self.appearances.reset(torch.arange(episodes), streams)
        self._drawn = torch.stack([task.sample(stream) for stream in streams])
        dynamics = make_dynamics(task.make_dynamics, subject.dynamics, subject.actions)
        self._actions = dynamics.actions
        self._seeds = draw_seeds(streams) if dynamics.is_random else None
        self._built: dict[tuple[Any, ...], Worlds] = {}

    def settings(self, condition: Condition) -> tuple[BaseTaskSettings, CameraSettings]:
        """Return task and camera under a condition.

        A setting out of range, or a task that the policy's actions can't do, is an `InputError`.
        """
        with prefixed_errors("task"):
            task = self.subject.task.replace(**condition.task)
        with prefixed_errors("camera"):
            camera = self.subject.camera.replace(**condition.camera)
        as_task(task).check_actions(self._actions)
        return task, camera

    def worlds(self, condition: Condition) -> Worlds:
        """Return the simulated environments of a condition, cached by task and camera."""
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
                distractors=self.appearances.distractors + condition.clutter,
            )
        return self._built[key]

    @torch.no_grad()
    def run(
        self,
        condition: Condition,
        mode: PerturbationMode = PerturbationMode.CONSTANT,
        agent: Agent | None = None,
    ) -> ConditionResult:
        """Run one episode of an agent, by default the policy, in every environment.

        The perturbations of the condition are active as the mode says.
        """
        if agent is None:
            agent = PolicyAgent(self.subject.network, self.subject.transforms, self.episodes)
        stages = {0: condition}
        if mode is PerturbationMode.ONSET:
            stages = {0: Condition(), ONSET_STEP: condition}
        stage = _Stage(self, stages[0], mode, agent)
        start = stage.worlds.start(self._drawn, self._seeds)
        active = torch.arange(len(start), device=start.end_reason.device)
        final, state = start[active], start
        trace = torch.zeros(len(start), dtype=torch.float64, device=stage.worlds.device)
        decided: list[Tensor] = []
        for number in itertools.count():
            if number and number in stages:
                stage = _Stage(self, stages[number], mode, agent)
            delay = stage.delay
            due = range(number, number + delay) if decided else ()
            pending = [decided[max(s - delay, 0)][active] for s in due]
            action, seen = agent.act(stage.context(state, active, pending))
            if seen is not None:
                trace[active] += (number + 1) * seen.flatten(1).double().sum(-1)
            decided.append(action.new_zeros(len(start), *action.shape[1:]))
            decided[-1][active] = action
            state, _ = stage.worlds.advance(state, decided[max(number - delay, 0)][active])
            final[active] = state
            is_active = state.end_reason == 0
            if not is_active.all():
                state, active = state[is_active], active[is_active]
            if not len(active):
                break
        worlds = stage.worlds
        episodes = CompleteEpisodes.ended(worlds.task, worlds.info(final), final.steps)
        return ConditionResult(episodes, trace.cpu())

    def run_baselines(self, condition: Condition) -> dict[str, CompleteEpisodes]:
        """Return the episodes of the task's random and constant baselines, by name."""
        worlds = self.worlds(condition)
        episodes = {}
        for name in worlds.task.blind_baselines:
            generator = torch_generator(self.seed, Stream.ACTIONS)
            agent = BaselineAgent(name, worlds.dynamics.actions, generator)
            episodes[name] = self.run(condition, agent=agent).episodes
        return episodes

    def distractor_places(self) -> Tensor:
        """Return positions of distractors, see `perturbations.sample_distractors`."""
        generator = torch_generator(self.seed, Stream.SHIFTS, number=_CLUTTER)
        places = sample_distractors(task_region(self.subject.task), self.episodes, generator)
        return places.to(self.subject.device)

    def close(self) -> None:
        """Close the renderers."""
        for worlds in self._built.values():
            worlds.close()


class _Stage:
    """A part of an episode under one condition."""

    def __init__(
        self, evaluator: PairedEvaluator, condition: Condition, mode: PerturbationMode, agent: Agent
    ) -> None:
        self._evaluator, self._condition = evaluator, condition
        self.worlds, self.delay = evaluator.worlds(condition), condition.delay
        episodes, seed = evaluator.episodes, evaluator.seed
        generator = torch_generator(seed, Stream.SHIFTS)
        self._variations = variations(mode, condition.dimensions, episodes, generator)
        self._faults = FaultPipeline(
            condition.faults, episodes, seed, hiding_only=agent.needs_only_hiding_faults
        )
        self._own = None if evaluator.appearances.varies else evaluator.appearances.middle
        self._full = scene_appearance(self.worlds.scene) if condition.appearance_changes else None
        self._distractors = evaluator.distractor_places() if condition.clutter else None

    def context(self, state: State, active: Tensor, pending: list[Tensor]) -> StepContext:
        """Everything that the agent may use at the next step."""
        appearances, condition = self._evaluator.appearances, self._condition
        variation = [part.to(self.worlds.device)[active] for part in next(self._variations)]
        appearance = appearances.current(active) if appearances.varies else self._own
        if self._full is not None:
            appearance = self._full if appearance is None else appearance.over(self._full)
        for part, by in zip(
            (*condition.appearance_changes, *condition.mounts), variation, strict=True
        ):
            appearance = part.change(appearance or Appearance(), by)
        if self._distractors is not None:
            region = task_region(self._evaluator.subject.task)
            places = self._distractors[active, : condition.clutter]
            appearance = clutter(appearance, region, places)
        poses = self.worlds.poses(state, appearance)
        return StepContext(self.worlds, state, active, poses, appearance, self._faults, pending)
