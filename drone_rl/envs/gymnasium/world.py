"""One world of a task as a Gymnasium environment."""

from typing import Any

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray

from drone_rl.envs.gymnasium.spaces import read_action
from drone_rl.envs.gymnasium.stage import METADATA, Chosen, Stage
from drone_rl.utils.errors import InputError

_ONLY = torch.zeros(1, dtype=torch.int64)


class DroneWorld(gymnasium.Env[NDArray[Any], Any]):
    """A drone with a task: `gymnasium.make("drone_rl/CollectCubes-v0", num_cubes=2)`.

    `import drone_rl` registers the name; `"drone_rl:drone_rl/CollectCubes-v0"` needs no import.

    Observations are the camera's frame, RGB bytes (height, width, 3), or, with
    `observations="state"`, the truth in a vector of float32: the entries of `info` but for
    "end_reason" and "is_success", in their order. `info` is the truth, see `Stage.info`. The task's
    step limit truncates.

    An episode is drawn from `np_random` alone, so that after `reset(seed=7)` it is that of any
    world, in a vector or not, that was reset with seed 7.
    """

    metadata = METADATA

    def __init__(self, task: Chosen = None, **options: Any) -> None:
        """Makes the world.

        Args:
            task: What there is to do.
            options: `drone_rl.config.commands.GymnasiumSettings`, and settings of the task.

        Raises:
            InputError: An option is unknown or out of range.
        """
        self.stage = Stage(1, task, options)
        self.render_mode = self.stage.render_mode
        self.observation_space = self.stage.observation_space
        self.action_space = self.stage.action_space
        self._is_running = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[Any], dict[str, Any]]:
        """Starts an episode.

        Args:
            seed: Of this episode and those after it; None goes on with the stream.
            options: None are known.

        Raises:
            InputError: There are options.
        """
        super().reset(seed=seed)
        if options:
            raise InputError(f"options={list(options)} are unknown to reset; give none")
        self.stage.reset(_ONLY, [self.np_random])
        self._is_running = True
        return self.stage.observe()[0], self._info()

    def step(self, action: Any) -> tuple[NDArray[Any], float, bool, bool, dict[str, Any]]:
        """Moves the drone.

        Args:
            action: One of `action_space`.

        Raises:
            InputError: The action is none, or no episode is running.
        """
        if not self._is_running:
            raise InputError("step() has no episode to go on with; call reset() first")
        actions = read_action(action, self.stage.worlds.dynamics.actions)
        reward = self.stage.step(actions[None])
        terminated, truncated = (bool(flag) for (flag,) in self.stage.flags())
        self._is_running = not (terminated or truncated)
        return self.stage.observe()[0], float(reward[0]), terminated, truncated, self._info()

    def render(self) -> NDArray[np.uint8] | None:
        """The drone from behind, (360, 640, 3), if that was asked for."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() draws nothing; make it with render_mode='rgb_array'")
            return None
        return self.stage.film()[0]

    def close(self) -> None:
        """Ends the renderer."""
        self.stage.worlds.close()

    def _info(self) -> dict[str, Any]:
        info = {name: value[0] for name, value in self.stage.info().items()}
        return {k: v if isinstance(v, np.ndarray) else v.item() for k, v in info.items()}
