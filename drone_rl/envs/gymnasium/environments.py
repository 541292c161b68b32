"""The Gymnasium environments: `DroneWorld`, and `DroneWorlds` stepped and rendered as a batch."""

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.envs.gymnasium.world_batch import (
    METADATA,
    Chosen,
    Seen,
    WorldBatch,
    read_action,
    rows_of,
)
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Whole

Info = dict[str, Any]
Mask = NDArray[np.bool_]


class DroneWorlds(VectorEnv[Seen, Any, NDArray[Any]]):
    """`gymnasium.make_vec("drone_rl/MyTask-v0", num_envs=64)`; see `DroneWorld`.

    It behaves like Gymnasium's `SyncVectorEnv` of `DroneWorld`s: after `reset(seed=7)` environment
    i samples the same episodes as a single one after `reset(seed=7 + i)`.
    """

    metadata = {**METADATA, "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        task: Chosen = None,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        **options: Any,
    ) -> None:
        """Create the environments.

        Args:
            num_envs: Batch size.
            task: The task.
            autoreset_mode: When finished environments are reset: in the next step ("NextStep"), in
                the same step ("SameStep"), or by `reset(options={"reset_mask": mask})`
                ("Disabled").
            options: See `DroneWorld`.

        Raises:
            InputError: An option is unknown or out of range.
        """
        Whole(1).read(num_envs, "num_envs")
        self.autoreset_mode = _mode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.autoreset_mode}
        self.batch = WorldBatch(num_envs, task, dict(options))
        self.num_envs = num_envs
        self.render_mode = self.batch.render_mode
        self.single_observation_space = self.batch.observation_space
        self.single_action_space = self.batch.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._generators: list[np.random.Generator | None] = [None] * num_envs
        self._seeds: list[int | None] = [None] * num_envs
        self._ended: Mask | None = None  # none is running before the first reset

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:  # pyright: ignore[reportIncompatibleMethodOverride] (as SyncVectorEnv's)
        """The random generators of the environments."""
        return tuple(map(self._generator, range(self.num_envs)))

    @property
    def np_random_seed(self) -> tuple[int | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride] (as SyncVectorEnv's)
        """The seeds of the environments."""
        return tuple(self._seeds)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> tuple[Seen, Info]:
        """Start episodes.

        Args:
            seed: Seed of the first environment, incremented for each following one; or one seed
                each; None continues the random streams.
            options: "reset_mask", bool (num_envs,): the environments to reset; all by default.

        Raises:
            InputError: The number of seeds is wrong, or an option is unknown.
        """
        mask = self._read_mask(dict(options or {}))
        for i, one in enumerate(self._read_seeds(seed)):
            if mask[i] and one is not None:
                self._generators[i], self._seeds[i] = seeding.np_random(one)
        seen = self.batch.observe(True, self._start(mask))
        self._ended = ~mask if self._ended is None else self._ended & ~mask
        return seen, _masked(self.batch.info(), mask)

    def step(self, actions: Any) -> tuple[Seen, NDArray[Any], Mask, Mask, Info]:
        """Step each environment by one of `single_action_space`; reset those that had finished.

        Raises:
            InputError: An action is invalid, or environments must be reset first.
        """
        if self._ended is None:
            raise InputError("step() needs a running episode; call reset() first")
        actions = read_action(actions, self.batch.worlds.dynamics.actions, (self.num_envs,))
        if self.autoreset_mode is AutoresetMode.DISABLED and self._ended.any():
            raise InputError(
                f"worlds {np.flatnonzero(self._ended).tolist()} have ended; reset them by "
                "reset(options={'reset_mask': mask}), or choose another autoreset_mode"
            )
        rewards = np.where(self._ended, 0.0, self.batch.step(actions))
        self._start(self._ended)
        starts = torch.from_numpy(self._ended).to(self.batch.worlds.device)
        seen = self.batch.observe(starts)
        flags = self.batch.flags()
        self._ended = flags[0] | flags[1]
        final = {}
        if self.autoreset_mode is AutoresetMode.SAME_STEP and self._ended.any():
            seen, final = self._finish(self._ended, seen)
        info = {**_masked(self.batch.info(), np.ones(self.num_envs, bool)), **final}
        return seen, rewards, *flags, info

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Render each drone from behind, (360, 640, 3), if `render_mode` is set."""
        film = self.batch.film()
        return None if film is None else tuple(film)

    def close_extras(self, **kwargs: Any) -> None:
        """Close the renderer."""
        self.batch.worlds.close()

    def _finish(self, ended: Mask, seen: Seen) -> tuple[Seen, Info]:
        """Reset environments that have just finished, as last seen.

        Return the observations then, and the final information.
        """
        last = np.full(self.num_envs, None, object)
        for i in np.flatnonzero(ended):
            last[i] = rows_of(seen, i)
        info = _masked(self.batch.info(), ended)
        after = self.batch.observe(True, self._start(ended))
        self._ended = np.zeros_like(ended)
        return after, _masked({"final_obs": last, "final_info": info}, ended)

    def _start(self, mask: Mask) -> Tensor:
        """Start episodes, without observations; return the indices of the environments."""
        worlds = torch.from_numpy(np.flatnonzero(mask)).to(self.batch.worlds.device)
        self.batch.reset(worlds, [self._generator(i) for i in worlds.tolist()])
        return worlds

    def _generator(self, world: int) -> np.random.Generator:
        generator = self._generators[world]
        if generator is None:
            generator, self._seeds[world] = seeding.np_random()
            self._generators[world] = generator
        return generator

    def _read_seeds(self, seed: int | Sequence[int | None] | None) -> Sequence[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int | np.integer):
            return [int(seed) + i for i in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise InputError(f"seed has {len(seed)} values; give one, or {self.num_envs}")
        return seed

    def _read_mask(self, options: Info) -> Mask:
        mask = options.pop("reset_mask", np.ones(self.num_envs, bool))
        if options:
            raise InputError(f"options={list(options)} are unknown to reset; give reset_mask")
        mask = np.asarray(mask)
        if mask.dtype != np.bool_ or mask.shape != (self.num_envs,):
            raise InputError(
                f"reset_mask is of {mask.dtype} and shape {mask.shape}; give bool of shape "
                f"({self.num_envs},)"
            )
        return mask


def _masked(info: Info, mask: Mask) -> Info:
    """Add to each entry the mask of its environments; set the others to 0."""
    masked = {}
    for name, value in info.items():
        if isinstance(value, np.ndarray) and value.dtype != object and not mask.all():
            value = np.where(mask.reshape(-1, *[1] * (value.ndim - 1)), value, value.dtype.type(0))
        masked |= {name: value, f"_{name}": mask.copy()}
    return masked


def _mode(name: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(name)
    except ValueError:
        names = ", ".join(mode.value for mode in AutoresetMode)
        raise InputError(f"autoreset_mode={name!r} is unknown; give one of: {names}") from None


_ONLY = torch.zeros(1, dtype=torch.int64)


class DroneWorld(gymnasium.Env[Seen, Any]):
    """A drone with a task: `gymnasium.make("drone_rl/MyTask-v0", step_limit=50)` for my_task.

    The name is registered with the task: `import drone_rl` registers those of the package, your
    module its own. Gymnasium imports a module before a colon: `"my_module:drone_rl/MyTask-v0"`.

    Observations are camera images, RGB bytes (height, width, 3), after the `transforms`, if any,
    among which may be camera faults and stacks of frames; with `inputs=["gray", "goal"]` they are a
    dictionary of these inputs. With `observations="state"` they are the
    ground truth as a float32 vector: the entries of `info` except "end_reason" and "is_success", in
    order. For `info` see `WorldBatch.info`. The task's step limit truncates.

    Episodes are sampled from `np_random` only, so that `reset(seed=7)` starts the same episode in
    any environment, single or vector.
    """

    metadata = METADATA

    def __init__(self, task: Chosen = None, **options: Any) -> None:
        """Create the environment.

        `options` are `drone_rl.config.commands.GymnasiumSettings` and settings of the task.

        Raises:
            InputError: An option is unknown or out of range.
        """
        self.batch = WorldBatch(1, task, dict(options))
        self.render_mode = self.batch.render_mode
        self.observation_space = self.batch.observation_space
        self.action_space = self.batch.action_space
        self._is_running = False

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Seen, dict[str, Any]]:
        """Start an episode.

        A seed is that of this episode and the following ones; None continues the random stream.

        Raises:
            InputError: There are options.
        """
        super().reset(seed=seed)
        if options:
            raise InputError(f"options={list(options)} are unknown to reset; give none")
        self.batch.reset(_ONLY, [self.np_random])
        self._is_running = True
        return rows_of(self.batch.observe(True), 0), self._info()

    def step(self, action: Any) -> tuple[Seen, float, bool, bool, dict[str, Any]]:
        """Step the environment by one of `action_space`.

        Raises:
            InputError: The action is invalid, or no episode is running.
        """
        if not self._is_running:
            raise InputError("step() needs a running episode; call reset() first")
        actions = read_action(action, self.batch.worlds.dynamics.actions)
        reward = self.batch.step(actions[None])
        terminated, truncated = (bool(flag) for (flag,) in self.batch.flags())
        self._is_running = not (terminated or truncated)
        seen = rows_of(self.batch.observe(False), 0)
        return seen, float(reward[0]), terminated, truncated, self._info()

    def render(self) -> NDArray[np.uint8] | None:
        """Render the drone from behind, (360, 640, 3), if `render_mode` is set."""
        film = self.batch.film()
        return None if film is None else film[0]

    def close(self) -> None:
        """Close the renderer."""
        self.batch.worlds.close()

    def _info(self) -> dict[str, Any]:
        info = {name: value[0] for name, value in self.batch.info().items()}
        return {k: v if isinstance(v, np.ndarray) else v.item() for k, v in info.items()}
