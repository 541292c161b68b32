"""Rate of verdicts that are certain and wrong, for simulated policies near every threshold.

A simulated policy samples each episode from a few types. A type defines the sides of the cubes,
which are collected, and the baselines' results. So the policy's true kind by the rule is known.
"""

import dataclasses
import functools
import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from drone_rl.collectors.complete_episodes import CompleteEpisodes
from drone_rl.sim.tasks import CollectCubes, Goals
from drone_rl.sim.tasks.collect_cubes import CubesEnd, Side
from drone_rl.trust.baselines import BASELINES
from drone_rl.trust.rule import Quantity, Rule, VerdictKind, decide, kinds_within
from drone_rl.trust.verdict import estimate, observe

L, A, R = Side
Type = tuple[tuple[Side, ...], tuple[int, ...], bool]
"""Sides of an episode's cubes, whether each is collected, and whether flying straight succeeds."""
SHIFTS = (-0.03, 0.0, 0.03)
"""Distances of policies from a threshold."""
EPISODES = (400, 1600)
_RULE, _TASK = Rule(), CollectCubes()


@dataclasses.dataclass(frozen=True)
class SimulatedPolicy:
    """A policy as a mixture of types of episodes."""

    types: Mapping[Type, float]
    """The types and their probabilities, which sum to 1."""
    forward_share: float = 0.0
    """Fraction of the cubes that flying straight collects in every episode."""

    @functools.cached_property
    def observed(self) -> list[NDArray]:
        """Value of each quantity in each type of episode; NaN if undefined. Shapes: (types,)."""
        each = [_observe(kind, self.forward_share) for kind in self.types]
        return [np.array(values) for values in zip(*each, strict=True)]

    @property
    def shares(self) -> NDArray:
        """Probabilities of the types."""
        return np.array(list(self.types.values()))

    @property
    def kind(self) -> VerdictKind:
        """The true kind."""
        return decide([self._truth(i).level for i in range(len(_RULE.quantities))])

    def _truth(self, quantity: int) -> Quantity:
        values, thresholds = self.observed[quantity], _RULE.thresholds[quantity]
        defined = ~np.isnan(values)
        if not self.shares[defined].sum():
            return Quantity(value=None, lower=0.0, upper=1.0, thresholds=thresholds)
        mean = float(np.average(values[defined], weights=self.shares[defined]))
        return Quantity(value=mean, lower=mean, upper=mean, thresholds=thresholds)


def policies() -> dict[str, SimulatedPolicy]:
    """Return policies at and near each threshold of the rule, and at two thresholds at once."""
    policies: dict[str, SimulatedPolicy] = {}
    for shift in SHIFTS:
        shifted = {
            "all or nothing, success": _mixture(0.9 + shift, (L, R), (1, 1), (0, 0)),
            "last cube, success": _mixture(0.9 + shift, (L, A, R), (1, 1, 1), (1, 1, 0)),
            "ahead, seldom offered": _join(
                (0.85, _mixture(1.0, (L, R), (1, 1), (1, 1))),
                (0.15, _mixture(0.7 + shift, (A, A), (1, 1), (0, 0))),
            ),
            "ahead, seldom offered, independent cubes": _join(
                (0.85, _mixture(1.0, (L, R), (1, 1), (1, 1))),
                (0.15, _independent((A, A), 0.7 + shift)),
            ),
            "left just short of none": _mixture(0.3 + shift, (L, R), (1, 1), (0, 1)),
            "right just enough, left lost": _mixture(0.7 + shift, (L, R), (0, 1), (0, 0)),
            "both sides at once": _join(
                (0.5, _mixture(0.3 - shift, (L, L), (1, 1), (0, 0))),
                (0.5, _mixture(0.7 + shift, (R, R), (1, 1), (0, 0))),
            ),
            "left lost and seldom offered": _join(
                (0.05 + shift, _mixture(1.0, (L, R), (0, 1), (0, 1))),
                (0.95 - shift, _mixture(1.0, (A, R), (1, 1), (1, 1))),
            ),
            "ahead lost and seldom offered": _join(
                (0.05 + shift, _mixture(1.0, (A, R), (0, 1), (0, 1))),
                (0.95 - shift, _mixture(1.0, (L, R), (1, 1), (1, 1))),
            ),
            "luck, all or nothing": _mixture(
                5 / 12 + shift, (L, R), (1, 1), (0, 0), forward_share=0.3
            ),
            "luck, independent cubes": _independent((L, R), 5 / 12 + shift, forward_share=0.3),
            "trivial, flying straight succeeds": _solved_by_flying_straight(0.9 + shift),
            "trivial and success at once": _join(
                (0.9 + shift, _solved_by_flying_straight(1.0)),
                (0.1 - shift, _mixture(1.0, (A, A), (0, 0), (0, 0))),
            ),
            "success and ahead at once": _join(
                (2 / 3, _mixture(1.0, (L, R), (1, 1), (1, 1))),
                (1 / 3, _mixture(0.7 + shift, (A, L), (1, 1), (0, 1))),
            ),
        }
        policies |= {f"{name} {shift:+.2f}": policy for name, policy in shifted.items()}
    return policies


def bench_false_certain(quick: bool) -> dict[str, Any]:
    """Measure the rate of verdicts that are certain and wrong, for all `policies`.

    Args:
        quick: Whether to take few samples, of the smaller size only.

    Returns:
        "false_certain_rate", the largest rate; "false_certain_worst", its row; "certain", all rows.
    """
    draws, sizes = (20, EPISODES[:1]) if quick else (400, EPISODES)
    rng, rows = np.random.default_rng(0), []
    for name, policy in policies().items():
        for episodes in sizes:
            kinds = judge_samples(policy, rng.multinomial(episodes, policy.shares, draws))
            wrong = sum(kind not in (None, policy.kind) for kind in kinds)
            row = {"policy": name, "kind": policy.kind.value, "episodes": episodes, "draws": draws}
            row |= {"certain": sum(k is not None for k in kinds) / draws, "wrong": wrong / draws}
            rows.append(row)
    worst = max(rows, key=lambda row: row["wrong"])
    return {"false_certain_rate": worst["wrong"], "false_certain_worst": worst, "certain": rows}


def judge_samples(policy: SimulatedPolicy, counts: NDArray) -> list[VerdictKind | None]:
    """Return the kind of each sample if the verdict is certain, else None.

    Args:
        policy: Policy of the samples.
        counts: Numbers of episodes of each type in each sample. Shape: (samples, types).
    """

    @functools.cache
    def levels(quantity: int, *row: int) -> tuple[int, int]:
        return estimate(quantity, np.repeat(merged[quantity][0], row), _RULE).levels

    merged = [_merge(values) for values in policy.observed]
    kinds = []
    for sample in counts:
        box = tuple(
            levels(i, *(int(sample[of].sum()) for of in which))
            for i, (_, which) in enumerate(merged)
        )
        possible = kinds_within(box)
        kinds.append(next(iter(possible)) if len(possible) == 1 else None)
    return kinds


def _merge(values: NDArray) -> tuple[NDArray, list[NDArray]]:
    """Return the distinct values, and the types that have each."""
    distinct = np.unique(values[~np.isnan(values)])
    return distinct, [np.flatnonzero(values == value) for value in distinct]


def _mixture(
    share: float,
    sides: tuple[Side, ...],
    first: tuple,
    second: tuple,
    forward_share: float = 0.0,
) -> SimulatedPolicy:
    """Collect the cubes of `first` in a fraction of the episodes, those of `second` in others."""
    types = {(sides, first, False): share}
    types[sides, second, False] = types.get((sides, second, False), 0.0) + 1.0 - share
    return SimulatedPolicy(types, forward_share)


def _solved_by_flying_straight(share: float) -> SimulatedPolicy:
    """Collect all cubes; flying straight does, too, in a fraction of the episodes."""
    types = {((A, A), (1, 1), True): share, ((A, A), (1, 1), False): 1.0 - share}
    return SimulatedPolicy({kind: share for kind, share in types.items() if share > 0})


def _independent(
    sides: tuple[Side, Side], share: float, forward_share: float = 0.0
) -> SimulatedPolicy:
    """Collect each of two cubes independently."""
    chance = {1: share, 0: 1.0 - share}
    pairs = itertools.product((1, 0), repeat=2)
    types = {(sides, (a, b), False): chance[a] * chance[b] for a, b in pairs}
    return SimulatedPolicy(types, forward_share)


def _join(*parts: tuple[float, SimulatedPolicy]) -> SimulatedPolicy:
    types: dict[Type, float] = {}
    for weight, part in parts:
        for kind, share in part.types.items():
            types[kind] = types.get(kind, 0.0) + weight * share
    return SimulatedPolicy(types, parts[0][1].forward_share)


@functools.cache
def _observe(kind: Type, forward_share: float) -> list[float]:
    """Return the value of each quantity of the rule in one episode of a type."""
    sides, hits, is_solved = kind
    ours = _episode(sides, hits)
    baselines = {name: _episode(sides, [0] * len(sides)) for name in BASELINES}
    baselines["oracle"] = _episode(sides, [1] * len(sides))
    baselines["forward"] = _episode(sides, [int(is_solved)] * len(sides))
    observed = [float(value) for (value,) in observe(ours, baselines, _RULE)]
    straight = _RULE.quantities.index("above forward")
    observed[straight] -= (1 - _RULE.poor_margin) * forward_share
    return observed


def _episode(sides: tuple[Side, ...], hits: Any) -> CompleteEpisodes:
    side = torch.tensor([[int(s) for s in sides]])
    return CompleteEpisodes(
        task=_TASK,
        goals=Goals(
            reached=torch.tensor([list(hits)], dtype=torch.bool),
            stratum=side,
            world=torch.zeros(1, 1),
        ),
        end_reason=torch.tensor([_TASK.success_end if all(hits) else CubesEnd.STEP_LIMIT]),
        length=torch.ones(1, dtype=torch.int64),
    )
