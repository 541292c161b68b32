"""A batch of environments with NumPy arrays and Gymnasium spaces; both classes use it."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.config import BaseTaskSettings, TaskSettings
from drone_rl.config.commands import GymnasiumSettings
from drone_rl.config.inputs import PIXELS, describe_inputs, first_camera
from drone_rl.envs import DroneEnv
from drone_rl.envs.observer import Starts
from drone_rl.sim.actions import Actions, Entry
from drone_rl.sim.composer_task import CONTROL_TIMESTEP_S
from drone_rl.sim.entities import CHASE
from drone_rl.sim.tasks import Task, as_task
from drone_rl.utils.errors import InputError, did_you_mean
from drone_rl.utils.settings import Settings

_MOST = float(np.finfo(np.float32).max)
"""Bound of spaces without a limit: Gymnasium's checker requires finite bounds."""


Seen = NDArray[Any] | dict[str, NDArray[Any]]
"""Observations: an array, or arrays by the names of inputs."""


def rows_of(seen: Seen, row: Any) -> Any:
    """Return a row of observations."""
    if isinstance(seen, dict):
        return {name: values[row] for name, values in seen.items()}
    return seen[row]


def input_space(example: Tensor) -> spaces.Box:
    """Return the space of an input: bytes are from 0 to 255, floats any numbers."""
    shape, is_bytes = tuple(example.shape), example.dtype == torch.uint8
    return spaces.Box(0, 255, shape, np.uint8) if is_bytes else spaces.Box(-_MOST, _MOST, shape)


def vector_space(entries: Mapping[str, Entry]) -> spaces.Box:
    """Return the space of concatenated entries, as float32."""
    bounds = [np.tile(_finite_bounds(e), (math.prod(e.shape), 1)) for e in entries.values()]
    low, high = np.concatenate(bounds).T.astype(np.float32)
    return spaces.Box(low, high)


def action_space(entry: Entry) -> spaces.Space[Any]:
    """Return the space of an action: discrete for whole numbers, else a box."""
    low, high = _finite_bounds(entry)
    if entry.dtype != torch.int64:
        return spaces.Box(low, high, entry.shape)
    count = int(high) + 1
    space: Any = spaces.MultiDiscrete if entry.shape else spaces.Discrete
    return space(np.full(entry.shape, count) if entry.shape else count)


def read_action(action: Any, actions: Actions, batch: tuple[int, ...] = ()) -> Tensor:
    """Check and convert an action, or a batch of them. Shape: (*batch, *actions.entry.shape).

    Raises:
        InputError: The action or its shape is invalid.
    """
    entry, (low, high) = actions.entry, _finite_bounds(actions.entry)
    is_whole = entry.dtype == torch.int64
    try:
        array = np.asarray(action)
    except (ValueError, TypeError, RuntimeError):  # a ragged list, a tensor elsewhere
        array = np.empty(0, object)
    shape = (*batch, *entry.shape)
    fits = array.shape == shape and array.dtype.kind in ("iu" if is_whole else "iuf")
    if not fits or not ((array >= low) & (array <= high)).all():
        numbers = ", ".join(f"{i} {name}" for i, name in enumerate(actions.names))
        numbers = numbers if is_whole else f"numbers from {low:g} to {high:g}"
        many = f"an array of shape {shape} of" if shape else "one of"
        text = " ".join(repr(action).split())[:80]
        raise InputError(f"action={text} is invalid; give {many}: {numbers}")
    return torch.as_tensor(array, dtype=entry.dtype)


def _finite_bounds(entry: Entry) -> tuple[float, float]:
    if entry.dtype == torch.bool:
        return 0.0, 1.0
    low = -_MOST if entry.low is None else float(entry.low)
    return low, _MOST if entry.high is None else float(entry.high)


METADATA: dict[str, Any] = {
    "render_modes": ["rgb_array"],
    "render_fps": round(1 / CONTROL_TIMESTEP_S),
}
"""Metadata of every environment; the frame rate is that of the default control step."""

FILM_HEIGHT, FILM_WIDTH = 360, 640
"""Size in pixels of the images of `render`, which show the drone from behind."""
END = "end_reason"
Chosen = str | BaseTaskSettings | Task[Any] | None
"""A task, its settings or its registered name; cube collection by default."""


class KeywordError(InputError, TypeError):
    """An option that does not exist; a `TypeError`, by which TorchRL's `GymEnv` probes options."""


class WorldBatch:
    """A batch of environments, their observations and their spaces."""

    def __init__(self, num_envs: int, task: Chosen, arguments: Mapping[str, Any]) -> None:
        """Create the environments.

        `arguments` has fields of `GymnasiumSettings`, some as mappings, and settings of the task.

        Raises:
            InputError: An option or setting is unknown or out of range.
        """
        names = GymnasiumSettings.model_fields
        options = {name: value for name, value in arguments.items() if name in names}
        options = GymnasiumSettings(**options)
        options.dynamics.check_air()
        changes = {name: value for name, value in arguments.items() if name not in names}
        self.options = options
        self.task = _chosen_task(task, changes)
        """The task or its settings."""
        self.render_mode = options.render_mode
        self.has_images = options.observations == "pixels"
        if (options.transforms or options.inputs) and not self.has_images:
            what = "transforms change images" if options.transforms else "inputs are of policies"
            raise InputError(
                f"{what}, but observations={options.observations}; leave one of them out"
            )
        self.inputs = None if options.inputs is None else describe_inputs(options.inputs)
        """The inputs by name, if they were given."""
        if self.inputs is not None and {"camera", "transforms"} & options.model_fields_set:
            raise InputError(
                "camera= and transforms= describe the default input; leave them out, or describe "
                "all inputs in inputs="
            )
        self._env = DroneEnv(
            num_envs,
            as_task(self.task),
            options.camera if self.inputs is None else first_camera(self.inputs),
            inputs=self.inputs,
            transforms=[transform.make() for transform in options.transforms],
            pixels=self.has_images,
            device=options.device,
            dynamics=options.dynamics,
            actions=options.actions,
            renderer=options.renderer,
        )
        self.worlds = self._env.worlds
        self._every = torch.arange(num_envs, device=self.worlds.device)
        self.names = tuple(name for name in self.worlds.entries if name != END)
        """Entries of `info` that make up the state vector, in order."""
        self.observation_space: spaces.Space[Any] = self._observation_space()
        self.action_space = action_space(self.worlds.dynamics.actions.entry)

    def _observation_space(self) -> spaces.Space[Any]:
        if not self.has_images:
            return vector_space({name: self.worlds.entries[name] for name in self.names})
        examples = self._env.observer.examples().items()
        inputs: dict[str, Any] = {name: input_space(example[0]) for name, example in examples}
        return inputs[PIXELS] if self.inputs is None else spaces.Dict(inputs)

    def reset(self, env_ids: Tensor, generators: Sequence[np.random.Generator]) -> None:
        """Reset environments by index, shape (k,), each with its own random generator."""
        # each RandomState shares its generator's bit generator, so both advance together
        for row, generator in zip(env_ids.tolist(), generators, strict=True):
            self._env.random_states[row] = np.random.RandomState(generator.bit_generator)
        self._env.start(env_ids)

    def step(self, actions: Tensor) -> NDArray[np.float64]:
        """Step all environments; return their rewards. Shapes: (num_envs, *) to (num_envs,)."""
        actions = actions.to(self.worlds.device)
        return self.worlds.step(self._every, actions).cpu().numpy()

    def observe(self, starts: Starts, env_ids: Tensor | None = None) -> Seen:
        """Return the observations of all environments as new arrays, after a step or reset.

        Args:
            starts: Where episodes start, see `drone_rl.envs.observer.Starts`.
            env_ids: Environments with a new state, (k,); all by default.
        """
        if self.has_images:
            seen = self._env.observe(self._every if env_ids is None else env_ids, starts)
            arrays = {name: values.cpu().numpy().copy() for name, values in seen.items()}
            return arrays[PIXELS] if self.inputs is None else arrays
        info = self.worlds.info()
        flat = [info[name][:, None].flatten(1).float().nan_to_num() for name in self.names]
        return torch.cat(flat, 1).cpu().numpy()

    def flags(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return the terminated and truncated flags. Shapes: (num_envs,)."""
        terminated, truncated = self.worlds.ends()
        return terminated.cpu().numpy(), truncated.cpu().numpy()

    def info(self) -> dict[str, NDArray[Any]]:
        """Return `Worlds.info` with flat "end_reason" and with "is_success". (num_envs, *).

        Unknown values are 0, since Gymnasium's checker rejects NaN.
        """
        truth = self.worlds.info().items()
        info = {name: value.nan_to_num().cpu().numpy() for name, value in truth}
        info[END] = info[END][:, 0]
        return {**info, "is_success": info[END] == self.worlds.task.success_end}

    def film(self) -> NDArray[np.uint8] | None:
        """Render each drone from behind, (num_envs, 360, 640, 3); None without `render_mode`."""
        if self.render_mode is None:
            gymnasium.logger.warn("render() needs render_mode='rgb_array' at creation")
            return None
        worlds = self.worlds
        view = worlds.view(CHASE.name, height=FILM_HEIGHT, width=FILM_WIDTH, show_drone=True)
        return worlds.render(worlds.state, view).cpu().numpy()


def _chosen_task(task: Chosen, changes: Mapping[str, Any]) -> BaseTaskSettings | Task[Any]:
    chosen: Any = (
        BaseTaskSettings.read(task, "task") if isinstance(task, str) else task or TaskSettings()
    )
    kinds = type(chosen).model_fields if isinstance(chosen, Settings) else {}
    for name in changes:
        if name not in kinds:
            there = (*GymnasiumSettings.model_fields, *kinds)
            meant = did_you_mean(name, there)
            raise KeywordError(
                f"unexpected keyword argument {name!r}; valid names: {', '.join(there)}{meant}"
            )
    made: Any = chosen.replace(**changes) if changes else chosen
    return made
