"""Many worlds of a task as one Gymnasium vector environment, stepped and drawn as a batch."""

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from drone_rl.envs.gymnasium.spaces import read_action
from drone_rl.envs.gymnasium.stage import METADATA, Chosen, Stage
from drone_rl.utils.errors import InputError

Info = dict[str, Any]
Mask = NDArray[np.bool_]


class DroneWorlds(VectorEnv[NDArray[Any], Any, NDArray[Any]]):
    """`gymnasium.make_vec("drone_rl/CollectCubes-v0", num_envs=64)`; see `DroneWorld`.

    Each world is reset, stepped and told of as by Gymnasium's `SyncVectorEnv` of so many
    `DroneWorld`s: after `reset(seed=7)` world i draws its episodes as one world does after
    `reset(seed=7 + i)`.
    """

    metadata = {**METADATA, "autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012 (Gymnasium's)

    def __init__(
        self,
        num_envs: int = 1,
        task: Chosen = None,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        **options: Any,
    ) -> None:
        """Makes the worlds.

        Args:
            num_envs: How many.
            task: What there is to do.
            autoreset_mode: When worlds begin anew that have ended: in the step after ("NextStep"),
                in the same one ("SameStep"), or when they are told to, by
                `reset(options={"reset_mask": mask})` ("Disabled").
            options: See `DroneWorld`.

        Raises:
            InputError: An option is unknown or out of range.
        """
        if not (isinstance(num_envs, int) and num_envs >= 1):
            raise InputError(f"num_envs={num_envs} is out of range; give a whole number from 1")
        self.mode = _mode(autoreset_mode)
        self.metadata = {**self.metadata, "autoreset_mode": self.mode}
        self.stage = Stage(num_envs, task, options)
        self.num_envs = num_envs
        self.render_mode = self.stage.render_mode
        self.single_observation_space = self.stage.observation_space
        self.single_action_space = self.stage.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._generators: list[np.random.Generator | None] = [None] * num_envs
        self._seeds: list[int | None] = [None] * num_envs
        self._ended: Mask | None = None  # none is running before the first reset

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:  # pyright: ignore[reportIncompatibleMethodOverride] (as SyncVectorEnv's)
        """The streams from which the worlds draw their episodes."""
        return tuple(map(self._generator, range(self.num_envs)))

    @property
    def np_random_seed(self) -> tuple[int | None, ...]:  # pyright: ignore[reportIncompatibleMethodOverride] (as SyncVectorEnv's)
        """Their seeds."""
        return tuple(self._seeds)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> tuple[NDArray[Any], Info]:
        """Starts episodes.

        Args:
            seed: Of the first world, the next one for the next world; or one a world; None goes on
                with the streams.
            options: "reset_mask", bool (num_envs,): which worlds; all by default.

        Raises:
            InputError: There are not as many seeds as worlds, or an option is unknown.
        """
        mask = self._read_mask(dict(options or {}))
        for i, own in enumerate(self._read_seeds(seed)):
            if mask[i] and own is not None:
                self._generators[i], self._seeds[i] = seeding.np_random(own)
        self._start(mask)
        self._ended = ~mask if self._ended is None else self._ended & ~mask
        return self.stage.observe(), _masked(self.stage.info(), mask)

    def step(self, actions: Any) -> tuple[NDArray[Any], NDArray[Any], Mask, Mask, Info]:
        """Moves the drones, or begins anew where an episode has ended.

        Args:
            actions: One of `single_action_space` for each world.

        Raises:
            InputError: The actions are none, or worlds must be reset first.
        """
        if self._ended is None:
            raise InputError("step() has no episodes to go on with; call reset() first")
        given = read_action(actions, self.stage.worlds.dynamics.actions, (self.num_envs,))
        if self.mode is AutoresetMode.DISABLED and self._ended.any():
            raise InputError(
                f"worlds {np.flatnonzero(self._ended).tolist()} have ended; reset them by "
                "reset(options={'reset_mask': mask}), or choose another autoreset_mode"
            )
        rewards = np.where(self._ended, 0.0, self.stage.step(given))
        self._start(self._ended)
        flags = self.stage.flags()
        self._ended = flags[0] | flags[1]
        final = {}
        if self.mode is AutoresetMode.SAME_STEP and self._ended.any():
            final = self._finish(self._ended)
        everywhere = np.ones(self.num_envs, bool)
        info = {**_masked(self.stage.info(), everywhere), **final}
        return self.stage.observe(), rewards, *flags, info

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """Each drone from behind, (360, 640, 3), if that was asked for."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() draws nothing; make it with render_mode='rgb_array'")
            return None
        return tuple(self.stage.film())

    def close_extras(self, **kwargs: Any) -> None:
        """Ends the renderer."""
        self.stage.worlds.close()

    def _finish(self, ended: Mask) -> Info:
        """Begins anew where episodes have just ended; returns how they did."""
        state = self.stage.worlds.state[torch.from_numpy(ended).nonzero()[:, 0]]
        last = np.full(self.num_envs, None, object)
        for i, seen in zip(np.flatnonzero(ended), self.stage.observe(state), strict=True):
            last[i] = seen
        info = {}
        for name, value in self.stage.info(state).items():
            info[name] = np.zeros((self.num_envs, *value.shape[1:]), value.dtype)
            info[name][ended] = value
        self._start(ended)
        self._ended = np.zeros_like(ended)
        return _masked({"final_obs": last, "final_info": _masked(info, ended)}, ended)

    def _start(self, mask: Mask) -> None:
        worlds = np.flatnonzero(mask)
        self.stage.reset(torch.from_numpy(worlds), [self._generator(i) for i in worlds.tolist()])

    def _generator(self, world: int) -> np.random.Generator:
        found = self._generators[world]
        if found is None:
            found, self._seeds[world] = seeding.np_random()
            self._generators[world] = found
        return found

    def _read_seeds(self, seed: int | Sequence[int | None] | None) -> Sequence[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int):
            return [seed + i for i in range(self.num_envs)]
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
    """Adds to each entry which worlds have it; it is 0 for the others."""
    told = {}
    for name, value in info.items():
        if isinstance(value, np.ndarray) and value.dtype != object and not mask.all():
            value = np.where(mask.reshape(-1, *[1] * (value.ndim - 1)), value, value.dtype.type(0))
        told |= {name: value, f"_{name}": mask.copy()}
    return told


def _mode(given: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(given)
    except ValueError:
        known = ", ".join(mode.value for mode in AutoresetMode)
        raise InputError(f"autoreset_mode={given!r} is unknown; give one of: {known}") from None
