"""Recorded flights: each step of the policy's actions, written as demonstrations."""

from pathlib import Path

import numpy as np
from torch import Tensor

from drone_rl.explanations.fly_page.world import World


class Recorder:
    """Collects steps of one flyer in one episode and writes them to a folder."""

    def __init__(self, world: World, folder: Path) -> None:
        """Take the world, and the folder to which files are added."""
        self._world, self.folder = world, folder
        self.is_on = False
        self.saved = 0
        """Number of files written."""
        self._steps: list[tuple[Tensor, Tensor, float]] = []

    def __len__(self) -> int:
        """Return the number of steps that are not written yet."""
        return len(self._steps)

    def note(self, frame: Tensor, action: Tensor, reward: float, pilot: str) -> None:
        """Add a step, if recording is on; the end of an episode writes the file.

        Args:
            frame: Image before the action. Shape: (1, H, W, 3).
            action: The action. Shape: (1,), then that of an action.
            reward: Its reward.
            pilot: Name of who flies.
        """
        if not self.is_on:
            return
        self._steps.append((frame, action, reward))
        if self._world.is_over:
            self.finish(pilot)

    def finish(self, pilot: str) -> None:
        """Write the steps so far, if there are any, to a new file."""
        steps, self._steps = self._steps, []
        if not steps:
            return
        from drone_rl.training.demonstrations import (  # slow to import
            Demonstration,
            FlightConditions,
            add_demonstration,
        )

        frames, actions, rewards = zip(*steps, strict=True)
        done = np.zeros(len(steps), np.bool_)
        done[-1] = self._world.is_over
        demonstration = Demonstration(
            FlightConditions(*self._world.conditions),
            images=np.concatenate([frame.numpy() for frame in frames]),
            actions=np.concatenate([action.numpy() for action in actions]),
            rewards=np.array(rewards, np.float32),
            done=done,
            pilot=pilot,
        )
        add_demonstration(self.folder, demonstration)
        self.saved += 1
