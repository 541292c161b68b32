"""Repeat a policy's episodes: called in other ways, and with the inputs of other episodes.

A policy acts by its own observations and its memory of the episode. If the same episodes end
otherwise when it is called with fewer environments at a time, or by another implementation, they
depend on something else: the order of sums, the batch, other calls. If they succeed as often with
the images of other episodes, it does not use its camera. Of several inputs, each is exchanged
alone, too.
"""

import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any

import torch
from tensordict.nn import TensorDictModuleBase
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.collectors.complete_episodes import CompleteEpisodes, rollout
from drone_rl.envs import base_env
from drone_rl.envs.observer import with_rows
from drone_rl.envs.rollout import Act, Agent, StepContext, as_agent
from drone_rl.policies.policy import BasePolicy
from drone_rl.trust.results import NEEDED_EPISODES, CameraUse, InputUse, Repeated, Repetition
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import mean_bounds, proportion

FEW = 8
"""Environments that a policy is called with at a time, in the second repetition."""
EXCHANGED = 200
"""Episodes with the images of other episodes; the interval of no difference ends at 3 points."""
DONORS = (1, 7, 31)
"""Which further environments' inputs an action is compared with."""
_REPEATED = zlib.crc32(b"repeated episodes")
"""Key of the random stream that selects them; see `DroneEnv.side_streams`."""


class InGroups:
    """An agent that is called with so many of the running environments at a time."""

    def __init__(self, agent: Agent, size: int) -> None:
        self._agent, self._size = agent, size

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        firsts = range(0, len(context.rows), self._size)
        groups = (context.part(slice(first, first + self._size)) for first in firsts)
        return Act(torch.cat([self._agent.act(group).action for group in groups]))


class WithOtherInputs:
    """An agent that observes the next environment instead of its own.

    Where that one's episode has ended, it observes the last inputs again.
    """

    def __init__(self, agent: Agent, only: str | None = None) -> None:
        """Take the agent, and the only input that is exchanged; None for all."""
        self._agent, self._only = agent, only
        self._last: dict[str, Tensor] = {}
        self._count = 0

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        self.note(context)
        names = self._last if self._only is None else (self._only,)
        return self._agent.act(self.exchanged(context, 1, names))

    def note(self, context: StepContext) -> None:
        """Remember the inputs of each environment."""
        if bool(context.starts.any()):
            self._count = len(context.rows)
        for name, values in context.inputs.items():
            self._last[name] = with_rows(self._last.get(name), context.rows, values)

    def exchanged(self, context: StepContext, by: int, names: Iterable[str]) -> StepContext:
        """Return the context with these inputs of the environments `by` further."""
        rows = context.rows
        other = (rows + by) % self._count
        inputs = {**context.inputs, **{name: self._last[name][other] for name in names}}
        return context.part(slice(None), inputs)


class CountsChanges:
    """An agent that counts how often the action changes with each input of other episodes."""

    def __init__(self, agent: Agent, names: Iterable[str]) -> None:
        """Take an agent without memory, and the names of the inputs."""
        self._agent, self._others = agent, WithOtherInputs(agent)
        self.changed = dict.fromkeys(names, 0)
        self.compared = 0
        """Actions that were compared, for each input."""

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        act = self._agent.act(context)
        self._others.note(context)
        for name in self.changed:
            for by in DONORS:
                other = self._agent.act(self._others.exchanged(context, by, [name])).action
                self.changed[name] += int((other != act.action)[:, None].flatten(1).any(-1).sum())
        self.compared += len(DONORS) * len(context.rows)
        return act


def repeat(
    env: EnvBase, actor: TensorDictModuleBase | Agent, greedy: CompleteEpisodes
) -> Repetition:
    """Run episodes that are drawn at random again, at other places, and compare how they end.

    The policy is called with one environment at a time, and with `FEW` if there are so many.
    PyTorch evaluates it, so that these are another implementation if a fused kernel ran the first
    episodes.

    Args:
        env: The environments, in the state in which `greedy` began; they keep it.
        actor: The policy.
        greedy: Its greedy episodes.
    """
    source = base_env(env).side_streams(torch.tensor([0]), _REPEATED)[0]
    count = min(NEEDED_EPISODES, len(greedy))
    drawn = torch.from_numpy(source.choice(len(greedy), count, replace=False))
    runs = []
    for size in sorted({1, min(FEW, count, env.batch_size[0])}):
        how = "one environment at a time" if size == 1 else f"{size} environments at a time"
        again = _again(InGroups(as_agent(actor), size), env, drawn, flushes=size == 1)
        is_other = (again.end_reason != greedy.end_reason[drawn]) | (
            again.goals.reached != greedy.goals.reached[drawn]
        ).any(-1)
        successes = int(again.success.sum())
        runs.append(Repeated(how=how, different=int(is_other.sum()), successes=successes))
    return Repetition(
        implementation=greedy.implementation,
        episodes=count,
        successes=int(greedy.success[drawn].sum()),
        runs=tuple(runs),
    )


def exchange_images(
    env: EnvBase, actor: TensorDictModuleBase | Agent, greedy: CompleteEpisodes
) -> CameraUse:
    """Run the episodes again with the images of other episodes; the arguments are `repeat`'s.

    An episode that is alone in its batch is left out, since there are no other images.
    """
    own, size = float(greedy.success.mean()), env.batch_size[0]
    count = min(EXCHANGED, len(greedy))
    count = 0 if size == 1 else count - (count % size == 1)
    if not count:
        return CameraUse(own=own, exchanged=None, success=mean_bounds([], -1.0, 1.0), strata={})
    greedy = greedy.first(count)
    exchanged = _again(WithOtherInputs(as_agent(actor)), env, torch.arange(count))
    strata = {}
    confidence = 1.0 - 0.05 / len(greedy.task.strata)
    for i, name in enumerate(greedy.task.strata):
        difference = greedy.stratum_share(i) - exchanged.stratum_share(i)
        strata[name] = mean_bounds(difference, -1.0, 1.0, confidence)
    success = mean_bounds(greedy.success - exchanged.success, -1.0, 1.0)
    rates = [float(of.success.mean()) for of in (greedy, exchanged)]
    return CameraUse(own=rates[0], exchanged=rates[1], success=success, strata=strata)


def exchange_inputs(
    env: EnvBase, actor: TensorDictModuleBase | Agent, greedy: CompleteEpisodes
) -> dict[str, InputUse]:
    """Return what changes with each of several inputs of other episodes; see `exchange_images`."""
    names, size = [*base_env(env).observer.sources], env.batch_size[0]
    count = min(EXCHANGED, len(greedy))
    count = 0 if size == 1 or len(names) == 1 else count - (count % size == 1)
    if not count:
        return {}
    uses, agent, which, own = {}, as_agent(actor), torch.arange(count), greedy.first(count)
    counts = CountsChanges(agent, names)
    _again(counts, env, which)
    for name in names:
        exchanged = _again(WithOtherInputs(agent, name), env, which)
        uses[name] = InputUse(
            changed=proportion(counts.changed[name], counts.compared),
            own=float(own.success.mean()),
            exchanged=float(exchanged.success.mean()),
            success=mean_bounds(own.success - exchanged.success, -1.0, 1.0),
        )
    return uses


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


def _again(agent: Agent, env: EnvBase, which: Tensor, *, flushes: bool = False) -> CompleteEpisodes:
    """Run episodes of these numbers, (n,), again in this order, and restore the environments."""
    base = base_env(env)
    state = base.state_dict()
    starts = [*state["random_states"]]  # random streams at the start of each episode
    while len(starts) <= int(which.max()):
        base.start()
        starts += base.state_dict()["random_states"]
    parts = []
    with _subnormal_numbers(flushed=flushes):
        for batch in which.split(env.batch_size[0]):
            chosen = [starts[episode] for episode in batch.tolist()]
            unused = state["random_states"][len(chosen) :]
            base.load_state_dict({**state, "random_states": [*chosen, *unused]})
            parts.append(rollout(agent, env, len(batch), exact=True))
    base.load_state_dict(state)
    return CompleteEpisodes.joined(parts)


@contextmanager
def _subnormal_numbers(*, flushed: bool) -> Iterator[None]:
    """Count subnormal numbers as zero in the calling thread, as some processors and kernels do."""
    was = bool(torch.tensor(1e-40) * 1.0 == 0.0)
    torch.set_flush_denormal(flushed or was)
    try:
        yield
    finally:
        torch.set_flush_denormal(was)
