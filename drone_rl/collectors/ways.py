"""Ways from the actions of some worlds to what is seen in those that go on.

A step of TorchRL's copies every entry of every world, whether or not it still flies, through each
transform. With few worlds that takes longer than simulating, drawing and acting together. So where
nothing but maps from picture to picture stands between worlds and actor, there is a straight way;
both give the same, bit for bit.
"""

from collections.abc import Iterable, Sequence
from typing import Any, Protocol, cast

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.utils import NestedKey
from torch import Tensor
from torchrl.envs import EnvBase, TransformedEnv

from drone_rl.collectors.worlds_collector import take_rows
from drone_rl.envs import DroneEnv
from drone_rl.envs.pipeline import on_pixels
from drone_rl.envs.transforms import GrayPixels, PixelTransform
from drone_rl.sim.tasks import State

Entries = dict[NestedKey, Tensor]
FLAGS = ("reward", "done", "terminated", "truncated")


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
        first = {key if isinstance(key, str) else key[0] for key in self._observed}
        self._dropped = {env.reward_key, "info"} - first
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
        for key in self._dropped:  # entries that no step reads make each step dearer
            state.pop(key, None)
        return entries, self._seen(worlds[~state.get("done")[worlds].flatten()])

    def _seen(self, worlds: Tensor) -> TensorDictBase:
        return take_rows(self._state.select(*self._observed), worlds)


class StraightWay:
    """By the worlds themselves; nothing is drawn of one that has ended, for nobody will look.

    Where the first of the transforms makes pictures gray, they are drawn so.
    """

    def __init__(
        self, env: EnvBase, transforms: Sequence[PixelTransform], kept: Iterable[NestedKey]
    ) -> None:
        """Takes an environment's worlds over.

        Args:
            env: Whose worlds they are.
            transforms: What becomes of their pictures.
            kept: Of the reward, the end flags and "info".
        """
        self._env, self._kept = env, tuple(kept)
        self._base: DroneEnv = cast(Any, env).base_env
        self._worlds = self._base.worlds
        is_gray = type(next(iter(transforms), None)) is GrayPixels
        self._view = self._worlds.view(modality="gray") if is_gray else self._worlds.policy_view
        self._see = on_pixels(transforms[1:] if is_gray else transforms)
        self._names = [(key, str(key[2])) for key in self._kept if len(key) == 3]

    def begin(self, worlds: Tensor) -> TensorDictBase:
        """See `Way`."""
        return self._seen(self._env.reset().get("pixels")[worlds])

    def step(self, worlds: Tensor, action: Tensor) -> tuple[Entries, TensorDictBase]:
        """See `Way`."""
        simulated = self._worlds
        reward = simulated.step(worlds, action).float()[:, None]
        is_whole = len(worlds) == simulated.num_worlds
        state = simulated.state if is_whole else simulated.state[worlds]
        reason = state.end_reason[:, None]
        truncated, done = reason == simulated.task.truncation, reason != 0
        flags = (reward, done, done & ~truncated, truncated)
        told: Entries = {("next", name): flag for name, flag in zip(FLAGS, flags, strict=True)}
        if self._names:
            info = simulated.info(state)
            told.update((key, info[name]) for key, name in self._names)
        on = (~done[:, 0]).nonzero()[:, 0]
        going = state if len(on) == len(worlds) else state[on]
        return {key: told[key] for key in self._kept}, self._look(going)

    def _look(self, state: State) -> TensorDictBase:
        picture = self._worlds.render(state, self._view)
        if self._view.modalities == ("gray",):
            picture = picture[:, None]
        return self._seen(self._see(picture))

    def _seen(self, pixels: Tensor) -> TensorDictBase:
        return TensorDict({"pixels": pixels}, [len(pixels)], device=pixels.device)


def find_way(env: EnvBase, observed: Iterable[NestedKey], kept: Iterable[NestedKey]) -> Way:
    """The shortest way that an environment allows.

    Args:
        env: Any batch of worlds.
        observed: What the actor looks at.
        kept: ("next", ...) entries that are kept of each step.
    """
    observed, kept = tuple(observed), tuple(kept)
    if type(env) is TransformedEnv and type(env.base_env) is DroneEnv and env.base_env.pixels:
        transforms: list[Any] = list(cast(Any, env.transform))
        are_maps = all(isinstance(t, PixelTransform) and t.is_in_place for t in transforms)
        told = {("next", name) for name in FLAGS}
        told |= {("next", "info", name) for name in env.base_env.worlds.entries}
        if are_maps and observed == ("pixels",) and set(kept) <= told:
            return StraightWay(env, transforms, kept)
    return TorchrlWay(env, observed, kept)
