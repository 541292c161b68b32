"""Who knows where every cube is that the camera shows: where it fails, nobody can do well.

It looks at the picture's segmentation, taken by the same camera, hidden by the same faults: a cube
that shows in one pixel it knows exactly, one that shows in none it knows nothing of. It knows its
own delay, too.
"""

import dataclasses

import torch
from torch import Tensor

from drone_rl.robustness.eyes import Sight
from drone_rl.sim.tasks import Task

_NOTHING = -1.0


class OracleEyes:
    """Does what the task's oracle does about the first cube that it sees."""

    knows_truth = True

    def __init__(self, *, looks: bool = True) -> None:
        """Sets what it knows.

        Args:
            looks: Whether it knows what its camera shows, or everything.
        """
        self._looks = looks

    def act(self, sight: Sight) -> tuple[Tensor, Tensor | None]:
        """See `Eyes`."""
        worlds, rule = sight.worlds, sight.worlds.task.oracle
        assert rule is not None
        body = sight.state.body
        for action in sight.pending:
            body = worlds.dynamics.step(body, action)
        info = worlds.info(dataclasses.replace(sight.state, body=body))  # pyright: ignore[reportArgumentType] (a dataclass)
        if self._looks:
            info["next_cube"] = self._first_seen(sight, info["next_cube"])
        return rule.decide([info[name] for name in rule.reads], worlds.dynamics.actions), None

    def _first_seen(self, sight: Sight, next_cube: Tensor) -> Tensor:
        """The nearest standing cube that shows; their number if none does. Shape: (n, 1)."""
        props = torch.tensor([*sight.worlds.scene.props, -1], device=next_cube.device)
        shown = props[sight.draw("segmentation").long()].float()[:, None]
        shown = sight.spoil(shown, sight.flying, _NOTHING).flatten(1)
        count = sight.worlds.task.places(sight.state).shape[1]  # what follows are distractors
        stands = (shown >= next_cube) & (shown < count)
        there = torch.where(stands, shown, torch.full_like(shown, count))
        return there.amin(-1, keepdim=True).long()


def has_oracle(task: Task) -> bool:
    """Whether a task has one of whom the next cube can be hidden."""
    return task.oracle is not None and "next_cube" in task.oracle.reads
