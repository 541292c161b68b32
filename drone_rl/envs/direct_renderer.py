"""Render observations of simulation states without TorchRL's step.

A step of TorchRL copies every entry of every environment in each transform. With few environments,
this takes longer than simulation, rendering and the policy's forward pass together.
"""

from collections.abc import Iterable, Sequence
from typing import Any, Self

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.utils import NestedKey
from torch import Tensor
from torchrl.envs import Compose, EnvBase, TransformedEnv

from drone_rl.envs.drone_env import DroneEnv
from drone_rl.envs.transforms import GrayPixels, PixelTransform, on_pixels, without_identities
from drone_rl.sim.tasks import State

Entries = dict[NestedKey, Tensor]
STEP_NAMES = ("reward", "done", "terminated", "truncated")
_END_REASON = ("next", "info", "end_reason")


class Reasons(tuple[str, ...]):
    """Reasons why an implementation does not support a configuration; empty if there is none."""

    def __str__(self) -> str:
        return "; ".join(self)


class DirectRenderer:
    """Render an actor's observations of states, and compute the entries of a step.

    If the first transform is `GrayPixels`, the renderer renders gray frames.
    """

    def __init__(
        self,
        env: DroneEnv,
        transforms: Sequence[PixelTransform],
        observed: Iterable[NestedKey],
        kept: Iterable[NestedKey],
    ) -> None:
        """Use the environment's simulation and camera; see `try_create`."""
        self.env, self.worlds = env, env.worlds
        self._observed, camera = tuple(observed), env.worlds.camera
        is_gray = type(next(iter(transforms), None)) is GrayPixels
        self.view = self.worlds.view(modality="gray") if is_gray else self.worlds.policy_view
        frame = torch.zeros(1, camera.height, camera.width, 3, dtype=torch.uint8)
        effective = without_identities(transforms, frame)
        self.after: Sequence[Any] = effective[1:] if is_gray else effective
        """Transforms that are applied to rendered frames, without identity resizing."""
        self._transform = on_pixels(self.after)
        self._kept = tuple(kept)
        self._info = [
            (key, str(key[2])) for key in self._kept if len(key) == 3 and key != _END_REASON
        ]

    @property
    def needs_info(self) -> bool:
        """Whether `kept` has entries other than reward, flags and end reason."""
        return bool(self._info)

    @classmethod
    def try_create(
        cls, env: EnvBase, observed: Iterable[NestedKey], kept: Iterable[NestedKey]
    ) -> Self | Reasons:
        """Return the renderer of an environment, or the reasons why it is not supported.

        `observed` are the entries that the actor reads, `kept` the ("next", ...) entries to keep.
        """
        base: Any = env.base_env if type(env) is TransformedEnv else env
        if type(base) is not DroneEnv:
            return Reasons([f"environment {type(base).__name__} is not a DroneEnv"])
        one: Any = env.transform if isinstance(env, TransformedEnv) else ()
        transforms: list[Any] = list(one) if isinstance(one, (Compose, tuple)) else [one]
        observed = tuple(observed)
        readable = {"pixels", "done", *(("info", name) for name in base.worlds.entries)}
        available = {("next", name) for name in STEP_NAMES}
        available |= {("next", "info", name) for name in base.worlds.entries}
        reasons = [
            f"transform {type(t).__name__} is not fused"
            for t in transforms
            if not (isinstance(t, PixelTransform) and t.is_in_place)
        ]
        if "pixels" in observed and not base.pixels:
            reasons.append("the environment renders no pixels")
        reasons += [f"the policy reads {key}" for key in observed if key not in readable]
        reasons += [f"entry {key} needs a step of TorchRL" for key in kept if key not in available]
        return Reasons(reasons) if reasons else cls(base, transforms, observed, kept)

    def observe(self, state: State, rows: Tensor | None = None) -> TensorDictBase:
        """Return the actor's input for states of environments `rows`, (k,); default: all."""
        size, device = len(state.steps), state.steps.device
        entries: Entries = {}
        if "pixels" in self._observed:
            entries["pixels"] = self._pixels(state, rows)
        if "done" in self._observed:
            entries["done"] = torch.zeros(size, 1, dtype=torch.bool, device=device)
        names = [str(key[1]) for key in self._observed if isinstance(key, tuple)]
        if names:
            info = self.worlds.info(state)
            entries["info"] = TensorDict(
                {name: info[name] for name in names}, [size], device=device
            )
        return TensorDict(entries, [size], device=device)

    def _pixels(self, state: State, rows: Tensor | None) -> Tensor:
        frames = self.worlds.render(state, self.view, self.env.appearances.current(rows))
        if self.view.modalities == ("gray",):
            frames = frames[:, None]
        return self._transform(frames)

    def entries(self, state: State, reward: Tensor) -> tuple[Entries, Tensor]:
        """Return the kept entries of a step, (num_envs, *), and the done flag.

        `state` is after the step, `reward` float64 of shape (num_envs,).
        """
        entries = self.flags(reward, state.end_reason)
        if self._info:
            info = self.worlds.info(state)
            entries.update((key, info[name]) for key, name in self._info)
        return {key: entries[key] for key in self._kept}, entries["next", "done"]

    def flags(self, reward: Tensor, end_reason: Tensor) -> Entries:
        """Return the entries of every step: ("next", ...) "reward", flags and end reason.

        Shapes: (num_envs,) to (num_envs, 1).
        """
        terminated, truncated = self.worlds.ends(end_reason)
        values = (reward.float(), terminated | truncated, terminated, truncated, end_reason)
        keys = (*(("next", name) for name in STEP_NAMES), _END_REASON)
        return {key: value[:, None] for key, value in zip(keys, values, strict=True)}
