"""From flown episodes to a verdict."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.envs import worlds_of
from drone_rl.evaluation import Episodes, run_episodes, summarise
from drone_rl.utils.intervals import mean_bounds, proportion
from drone_rl.utils.seeding import RootSeed
from drone_rl.verdicts.failures import failure_table
from drone_rl.verdicts.kinds import NOT_CERTAIN, Kind
from drone_rl.verdicts.luck import fly_baselines
from drone_rl.verdicts.proof import Claim
from drone_rl.verdicts.rule import Quantity, Rule, decide, kinds_within
from drone_rl.words.certificate import is_proved
from drone_rl.words.licence import say
from drone_rl.words.verdict import SENTENCES

MANY = (2, 3, 5, 10, 20, 50, 100)
"""How many times as many episodes are tried out, in thought, where they are not enough."""


@dataclasses.dataclass(frozen=True)
class Verdict:
    """The kind, whether the episodes are enough to be certain of it, and all that it rests on."""

    kind: Kind
    certain: bool
    evidence: dict[str, Any]
    """Plain values; what `as_dict` returns but for the sentence."""

    @property
    def exit_code(self) -> int:
        """The kind's if it is certain, else 13."""
        return self.evidence["exit_code"]

    @property
    def is_proved(self) -> bool:
        """Whether a certificate says so of every placement, and rollouts re-checked it."""
        return is_proved(self.evidence)

    @property
    def sentence(self) -> str:
        """For a person."""
        return say(SENTENCES, self.evidence)

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as in `verdict.json`."""
        return {**self.evidence, "sentence": self.sentence}


def judge_policy(
    env: EnvBase,
    actor: TensorDictModuleBase,
    episodes: int,
    *,
    rule: Rule | None = None,
    sampled: bool = True,
    claim: Claim | None = None,
    unlike: Mapping[str, Any] | None = None,
    seed: RootSeed | None = None,
) -> Verdict:
    """Flies a policy, greedily and sampled, and the baselines, all in the same worlds, and judges.

    Args:
        env: A batch of worlds.
        actor: The policy.
        episodes: How many of each.
        rule: Thresholds.
        sampled: Whether to fly the policy with drawn actions, too; one that has no probabilities
            to draw from need not.
        claim: A certificate of the policy in the task of the worlds, if there is one.
        unlike: By what the drones' dynamics differ from those that the policy was made for: setting
            to "own" and "flown", plain values.
        seed: Root of the environments' random streams; without it the verdict says that a policy
            could have been fitted to these environments.
    """
    base: Any = getattr(env, "base_env", env)
    state, worlds = base.state_dict(), worlds_of(env)
    greedy = run_episodes(env, actor, episodes, is_compiled=True)
    drawn = None
    if sampled:
        base.load_state_dict(state)
        drawn = run_episodes(env, actor, episodes, greedy=False)
    baselines = fly_baselines(
        env.batch_size[0], worlds.task, state, episodes, str(worlds.device), worlds.dynamics
    )
    return judge(greedy, baselines, rule=rule, sampled=drawn, claim=claim, unlike=unlike, seed=seed)


def judge(
    greedy: Episodes,
    baselines: Mapping[str, Episodes],
    *,
    rule: Rule | None = None,
    sampled: Episodes | None = None,
    claim: Claim | None = None,
    unlike: Mapping[str, Any] | None = None,
    seed: RootSeed | None = None,
) -> Verdict:
    """Applies the rule.

    Args:
        greedy: The policy's episodes, each with the most probable actions.
        baselines: Those of the task's luck and of the oracle, the k-th in the same world as the
            policy's.
        rule: Thresholds.
        sampled: The policy's episodes with drawn actions, in the same worlds.
        claim: A certificate of the policy in the same task, if there is one.
        unlike: See `judge_policy`.
        seed: See `judge_policy`.

    Raises:
        ValueError: They were flown in different worlds.
    """
    task = greedy.task
    rule = dataclasses.replace(rule or Rule(), strata=task.strata, luck=task.luck)
    _check_pairs(greedy, [*baselines.values(), *([] if sampled is None else [sampled])])
    found = measure(greedy, baselines, rule)
    kind = decide([quantity.level for quantity in found], len(rule.strata))
    certain = _is_certain(found, rule)
    evidence = {
        "kind": kind.value,
        "certain": certain,
        "exit_code": kind.exit_code if certain else NOT_CERTAIN,
        **({"seed": None, "seed_is_fixed": True} if seed is None else seed.as_dict()),
        "rule": rule.text,
        "error_rate": rule.error_rate,
        "good_share": rule.good_share,
        "terms": task.terms.as_dict(),
        "num_cubes": greedy.goals.reached.shape[-1],
        "proof": None if claim is None else claim.beside(greedy),
        "greedy": summarise(greedy),
        "sampled": None if sampled is None else summarise(sampled),
        "baselines": {name: summarise(flown) for name, flown in baselines.items()},
        "skill": {name: _gain(greedy.share, flown.share) for name, flown in baselines.items()},
        "drawing": None if sampled is None else _gain(sampled.success, greedy.success),
        "failures": failure_table(greedy),
        "quantities": {name: q._asdict() for name, q in zip(rule.quantities, found, strict=True)},
        "enough": len(greedy) if certain else _enough(greedy, baselines, rule),
        **({"unlike": dict(unlike)} if unlike else {}),
    }
    return Verdict(kind, certain, evidence)


def measure(
    greedy: Episodes, baselines: Mapping[str, Episodes], rule: Rule, times: int = 1
) -> tuple[Quantity, ...]:
    """The rule's quantities with intervals that hold all at once.

    Args:
        greedy: The policy's episodes.
        baselines: Those of the baselines in the same worlds.
        rule: Thresholds.
        times: Counts every episode so often, to see what more of the same would tell.
    """
    observed = observe(greedy, baselines, rule)
    return tuple(estimate(i, np.tile(values, times), rule) for i, values in enumerate(observed))


def observe(greedy: Episodes, baselines: Mapping[str, Episodes], rule: Rule) -> list[NDArray]:
    """What each episode says of each of the rule's quantities: one value, or none.

    Returns:
        One array a quantity; those of "collected" have a value for each episode that offered such a
        cube, the others one for each episode. Shape: (at most n,), float64.
    """
    oracle = baselines["oracle"]
    observed = [greedy.success - rule.good_share * oracle.success]
    strata = range(len(rule.strata))
    observed += [greedy.offered(stratum).double() for stratum in strata]
    observed += [greedy.stratum_share(stratum) for stratum in strata]
    for name in rule.luck:
        luck = (1 - rule.luck_margin) * baselines[name].share
        observed.append(greedy.share - luck - rule.luck_margin * oracle.share)
    for name in rule.luck:
        observed.append(rule.good_share * oracle.success - baselines[name].success)
    return [values.numpy() for values in observed]


def estimate(quantity: int, values: NDArray, rule: Rule) -> Quantity:
    """One of the rule's quantities from what episodes say of it.

    Args:
        quantity: Its place among them.
        values: As `observe` returns them.
        rule: Thresholds.
    """
    name, thresholds = rule.quantities[quantity], rule.thresholds[quantity]
    if name.startswith("offered"):
        share = proportion(int(values.sum()), len(values), rule.confidence)
        return Quantity(share["share"], share["lower95"], share["upper95"], thresholds)
    low, high = {
        "success": (-rule.good_share, 1.0),
        "collected": (0.0, 1.0),
        "above": (-1.0, 1.0),
        "unsolved": (-1.0, rule.good_share),
    }[name.split()[0]]
    mean = mean_bounds(values, low, high, rule.confidence)
    return Quantity(mean["mean"], mean["lower95"], mean["upper95"], thresholds)


def _is_certain(found: tuple[Quantity, ...], rule: Rule) -> bool:
    box = tuple(quantity.levels for quantity in found)
    return len(kinds_within(box, len(rule.strata))) == 1


def _enough(greedy: Episodes, baselines: Mapping[str, Episodes], rule: Rule) -> int | None:
    """Roughly how many episodes would do if they went on like this; None for very many."""
    for times in MANY:
        if _is_certain(measure(greedy, baselines, rule, times), rule):
            return times * len(greedy)
    return None


def _gain(ours: Tensor, theirs: Tensor) -> dict[str, Any]:
    """The mean paired difference of two shares, with its interval."""
    return mean_bounds(ours - theirs, -1.0, 1.0)


def _check_pairs(greedy: Episodes, others: list[Episodes]) -> None:
    for other in others:
        if not torch.equal(other.goals.world, greedy.goals.world):
            raise ValueError("policy and baselines were flown in different worlds; pair them")
