"""A task that needs memory: a cube is shown in the first frames only, and must be collected later.

drone-rl train 'plugins=[examples.recall]' task=recall network=lstm
"""

import dataclasses
from collections.abc import Mapping

import numpy as np
import torch
from torch import Tensor

import drone_rl
from drone_rl.sim.actions import MOVES, Move
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.entities import Cube
from drone_rl.sim.tasks import EndReason, Goals, OracleRule, SampledState, Task
from drone_rl.sim.vocabulary import TaskVocabulary

AHEAD, ASIDE, REACH = 4.0, 2.0, 1.5
"""Metres to the cube, straight on and to a side; to a side at which it is collected."""
SHOWN, LIMIT = 2, 12
"""Frames that show the cube, in which the drone waits; steps of an episode at most."""


def approach(drone: Tensor, cube: Tensor) -> Tensor:
    """Return the move towards a cube, sideways first. Shapes: (N, 3)."""
    lateral = (cube - drone)[..., 1]
    aside = torch.where(lateral > 0, Move.LEFT, Move.RIGHT)
    return torch.where(lateral.abs() > REACH / 2, aside, Move.FORWARD)


class Recall(Task[SampledState]):
    """The reward is 1 for passing where the cube stood.

    Actions have no effect while the cube is shown. So neither a frame nor the drone's position
    tells a policy without memory the side, and it succeeds in half of the episodes at most.
    """

    name = "recall"
    vocabulary = TaskVocabulary(goal="cube", reach="collect", reached="collected", target="cube")
    strata = ("left", "right")
    oracle = OracleRule(("drone", "sampled"), approach, MOVES)

    def make_props(self) -> list[Cube]:
        """Return the cube."""
        return [Cube(1.0, (0.1, 0.1, 0.6), name="cube")]

    def sample(self, random_state: np.random.RandomState) -> Tensor:
        """Sample the side of the cube; return its position, metres."""
        side = random_state.choice([-1.0, 1.0])
        return torch.tensor([AHEAD, side * ASIDE, 1.0], dtype=torch.float64)

    def places(self, state: SampledState) -> Tensor:
        """Return the cube's position, which is behind the drone once hidden. Shape: (N, 1, 3)."""
        is_hidden = (state.steps >= SHOWN)[:, None]
        behind = state.sampled.new_tensor([-100.0, 0.0, 1.0])
        return torch.where(is_hidden, behind, state.sampled)[:, None]

    def step(self, state: SampledState, body: BodyState) -> tuple[SampledState, Tensor]:
        """End the episode where the cube was passed, on either side, or after too many steps."""
        steps, cube = state.steps + 1, state.sampled
        waits = steps <= SHOWN
        body = body.moved(torch.where(waits[:, None], state.drone, body.position))
        is_past = body.position[:, 0] >= cube[:, 0]
        is_near = (body.position - cube)[:, 1].abs() < REACH
        end = torch.where(steps >= LIMIT, EndReason.STEP_LIMIT, EndReason.RUNNING)
        end = end.masked_fill(is_past, EndReason.FAILURE)
        end = end.masked_fill(is_past & is_near, EndReason.SUCCESS)
        new = dataclasses.replace(state, body=body, steps=steps, end_reason=end)
        return new, (end == EndReason.SUCCESS).double()

    def score(self, info: Mapping[str, Tensor]) -> Goals:
        """Count cubes to the left and to the right separately."""
        goals = super().score(info)
        return dataclasses.replace(goals, stratum=(info["sampled"][:, 1:2] < 0).long())


drone_rl.register_task(Recall())
