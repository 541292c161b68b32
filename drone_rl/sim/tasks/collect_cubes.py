"""Collect the cubes (chapter, section 4): the drone moves until it has touched every cube."""

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.config import TaskSettings
from drone_rl.config.term_task import ObjectSettings
from drone_rl.sim.actions import DOWN, MOVES, MOVES_3D, UP, Entry, Move
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.tasks.applied_rules import AppliedRules, largest_reward, reward_terms
from drone_rl.sim.tasks.collect_cubes_kernel import (
    ALL_CUBES,
    ENDS,
    CubesEnd,
    choose_first,
    touch_cubes,
)
from drone_rl.sim.tasks.common import (
    Side,
    first_contact,
    interval_classes,
    number_classes,
    turn_towards,
)
from drone_rl.sim.tasks.objects import ObjectState, ObjectTask
from drone_rl.sim.tasks.rules_kernel import make_rules
from drone_rl.sim.tasks.scene_edits import Range, SceneEdits
from drone_rl.sim.tasks.task import Goals, OracleRule, register_task
from drone_rl.sim.vocabulary import shipped_vocabulary


@dataclasses.dataclass
class CubeGoals(Goals):
    """Cubes that were to be collected; their strata are sides."""

    lateral: Tensor  # (n, C) float64
    """Metres to the left of the drone at which each became the next one; NaN if it never did."""
    height: Tensor  # (n, C) float64
    """Metres by which each stands higher than the drone at the start of the episode."""


class CollectCubes(ObjectTask):
    """Move until every cube is touched. By default the reward is 1 a cube."""

    name = TaskSettings.name
    ends = CubesEnd
    truncation = CubesEnd.STEP_LIMIT
    success_end = CubesEnd.ALL_CUBES
    expected_end = CubesEnd.FRONT_BOUNDARY
    observed = ("cubes", "collected", "side", "end_reason")
    scored = ("collected", "side", "lateral", "cube_positions")

    def __init__(self, settings: TaskSettings | None = None) -> None:
        s = settings or TaskSettings()
        cube = ObjectSettings(shape="box", role="goal", size=(s.cube_size,) * 3, color=s.cube_color)
        rules = make_rules(
            reward_terms(s.reward),
            ENDS,
            ALL_CUBES,
            touch=touch_cubes,
            choose=choose_first,
            success_first=True,
        )
        bounds = (s.front_bound, s.side_bound, s.altitude, s.height_bound)
        cubes = {f"cube_{i}": cube for i in range(s.num_cubes)}
        applied = AppliedRules(rules, s, [*cubes.values()], rewards=s.reward, parameters=bounds)
        super().__init__(s, cubes, applied)
        self.largest_reward = largest_reward(s.reward, reached=s.num_cubes)
        self.origin = (0.0, 0.0, s.altitude)
        if s.must_climb:
            self.needed_actions = {
                "up": f"task.vertical_bound={s.vertical_bound} puts cubes where a drone that "
                f"keeps its altitude never touches them; give at most {s.touch_distance} (half of "
                "cube_size + drone_size), or actions=moves_3d"
            }
        self.vocabulary = shipped_vocabulary(TaskSettings.name).replace(tested=_some_cubes(s))
        actions = MOVES_3D if s.must_climb else MOVES
        self.oracle = OracleRule(("drone", "cube_positions", "next_cube"), self.line_up, actions)
        reach, bound = s.touch_distance, s.vertical_bound
        widest = 2.0 * s.lateral_bound
        self.edits = SceneEdits(
            task=self,
            reach=reach,
            ahead=Range(reach + 0.5 * s.step_length, s.first_distance, widest or 2.0 * reach),
            around=Range(reach + s.cube_size, s.first_distance, widest),
            heights=(-bound, 0.0, bound) if bound else (0.0,),
            is_sorted=True,
        )

    @property
    def entries(self) -> Mapping[str, Entry]:
        """Algorithm 3's info; see `ObjectState`.

        "cubes" is the number collected, "lateral" how far to its left each cube came up, metres.
        """
        cubes = self.settings.num_cubes
        return {
            "cubes": Entry((1,), torch.int64, 0, cubes),
            "collected": Entry((cubes,), torch.bool),
            "side": Entry((cubes,), torch.int64, -1, len(Side) - 1),
            "lateral": Entry((cubes,), torch.float64),
            "next_cube": Entry((1,), torch.int64, 0, cubes),
            "end_reason": Entry((1,), torch.int64, 0, len(CubesEnd) - 1),
            "cube_positions": Entry((cubes, 3), torch.float32),
        }

    def sample(self, random_state: np.random.RandomState) -> Tensor:
        """Sample the positions of the cubes (Algorithm 2). Shape: (C, 3), metres."""
        s = self.settings
        bounds = (s.lateral_bound, s.vertical_bound)
        offsets = random_state.uniform(-1.0, 1.0, size=(s.num_cubes, 2)) * bounds
        offsets += (0.0, s.altitude)
        x = s.first_distance + s.spacing * np.arange(s.num_cubes)
        return torch.from_numpy(np.column_stack([x, offsets]))

    def start(self, sampled: Tensor, body: BodyState | None = None) -> ObjectState:
        """Return states at the start of episodes, at rest by default; `sampled` are the cubes."""
        if body is None:
            body = BodyState.at_rest(sampled.new_tensor(self.origin).repeat(len(sampled), 1))
        return self.begun(body, sampled)

    def touch(self, state: ObjectState, position: Tensor, before: Tensor | None = None) -> Tensor:
        """Collect the cubes that the drones touch, see `Task.touch`."""
        before, reach = position if before is None else before, self.settings.touch_distance
        contact = first_contact(reach, before, position, state.places)
        contact = contact.masked_fill(~state.present, torch.inf)
        is_touched = contact.isfinite()
        state.touched |= is_touched
        state.reached |= is_touched
        state.present &= ~is_touched
        return contact

    def info(self, state: ObjectState) -> dict[str, Tensor]:
        """See `entries`."""
        return {
            "cubes": state.reached.sum(-1, keepdim=True),
            "collected": state.reached,
            "side": state.sides.long(),
            "lateral": state.noted,
            "next_cube": (~state.present).long().cumprod(-1).sum(-1, keepdim=True),
            "end_reason": state.end_reason[:, None],
            "cube_positions": state.places.float(),
        }

    # Oracle and goals

    def line_up(self, drone: Tensor, cubes: Tensor, next_cube: Tensor) -> Tensor:
        """Line up with the next cube sideways, then in height, then fly forward.

        Shapes: (N, 3), (N, C, 3), (N, 1).
        """
        nearest = next_cube.clamp(max=cubes.shape[-2] - 1)
        rows = nearest[..., None].expand(*next_cube.shape[:-1], 1, 3)
        offset = cubes.gather(-2, rows)[..., 0, :] - drone
        tolerance = max(0.5 * self.settings.step_length, 0.5 * self.settings.touch_distance)
        is_done = next_cube[..., 0] >= cubes.shape[-2]  # no cube stands any more
        turn = turn_towards(offset[..., 1], tolerance)
        if self.settings.must_climb:
            height, is_level = offset[..., 2], turn == Move.FORWARD
            turn = turn.masked_fill(is_level & (height > tolerance), UP)
            turn = turn.masked_fill(is_level & (height < -tolerance), DOWN)
        return turn.masked_fill(is_done, Move.FORWARD)

    def score(self, info: Mapping[str, Tensor]) -> CubeGoals:
        """Each cube is a goal, which is reached by collecting it."""
        return CubeGoals(
            reached=info["collected"],
            stratum=info["side"],
            world=info["cube_positions"].flatten(1),
            lateral=info["lateral"],
            height=info["cube_positions"][..., 2].double() - self.settings.altitude,
        )

    def classes(self, goals: CubeGoals) -> Iterator[tuple[str, str, Tensor]]:
        """Yield classes by number of the cube, side, sideways distance and height."""
        yield from number_classes("cube", goals)
        yield from super().classes(goals)
        yield from interval_classes("sideways", goals.lateral.abs(), self.sideways_edges())
        if self.settings.vertical_bound > 0:
            level = self.settings.vertical_bound / 3
            yield "height", "lower", goals.height < -level
            yield "height", "level", goals.height.abs() <= level
            yield "height", "higher", goals.height > level

    def sideways_edges(self) -> list[float]:
        """Return the bounds of the classes of sideways distance, metres, increasing."""
        touch, bound = self.settings.touch_distance, self.settings.lateral_bound
        edges = [round(2 * edge) / 2 for edge in ((touch + bound) / 2, bound, 1.5 * bound)]
        return [touch, *sorted({edge for edge in edges if edge > touch})]


register_task(TaskSettings, CollectCubes)


class FailureReplayTask(CollectCubes):
    """Cube collection in which a fraction of the episodes have their cubes in given boxes.

    Every episode takes the same number of random numbers from the environment's stream, in a box or
    not, so that resuming is exact.
    """

    def __init__(self, settings: TaskSettings, boxes: NDArray[np.float64], share: float) -> None:
        """Take settings, and boxes: lowest and highest y of each cube, metres, (N, num_cubes, 2).

        `share` is the fraction of episodes in boxes, 0 to 1; boxes are equally likely.
        """
        super().__init__(settings)
        self.boxes, self.share = boxes, share

    def __reduce__(self) -> Any:
        """See `ObjectTask`."""
        return type(self), (self.settings, self.boxes, self.share)

    def sample(self, random_state: np.random.RandomState) -> Tensor:
        """Sample the positions of the cubes. Shape: (num_cubes, 3)."""
        cubes = super().sample(random_state)
        chance, which, *parts = random_state.uniform(size=2 + len(cubes))
        if chance < self.share:
            lower, upper = self.boxes[int(which * len(self.boxes))].T
            cubes[:, 1] = torch.from_numpy(lower + np.array(parts) * (upper - lower))
        return cubes


def inflated(boxes: NDArray[np.float64], metres: float, bound: float) -> NDArray[np.float64]:
    """Return boxes, (N, num_cubes, 2), extended by metres at both ends, clipped to the bound."""
    return np.clip(boxes + np.array([-metres, metres]), -bound, bound)


def _some_cubes(task: TaskSettings) -> str:
    names = {1: "one cube", 2: "two cubes", 3: "three cubes", 4: "four cubes", 5: "five cubes"}
    cubes = names.get(task.num_cubes, f"{task.num_cubes} cubes")
    return (
        f"{cubes} of {task.cube_size:g} m, up to {task.lateral_bound:g} m to either side "
        f"and {task.vertical_bound:g} m up or down"
    )
