"""`drone-rl evaluate`: evaluate a policy next to the baselines, and print the figures."""

import dataclasses
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, ClassVar

import pydantic
from tensordict.nn import TensorDictModuleBase

from drone_rl.collectors.complete_episodes import rollout
from drone_rl.config import AppearanceSettings
from drone_rl.config.commands import EvaluateSettings, HeldOutSettings
from drone_rl.config.configuration import from_arguments
from drone_rl.envs import base_env, worlds_of
from drone_rl.policies.baselines import check_baselines
from drone_rl.policies.external_network import Logits
from drone_rl.policies.external_policy import as_policy
from drone_rl.policies.policy import BasePolicy, Policy
from drone_rl.sim.tasks import as_task
from drone_rl.sim.vocabulary import TaskVocabulary
from drone_rl.trust.baselines import run_baselines
from drone_rl.trust.metrics import summarise
from drone_rl.trust.repetition import require_repeatable
from drone_rl.trust.results import Difference, Figures
from drone_rl.utils.display import TableResult
from drone_rl.utils.intervals import Mean, Share
from drone_rl.utils.models import Seeded
from drone_rl.utils.progress import Progress, as_progress
from drone_rl.utils.provenance import Provenance, provenance
from drone_rl.utils.seeding import RootSeed, with_seed
from drone_rl.utils.text import interval, percent, render


class Evaluation(TableResult, Seeded, Provenance):
    """Figures of a policy and of the baselines on the same initial states, by name."""

    model_config = pydantic.ConfigDict(extra="allow")
    __pydantic_extra__: dict[str, Figures]  # pyright: ignore[reportIncompatibleVariableOverride]

    policy: str
    """Its name."""
    terms: TaskVocabulary
    unlike: dict[str, Difference] = {}
    """Settings that differ from the training, by name."""
    greedy: Figures
    """With the most probable actions."""
    sampled: Figures
    trained: dict[str, Any] | None = None
    """Progress of the training."""
    are_numbers: ClassVar[bool] = True

    @property
    def figures(self) -> dict[str, Figures]:
        """Figures of "greedy", "sampled" and the baselines."""
        return {"greedy": self.greedy, "sampled": self.sampled, **self.__pydantic_extra__}

    @property
    def success(self) -> float:
        """Success rate with the most probable actions."""
        return self.greedy.success.share or 0.0

    def rows(self) -> list[list[str]]:
        """Return the figures as rows of text: a header, the figures, and intervals of rates.

        The intervals are those of the policy only, so that the table fits a terminal.
        """
        figures, terms = self.figures.values(), self.terms
        rows = [["", *self.figures], *self._rates("success rate", [f.success for f in figures])]
        for name in self.greedy.shares:
            label = f"{terms.goals} {terms.reached}" if name == "all" else terms.side(name)
            rows += self._rates(label, [f.shares[name] for f in figures])
        rows.append([f"mean {terms.goals}", *(f"{f.mean_goals:.2f}" for f in figures)])
        lost = [f.never_reached and f.never_reached.mean for f in figures]
        rows.append(["never reached", *(percent(share or 0.0) for share in lost)])
        for reason in self.greedy.ends:
            cells = (str(f.ends[reason].successes) for f in figures)
            rows.append([f"end: {reason.replace('_', ' ')}", *cells])
        rows.append(["mean length", *(f"{f.mean_length:.1f}" for f in figures)])
        rows.append(["episodes", *(str(f.episodes) for f in figures)])
        return rows

    def _rates(self, label: str, figures: Sequence[Share | Mean]) -> list[list[str]]:
        """Return a row of rates, and a row of the policy's 95% intervals."""
        rates = [f.share if isinstance(f, Share) else f.mean for f in figures]
        texts = ["-" if rate is None else percent(rate) for rate in rates]
        policy = [
            interval(figure) if name in ("greedy", "sampled") and rate is not None else ""
            for name, rate, figure in zip(self.figures, rates, figures, strict=True)
        ]
        return [[label, *texts], ["  95% CI", *policy]]

    def notes(self) -> list[str]:
        """Return notes on the seed and what differs from the training."""
        unlike = render("drone_rl.trust", "evaluation.j2", e=self)
        return [*filter(None, [self.seed_warning(), unlike]), self.seed_line()]

    def save(self, path: Path) -> None:
        """Write `evaluation.json`."""
        self.replace(**provenance()).write_json(path)


def evaluate(
    policy: str | Path | BasePolicy | Logits,
    settings: EvaluateSettings | None = None,
    *,
    task: Mapping[str, Any] | None = None,
    dynamics: Mapping[str, Any] | None = None,
    appearance: AppearanceSettings | str | None = None,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    **changes: Any,
) -> Evaluation:
    """Evaluate a policy, greedily and with sampled actions, and the baselines, on held-out states.

    Args:
        policy: The policy, an argument of `load_policy`, or a callable, see `policy_from`.
        settings: Number of episodes, seed, device and so on.
        task: Settings to change of the policy's task.
        dynamics: Settings to change of its vehicle dynamics.
        appearance: Appearance of the scenes, or the name of one such as "fog"; by default that of
            the policy's training.
        outputs: See `load_policy`.
        progress: Called with the name of each step; a progress bar by default.
        changes: Changed settings, as in `evaluate("good", episodes=200)`.

    Raises:
        InputError: The policy or a setting is unusable, or the drones lack a baseline's action.
    """
    settings, seed = with_seed(from_arguments(EvaluateSettings, settings, changes, evaluate))
    progress = as_progress(progress)
    policy = as_policy(policy, outputs, task=task, dynamics=dynamics, appearance=appearance)
    progress("repeated episodes")
    require_repeatable(policy, seed=seed.value, device=settings.device, renderer=settings.renderer)
    episodes, steps = settings.episodes, 3 if settings.baselines else 2
    with held_out_environments(policy, settings, seed) as (env, actor):
        state, flown = base_env(env).state_dict(), worlds_of(env).dynamics
        if settings.baselines:
            check_baselines(as_task(policy.task), flown.actions)
        progress("most probable actions", 0, steps)
        greedy = rollout(actor, env, episodes)
        base_env(env).load_state_dict(state)
        progress("sampled actions", 1, steps)
        rollouts = {"greedy": greedy, "sampled": rollout(actor, env, episodes, greedy=False)}
    if settings.baselines:
        progress("baselines", 2, steps)
        num_envs, device = settings.batch_size, settings.device
        rollouts |= run_baselines(num_envs, policy.task, state, episodes, device, flown)
    progress("evaluated", steps, steps)
    return Evaluation(
        policy=policy.source,
        **seed.as_dict(),
        terms=as_task(policy.task).vocabulary,
        unlike=policy.unlike,
        trained=dataclasses.asdict(policy.state.progress) if isinstance(policy, Policy) else None,
        **{name: summarise(e) for name, e in rollouts.items()},
    )


def held_out_environments(
    policy: BasePolicy, settings: HeldOutSettings, seed: RootSeed
) -> AbstractContextManager[tuple[Any, TensorDictModuleBase]]:
    """Return a context manager of environments that no training uses, and the policy's actor."""
    where: dict[str, Any] = {"device": settings.device, "renderer": settings.renderer}
    return policy.flying(settings.batch_size, seed=seed.value, **where)
