"""Check whether a policy's episodes depend on rounding, and whether implementations agree."""

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, cast

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.collectors.complete_episodes import (
    Episodes,
    StepLog,
    episode_batches,
    final_episodes,
    run_episodes,
)
from drone_rl.envs import base_env, worlds_of
from drone_rl.envs.direct_renderer import DirectRenderer, Reasons
from drone_rl.policies import ImageNetwork, make_actor
from drone_rl.policies.external_policy import ExternalPolicy
from drone_rl.policies.networks import require_finite
from drone_rl.policies.policy import BasePolicy
from drone_rl.policies.rounding import (
    REMEDY,
    Decide,
    Regrouped,
    arithmetic_on,
    decider,
    require_same_in_any_batch,
)
from drone_rl.sim.actions import DiscreteActions
from drone_rl.sim.dynamics import ComputerVision
from drone_rl.trust.outcomes import (
    MAX_FRAGILE_EPISODES,
    MAX_UNEXPLAINED,
    OutcomeSet,
    Rounding,
    enumerate_outcomes,
)
from drone_rl.trust.rollouts import first_difference, only_index, outcome_difference
from drone_rl.utils.errors import InputError

_CHECKED_EPISODES = 32
"""Episodes that check whether a third-party policy depends on the current frame only."""
COMPARED = 50
"""Episodes that are run again: by the other implementation, or in other batches."""
ALONE = 16
"""Episodes that a third-party network runs again one frame at a time and in other batches."""

_BATCH_SIZES = (*range(1, 65), 100, 128, 200, 250, 256, 400, 500, 512, 1000)
"""Sizes of the batches in which the same frames are evaluated."""


def run_compared(
    env: EnvBase, actor: TensorDictModuleBase, num_episodes: int
) -> tuple[Episodes, Rounding | None]:
    """Run greedy episodes in PyTorch, and the first ones again by another implementation.

    Return the episodes and what `compare_implementations` returns.

    Raises:
        InputError: See `check_rounding`.
    """
    state, log = base_env(env).state_dict(), StepLog()
    episodes = run_episodes(env, actor, num_episodes, log=log)
    base_env(env).load_state_dict(state)
    return episodes, compare_implementations(env, actor, greedy=episodes, log=log)


def require_function(policy: BasePolicy, **how: Any) -> None:
    """Check that a third-party policy depends on the current frame only.

    Others are not checked: their descriptions state whether they use earlier frames. `how` are the
    seed, device and renderer of the environments, see `BasePolicy.flying`.

    Raises:
        InputError: Its actions depend on the batch, on a frame's row, or on earlier calls.
    """
    if isinstance(policy, ExternalPolicy):
        with policy.flying(_CHECKED_EPISODES, **how) as (env, actor):
            run_compared(env, actor, _CHECKED_EPISODES)


def check_rounding(
    env: EnvBase,
    actor: TensorDictModuleBase,
    episodes: int,
    *,
    greedy: Episodes,
    log: StepLog,
) -> Rounding | None:
    """Run the first episodes again in PyTorch, with a bound on the rounding error at every frame.

    They are compared with greedy episodes and their actions, `greedy` and `log`, which started from
    the present state of the environments. Return None for an actor without a
    network that depends on single images only.

    Raises:
        InputError: An output is not finite, or a third-party network depends on other frames.
    """
    network = _network_of(actor)
    return network and _check_rounding(env, network, episodes, greedy, log)[0]


def _network_of(actor: TensorDictModuleBase) -> ImageNetwork | None:
    network = getattr(actor, "network", None)
    is_checked = isinstance(network, ImageNetwork) and not network.is_recurrent
    return network if is_checked else None


def _check_rounding(
    env: EnvBase, network: ImageNetwork, episodes: int, greedy: Episodes, log: StepLog
) -> tuple[Rounding, "_Checked"]:
    decide, is_bound = decider(network)
    arithmetic, is_exact = arithmetic_on(worlds_of(env).device)
    episodes, before = min(episodes, len(greedy)), base_env(env).state_dict()
    checked, again = _run_checked(env, decide, network, episodes)
    by_action = _by_action(env, network)
    compared, count, ends = "PyTorch", episodes, checked.episodes
    if log.implementation == "PyTorch":
        base_env(env).load_state_dict(before)
        compared, count = "PyTorch, in other batches", min(COMPARED, episodes)
        again, ends = _run_regrouped(env, network, count)
    differing = _differences(greedy, ends, log.actions, again, count, by_action=by_action)
    if not is_bound:
        base_env(env).load_state_dict(before)
        _require_function_of_frames(env, network, log, checked)
    found = Rounding(
        arithmetic=f"{arithmetic}, {log.implementation}",
        is_bound=is_bound and by_action and is_exact,
        frames=sum(map(len, checked.fragile)),
        fragile=int(sum(f.sum() for f in checked.fragile)),
        is_fragile=checked.is_fragile,
        outcomes=checked.outcomes(),
        compared=compared,
        compared_episodes=count,
        differing=len(differing),
        unexplained=checked.unexplained(differing),
    )
    return found, checked


def compare_implementations(
    env: EnvBase, actor: TensorDictModuleBase, *, greedy: Episodes, log: StepLog
) -> Rounding | None:
    """Run the first episodes again by another implementation: the fused kernel if there is one.

    Arguments, result and errors are those of `check_rounding`; `greedy` was run in PyTorch.
    """
    network = _network_of(actor)
    if network is None:
        return None
    state, count = base_env(env).state_dict(), min(COMPARED, len(greedy))
    found, checked = _check_rounding(env, network, count, greedy, log)
    base_env(env).load_state_dict(state)
    again, by_action = StepLog(), _by_action(env, network)
    ends = run_episodes(env, actor, count, is_compiled=True, is_exact=True, log=again)
    if again.implementation == log.implementation:
        return found
    differing = _differences(greedy, ends, log.actions, again.actions, count, by_action=by_action)
    return dataclasses.replace(
        found,
        compared=again.implementation,
        differing=len(differing),
        unexplained=checked.unexplained(differing),
    )


def _by_action(env: EnvBase, network: ImageNetwork) -> bool:
    """Return whether episodes are compared by action, not only by outcome.

    Implementations of flight dynamics round differently, so frames are not the same.
    """
    return isinstance(network.actions, DiscreteActions) and isinstance(
        worlds_of(env).dynamics, ComputerVision
    )


def _differences(
    greedy: Episodes,
    ends: Episodes,
    actions: Sequence[Tensor],
    again: Sequence[Tensor],
    count: int,
    *,
    by_action: bool,
) -> dict[int, int]:
    """By differing episode the first other action's step, or the length if the outcome differs."""
    if by_action:
        pairs = zip(actions[:count], again[:count], strict=True)
        steps = [first_difference(one, other) for one, other in pairs]
    else:
        steps = [outcome_difference(greedy, ends, i) for i in range(count)]
    return _differing(steps)


def _differing(steps: Iterable[int | None]) -> dict[int, int]:
    """Return the steps at which episodes differ, by the index of those that do."""
    return {i: step for i, step in enumerate(steps) if step is not None}


class _CheckingActor(TensorDictModuleBase):
    """Act greedily, and write whether rounding could change the action."""

    def __init__(self, decide: Decide, network: ImageNetwork, *, is_contrary: bool = False) -> None:
        """Take a network; `is_contrary`: take the other action where two are possible."""
        super().__init__()
        self.in_keys, self.out_keys = ["pixels"], ["action", "fragile"]
        self._decide, self._network, self._is_contrary = decide, network, is_contrary

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Write "action" and "fragile"."""
        found = self._decide(cast(Tensor, tensordict.get("pixels")))
        require_finite(found.outputs, self._network.owner)
        tensordict.set("fragile", found.is_fragile)
        action = self._network.actions.greedy(found.outputs)
        if self._is_contrary:
            others = found.possible.scatter(1, action[:, None], False)
            action = torch.where(others.sum(-1) == 1, others.int().argmax(-1), action)
        return tensordict.set("action", action)


@dataclasses.dataclass(frozen=True)
class _Checked:
    """Episodes whose every frame was checked for rounding."""

    episodes: Episodes
    fragile: list[Tensor]
    """By episode, which frames are fragile. Shapes: (T,), bool."""
    followed: list[tuple[int, OutcomeSet, Tensor]] | None
    """By batch: its first episode, the outcomes of its fragile ones, and which these are. None if
    they cannot be enumerated."""

    def unexplained(self, differing: Mapping[int, int]) -> int:
        """Count the episodes without a fragile frame up to the given step of each."""
        return sum(not self.fragile[i][: step + 1].any() for i, step in differing.items())

    @property
    def is_fragile(self) -> Tensor:
        """Episodes with a fragile frame. Shape: (n,), bool."""
        return torch.tensor([bool(f.any()) for f in self.fragile])

    def outcomes(self) -> OutcomeSet:
        """Possible outcomes of all episodes."""
        none = torch.empty(0, dtype=torch.int64)
        if self.followed is None:
            return OutcomeSet(None, none, self.is_fragile)
        is_open = torch.zeros_like(self.is_fragile)
        ends, owners = [], []
        for first, found, worlds in self.followed:
            is_open[first + worlds] = found.is_open
            if found.episodes is not None:
                ends.append(found.episodes)
                owners.append(first + worlds[found.owner])
        if not ends:
            return OutcomeSet(None, none, is_open)
        return OutcomeSet(Episodes.joined(ends), torch.cat(owners), is_open)


def _run_checked(
    env: EnvBase, decide: Decide, network: ImageNetwork, episodes: int
) -> tuple[_Checked, list[Tensor]]:
    """Run episodes and check each frame. Returns also the actions of each episode."""
    renderer = DirectRenderer.try_create(env, ("pixels",), ())
    is_discrete = isinstance(network.actions, DiscreteActions)
    fragile, followed, log, finals, first = [], [], StepLog(), [], 0
    before, actor = base_env(env).state_dict(), _CheckingActor(decide, network)
    for batch in episode_batches(env, actor, episodes, ("fragile",), log=log):
        lengths = [len(a) for a in log.actions[first:]]
        fragile += cast(Tensor, batch["fragile"]).cpu().split(lengths)
        finals.append(final_episodes(env, batch))
        worlds = torch.tensor([bool(f.any()) for f in fragile[first:]]).nonzero()[:, 0]
        if is_discrete and len(worlds):
            if len(worlds) > MAX_FRAGILE_EPISODES * len(lengths):
                found = OutcomeSet(None, worlds[:0], torch.ones_like(worlds, dtype=torch.bool))
            elif not isinstance(renderer, Reasons):
                found = enumerate_outcomes(renderer, decide, worlds.to(env.device))
            else:
                contrary = _CheckingActor(decide, network, is_contrary=True)
                taken = log.actions[first:]
                found = _run_other_actions(env, contrary, before, taken, fragile[first:], worlds)
            followed.append((first, found, worlds))
        first += len(lengths)
        before = base_env(env).state_dict()
    followed = followed if is_discrete else None
    return _Checked(Episodes.joined(finals), fragile, followed), log.actions


def _run_other_actions(
    env: EnvBase,
    actor: TensorDictModuleBase,
    before: dict[str, Any],
    taken: Sequence[Tensor],
    fragile: Sequence[Tensor],
    env_ids: Tensor,
) -> OutcomeSet:
    """Run a batch again with the other action in fragile frames where two are possible.

    For policies whose observations cannot be rendered from a state. If each of the two rollouts
    has a single fragile frame, in which they take different actions, there are no other outcomes.
    `before` has the random streams at the start of the batch, `taken` the first rollout's actions,
    and `env_ids` are the episodes with fragile frames.
    """
    after, log = base_env(env).state_dict(), StepLog()
    base_env(env).load_state_dict(before)
    (batch,) = episode_batches(env, actor, len(fragile), ("fragile",), log=log)
    base_env(env).load_state_dict(after)
    again = cast(Tensor, batch["fragile"]).cpu().split([len(a) for a in log.actions])
    steps = [
        (only_index(fragile[i]), only_index(again[i]), first_difference(taken[i], log.actions[i]))
        for i in env_ids.tolist()
    ]
    is_open = torch.tensor([None in three or len(set(three)) > 1 for three in steps])
    return OutcomeSet(final_episodes(env, batch)[env_ids], torch.arange(len(env_ids)), is_open)


def _run_regrouped(
    env: EnvBase, network: ImageNetwork, episodes: int
) -> tuple[list[Tensor], Episodes]:
    """Run with the network evaluated in other batches. Returns actions and episodes."""
    log, actor = StepLog(), make_actor(Regrouped(network, "mixed"), env.action_spec)
    ends = run_episodes(env, actor, episodes, is_exact=True, log=log)
    return log.actions, ends


def _require_function_of_frames(
    env: EnvBase, network: ImageNetwork, log: StepLog, checked: _Checked
) -> None:
    """Check that a third-party network depends on the frame alone, in batches of any size."""
    before, frames = base_env(env).state_dict(), torch.empty(0)
    count = min(ALONE, len(checked.fragile))
    for groups, how in (("single", "one frame at a time"), ("mixed", "in other batches")):
        base_env(env).load_state_dict(before)
        again, actor = StepLog(), make_actor(Regrouped(network, groups), env.action_spec)
        for batch in episode_batches(env, actor, count, ("pixels",), log=again):
            frames = cast(Tensor, batch["pixels"])
        steps = map(first_difference, log.actions, again.actions)  # until one log ends
        other = checked.unexplained(_differing(steps))
        if isinstance(network.actions, DiscreteActions) and other > MAX_UNEXPLAINED * count:
            raise InputError(
                f"{network.owner} depends on more than the frame: evaluated {how} it takes other "
                f"actions in {other} of {count} episodes; {REMEDY}"
            )
    require_same_in_any_batch(network, frames, sorted({*_BATCH_SIZES, env.batch_size[0]}))
