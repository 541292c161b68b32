"""Ways through episodes: from the actions of some worlds to what is seen in those that go on.

There is TorchRL's way, and a straight one (`DirectRenderer`); both give the same, bit for bit.
"""

from collections.abc import Iterable
from typing import Any, Protocol

import torch
from tensordict import TensorDictBase
from tensordict.utils import NestedKey
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.collectors.worlds_collector import ballast, take_rows
from drone_rl.envs.direct_renderer import DirectRenderer, Entries
from drone_rl.sim.tasks import State


class Way(Protocol):
    """Takes worlds through their episodes, all from the start to the end."""

    def begin(self, worlds: Tensor) -> TensorDictBase:
        """Starts an episode in every world; returns what is seen in some, by their indices."""
        ...

    def step(self, worlds: Tensor, action: Tensor) -> tuple[Entries, TensorDictBase]:
        """Moves worlds.

        Args:
            worlds: Indices, in order: those that went on after the step before. Shape: (k,).
            action: Of each. Shape: (k, *).

        Returns:
            What is kept of each, and what is seen in those that go on, in order.
        """
        ...


class TorchrlWay:
    """By `env.step`, whatever the environment is and stands before it."""

    def __init__(
        self, env: EnvBase, observed: Iterable[NestedKey], kept: Iterable[NestedKey]
    ) -> None:
        """See `find_way`."""
        self._env, self._observed, self._kept = env, tuple(observed), tuple(kept)
        self._dropped = ballast(env, self._observed)
        self._state: Any = None

    def begin(self, worlds: Tensor) -> TensorDictBase:
        """See `Way`."""
        self._state = self._env.reset()
        return self._seen(worlds)

    def step(self, worlds: Tensor, action: Tensor) -> tuple[Entries, TensorDictBase]:
        """See `Way`."""
        env, state = self._env, self._state
        if len(worlds) < len(state):
            action = env.action_spec.zero().index_copy(0, worlds, action)
            going = torch.zeros(len(state), dtype=torch.bool, device=worlds.device)
            state.set("_step", going.index_fill_(0, worlds, True))
        after = env.step(state.set(env.action_key, action))
        entries = {key: after.get(key)[worlds] for key in self._kept}
        self._state = state = after.get("next")
        for key in self._dropped:
            state.pop(key, None)
        return entries, self._seen(worlds[~state.get("done")[worlds].flatten()])

    def _seen(self, worlds: Tensor) -> TensorDictBase:
        return take_rows(self._state.select(*self._observed), worlds)


class StraightWay:
    """By the worlds themselves; nothing is drawn of one that has ended, for nobody will look.

    The worlds of the environment stay as they were at the start.
    """

    def __init__(self, sight: DirectRenderer) -> None:
        """Takes an environment's worlds over."""
        self.sight = sight
        self._going: Any = None

    def begin(self, worlds: Tensor) -> TensorDictBase:
        """See `Way`."""
        self.sight.env.start()
        return self._look(self.sight.worlds.state[worlds], worlds)

    def step(self, worlds: Tensor, action: Tensor) -> tuple[Entries, TensorDictBase]:
        """See `Way`."""
        state, reward = self.sight.worlds.advance(self._going, action)
        entries, done = self.sight.tell(state, reward)
        on = (~done[:, 0]).nonzero()[:, 0]
        if len(on) < len(worlds):
            state, worlds = state[on], worlds[on]
        return entries, self._look(state, worlds)

    def _look(self, state: State, worlds: Tensor) -> TensorDictBase:
        self._going = state
        return self.sight.look(state, worlds)


def find_way(env: EnvBase, observed: Iterable[NestedKey], kept: Iterable[NestedKey]) -> Way:
    """The shortest way that an environment allows.

    Args:
        env: Any batch of worlds.
        observed: What the actor looks at.
        kept: ("next", ...) entries that are kept of each step.
    """
    observed, kept = tuple(observed), tuple(kept)
    sight = DirectRenderer.find(env, observed, kept)
    return TorchrlWay(env, observed, kept) if sight is None else StraightWay(sight)
