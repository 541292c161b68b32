"""Cube collection with episodes that begin where somebody wants them to."""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.config import TaskSettings
from drone_rl.sim.tasks.collect_cubes import CollectCubes
from drone_rl.utils.errors import InputError


class FailureReplayTask(CollectCubes):
    """The same task, but a share of its episodes have their cubes in given boxes.

    Which ones, which box, and where in it, is drawn from the world's own stream, and the same
    numbers are drawn for every episode: a world that goes on from a saved stream goes on alike.
    """

    def __init__(self, settings: TaskSettings, boxes: NDArray[np.float64], share: float) -> None:
        """Takes the boxes.

        Args:
            settings: The task's.
            boxes: Sideways places of the cubes, the lower and upper end for each, metres to the
                left of the start; each box is drawn as often. Shape: (N, num_cubes, 2).
            share: Of the episodes, 0 to 1.

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
        if not (boxes[..., 0] <= boxes[..., 1]).all() or np.abs(boxes).max() > self.bound:
            raise InputError(f"boxes reach beyond {self.bound} m to either side; give such within")
        self.boxes, self.share = boxes, share

    @property
    def bound(self) -> float:
        """Metres to either side within which cubes are placed."""
        return self.settings.lateral_bound

    def draw(self, random_state: np.random.RandomState) -> Tensor:
        """Places of the cubes. Shape: (num_cubes, 3)."""
        cubes = super().draw(random_state)
        chance, which, *parts = random_state.uniform(size=2 + len(cubes))
        if chance < self.share:
            lower, upper = self.boxes[int(which * len(self.boxes))].T
            cubes[:, 1] = torch.from_numpy(lower + np.array(parts) * (upper - lower))
        return cubes


def inflated(boxes: NDArray[np.float64], metres: float, bound: float) -> NDArray[np.float64]:
    """Boxes that reach farther on every side, though not beyond the placements.

    Args:
        boxes: Shape: (N, num_cubes, 2), metres.
        metres: How much farther.
        bound: Cubes are placed up to so many metres to either side.
    """
    return np.clip(boxes + np.array([-metres, metres]), -bound, bound)
