"""Run a policy under conditions, from the same initial states in each of them."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor

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
from drone_rl.config.commands import Mode
from drone_rl.config.inputs import VectorInput
from drone_rl.envs import Observer, base_env, worlds_of
from drone_rl.envs.observer import Seen
from drone_rl.envs.rollout import Agent, DelayedAgent, steps
from drone_rl.policies import ImageNetwork, greedy_agent
from drone_rl.policies.baselines import (
    OracleAgent,
    baseline_names,
    has_visible_oracle,
    make_baseline,
)
from drone_rl.policies.policy import BasePolicy
from drone_rl.sim.dynamics import draw_seeds, make_dynamics
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.tasks import as_task
from drone_rl.sim.visual_randomization import AppearanceSampler
from drone_rl.sim.worlds import Worlds
from drone_rl.trust.baselines import reference
from drone_rl.trust.perturbations import (
    ONSET_STEP,
    Condition,
    clutter,
    make_faults,
    sample_distractors,
    scene_appearance,
    task_region,
    variations,
)
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import Share, rate_of
from drone_rl.utils.seeding import Stream, torch_generator, world_random_state
from drone_rl.utils.settings import prefixed_errors

MAX_WORLDS = 20
"""Largest number of simulated environments to keep, of different tasks and cameras."""
_CLUTTER = 1000
"""Number of the distractors' random stream; those of faults begin at 1."""


@dataclasses.dataclass(frozen=True)
class EvaluatedPolicy:
    """A policy with its task, camera, transforms and dynamics."""

    network: ImageNetwork
    task: BaseTaskSettings
    camera: CameraSettings
    inputs: Mapping[str, Seen]
    appearance: AppearanceSettings = MINIMAL
    device: str = "cpu"
    renderer: str = "raytrace"
    dynamics: DynamicsSettings = COMPUTER_VISION
    actions: ActionSettings = MOVES_SETTINGS

    @classmethod
    def of(
        cls, policy: BasePolicy, *, device: str = "cpu", renderer: str = "raytrace"
    ) -> "EvaluatedPolicy":
        """Return the policy with its task, camera and transforms.

        Raises:
            InputError: The task has no settings to perturb, or its settings make another task.
        """
        task: Any = policy.task
        if not isinstance(task, BaseTaskSettings):
            settings_of_task = getattr(task, "settings", None)
            is_rebuilt = isinstance(settings_of_task, BaseTaskSettings)
            is_rebuilt = is_rebuilt and type(as_task(settings_of_task)) is type(task)
            task = settings_of_task if is_rebuilt else None
        if task is None:
            raise InputError(
                f"the task of policy={policy.name} has no settings to perturb; give another policy"
            )
        env: Any = policy.make_env(1, device=device, renderer=renderer)
        try:
            camera, inputs = worlds_of(env).camera, base_env(env).observer.inputs
        finally:
            env.close()
        network = policy.make_network(device).eval()
        described = getattr(policy, "description", None)  # only policies from files have one
        look = MINIMAL if described is None else described.appearance
        where, moved = (device, renderer), (policy.dynamics, policy.actions)
        return cls(network, task, camera, inputs, look, *where, *moved)


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
        self.subject, self.episodes = subject, episodes
        self._task = as_task(subject.task)
        self.appearances = AppearanceSampler(
            subject.appearance, episodes, subject.device, task=self._task, camera=subject.camera
        )
        self._dynamics = make_dynamics(self._task.make_dynamics, subject.dynamics, subject.actions)
        self._built: dict[tuple[Any, ...], Worlds] = {}
        self.sample(seed)

    def sample(self, seed: int) -> None:
        """Sample other initial states."""
        self.seed, count = seed, self.episodes
        self._oracle: Share | None = None
        streams = [world_random_state(seed, i, Stream.SHIFTED) for i in range(count)]
        self.appearances.reset(torch.arange(count), streams)
        self._drawn = torch.stack([self._task.sample(stream) for stream in streams])
        self._seeds = draw_seeds(streams) if self._dynamics.is_random else None

    def settings(self, condition: Condition) -> tuple[BaseTaskSettings, CameraSettings]:
        """Return task and camera under a condition.

        A setting out of range, or a task that the policy's actions can't do, is an `InputError`.
        """
        with prefixed_errors("task"):
            task = self.subject.task.replace(**condition.task)
        with prefixed_errors("camera"):
            camera = self.subject.camera.replace(**condition.camera)
        as_task(task).check_dynamics(self._dynamics)
        return task, camera

    def worlds(self, condition: Condition) -> Worlds:
        """Return the simulated environments of a condition, cached by task and camera."""
        task, camera = self.settings(condition)
        key = (task, camera, condition.clutter)
        if key not in self._built:
            if len(self._built) == MAX_WORLDS:
                self.close()
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
        mode: Mode = "constant",
        agent: Agent | None = None,
        num_steps: int | None = None,
    ) -> ConditionResult:
        """Run one episode of an agent, by default the policy, in every environment.

        The perturbations of the condition are active as the mode says. `num_steps` ends it early.
        """
        agent = agent or greedy_agent(self.subject.network)
        delayed, observer = DelayedAgent(agent), None
        stages = [(condition, num_steps)]
        if mode == "onset":
            stages.insert(0, (Condition(), ONSET_STEP))
        state = self.worlds(stages[0][0]).start(self._drawn, self._seeds)
        rows = torch.arange(len(state), device=state.end_reason.device)
        final = state[rows]
        trace = torch.zeros(len(state), dtype=torch.float64, device=rows.device)
        number = 0
        for stage, most in stages:
            if not len(rows):
                break
            starts = observer is None
            observer = self._observer(stage, mode, agent, observer)
            delayed.delay = stage.delay
            for step in steps(delayed, observer, state, rows, starts=starts, num_steps=most):
                number += 1
                if step.act.distribution is not None:
                    seen = sum(
                        s.last.double().flatten(1).sum(-1) for s in observer.sources.values()
                    )
                    trace[step.rows] += number * seen
                final[step.rows] = step.after
            rows = (final.end_reason == 0).nonzero()[:, 0]
            state = final[rows]
        assert observer is not None
        worlds = observer.worlds
        episodes = CompleteEpisodes.ended(worlds.task, worlds.info(final), final.steps)
        return ConditionResult(episodes, trace.cpu())

    def _observer(
        self, condition: Condition, mode: Mode, agent: Agent, earlier: Observer | None
    ) -> Observer:
        """Return what observes the environments under a condition; memory goes on from `earlier`.

        It must be asked for the appearance once at each step.
        """
        worlds, appearances = self.worlds(condition), self.appearances
        generator = torch_generator(self.seed, Stream.SHIFTS)
        varied = variations(mode, condition.dimensions, self.episodes, generator)
        changes = (*condition.appearance_changes, *condition.mounts)
        full = scene_appearance(worlds.scene) if condition.appearance_changes else None
        distractors = self.distractor_places() if condition.clutter else None

        known: tuple[Tensor, Appearance | None] | None = None

        def appearance(rows: Tensor) -> Appearance | None:
            nonlocal known
            if mode != "drifting" and known is not None and torch.equal(known[0], rows):
                return known[1]  # which the renderer need not encode again
            look = appearances.current(rows) if appearances.varies else appearances.middle
            if full is not None:
                look = full if look is None else look.over(full)
            for part, by in zip(changes, next(varied), strict=True):
                look = part.change(look or Appearance(), by.to(worlds.device)[rows])
            if distractors is not None:
                region = task_region(self.subject.task)
                look = clutter(look, region, distractors[rows, : condition.clutter])
            known = rows, look
            return look

        hiding_only = getattr(agent, "needs_only_hiding_faults", False)
        inputs = self.subject.inputs
        images = [name for name in inputs if not isinstance(inputs[name], VectorInput)]
        return Observer(
            worlds,
            self.subject.inputs,
            appearance=appearance,
            faults={
                name: make_faults(
                    condition.faults, self.episodes, self.seed, image=i, hiding_only=hiding_only
                )
                for i, name in enumerate(images)
            },
            earlier=earlier,
        )

    def run_baselines(self, condition: Condition) -> dict[str, CompleteEpisodes]:
        """Return the episodes of the task's random and constant baselines, by name."""
        worlds = self.worlds(condition)
        episodes = {}
        for name in worlds.task.blind_baselines:
            generator = torch_generator(self.seed, Stream.ACTIONS)
            actions = worlds.dynamics.actions
            agent = make_baseline(name, worlds.task, actions, generator)
            episodes[name] = self.run(condition, agent=agent).episodes
        return episodes

    def rate_of_oracle(self, condition: Condition) -> Share | None:
        """Return the success rate of the oracle that knows only visible cubes; None without one.

        Light, colors and faults that hide nothing do not affect it.
        """
        if not has_visible_oracle(self._task):
            return None
        faults = tuple(fault for fault in condition.faults if fault.hides)
        kept = dataclasses.replace(condition, appearance_changes=(), faults=faults)
        if kept != Condition() or self._oracle is None:
            success = self.run(kept, agent=OracleAgent(only_visible=True)).episodes.success
            if kept != Condition():
                return rate_of(success)
            self._oracle = rate_of(success)
        return self._oracle

    def run_oracle(self) -> CompleteEpisodes | None:
        """Return the oracle's episodes without perturbation; None without a usable oracle."""
        worlds = self.worlds(Condition())
        if "oracle" not in baseline_names(worlds.task, worlds.dynamics.actions):
            return None
        return reference({"oracle": self.run(Condition(), agent=OracleAgent()).episodes})

    def distractor_places(self) -> Tensor:
        """Return positions of distractors, see `perturbations.sample_distractors`."""
        generator = torch_generator(self.seed, Stream.SHIFTS, number=_CLUTTER)
        places = sample_distractors(task_region(self.subject.task), self.episodes, generator)
        return places.to(self.subject.device)

    def close(self) -> None:
        """Close the renderers."""
        while self._built:
            self._built.popitem()[1].close()
