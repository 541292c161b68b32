"""Greedy flights from given placements: the real worlds, renderer, transforms and network."""

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Self

import numpy as np
import torch
from numpy.typing import NDArray
from tensordict import TensorDict
from torch import Tensor
from torchrl.envs import Transform

from drone_rl.envs import worlds_of
from drone_rl.policies.zoo import PolicyDescription
from drone_rl.sim.tasks import State
from drone_rl.sim.tasks.collect_cubes import WorldState
from drone_rl.verification.requirements import require_cubes

MOST_AT_ONCE = 1024
"""Flights in one batch."""
MOST_PIXELS = 2**22
"""Of the pictures of a batch."""
Tell = Callable[[int, int], None]
"""Told how much is done, and of how much."""


@dataclasses.dataclass(frozen=True)
class Flown:
    """How flights ended; the first dimension counts flights."""

    end: NDArray[np.int64]  # (k,)
    """Why, an `EndReason`."""
    collected: NDArray[np.bool_]  # (k, cubes)
    """Which cubes were collected."""
    steps: NDArray[np.int64]  # (k,)
    """How many there were."""
    repeats: NDArray[np.int64]  # (k,)
    """At how many of the last steps, one after the other, the world was as two steps before."""

    @classmethod
    def join(cls, parts: Iterable["Flown"]) -> Self:
        """All of them, one after the other."""
        every = list(parts)
        names = [field.name for field in dataclasses.fields(cls)]
        return cls(**{n: np.concatenate([getattr(p, n) for p in every]) for n in names})


class Simulator:
    """Flies a policy that acts by the present picture alone."""

    def __init__(
        self,
        described: PolicyDescription,
        weights: Mapping[str, Tensor],
        device: str = "cpu",
        renderer: str = "raytrace",
    ) -> None:
        """Builds worlds and network.

        Args:
            described: The policy, in the task to fly.
            weights: Of its network.
            device: Where worlds are drawn and the network runs.
            renderer: Who draws, see `drone_rl.sim.rendering.find_renderer`.

        Raises:
            InputError: There is no such device.
        """
        pixels = described.camera.width * described.camera.height
        self.at_once = max(1, min(MOST_AT_ONCE, MOST_PIXELS // pixels))
        count = min(self.at_once, 64)
        self._env = described.build_env(count, seed=0, device=device, renderer=renderer)
        self._worlds = worlds_of(self._env)
        self._task = require_cubes(described.task, "what a certificate states")
        every: Iterable[Transform] = self._env.transform  # type: ignore[assignment]
        self._transforms = [t for t in every if "pixels" in (t.in_keys or [])]
        self._network = described.load_network(weights).to(self._worlds.device)
        self._dtype = torch.float32

    def fly(self, placements: NDArray[np.float64], tell: Tell = lambda done, total: None) -> Flown:
        """Flies flights to their ends, so many in a batch.

        Args:
            placements: Metres to the left of each cube. Shape: (k, cubes).
            tell: Told after each batch how many were flown, and of how many.
        """
        parts = [self._fly(placements[:0])]
        for first in range(0, len(placements), self.at_once):
            parts.append(self._fly(placements[first : first + self.at_once]))
            tell(min(first + self.at_once, len(placements)), len(placements))
        return Flown.join(parts)

    def compute_in(self, dtype: torch.dtype) -> None:
        """Evaluate the network in another precision from now on."""
        self._network, self._dtype = self._network.to(dtype), dtype

    def close(self) -> None:
        """Ends the renderer."""
        self._env.close()

    @torch.no_grad()
    def _fly(self, placements: NDArray[np.float64]) -> Flown:
        now: Any = self._start(torch.from_numpy(placements))  # worlds are of any task's state
        flying = torch.arange(len(now), device=self._worlds.device)
        done, before = now[flying], now
        repeats = torch.zeros_like(flying)
        while len(flying):
            earlier, before = before, now
            now, _ = self._worlds.advance(now, self._choose(now))
            is_same = self._is_same(earlier, now)
            done[flying], repeats[flying] = now, (repeats[flying] + 1) * is_same
            on = now.end_reason == 0
            flying, now, before = flying[on], now[on], before[on]
        ended = (done.end_reason, done.collected, done.steps, repeats)
        return Flown(*(value.cpu().numpy() for value in ended))

    def _start(self, lateral: Tensor) -> State:
        """The worlds at the start, with cubes at these places."""
        task = self._task
        ahead = task.first_distance + task.spacing * torch.arange(task.num_cubes).double()
        up = torch.full_like(lateral, task.altitude)
        return self._worlds.start(torch.stack([ahead.expand_as(lateral), lateral, up], -1))

    def _choose(self, state: WorldState) -> Tensor:
        """The most probable action in each world."""
        seen = TensorDict({"pixels": self._worlds.render(state)}, [len(state)])
        for transform in self._transforms:
            seen = transform(seen)
        return self._network(seen["pixels"].to(self._dtype)).argmax(-1)

    def _is_same(self, one: WorldState, other: WorldState) -> Tensor:
        """Whether worlds are as they were: the drone at its place, the same cubes standing."""
        moved = (one.drone - other.drone).abs().amax(-1) > self._task.step_length / 2
        return ~moved & (one.present == other.present).all(-1)
