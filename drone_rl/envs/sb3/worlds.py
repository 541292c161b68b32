"""A Gymnasium vector environment as a Stable-Baselines3 `VecEnv`.

Stable-Baselines3's own wrappers take single environments; `DummyVecEnv` steps them in turn.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from gymnasium import Wrapper, spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvStepReturn

from drone_rl.config.transforms import Fault, Stack, Transform, as_transforms
from drone_rl.envs.observer import Pipeline
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import shown


class Sb3Worlds(VecEnv):
    """Wrap `gymnasium.make_vec(name, num_envs=64, autoreset_mode="SameStep")` as a `VecEnv`.

    A step returns infos only for environments whose episode has just ended.
    """

    def __init__(self, env: VectorEnv, transforms: Transform | Sequence[Transform] = ()) -> None:
        """Wrap a vector environment.

        Args:
            env: An environment with autoreset mode "SameStep".
            transforms: Transform of its images, RGB bytes (H, W, 3), or several in order; without
                any, Stable-Baselines3 moves the channels first and scales to 0 to 1.

        Raises:
            InputError: The autoreset mode is different, or a transform is unsuitable.
        """
        if not isinstance(env, VectorEnv):
            raise InputError(
                f"env={shown(env)} is no vector environment; give gymnasium.make_vec(NAME, "
                "num_envs=64, autoreset_mode='SameStep') of gymnasium"
            )
        mode = env.metadata.get("autoreset_mode")
        if mode is not AutoresetMode.SAME_STEP:
            name = getattr(mode, "value", mode)
            raise InputError(
                f"autoreset_mode={name}, but Stable-Baselines3 needs SameStep; give "
                "gymnasium.make_vec(..., autoreset_mode='SameStep')"
            )
        transforms = as_transforms(transforms)
        if any(isinstance(transform, Stack) for transform in transforms):
            raise InputError("transforms stack frames; use Stable-Baselines3's VecFrameStack")
        if strange := [t.name for t in transforms if isinstance(t, Fault)]:
            raise InputError(f"the transform {strange[0]} needs a TorchRL environment; omit it")
        self.env = env
        self.transforms = transforms
        self._transform = Pipeline([transform.make() for transform in transforms])
        self._actions: NDArray[Any] = np.zeros(env.num_envs, np.int64)
        space = env.single_observation_space
        if transforms:
            seen = self.observe(np.zeros((1, *(space.shape or ())), space.dtype))[0]
            space = spaces.Box(-np.inf, np.inf, seen.shape, np.float32)
        super().__init__(env.num_envs, space, env.single_action_space)

    def reset(self) -> NDArray[Any]:
        """Start episodes, with the seeds of `seed`, if any. Shape: (num_envs, *)."""
        if any(self._options):
            raise InputError("reset takes no options; set none")
        seen, info = self.env.reset(seed=self._seeds)  # pyright: ignore[reportArgumentType] (one a world, as SyncVectorEnv)
        self.reset_infos = [_of_world(info, i) for i in range(self.num_envs)]
        self._reset_seeds()
        return self.observe(seen)

    def step_async(self, actions: NDArray[Any]) -> None:
        """Store the actions."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Apply the stored actions.

        Returns:
            Observations, rewards, dones, and the infos of finished episodes with
            "terminal_observation" and "TimeLimit.truncated".
        """
        seen, rewards, terminated, truncated, info = self.env.step(self._actions)
        done = terminated | truncated
        infos: list[dict[str, Any]] = [{} for _ in done]
        if done.any():
            worlds = np.flatnonzero(done)
            last = self.observe(np.stack([info["final_obs"][i] for i in worlds]))
            for i, observation in zip(worlds.tolist(), last, strict=True):
                infos[i] = {
                    **_of_world(info["final_info"], i),
                    "terminal_observation": observation,
                    "TimeLimit.truncated": bool(truncated[i] and not terminated[i]),
                }
        return self.observe(seen), rewards.astype(np.float32), done, infos

    def observe(self, images: NDArray[Any]) -> NDArray[Any]:
        """Apply the transforms to images, (N, H, W, 3)."""
        return self._transform(torch.from_numpy(images)).numpy()

    def close(self) -> None:
        """Close the renderer."""
        self.env.close()

    def get_images(self) -> Sequence[Any]:
        """Return the image of `render` of each environment."""
        return self.env.render() or [None] * self.num_envs

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of the vector environment, repeated for each environment."""
        return [getattr(self.env, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Raise an error: the environments have no own attributes."""
        raise InputError(f"{attr_name} can't be set per environment; set it on .env")

    def env_method(
        self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any
    ) -> list[Any]:
        """Raise an error: the environments have no own methods."""
        raise InputError(f"{method_name} can't be called per environment; call it on .env")

    def env_is_wrapped(
        self, wrapper_class: type[Wrapper], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Return False for each environment."""
        return [False for _ in self._get_indices(indices)]


def _of_world(info: dict[str, Any], world: int) -> dict[str, Any]:
    """Return one environment's part of a vector environment's info."""
    return {name: value[world] for name, value in info.items() if not name.startswith("_")}
