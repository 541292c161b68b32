"""Check whether a policy's episodes depend on rounding, and whether implementations agree."""

from collections.abc import Iterable, Sequence
from typing import Any, cast

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.collectors.complete_episodes import CompleteEpisodes, rollout
from drone_rl.envs import base_env, worlds_of
from drone_rl.envs.rollout import Agent
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
from drone_rl.trust.results import MAX_UNEXPLAINED, Rounding
from drone_rl.utils.errors import InputError

COMPARED = 50
"""Episodes that are run again: by the other implementation, or in other batches."""
ALONE = 16
"""Episodes that a third-party network runs again one frame at a time and in other batches."""
_CHECKED_EPISODES = 32
"""Episodes that check whether a third-party policy depends on the current frame only."""
_BATCH_SIZES = (*range(1, 65), 100, 128, 200, 250, 256, 400, 500, 512, 1000)
"""Sizes of the batches in which the same frames are evaluated."""


def require_function(
    policy: BasePolicy, *, seed: int, device: str = "cpu", renderer: str = "raytrace"
) -> None:
    """Check that a third-party policy depends on the current frame only.

    Others are not checked: their descriptions state whether they use earlier frames. The seed,
    device and renderer are those of the environments, see `BasePolicy.flying`.

    Raises:
        InputError: Its actions depend on the batch, on a frame's row, or on earlier calls.
    """
    if isinstance(policy, ExternalPolicy):
        options: dict[str, Any] = {"seed": seed, "device": device, "renderer": renderer}
        with policy.flying(_CHECKED_EPISODES, **options) as (env, actor):
            state = base_env(env).state_dict()
            greedy = rollout(actor, env, _CHECKED_EPISODES)
            base_env(env).load_state_dict(state)
            check_rounding(env, actor, COMPARED, greedy)


def check_rounding(
    env: EnvBase,
    actor: TensorDictModuleBase | Agent,
    episodes: int,
    greedy: CompleteEpisodes,
) -> Rounding | None:
    """Run the first episodes again, with a bound on the rounding error at every frame.

    They are compared with `greedy` episodes, which started from the present state of the
    environments. If the fused kernel ran those, PyTorch runs them again; otherwise PyTorch with the
    frames in other batches.

    Args:
        env: The environments.
        actor: The policy's actor.
        episodes: How many at most.
        greedy: Greedy episodes of the policy.

    Returns:
        None for an actor without a network that depends on single images only.

    Raises:
        InputError: An output is not finite, or a third-party network depends on other frames.
    """
    network = getattr(actor, "network", None)
    if not isinstance(network, ImageNetwork) or network.is_recurrent:
        return None
    decide, is_bound = decider(network)
    arithmetic, is_exact = arithmetic_on(worlds_of(env).device)
    episodes, state = min(episodes, len(greedy)), base_env(env).state_dict()
    checking = _CheckingActor(decide, network)
    again = rollout(checking, env, episodes, exact=True, keep=("action", "fragile"))
    fragile, compared = again.each("fragile"), again.implementation
    if greedy.implementation == "PyTorch":
        mixed = make_actor(Regrouped(network, "mixed"), env.action_spec)
        base_env(env).load_state_dict(state)
        again = rollout(mixed, env, min(COMPARED, episodes), exact=True)
        compared = "PyTorch, in other batches"
    count = len(again)
    if by_action := _is_compared_by_action(env, network):
        pairs = zip(greedy.each("action")[:count], again.each("action"), strict=True)
        steps = [_first_difference(one, other) for one, other in pairs]
    else:
        steps = [_other_outcome(greedy, again, i) for i in range(count)]
    if not is_bound:
        base_env(env).load_state_dict(state)
        _require_function_of_frames(env, network, greedy.each("action"), fragile)
    return Rounding(
        arithmetic=f"{arithmetic}, {greedy.implementation}",
        bound=is_bound and by_action and is_exact,
        frames=sum(map(len, fragile)),
        fragile=int(sum(f.sum() for f in fragile)),
        episodes=len(fragile),
        fragile_episodes=sum(bool(f.any()) for f in fragile),
        compared=compared,
        compared_episodes=count,
        differing=sum(step is not None for step in steps),
        unexplained=_count_unexplained(steps, fragile),
    )


def _is_compared_by_action(env: EnvBase, network: ImageNetwork) -> bool:
    """Return whether episodes are compared by action, not only by outcome.

    Implementations of flight dynamics round differently, so frames are not the same.
    """
    dynamics = worlds_of(env).dynamics
    return isinstance(network.actions, DiscreteActions) and isinstance(dynamics, ComputerVision)


def _first_difference(one: Tensor, other: Tensor) -> int | None:
    """Return the first step at which two sequences of actions differ, or None."""
    shared = min(len(one), len(other))
    steps = (one[:shared] != other[:shared]).nonzero()
    if len(steps):
        return int(steps[0, 0])
    return None if len(one) == len(other) else shared


def _other_outcome(one: CompleteEpisodes, other: CompleteEpisodes, i: int) -> int | None:
    """Return the length of episode i if its outcomes differ, or None."""
    is_same = bool(one.end_reason[i] == other.end_reason[i]) and torch.equal(
        one.goals.reached[i], other.goals.reached[i]
    )
    return None if is_same else int(one.length[i])


def _count_unexplained(steps: Iterable[int | None], fragile: Sequence[Tensor]) -> int:
    """Count the differing episodes without a fragile frame up to the step where they differ."""
    differing = ((i, step) for i, step in enumerate(steps) if step is not None)
    return sum(not fragile[i][: step + 1].any() for i, step in differing)


class _CheckingActor(TensorDictModuleBase):
    """Act greedily, and write whether rounding could change the action."""

    def __init__(self, decide: Decide, network: ImageNetwork) -> None:
        super().__init__()
        self.in_keys, self.out_keys = ["pixels"], ["action", "fragile"]
        self._decide, self._network = decide, network

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Write "action" and "fragile"."""
        decisions = self._decide(cast(Tensor, tensordict.get("pixels")))
        require_finite(decisions.outputs, self._network.owner)
        tensordict.set("fragile", decisions.is_fragile)
        return tensordict.set("action", self._network.actions.greedy(decisions.outputs))


def _require_function_of_frames(
    env: EnvBase, network: ImageNetwork, actions: Sequence[Tensor], fragile: Sequence[Tensor]
) -> None:
    """Check that a third-party network depends on the frame alone, in batches of any size."""
    before, frames = base_env(env).state_dict(), torch.empty(0)
    count = min(ALONE, len(fragile))
    for groups, how in (("single", "one frame at a time"), ("mixed", "in other batches")):
        base_env(env).load_state_dict(before)
        actor = make_actor(Regrouped(network, groups), env.action_spec)
        again = rollout(actor, env, count, exact=True, keep=("action", "pixels"))
        assert again.steps is not None
        frames = cast(Tensor, again.steps["pixels"]).to(env.device)
        steps = map(_first_difference, actions, again.each("action"))  # until one ends
        other = _count_unexplained(steps, fragile)
        if isinstance(network.actions, DiscreteActions) and other > MAX_UNEXPLAINED * count:
            raise InputError(
                f"{network.owner} depends on more than the frame: evaluated {how} it takes other "
                f"actions in {other} of {count} episodes; {REMEDY}"
            )
    require_same_in_any_batch(network, frames, sorted({*_BATCH_SIZES, env.batch_size[0]}))
