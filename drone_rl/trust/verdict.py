"""Judge a policy: run episodes, apply the rule and return a verdict.

The class of verdicts is in `results.py`, their text in `templates/verdict.j2`.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from tensordict.nn import TensorDictModuleBase
from torchrl.envs import EnvBase

from drone_rl.collectors.complete_episodes import CompleteEpisodes, rollout
from drone_rl.envs import base_env, worlds_of
from drone_rl.envs.rollout import Agent
from drone_rl.policies.baselines import check_baselines
from drone_rl.policies.policy import BasePolicy, load_policy
from drone_rl.policies.zoo import TrainingProgress
from drone_rl.sim.actions import Actions
from drone_rl.sim.tasks import Task
from drone_rl.trust.baselines import reference, run_baselines
from drone_rl.trust.metrics import failure_table, summarise
from drone_rl.trust.repetition import exchange_images, exchange_inputs, repeat
from drone_rl.trust.results import (
    NEEDED_EPISODES,
    CameraUse,
    InputUse,
    Proof,
    Repetition,
    Verdict,
)
from drone_rl.trust.rule import USABLE, Quantity, Rule, VerdictKind, decide, kinds_within
from drone_rl.utils.exit_codes import NOT_CERTAIN
from drone_rl.utils.intervals import mean_bounds, proportion, rate_of
from drone_rl.utils.progress import Progress, silent
from drone_rl.utils.seeding import RootSeed, Stream, root_seed

MANY = (2, 3, 5, 10, 20, 50, 100)
"""Multiples of the number of episodes for which certainty is extrapolated."""


class FindClaim(Protocol):
    """Finds and checks a policy's certificate; see `drone_rl.verification.claim.find_claim`."""

    def __call__(
        self,
        policy: BasePolicy,
        certificate: str | Path | None = None,
        *,
        flights: int = ...,
        prove_again: bool = ...,
        seed: RootSeed | None = None,
        device: str = ...,
        renderer: str = ...,
        progress: Progress = ...,
    ) -> Proof | None:
        """Return the certificate at a path, by default the one next to the policy, if any."""
        ...


def judge_policy(
    env: EnvBase,
    actor: TensorDictModuleBase | Agent,
    episodes: int,
    *,
    sampled: bool = True,
    rule: Rule | None = None,
    claim: Proof | None = None,
    unlike: Mapping[str, Any] | None = None,
    known_scenes: tuple[str, ...] = (),
    seed: RootSeed | None = None,
    progress: Progress = silent,
) -> Verdict:
    """Run so many episodes of a policy and of each baseline, and apply the rule.

    Initial states are the same. `sampled` also runs the policy with sampled actions; `progress` is
    called with the name of each step; for the other arguments see `apply_rule`. In environments
    with images the policy's episodes are repeated, see `drone_rl.trust.repetition`.

    Raises:
        InputError: The task has no baselines or strata, or an output is not finite.
    """
    base, worlds = base_env(env), worlds_of(env)
    check_judged(worlds.task, worlds.dynamics.actions)  # before its episodes
    state = base.state_dict()
    progress("baselines", 0, 6)
    baselines = run_baselines(
        env.batch_size[0], worlds.task, state, episodes, str(worlds.device), worlds.dynamics
    )
    drawn = None
    progress("most probable actions", 1, 6)
    greedy = rollout(actor, env, episodes, compiled=True)
    if sampled:
        base.load_state_dict(state)
        progress("sampled actions", 2, 6)
        drawn = rollout(actor, env, episodes, greedy=False)
    base.load_state_dict(state)
    repetition = camera = inputs = None
    if base.pixels:
        progress("repeated episodes", 3, 6)
        repetition = repeat(env, actor, greedy)
        progress("images of other episodes", 4, 6)
        camera = exchange_images(env, actor, greedy)
        progress("inputs of other episodes", 5, 6)
        inputs = exchange_inputs(env, actor, greedy)
    progress("judged", 6, 6)
    return apply_rule(
        greedy,
        baselines,
        rule=rule,
        sampled=drawn,
        claim=claim,
        unlike=unlike,
        known_scenes=known_scenes,
        seed=seed,
        repetition=repetition,
        camera=camera,
        inputs=inputs,
    )


def judge_for_selection(
    path: Path,
    episodes: int,
    device: str,
    renderer: str = "raytrace",
    *,
    seed: RootSeed | None = None,
) -> tuple[Verdict, TrainingProgress]:
    """Judge a checkpoint in environments of `Stream.CHOICE`, for selection.

    Reported figures come from environments of `Stream.REPORT`, never from these.
    The root of the random streams is fresh by default. Return the verdict and the checkpoint's
    progress.

    Raises:
        InputError: The checkpoint is unusable.
    """
    policy, seed = load_policy(path), seed or root_seed(None)
    how: dict[str, Any] = {"stream": Stream.CHOICE, "device": device, "renderer": renderer}
    with policy.flying(min(episodes, 250), seed=seed.value, **how) as (env, actor):
        return judge_policy(env, actor, episodes, seed=seed), policy.state.progress


def check_judged(task: Task[Any], actions: Actions) -> None:
    """Raise the `InputError` with which a verdict on a task would end after its episodes."""
    _rule_of(None, task)
    check_baselines(task, actions)


def _rule_of(rule: Rule | None, task: Task[Any]) -> Rule:
    """Return the rule for a task's strata and baselines; an `InputError` if it has none."""
    return (rule or Rule()).replace(strata=task.strata, blind_baselines=task.blind_baselines)


def apply_rule(
    greedy: CompleteEpisodes,
    baselines: Mapping[str, CompleteEpisodes],
    *,
    rule: Rule | None = None,
    sampled: CompleteEpisodes | None = None,
    claim: Proof | None = None,
    unlike: Mapping[str, Any] | None = None,
    known_scenes: tuple[str, ...] = (),
    seed: RootSeed | None = None,
    repetition: Repetition | None = None,
    camera: CameraUse | None = None,
    inputs: Mapping[str, InputUse] | None = None,
) -> Verdict:
    """Apply the rule to episodes.

    Args:
        greedy: The policy's episodes with the most probable actions.
        baselines: Episodes of each baseline; the k-th starts in the state of the policy's k-th.
        rule: Thresholds of the verdict.
        sampled: The policy's episodes with sampled actions, from the same states.
        claim: A certificate of the policy in this task, if there is one.
        unlike: Settings that differ from the training, by name.
        known_scenes: The scene files of the training, if these episodes are in no other ones.
        seed: Root of the environments' random streams; without it the verdict says that a policy
            could have been fitted to these environments.
        repetition: The same episodes again; None for baselines, which see no images.
        camera: What changes with the images of other episodes; None for baselines.
        inputs: What changes with each of several inputs of other episodes.

    Raises:
        ValueError: The initial states differ.
    """
    task = greedy.task
    rule = _rule_of(rule, task)
    for other in (*baselines.values(), greedy if sampled is None else sampled):
        if not torch.equal(other.goals.world, greedy.goals.world):
            raise ValueError("policy and baselines have different initial states; use the same")
    quantities = measure(greedy, baselines, rule)
    kind = decide([quantity.level for quantity in quantities.values()], len(rule.strata))
    enough = _enough(greedy, baselines, rule)
    certain = enough is not None and enough <= len(greedy)
    certain &= repetition is None or repetition.is_same
    if kind is VerdictKind.GOOD and camera is not None:
        certain &= camera.is_used is not None
        kind = VerdictKind.TRIVIAL if camera.is_used is False else kind
    verdict = Verdict(
        kind=kind,
        certain=certain,
        exit_code=kind.exit_code if certain else NOT_CERTAIN,
        **({} if seed is None else seed.as_dict()),
        rule=rule.text,
        error_rate=rule.error_rate,
        good_share=rule.good_share,
        terms=task.vocabulary,
        num_cubes=greedy.goals.reached.shape[-1],
        repetition=repetition,
        camera=camera,
        inputs=dict(inputs or {}),
        proof=_unless_contradicted(claim, greedy),
        greedy=summarise(greedy),
        sampled=None if sampled is None else summarise(sampled),
        baselines={name: summarise(of) for name, of in baselines.items()},
        drawing=None
        if sampled is None
        else mean_bounds(sampled.success - greedy.success, -1.0, 1.0),
        failures=failure_table(greedy),
        quantities=quantities,
        enough=enough,
        unlike=dict(unlike or {}),
        known_scenes=known_scenes,
    )
    if camera is None:
        return verdict
    return verdict.replace(camera=camera.replace(needs_images=not verdict.is_trivial))


def _unless_contradicted(claim: Proof | None, greedy: CompleteEpisodes) -> Proof | None:
    """Return the certificate, refused if it states success from everywhere and episodes failed."""
    failed = int((greedy.success < 1).sum())
    if claim is None or not (claim.every and failed):
        return claim
    why = f"{failed} of {len(greedy)} greedy episodes of this verdict failed, contrary to it"
    return Proof(path=claim.path, refused=why)


def measure(
    greedy: CompleteEpisodes, baselines: Mapping[str, CompleteEpisodes], rule: Rule, times: int = 1
) -> dict[str, Quantity]:
    """Return the rule's quantities with simultaneous confidence intervals.

    Every episode counts `times` times, to extrapolate to more episodes.
    """
    observed = observe(greedy, baselines, rule)
    measured = (estimate(i, np.tile(values, times), rule) for i, values in enumerate(observed))
    return dict(zip(rule.quantities, measured, strict=True))


def kinds_of(quantities: Mapping[str, Quantity], rule: Rule) -> frozenset[VerdictKind]:
    """Return all kinds that the intervals admit."""
    box = tuple(quantity.levels for quantity in quantities.values())
    return kinds_within(box, len(rule.strata))


def estimate(quantity: int, values: NDArray, rule: Rule) -> Quantity:
    """Estimate the quantity of this index in a rule from its values, see `observe`."""
    name, thresholds = rule.quantities[quantity], rule.thresholds[quantity]
    if name.startswith("offered"):
        of = rate_of(values, rule.confidence)
        value = of.share
    else:
        of = mean_bounds(values, *rule.ranges[quantity], rule.confidence)
        value = of.mean
    return Quantity(value=value, lower=of.lower95, upper=of.upper95, thresholds=thresholds)


def observe(
    greedy: CompleteEpisodes, baselines: Mapping[str, CompleteEpisodes], rule: Rule
) -> list[NDArray]:
    """Return each episode's value of each of the rule's quantities.

    Shapes: (n,), float64; NaN where an episode offered no such goal.
    """
    every = torch.ones_like(greedy.success)
    success = share = solved = every
    if (oracle := reference(baselines)) is not None:
        success, share = oracle.success, oracle.share
        solved = torch.maximum(oracle.success, greedy.success)
    strata = range(len(rule.strata))
    blind = [baselines[name] for name in rule.blind_baselines]
    margin = rule.poor_margin
    observed = [
        greedy.success - rule.good_share * success,
        *(greedy.offered(stratum).double() for stratum in strata),
        *(greedy.stratum_share(stratum) for stratum in strata),
        *(greedy.share - (1 - margin) * of.share - margin * share for of in blind),
        *(rule.good_share * solved - of.success for of in blind),
    ]
    return [values.numpy() for values in observed]


def _is_oracle_clear(baselines: Mapping[str, CompleteEpisodes], rule: Rule, times: int = 1) -> bool:
    """Return whether the episodes determine if the oracle succeeds often enough to be usable."""
    if (oracle := baselines.get("oracle")) is None:
        return True
    successes = times * int(oracle.success.sum())
    of = proportion(successes, times * len(oracle), rule.confidence)
    return not of.lower95 <= USABLE <= of.upper95


def _enough(
    greedy: CompleteEpisodes, baselines: Mapping[str, CompleteEpisodes], rule: Rule
) -> int | None:
    """Return about how many episodes certainty needs; None if more than `MANY` covers."""
    for times in (1, *MANY):
        kinds = kinds_of(measure(greedy, baselines, rule, times), rule)
        if len(kinds) == 1 and _is_oracle_clear(baselines, rule, times):
            return max(NEEDED_EPISODES, times * len(greedy))
    return None
