"""A Gymnasium vector environment as a Stable-Baselines3 `VecEnv`.

Stable-Baselines3's own wrappers take single environments; `DummyVecEnv` steps them in turn.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import Wrapper
from gymnasium.vector import AutoresetMode, VectorEnv
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvStepReturn

from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import shown


class Sb3Worlds(VecEnv):
    """Wrap `gymnasium.make_vec(name, num_envs=64, autoreset_mode="SameStep")` as a `VecEnv`.

    A step returns infos only for environments whose episode has just ended.
    """

    def __init__(self, env: VectorEnv) -> None:
        """Wrap a vector environment of autoreset mode "SameStep".

        Raises:
            InputError: It is none, or the autoreset mode is different.
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
        self.env = env
        self._actions: NDArray[Any] = np.zeros(env.num_envs, np.int64)
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)

    def reset(self) -> NDArray[Any]:
        """Start episodes, with the seeds of `seed`, if any. Shape: (num_envs, *)."""
        if any(self._options):
            raise InputError("reset takes no options; set none")
        seen, info = self.env.reset(seed=self._seeds)  # pyright: ignore[reportArgumentType] (one a world, as SyncVectorEnv)
        self.reset_infos = [_of_world(info, i) for i in range(self.num_envs)]
        self._reset_seeds()
        return seen

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
        for i in np.flatnonzero(done).tolist():
            infos[i] = {
                **_of_world(info["final_info"], i),
                "terminal_observation": info["final_obs"][i],
                "TimeLimit.truncated": bool(truncated[i] and not terminated[i]),
            }
        return seen, rewards.astype(np.float32), done, infos

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
