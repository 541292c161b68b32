"""Simulate greedy episodes with the real environment, renderer, transforms and network."""

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

MOST_AT_ONCE = 1024  # episodes per batch
MOST_PIXELS = 2**22  # pixels per batch of images
ProgressCallback = Callable[[int, int], None]  # called with the number done, and of all


@dataclasses.dataclass(frozen=True)
class Rollouts:
    """How episodes ended; the first dimension counts episodes."""

    end: NDArray[np.int64]  # (k,); `EndReason`
    collected: NDArray[np.bool_]  # (k, cubes); whether each cube was collected
    steps: NDArray[np.int64]  # (k,); number of steps
    repeats: NDArray[np.int64]  # (k,)
    """Number of final steps in a row after which the state was that of two steps before."""

    @classmethod
    def join(cls, parts: Iterable["Rollouts"]) -> Self:
        """Concatenate."""
        every = list(parts)
        names = [field.name for field in dataclasses.fields(cls)]
        return cls(**{n: np.concatenate([getattr(p, n) for p in every]) for n in names})


class Simulator:
    """Simulates a policy without memory."""

    def __init__(
        self,
        described: PolicyDescription,
        weights: Mapping[str, Tensor],
        device: str = "cpu",
        renderer: str = "raytrace",
    ) -> None:
        """Build the environment of a policy's task, and its network; see `check_certificate`."""
        pixels = described.camera.width * described.camera.height
        self.at_once = max(1, min(MOST_AT_ONCE, MOST_PIXELS // pixels))
        count = min(self.at_once, 64)
        self._env = described.build_env(count, seed=0, device=device, renderer=renderer)
        self._worlds = worlds_of(self._env)
        self._task = require_cubes(described.task, "certificates")
        every: Iterable[Transform] = self._env.transform  # type: ignore[assignment]
        self._transforms = [t for t in every if "pixels" in (t.in_keys or [])]
        self._network = described.load_network(weights).to(self._worlds.device)
        self._dtype = torch.float32

    def fly(
        self, placements: NDArray[np.float64], tell: ProgressCallback = lambda done, total: None
    ) -> Rollouts:
        """Simulate episodes in batches, from metres to the left of each cube (k, cubes)."""
        parts = [self._fly(placements[:0])]
        for first in range(0, len(placements), self.at_once):
            parts.append(self._fly(placements[first : first + self.at_once]))
            tell(min(first + self.at_once, len(placements)), len(placements))
        return Rollouts.join(parts)

    def compute_in(self, dtype: torch.dtype) -> None:
        """Evaluate the network in another precision from now on."""
        self._network, self._dtype = self._network.to(dtype), dtype

    def close(self) -> None:
        """Close the renderer."""
        self._env.close()

    @torch.no_grad()
    def _fly(self, placements: NDArray[np.float64]) -> Rollouts:
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
        return Rollouts(*(value.cpu().numpy() for value in ended))

    def _start(self, lateral: Tensor) -> State:
        """Return initial states with cubes at these positions."""
        task = self._task
        ahead = task.first_distance + task.spacing * torch.arange(task.num_cubes).double()
        up = torch.full_like(lateral, task.altitude)
        return self._worlds.start(torch.stack([ahead.expand_as(lateral), lateral, up], -1))

    def _choose(self, state: WorldState) -> Tensor:
        """Return the argmax actions."""
        seen = TensorDict({"pixels": self._worlds.render(state)}, [len(state)])
        for transform in self._transforms:
            seen = transform(seen)
        return self._network(seen["pixels"].to(self._dtype)).argmax(-1)

    def _is_same(self, one: WorldState, other: WorldState) -> Tensor:
        """Return whether states are equal: same position, same cubes standing."""
        moved = (one.drone - other.drone).abs().amax(-1) > self._task.step_length / 2
        return ~moved & (one.present == other.present).all(-1)
