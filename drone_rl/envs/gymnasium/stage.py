"""Worlds of a task in NumPy's arrays: what one environment and a vector of them have in common."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.config import (
    ActionSettings,
    BaseTaskSettings,
    CameraSettings,
    DynamicsSettings,
    TaskSettings,
    settings_of,
)
from drone_rl.config.commands import GymnasiumSettings
from drone_rl.config.configuration import Changes
from drone_rl.envs.gymnasium.spaces import action_space, picture_space, vector_space
from drone_rl.sim.composer_task import CONTROL_TIMESTEP_S
from drone_rl.sim.entities import CHASE
from drone_rl.sim.rendering import check_device
from drone_rl.sim.tasks import State, Task, as_task
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import Settings, kinds_of

METADATA: dict[str, Any] = {
    "render_modes": ["rgb_array"],
    "render_fps": round(1 / CONTROL_TIMESTEP_S),
}
"""Of every environment."""
_PARTS: dict[str, type[Settings]] = {
    "camera": CameraSettings,
    "dynamics": DynamicsSettings,
    "actions": ActionSettings,
}
"""Options of which some settings may be given in a mapping."""
FILM_HEIGHT, FILM_WIDTH = 360, 640
"""Pixels of what `render` draws: the drone from behind."""
END = "end_reason"
Chosen = str | BaseTaskSettings | Task[Any] | None
"""A task, its settings, or where to import their class from; cube collection by default."""


class Stage:
    """Worlds, and what is observed of them."""

    def __init__(self, num_worlds: int, task: Chosen, given: Mapping[str, Any]) -> None:
        """Makes the worlds.

        Args:
            num_worlds: How many.
            task: What there is to do.
            given: `GymnasiumSettings`, of camera, dynamics and actions also some settings in a
                mapping; and settings of the task.

        Raises:
            InputError: An option or setting is unknown or out of range.
        """
        own = kinds_of(GymnasiumSettings)
        options = {name: value for name, value in given.items() if name in own}
        for name, kind in _PARTS.items():
            if isinstance(options.get(name), Mapping):
                options[name] = kind(**Changes(kind).read(options[name], name))
        options = GymnasiumSettings(**options)
        options.dynamics.check_air()
        changes = {name: value for name, value in given.items() if name not in own}
        check_device(options.device)
        self.worlds = Worlds(
            num_worlds,
            _make_task(task, changes),
            options.camera,
            dynamics=options.dynamics,
            actions=options.actions,
            renderer=options.renderer,
            device=options.device,
        )
        self._every = torch.arange(num_worlds, device=self.worlds.device)
        self.render_mode = options.render_mode
        self.sees = options.observations == "pixels"
        self.names = tuple(name for name in self.worlds.entries if name != END)
        """Entries of the information that make up the state, in its order."""
        self.observation_space: spaces.Box = (
            picture_space(options.camera)
            if self.sees
            else vector_space({name: self.worlds.entries[name] for name in self.names})
        )
        self.action_space = action_space(self.worlds.dynamics.actions.entry)

    def reset(self, worlds: Tensor, generators: Sequence[np.random.Generator]) -> None:
        """Starts new episodes.

        Args:
            worlds: Indices. Shape: (k,).
            generators: Of each of these worlds, from which its episode is drawn.
        """
        # one stream in two guises: what is drawn by the one is gone for the other
        streams = [np.random.RandomState(generator.bit_generator) for generator in generators]
        self.worlds.reset(worlds, streams)

    def step(self, actions: Tensor) -> NDArray[np.float64]:
        """Moves all worlds; returns their rewards. Shapes: (num_worlds, *) to (num_worlds,)."""
        actions = actions.to(self.worlds.device)
        return self.worlds.step(self._every, actions).cpu().numpy()

    def observe(self, state: State | None = None) -> NDArray[Any]:
        """What is seen of all worlds, or of those of a state, in a new array."""
        state = self.worlds.state if state is None else state
        if self.sees:
            return self.worlds.render(state).cpu().numpy()
        info = self.worlds.info(state)
        flat = [info[name].flatten(1).float().nan_to_num() for name in self.names]
        return torch.cat(flat, 1).cpu().numpy()

    def flags(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Which worlds have terminated, and which were truncated. Shapes: (num_worlds,)."""
        terminated, truncated = self.worlds.ends()
        return terminated.cpu().numpy(), truncated.cpu().numpy()

    def info(self, state: State | None = None) -> dict[str, NDArray[Any]]:
        """The truth about all worlds, or about those of a state.

        The entries of `Worlds.entries`, of which "end_reason" is a plain number a world, and
        "is_success". What isn't known yet is 0: to Gymnasium's checker NaN is never the same.
        Shapes: (num_worlds, *).
        """
        truth = self.worlds.info(state)
        info = {name: value.nan_to_num().cpu().numpy() for name, value in truth.items()}
        info[END] = info[END][:, 0]
        return {**info, "is_success": info[END] == self.worlds.task.success_end}

    def film(self) -> NDArray[np.uint8]:
        """The drones from behind. Shape: (num_worlds, FILM_HEIGHT, FILM_WIDTH, 3)."""
        worlds = self.worlds
        view = worlds.view(CHASE.name, height=FILM_HEIGHT, width=FILM_WIDTH, show_drone=True)
        return worlds.render(worlds.state, view).cpu().numpy()


def _make_task(task: Chosen, changes: Mapping[str, Any]) -> Task[Any]:
    chosen: Any = settings_of(task, "task")() if isinstance(task, str) else task or TaskSettings()
    known = kinds_of(type(chosen)) if isinstance(chosen, Settings) else {}
    for name in changes:
        if name not in known:
            there = ", ".join((*kinds_of(GymnasiumSettings), *known))
            raise InputError(f"{name} is unknown; there are: {there}")
    made: Any = chosen.replace(**changes) if changes else chosen
    return as_task(made)
