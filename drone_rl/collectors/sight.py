"""Pictures as an actor sees them, straight from the worlds.

A step of TorchRL's copies every entry of every world, whether or not it still flies, through each
transform. With few worlds that takes longer than simulating, drawing and acting together. So where
nothing but maps from picture to picture stands between worlds and actor, collectors go without it.
"""

from collections.abc import Iterable, Sequence
from typing import Any, Self

from tensordict import TensorDict, TensorDictBase
from tensordict.utils import NestedKey
from torch import Tensor
from torchrl.envs import Compose, EnvBase, TransformedEnv

from drone_rl.envs import DroneEnv
from drone_rl.envs.transforms import GrayPixels, PixelTransform, on_pixels
from drone_rl.sim.tasks import State

Entries = dict[NestedKey, Tensor]
FLAGS = ("reward", "done", "terminated", "truncated")
_REASON = ("next", "info", "end_reason")


class Sight:
    """What an actor sees of worlds, and what is told of a step, without steps of TorchRL.

    Where the first of the transforms makes pictures gray, they are drawn so.
    """

    def __init__(
        self, env: DroneEnv, transforms: Sequence[PixelTransform], kept: Iterable[NestedKey]
    ) -> None:
        """Takes an environment's worlds over.

        Args:
            env: Whose worlds they are.
            transforms: What becomes of their pictures.
            kept: Which ("next", ...) entries of a step are told.
        """
        self.env, self.worlds = env, env.worlds
        is_gray = type(next(iter(transforms), None)) is GrayPixels
        self.view = self.worlds.view(modality="gray") if is_gray else self.worlds.policy_view
        self.after: Sequence[Any] = transforms[1:] if is_gray else transforms
        """What becomes of pictures once they are drawn."""
        self._see = on_pixels(self.after)
        self._kept = tuple(kept)
        self._asked = [(key, str(key[2])) for key in self._kept if len(key) == 3 and key != _REASON]

    @property
    def is_brief(self) -> bool:
        """Whether nothing is told of a step but reward, flags and why an episode ended."""
        return not self._asked

    @classmethod
    def find(
        cls, env: EnvBase, observed: Iterable[NestedKey], kept: Iterable[NestedKey]
    ) -> Self | None:
        """That of an environment, if it has one.

        Args:
            env: Any batch of worlds.
            observed: What the actor looks at.
            kept: ("next", ...) entries that are kept of each step.
        """
        if type(env) is not TransformedEnv or type(env.base_env) is not DroneEnv:
            return None
        one: Any = env.transform
        transforms: list[Any] = list(one) if isinstance(one, Compose) else [one]
        are_maps = all(isinstance(t, PixelTransform) and t.is_in_place for t in transforms)
        told = {("next", name) for name in FLAGS}
        told |= {("next", "info", name) for name in env.base_env.worlds.entries}
        is_straight = env.base_env.pixels and are_maps and tuple(observed) == ("pixels",)
        return cls(env.base_env, transforms, kept) if is_straight and set(kept) <= told else None

    def look(self, state: State, worlds: Tensor | None = None) -> TensorDictBase:
        """What is seen of worlds. First dimension: the state's.

        Args:
            state: Theirs.
            worlds: Which of the environment's they are; all by default. Shape: (k,).
        """
        picture = self.worlds.render(state, self.view, self.env.looks.drawn(worlds))
        if self.view.modalities == ("gray",):
            picture = picture[:, None]
        pixels = self._see(picture)
        return TensorDict({"pixels": pixels}, [len(pixels)], device=pixels.device)

    def tell(self, state: State, reward: Tensor) -> tuple[Entries, Tensor]:
        """What is kept of a step.

        Args:
            state: After it.
            reward: For it. Shape: (num_worlds,), float64.

        Returns:
            Each entry, and which worlds' episodes have ended. Shapes: (num_worlds, *).
        """
        told = self.flags(reward, state.end_reason)
        if self._asked:
            info = self.worlds.info(state)
            told.update((key, info[name]) for key, name in self._asked)
        return {key: told[key] for key in self._kept}, told["next", "done"]

    def flags(self, reward: Tensor, end_reason: Tensor) -> Entries:
        """What is told of every step.

        Args:
            reward: For it. Shape: (num_worlds,).
            end_reason: After it, 0 where the episode goes on. Shape: (num_worlds,).

        Returns:
            ("next", ...) "reward", float32, the flags, and why it ended. Shapes: (num_worlds, 1).
        """
        terminated, truncated = self.worlds.ends(end_reason)
        values = (reward.float(), terminated | truncated, terminated, truncated, end_reason)
        keys = (*(("next", name) for name in FLAGS), _REASON)
        return {key: value[:, None] for key, value in zip(keys, values, strict=True)}
