"""Cube collection with episodes in given boxes of placements."""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.config import TaskSettings
from drone_rl.sim.tasks.collect_cubes import CollectCubes
from drone_rl.utils.errors import InputError


class FailureReplayTask(CollectCubes):
    """The same task, but a fraction of its episodes have their cubes in given boxes.

    Every episode samples as many numbers from the environment's stream, so that resuming is exact.
    """

    def __init__(self, settings: TaskSettings, boxes: NDArray[np.float64], share: float) -> None:
        """Take the boxes.

        Args:
            settings: The task's.
            boxes: Lowest and highest y of each cube, metres. Shape: (N, num_cubes, 2).
            share: Fraction of episodes in boxes, 0 to 1; boxes are equally likely.

        Raises:
            InputError: There is no box, or one is not within the task's bounds.
        """
        super().__init__(settings)
        boxes = np.asarray(boxes, np.float64)
        if boxes.shape != (len(boxes), settings.num_cubes, 2) or not len(boxes):
            raise InputError(
                f"boxes of shape {boxes.shape} are none to draw {settings.num_cubes} cubes from; "
                f"give at least one, of shape (N, {settings.num_cubes}, 2)"
            )
        bound = settings.lateral_bound
        if not (boxes[..., 0] <= boxes[..., 1]).all() or np.abs(boxes).max() > bound:
            raise InputError(f"boxes reach beyond {bound} m to either side; give such within")
        self.boxes, self.share = boxes, share

    def draw(self, random_state: np.random.RandomState) -> Tensor:
        """Sample the positions of the cubes. Shape: (num_cubes, 3)."""
        cubes = super().draw(random_state)
        chance, which, *parts = random_state.uniform(size=2 + len(cubes))
        if chance < self.share:
            lower, upper = self.boxes[int(which * len(self.boxes))].T
            cubes[:, 1] = torch.from_numpy(lower + np.array(parts) * (upper - lower))
        return cubes


def inflated(boxes: NDArray[np.float64], metres: float, bound: float) -> NDArray[np.float64]:
    """Return boxes, (N, num_cubes, 2), extended by metres at both ends, clipped to the bound."""
    return np.clip(boxes + np.array([-metres, metres]), -bound, bound)
