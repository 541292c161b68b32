"""Record the steps of a person or a policy, written as demonstrations."""

from pathlib import Path

import numpy as np
from torch import Tensor

from drone_rl.config.inputs import PIXELS
from drone_rl.flight.fly_page.world import World
from drone_rl.utils.errors import InputError


class Recorder:
    """Collects steps of one flyer in one episode and writes them to a folder."""

    def __init__(self, world: World, folder: Path) -> None:
        """Take the world, and the folder to which files are added."""
        self._world, self.folder = world, folder
        self.is_on = False
        self.saved = 0
        """Number of files written."""
        self._steps: list[tuple[dict[str, Tensor], Tensor, float]] = []

    def __len__(self) -> int:
        """Return the number of steps that are not written yet."""
        return len(self._steps)

    def note(self, readings: dict[str, Tensor], action: Tensor, reward: float) -> None:
        """Add a step, if recording is on.

        Args:
            readings: What cameras and sensors gave before the action. Shapes: (1, *).
            action: The action. Shape: (1,), then that of an action.
            reward: Its reward.
        """
        if self.is_on:
            self._steps.append((readings, action, reward))

    def finish(self, pilot: str) -> None:
        """Write the steps so far, if there are any, to a new file.

        Args:
            pilot: Name of who flew.

        Raises:
            InputError: The file can't be written; recording is then off.
        """
        steps, self._steps = self._steps, []
        if not steps:
            return
        from drone_rl.training.demonstrations import (  # slow to import
            Demonstration,
            FlightConditions,
            add_demonstration,
        )

        seen, actions, rewards = zip(*steps, strict=True)
        done = np.zeros(len(steps), np.bool_)
        done[-1] = self._world.is_over
        conditions = FlightConditions(**self._world.conditions)
        names = conditions.recorded
        images = {n: np.concatenate([one[n].numpy() for one in seen]) for n in names}
        try:
            demonstration = Demonstration(
                conditions,
                images=images if conditions.inputs else images[PIXELS],
                actions=np.concatenate([action.numpy() for action in actions]),
                rewards=np.array(rewards, np.float32),
                done=done,
                pilot=pilot,
            )
            add_demonstration(self.folder, demonstration)
        except InputError:
            self.is_on = False
            raise
        except OSError as error:
            self.is_on = False
            raise InputError(
                f"demonstrations={self.folder} can't be written ({error.strerror or error}); start "
                "drone-rl fly with another folder"
            ) from error
        self.saved += 1
