"""Ways through episodes one after the other: worlds that go on, each beginning anew where one ends.

There is TorchRL's way, and a straight one (`DirectRenderer`); both give the same, bit for bit.
"""

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.utils import NestedKey
from torch import Tensor
from torchrl.envs import EnvBase

from drone_rl.collectors.worlds_collector import ballast
from drone_rl.envs.direct_renderer import DirectRenderer, Entries


class WorldStream(Protocol):
    """Takes all worlds on and on."""

    def seen(self) -> TensorDictBase:
        """What the worlds show now; the first time, once all have started. First: worlds."""
        ...

    def step(self, action: Tensor) -> Entries:
        """Moves every world.

        Args:
            action: Of each. Shape: (num_worlds, *).

        Returns:
            What is kept of each, and ("next", ...) what is seen after it.
        """
        ...

    def restart(self, ended: Tensor) -> None:
        """New episodes where old ones ended. Shape: (num_worlds, 1), bool."""
        ...

    def forget(self) -> None:
        """All will start when next they are seen."""
        ...

    def state_dict(self) -> dict[str, Any]:
        """All that is known of the episodes under way, but for the pictures."""
        ...

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Goes on within the episodes of a `state_dict`; pictures are drawn anew."""
        ...


class TorchrlStream:
    """By `env.step`, whatever the environment is and stands before it."""

    def __init__(
        self, env: EnvBase, observed: Iterable[NestedKey], kept: Iterable[NestedKey]
    ) -> None:
        """See `find_stream`."""
        self._env, self._observed, self._kept = env, tuple(observed), tuple(kept)
        self._dropped = ballast(env, self._observed)
        self._state: TensorDictBase | None = None

    @property
    def _worlds(self) -> Any:
        return getattr(self._env, "base_env", self._env)

    def seen(self) -> TensorDictBase:
        """See `WorldStream`."""
        return self._begin().select(*self._observed)

    def _begin(self) -> TensorDictBase:
        if self._state is None:
            self._state = self._without_ballast(self._env.reset())
        return self._state

    def step(self, action: Tensor) -> Entries:
        """See `WorldStream`."""
        after = self._env.step(self._begin().set(self._env.action_key, action))
        following = after.get("next")
        entries: Entries = {key: after.get(key) for key in self._kept}
        entries |= {("next", key): following.get(key) for key in self._observed}
        self._state = self._without_ballast(following)
        return entries

    def restart(self, ended: Tensor) -> None:
        """See `WorldStream`.

        TorchRL's `reset` would copy all worlds' pictures, and more than once.
        """
        state = self._begin()
        fresh = self._env._reset(TensorDict({"_reset": ended}, state.batch_size))
        worlds = ended.flatten().nonzero()[:, 0]
        begun = TensorDict({}, state.batch_size, device=state.device)
        for key in state.keys(True, True):
            rows = fresh.get(key).index_select(0, worlds)
            begun.set(key, state.get(key).index_copy(0, worlds, rows))
        self._state = begun

    def _without_ballast(self, state: TensorDictBase) -> TensorDictBase:
        """Without entries that no step reads; see `ballast`."""
        return state.exclude(*self._dropped, *self._env.done_keys)

    def forget(self) -> None:
        """See `WorldStream`."""
        self._state = None

    def state_dict(self) -> dict[str, Any]:
        """See `WorldStream`."""
        carried = self._begin().exclude(*self._observed)
        return {
            "worlds": self._worlds.running_state(),
            "transforms": self._memories(),
            "carried": carried.to_dict(),
        }

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """See `WorldStream`."""
        self._begin()  # without which transforms have no memory yet
        self._worlds.load_running_state(state["worlds"])
        if self._env is not self._worlds:
            self._env.load_state_dict(state["transforms"])
        nobody = torch.zeros(*self._env.batch_size, 1, dtype=torch.bool, device=self._env.device)
        drawn = self._env._reset(TensorDict({"_reset": nobody}, self._env.batch_size))
        self._state = self._without_ballast(drawn).update(state["carried"])

    def _memories(self) -> dict:
        """What transforms remember of earlier frames."""
        return {} if self._env is self._worlds else dict(self._env.state_dict())


class StraightStream:
    """By the worlds themselves."""

    def __init__(self, sight: DirectRenderer) -> None:
        """Takes an environment's worlds over."""
        self._sight = sight
        self._pixels: Tensor | None = None

    def seen(self) -> TensorDictBase:
        """See `WorldStream`."""
        pixels = self._begin()
        return TensorDict({"pixels": pixels}, [len(pixels)], device=pixels.device)

    def _begin(self) -> Tensor:
        if self._pixels is None:
            self._sight.env.start()
            self._pixels = self._look()
        return self._pixels

    def _look(self) -> Tensor:
        return self._sight.look(self._sight.worlds.state).get("pixels")

    def step(self, action: Tensor) -> Entries:
        """See `WorldStream`."""
        worlds = self._sight.worlds
        worlds.state, reward = worlds.advance(worlds.state, action)
        entries, _ = self._sight.tell(worlds.state, reward)
        self._pixels = self._look()
        return entries | {("next", "pixels"): self._pixels}

    def restart(self, ended: Tensor) -> None:
        """See `WorldStream`."""
        begun = ended.flatten().nonzero()[:, 0]
        self._sight.env.start(begun)
        fresh = self._sight.look(self._sight.worlds.state[begun], begun).get("pixels")
        self._pixels = self._begin().index_copy(0, begun, fresh)

    def forget(self) -> None:
        """See `WorldStream`."""
        self._pixels = None

    def state_dict(self) -> dict[str, Any]:
        """See `WorldStream`; nothing but the worlds remembers anything."""
        self._begin()
        return {"worlds": self._sight.env.running_state(), "transforms": {}, "carried": {}}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """See `WorldStream`."""
        self._sight.env.load_running_state(state["worlds"])
        self._pixels = self._look()


def find_stream(
    env: EnvBase, observed: Iterable[NestedKey], kept: Iterable[NestedKey]
) -> WorldStream:
    """The shortest way that an environment allows.

    Args:
        env: Any batch of worlds.
        observed: What the actor looks at.
        kept: ("next", ...) entries that are kept of each step.
    """
    observed, kept = tuple(observed), tuple(kept)
    sight = DirectRenderer.find(env, observed, kept)
    return TorchrlStream(env, observed, kept) if sight is None else StraightStream(sight)
