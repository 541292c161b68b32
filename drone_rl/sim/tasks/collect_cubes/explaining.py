"""Cube collection as explanations know it: cubes are targets."""

import types
from collections.abc import Mapping

import torch
from torch import Tensor

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.tasks.collect_cubes import changes, rules
from drone_rl.sim.tasks.collect_cubes.oracle import turn_towards
from drone_rl.sim.tasks.collect_cubes.rules import WorldState
from drone_rl.sim.tasks.explainable import Grid


class Explaining:
    """See `Explainable`."""

    settings: TaskSettings
    remembered: Mapping[str, str] = types.MappingProxyType(
        {
            "cubes": "positions of the cubes, metres, in order of x (T, C, 3)",
            "present": "whether each cube still stands, bool (T, C)",
            "collected": "whether each cube has been collected, bool (T, C)",
            "next_target": "index of the nearest standing cube, C if none (T,)",
        }
    )

    def remember(self, info: Mapping[str, Tensor]) -> dict[str, Tensor]:
        """See `remembered`."""
        next_cube, collected = info["next_cube"][:, 0], info["collected"]
        index = torch.arange(collected.shape[-1], device=next_cube.device)
        # cubes stand in order of x, so a standing cube is the next one or one behind it
        return {
            "cubes": info["cube_positions"],
            "present": ~collected & (index >= next_cube[:, None]),
            "collected": collected,
            "next_target": next_cube,
        }

    def tally(self, info: Mapping[str, Tensor]) -> tuple[Tensor, Tensor]:
        """Cubes collected, and cubes left behind."""
        collected = info["collected"].sum(-1)
        return collected, info["next_cube"][:, 0] - collected

    def recall(self, kept: Mapping[str, Tensor], body: BodyState) -> WorldState:
        """The worlds as they stood, but for where cubes were seen first."""
        present, collected = kept["present"], kept["collected"]
        return WorldState(
            body=body,
            cubes=kept["cubes"].double(),
            collected=collected,
            passed=~present & ~collected,
            side=torch.full(present.shape, -1),
            lateral=torch.full(present.shape, torch.nan, dtype=torch.float64),
            steps=kept["step"].clone(),
            end_reason=torch.zeros(len(present), dtype=torch.int64),
        )

    def next_target(self, state: WorldState) -> Tensor:
        """The next cube."""
        return state.next_cube

    def next_offset(self, state: WorldState) -> Tensor:
        """From the drone to it."""
        return changes.next_offset(state)

    def is_reached(self, state: WorldState, target: Tensor) -> Tensor:
        """Whether it is collected."""
        return state.collected[torch.arange(len(state), device=target.device), target]

    def is_behind(self, state: WorldState, target: Tensor) -> Tensor:
        """Whether the drone is beyond it, or where it was."""
        world = torch.arange(len(state), device=target.device)
        return state.drone[:, 0] > state.cubes[world, target, 0]

    def needed(self, offset: Tensor) -> Tensor:
        """A turn where flying straight on would miss."""
        return turn_towards(offset[..., 1], self.settings.touch_distance)

    def stratum_at(self, offset: Tensor) -> Tensor:
        """Its side."""
        return rules.side_of(self.settings, offset[..., 1])

    def grid(self, num_forward: int, num_lateral: int) -> Grid:
        """Wherever a next cube can stand."""
        return changes.grid(self.settings, num_forward, num_lateral)

    def one_target(self, body: BodyState, offset: Tensor) -> WorldState:
        """One cube there; the others are not."""
        return changes.one_cube(self.settings, body, offset)

    def without_targets(self, state: WorldState) -> WorldState:
        """No cube left."""
        return changes.without_cubes(state)

    def without_next(self, state: WorldState) -> WorldState:
        """The next cube left out."""
        return changes.without_next(state)

    def next_moved(self, state: WorldState, metres: Tensor | float) -> WorldState:
        """The next cube to the left by so much."""
        return changes.next_moved(state, metres)

    def elsewhere(
        self, state: WorldState, camera: CameraSettings, generator: torch.Generator
    ) -> WorldState:
        """All cubes standing, at random places in view."""
        return changes.elsewhere(self.settings, state, camera, generator)
