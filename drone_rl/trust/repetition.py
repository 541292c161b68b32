"""Repeat a policy's episodes: called in other ways, and with the images of other episodes.

A policy acts by its own observations and its memory of the episode. If the same episodes end
otherwise when it is called with fewer environments at a time, or by another implementation, they
depend on something else: the order of sums, the batch, other calls. If they succeed as often with
the images of other episodes, it does not use its camera.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import torch
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.collectors.complete_episodes import CompleteEpisodes, rollout
from drone_rl.envs import base_env
from drone_rl.envs.observer import with_rows
from drone_rl.envs.rollout import Act, ActorAgent, Agent, StepContext
from drone_rl.policies import ImageNetwork
from drone_rl.policies.policy import BasePolicy
from drone_rl.trust.agents import PolicyAgent
from drone_rl.trust.results import NEEDED_EPISODES, CameraUse, Repeated, Repetition
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import mean_bounds

FEW = 8
"""Environments that a policy is called with at a time, in the second repetition."""
EXCHANGED = 200
"""Episodes with the images of other episodes; the interval of no difference ends at 3 points."""


class InGroups:
    """An agent that is called with so many of the running environments at a time."""

    def __init__(self, agent: Agent, size: int) -> None:
        self._agent, self._size = agent, size

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        groups = torch.arange(len(context.rows), device=context.rows.device).split(self._size)
        acts = [self._agent.act(context.part(group)).action for group in groups]
        return Act(torch.cat(acts))


class WithOtherImages:
    """An agent that observes the next environment instead of its own.

    Where that one's episode has ended, it observes the last images again.
    """

    def __init__(self, agent: Agent) -> None:
        self._agent = agent
        self._last: dict[str, Tensor] = {}
        self._count = 0

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        rows = context.rows
        if bool(context.starts.any()):
            self._count = len(rows)
        for name, values in context.inputs.items():
            self._last[name] = with_rows(self._last.get(name), rows, values)
        other = (rows + 1) % self._count
        inputs = {name: values[other] for name, values in self._last.items()}
        every = torch.arange(len(rows), device=rows.device)
        return self._agent.act(context.part(every, inputs))


def repeat(
    env: EnvBase, actor: TensorDictModuleBase | Agent, greedy: CompleteEpisodes
) -> Repetition:
    """Run the first episodes again, and compare how they end.

    The policy is called with one environment at a time, and with `FEW`. PyTorch evaluates it, so
    that these are another implementation if a fused kernel ran the first episodes.

    Args:
        env: The environments, in the state in which `greedy` began; they keep it.
        actor: The policy.
        greedy: Its greedy episodes.
    """
    first = greedy.first(min(NEEDED_EPISODES, len(greedy)))
    runs = []
    for size, how in ((1, "one environment at a time"), (FEW, f"{FEW} environments at a time")):
        again = _again(InGroups(_as_agent(actor), size), env, len(first), flushes=size == 1)
        is_other = (again.end_reason != first.end_reason) | (
            again.goals.reached != first.goals.reached
        ).any(-1)
        successes = int(again.success.sum())
        runs.append(Repeated(how=how, different=int(is_other.sum()), successes=successes))
    return Repetition(
        implementation=greedy.implementation,
        episodes=len(first),
        successes=int(first.success.sum()),
        runs=tuple(runs),
    )


def exchange_images(
    env: EnvBase, actor: TensorDictModuleBase | Agent, greedy: CompleteEpisodes
) -> CameraUse:
    """Run the episodes again with the images of other episodes; the arguments are `repeat`'s."""
    greedy = greedy.first(min(EXCHANGED, len(greedy)))
    exchanged = _again(WithOtherImages(_as_agent(actor)), env, len(greedy))
    strata = {}
    confidence = 1.0 - 0.05 / len(greedy.task.strata)
    for i, name in enumerate(greedy.task.strata):
        both = greedy.offered(i) & exchanged.offered(i)
        shares = [_share(episodes, i)[both] for episodes in (greedy, exchanged)]
        strata[name] = mean_bounds(shares[0] - shares[1], -1.0, 1.0, confidence)
    success = mean_bounds(greedy.success - exchanged.success, -1.0, 1.0)
    rates = [float(of.success.mean()) for of in (greedy, exchanged)]
    return CameraUse(own=rates[0], exchanged=rates[1], success=success, strata=strata)


def _share(episodes: CompleteEpisodes, stratum: int) -> Tensor:
    """Return the fraction of a stratum's goals reached, NaN without any. Shape: (n,), float64."""
    share = torch.full((len(episodes),), torch.nan, dtype=torch.float64)
    share[episodes.offered(stratum)] = episodes.stratum_share(stratum)
    return share


def require_repeatable(
    policy: BasePolicy, *, seed: int, device: str = "cpu", renderer: str = "raytrace"
) -> None:
    """Check that a policy's episodes can be repeated, see `repeat`.

    The seed, device and renderer are those of the environments, see `BasePolicy.flying`.

    Raises:
        InputError: They end otherwise.
    """
    options: dict[str, Any] = {"seed": seed, "device": device, "renderer": renderer}
    with policy.flying(NEEDED_EPISODES, **options) as (env, actor):
        state = base_env(env).state_dict()
        greedy = rollout(actor, env, NEEDED_EPISODES, compiled=True)
        base_env(env).load_state_dict(state)
        found = repeat(env, actor, greedy)
    if not found.is_same:
        raise InputError(
            f"policy={policy.name} acts by more than its observations: with {found.worst.how}, "
            f"{found.worst.different} of {found.episodes} episodes end otherwise; give a policy "
            "whose actions depend on no other environment, no other episode and no order of sums"
        )


def _as_agent(actor: TensorDictModuleBase | Agent) -> Agent:
    """Return an agent that acts like an actor, without memory of earlier episodes."""
    network = getattr(actor, "network", None)
    if isinstance(network, ImageNetwork):
        return PolicyAgent(network)
    return ActorAgent(actor) if isinstance(actor, TensorDictModuleBase) else actor


def _again(agent: Agent, env: EnvBase, episodes: int, *, flushes: bool = False) -> CompleteEpisodes:
    """Run the first episodes again and restore the environments."""
    state = base_env(env).state_dict()
    with _subnormal_numbers(flushed=flushes):
        done = rollout(agent, env, episodes, exact=True)
    base_env(env).load_state_dict(state)
    return done


@contextmanager
def _subnormal_numbers(*, flushed: bool) -> Iterator[None]:
    """Count subnormal numbers as zero in the calling thread, as some processors and kernels do."""
    was = bool(torch.tensor(1e-40) * 1.0 == 0.0)
    torch.set_flush_denormal(flushed or was)
    try:
        yield
    finally:
        torch.set_flush_denormal(was)
