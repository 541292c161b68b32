"""Whether a policy's episodes depend on rounding, and whether two implementations agree on them."""

import dataclasses
from collections.abc import Sequence
from typing import Any, cast

import torch
from tensordict import TensorDictBase
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.envs import worlds_of
from drone_rl.envs.direct_renderer import DirectRenderer, Reasons
from drone_rl.evaluation.branches import Outcomes, follow
from drone_rl.evaluation.evaluator import StepLog
from drone_rl.evaluation.greedy_flights import (
    batches,
    ending,
    env_base,
    final,
    only,
    parting,
    streams,
)
from drone_rl.evaluation.metrics import Episodes
from drone_rl.policies import PictureNetwork, make_actor
from drone_rl.policies.finite import require_finite
from drone_rl.policies.regrouped import REMEDY, Regrouped, require_same_in_any_batch
from drone_rl.policies.rounding import Decide, RoundingBound, arithmetic_on, decider
from drone_rl.sim.actions import DiscreteActions
from drone_rl.sim.dynamics import ComputerVision
from drone_rl.utils.errors import InputError

COMPARED = 50
"""Episodes that are flown in batches of another composition where there is no fused kernel."""
ALONE = 16
"""Episodes that a network from elsewhere flies again, one frame at a time and in other batches."""
_PAIR = 2
"""Possible actions of a frame of which each is tried."""
MOST_FRAGILE = 0.02
"""Fragile frames, as a fraction of all, up to which a verdict can be certain. Honest policies have
at most 0.002."""
MOST_FRAGILE_EPISODES = 0.25
"""The same of episodes with a fragile frame. Honest policies have at most 0.06."""
MOST_UNEXPLAINED = 0.04
"""Episodes that may end otherwise in another implementation where no bound on rounding is known,
actions are continuous, or drones have flight dynamics. Otherwise none may take other actions,
unless a frame of it was fragile."""


@dataclasses.dataclass(frozen=True)
class Rounding:
    """What rounding can change in some episodes."""

    arithmetic: str
    """What the episodes hold for, such as "float32 on cpu, fused kernel"."""
    is_bound: bool
    """Whether errors are bounded, and not assumed."""
    frames: int
    fragile: int
    """Frames with more than one possible action."""
    is_fragile: Tensor
    """Episodes with such a frame. Shape: (n,), bool."""
    outcomes: Outcomes
    """How these can end; `owner` and `is_open` count all n episodes."""
    compared: str
    """With what the episodes were flown once more."""
    compared_episodes: int
    differing: int
    """Episodes in which that took other actions."""
    unexplained: int
    """Of these those whose frame was not fragile when they parted."""

    @property
    def is_excessive(self) -> bool:
        """Whether so much is fragile, or differs, that no outcome counts."""
        if not self.frames:
            return False
        allowed = 0.0 if self.is_bound else MOST_UNEXPLAINED
        return (
            self.fragile > MOST_FRAGILE * self.frames
            or int(self.is_fragile.sum()) > MOST_FRAGILE_EPISODES * len(self.is_fragile)
            or self.unexplained > allowed * self.compared_episodes
        )

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as in `verdict.json`."""
        fragile = int(self.is_fragile.sum())
        return {
            "arithmetic": self.arithmetic,
            "bound": self.is_bound,
            "frames": self.frames,
            "fragile": self.fragile,
            "fragile_rate": self.fragile / max(1, self.frames),
            "threshold": MOST_FRAGILE,
            "episodes": len(self.is_fragile),
            "fragile_episodes": fragile,
            "fragile_episodes_rate": fragile / max(1, len(self.is_fragile)),
            "threshold_episodes": MOST_FRAGILE_EPISODES,
            "open_episodes": int(self.outcomes.is_open.sum()),
            "compared": self.compared,
            "compared_episodes": self.compared_episodes,
            "differing": self.differing,
            "unexplained": self.unexplained,
            "excessive": self.is_excessive,
        }


def examine(
    env: EnvBase,
    actor: TensorDictModuleBase,
    episodes: int,
    *,
    flown: Episodes,
    log: StepLog,
) -> Rounding | None:
    """Fly the first episodes again in PyTorch, with a bound on the rounding error at every frame.

    Args:
        env: As it was before `flown`.
        actor: The policy.
        episodes: How many; all of `flown` at most.
        flown: Greedy episodes, to compare with.
        log: Their actions.

    Returns:
        None for an actor without a network.

    Raises:
        InputError: An output is not finite.
    """
    network = getattr(actor, "network", None)
    if not isinstance(network, PictureNetwork):
        return None
    decide, is_bound = decider(network)
    arithmetic, is_exact = arithmetic_on(worlds_of(env).device)
    episodes, before = min(episodes, len(flown)), streams(env)
    seen, again = _fly(env, decide, network, episodes)
    # implementations of flight dynamics round otherwise, so that frames are not the same
    is_counted = isinstance(network.actions, DiscreteActions) and isinstance(
        worlds_of(env).dynamics, ComputerVision
    )
    with_what, count = "PyTorch", episodes
    if log.implementation == "PyTorch":
        env_base(env).load_state_dict(before)
        with_what, count = "PyTorch, in other batches", min(COMPARED, episodes)
        again, ends = _fly_regrouped(env, network, count)
    else:
        ends = seen.episodes
    parted = [
        parting(a, b) if is_counted else ending(flown, ends, i)
        for i, (a, b) in enumerate(zip(log.actions[:count], again[:count], strict=True))
    ]
    differing = [i for i, step in enumerate(parted) if step is not None]
    unexplained = [i for i in differing if not seen.explains(i, cast(int, parted[i]))]
    if not RoundingBound.find(network):
        env_base(env).load_state_dict(before)
        _require_function(env, network, log, seen)
    return Rounding(
        arithmetic=f"{arithmetic}, {log.implementation}",
        is_bound=is_bound and is_counted and is_exact,
        frames=sum(map(len, seen.fragile)),
        fragile=int(sum(f.sum() for f in seen.fragile)),
        is_fragile=torch.tensor([bool(f.any()) for f in seen.fragile]),
        outcomes=seen.outcomes(),
        compared=with_what,
        compared_episodes=count,
        differing=len(differing),
        unexplained=len(unexplained),
    )


def compare(
    env: EnvBase, actor: TensorDictModuleBase, *, flown: Episodes, log: StepLog
) -> Rounding | None:
    """Fly the first episodes again by another implementation, the fused kernel if there is one.

    Args:
        env: As it was before `flown`.
        actor: The policy.
        flown: Greedy episodes, flown in PyTorch.
        log: Their actions.

    Returns:
        None for an actor without a network.

    Raises:
        InputError: See `examine`.
    """
    state, count = streams(env), min(COMPARED, len(flown))
    found = examine(env, actor, count, flown=flown, log=log)
    if found is None:
        return None
    env_base(env).load_state_dict(state)
    again, finals = StepLog(), []
    for batch in batches(env, actor, count, is_compiled=True, log=again):
        again.note(batch)
        finals.append(final(env, batch))
    if again.implementation == log.implementation:
        return found
    if isinstance(worlds_of(env).dynamics, ComputerVision):
        parted = [parting(a, b) for a, b in zip(log.actions, again.actions, strict=False)]
    else:
        ends = Episodes.joined(finals)
        parted = [ending(flown, ends, i) for i in range(count)]
    differing = [i for i, at in enumerate(parted) if at is not None]
    unexplained = sum(not found.is_fragile[i] for i in differing)
    return dataclasses.replace(
        found,
        compared=again.implementation,
        differing=len(differing),
        unexplained=unexplained,
    )


class _Deciding(TensorDictModuleBase):
    """Acts greedily and notes whether another action was possible."""

    def __init__(
        self, decide: Decide, network: PictureNetwork, *, is_contrary: bool = False
    ) -> None:
        """Takes a network.

        Args:
            decide: With it.
            network: It.
            is_contrary: Whether to take the second best action where it is possible.
        """
        super().__init__()
        self.in_keys, self.out_keys = ["pixels"], ["action", "fragile"]
        self._decide, self._network, self._is_contrary = decide, network, is_contrary

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Writes "action" and "fragile"."""
        found = self._decide(cast(Tensor, tensordict.get("pixels")))
        require_finite(found.outputs, self._network.owner)
        tensordict.set("fragile", found.is_fragile)
        action = self._network.actions.greedy(found.outputs)
        if self._is_contrary:
            second = found.outputs.topk(2).indices[:, 1]
            action = torch.where(found.possible.sum(-1) == _PAIR, second, action)
        return tensordict.set("action", action)


@dataclasses.dataclass(frozen=True)
class _Seen:
    """Examined episodes."""

    episodes: Episodes
    fragile: list[Tensor]
    """Of each episode, which frames are. Shapes: (T,), bool."""
    followed: list[tuple[int, Outcomes, Tensor]]
    """Of each batch: its first episode, the ends of its fragile ones, and which these are."""
    are_followed: bool
    """Whether the ends can be found at all."""

    def explains(self, episode: int, step: int) -> bool:
        """Whether a frame was fragile up to that step."""
        return bool(self.fragile[episode][: step + 1].any())

    def outcomes(self) -> Outcomes:
        """Those of all episodes."""
        is_fragile = torch.tensor([bool(f.any()) for f in self.fragile])
        if not self.are_followed:
            return Outcomes(None, torch.empty(0, dtype=torch.int64), is_fragile)
        is_open = torch.zeros_like(is_fragile)
        ends, owners = [], []
        for first, found, worlds in self.followed:
            is_open[first + worlds] = found.is_open
            if found.episodes is not None:
                ends.append(found.episodes)
                owners.append(first + worlds[found.owner])
        if not ends:
            return Outcomes(None, torch.empty(0, dtype=torch.int64), is_open)
        return Outcomes(Episodes.joined(ends), torch.cat(owners), is_open)


def _fly(
    env: EnvBase, decide: Decide, network: PictureNetwork, episodes: int
) -> tuple[_Seen, list[Tensor]]:
    """Flies and looks at each frame. Returns also the actions of each episode."""
    renderer = DirectRenderer.try_create(env, ("pixels",), ())
    is_counted = isinstance(network.actions, DiscreteActions)
    fragile, followed, log, finals, first = [], [], StepLog(), [], 0
    before = streams(env)
    for batch in batches(env, _Deciding(decide, network), episodes, ("fragile",)):
        log.note(batch)
        flags = cast(Tensor, batch["fragile"]).cpu()
        lengths = [len(a) for a in log.actions[first:]]
        fragile += flags.split(lengths)
        finals.append(final(env, batch))
        worlds = torch.tensor([bool(f.any()) for f in fragile[first:]]).nonzero()[:, 0]
        is_few = len(worlds) <= MOST_FRAGILE_EPISODES * len(lengths)
        if is_counted and len(worlds):
            if not is_few:
                found = Outcomes(None, worlds[:0], torch.ones_like(worlds, dtype=torch.bool))
            elif not isinstance(renderer, Reasons):
                found = follow(renderer, decide, worlds.to(env.device))
            else:
                actor = _Deciding(decide, network, is_contrary=True)
                found = _contrary(env, actor, before, fragile[first:], worlds)
            followed.append((first, found, worlds))
        first += len(lengths)
        before = streams(env)
    return _Seen(Episodes.joined(finals), fragile, followed, is_counted), log.actions


def _contrary(
    env: EnvBase,
    actor: TensorDictModuleBase,
    before: dict[str, Any],
    fragile: Sequence[Tensor],
    worlds: Tensor,
) -> Outcomes:
    """Fly a batch once more with the second best action in fragile frames.

    That is for policies whose observations cannot be rendered from a state alone. Both flights are
    all that there are of an episode if each has a single fragile frame, the same one.

    Args:
        env: Its streams are the same after as before.
        actor: Takes the second best action where two are possible.
        before: Streams at the start of the batch.
        fragile: Fragile frames of each episode of the batch.
        worlds: Episodes that have any. Shape: (k,).
    """
    after, log = streams(env), StepLog()
    env_base(env).load_state_dict(before)
    (batch,) = batches(env, actor, len(fragile), ("fragile",))
    env_base(env).load_state_dict(after)
    log.note(batch)
    again = cast(Tensor, batch["fragile"]).cpu().split([len(a) for a in log.actions])
    is_open = [
        only(fragile[i]) is None or only(fragile[i]) != only(again[i]) for i in worlds.tolist()
    ]
    return Outcomes(final(env, batch)[worlds], torch.arange(len(worlds)), torch.tensor(is_open))


def _fly_regrouped(
    env: EnvBase, network: PictureNetwork, episodes: int
) -> tuple[list[Tensor], Episodes]:
    """Flies with the network evaluated in other batches. Returns actions and episodes."""
    log, finals = StepLog(), []
    actor = make_actor(Regrouped(network, "mixed"), env.action_spec)
    for batch in batches(env, actor, episodes):
        log.note(batch)
        finals.append(final(env, batch))
    return log.actions, Episodes.joined(finals)


def _require_function(env: EnvBase, network: PictureNetwork, log: StepLog, seen: "_Seen") -> None:
    """Check that a network from elsewhere acts by the frame alone.

    Episodes that were flown in one batch are flown again one frame at a time, and in mixed batches;
    then frames are evaluated in batches of many sizes.

    Raises:
        InputError: It does not.
    """
    before, frames = streams(env), torch.empty(0)
    for groups, words in (("single", "one frame at a time"), ("mixed", "in other batches")):
        env_base(env).load_state_dict(before)
        again, actor = StepLog(), make_actor(Regrouped(network, groups), env.action_spec)
        count = min(ALONE, len(seen.fragile))
        for batch in batches(env, actor, count, ("pixels",)):
            again.note(batch)
            frames = cast(Tensor, batch["pixels"])
        parted = [parting(a, b) for a, b in zip(log.actions, again.actions, strict=False)]
        other = [i for i, at in enumerate(parted) if at is not None and not seen.explains(i, at)]
        if isinstance(network.actions, DiscreteActions) and len(other) > MOST_UNEXPLAINED * count:
            raise InputError(
                f"{network.owner} acts by more than the frame: evaluated {words} it takes other "
                f"actions in {len(other)} of {count} episodes; {REMEDY}"
            )
    require_same_in_any_batch(network, frames, env.batch_size[0])
