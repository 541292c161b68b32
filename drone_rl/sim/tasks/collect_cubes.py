"""Collect the cubes (chapter, section 4): the drone moves until it has touched every cube."""

import dataclasses
from collections.abc import Iterator, Mapping

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.sim.actions import DOWN, MOVES, MOVES_3D, UP, Actions, Entry, Move
from drone_rl.sim.dynamics import BodyState, Dynamics
from drone_rl.sim.entities import Cube
from drone_rl.sim.tasks.collect_cubes_kernel import (
    CubesEnd,
    FusedCubes,
    launch,
    start_all,
    step_all,
)
from drone_rl.sim.tasks.common import (
    PropTask,
    Side,
    first_contact,
    interval_classes,
    number_classes,
    place_in_view,
    side_of,
)
from drone_rl.sim.tasks.task import Goals, Grid, OracleRule, State, register_task
from drone_rl.sim.vocabulary import CUBES
from drone_rl.utils.errors import InputError


@dataclasses.dataclass
class WorldState(State):
    """State of N environments with C cubes each."""

    cubes: Tensor  # (N, C, 3) float64
    """Positions at which the cubes were placed, metres, in the order of their x."""
    collected: Tensor  # (N, C) bool
    """Cubes that the drone has touched."""
    passed: Tensor  # (N, C) bool
    """Cubes that the drone has left behind untouched."""
    side: Tensor  # (N, C) int64
    """`Side` of each cube when it became the next one; -1 before that."""
    lateral: Tensor  # (N, C) float64
    """Metres to the left of the drone at which it stood then; NaN before that."""

    @property
    def present(self) -> Tensor:
        """Cubes that still stand. Shape: (N, C)."""
        return ~(self.collected | self.passed)

    @property
    def next_cube(self) -> Tensor:
        """Index of the nearest standing cube, C when none is left. Shape: (N,)."""
        return (~self.present).long().cumprod(-1).sum(-1)


@dataclasses.dataclass
class CubeGoals(Goals):
    """Cubes that were to be collected; their strata are sides."""

    lateral: Tensor  # (n, C) float64
    """Metres to the left of the drone at which each became the next one; NaN if it never did."""
    height: Tensor  # (n, C) float64
    """Metres by which each stands higher than the drone at the start of the episode."""


class CollectCubes(PropTask[WorldState]):
    """Move until every cube is touched. The reward is 1 a cube."""

    name = TaskSettings.name
    ends = CubesEnd
    truncation = CubesEnd.STEP_LIMIT
    success_end = CubesEnd.ALL_CUBES
    expected_end = CubesEnd.FRONT_BOUNDARY
    observed = ("cubes", "collected", "side", "end_reason")
    props = "cubes"
    scored = ("collected", "side", "lateral", "cube_positions")
    remembered: Mapping[str, str] = {
        "cubes": "positions of the cubes, metres, in order of x (T, C, 3)",
        "present": "whether each cube still stands, bool (T, C)",
        "collected": "whether each cube has been collected, bool (T, C)",
        "next_target": "index of the nearest standing cube, C if none (T,)",
    }

    def __init__(self, settings: TaskSettings | None = None) -> None:
        self.settings = settings = settings or TaskSettings()
        self.largest_reward = float(settings.num_cubes)
        self.drone_size = settings.drone_size
        self.origin = (0.0, 0.0, settings.altitude)
        self.vocabulary = CUBES.replace(tested=_some_cubes(settings))
        actions = MOVES_3D if settings.must_climb else MOVES
        self.oracle = OracleRule(("drone", "cube_positions", "next_cube"), self.line_up, actions)

    @property
    def entries(self) -> Mapping[str, Entry]:
        """Algorithm 3's info: "cubes" is the number collected; see `WorldState` for the others."""
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

    def make_props(self) -> list[Cube]:
        """Return the cubes, nearest first."""
        size, color = self.settings.cube_size, self.settings.cube_color
        return [Cube(size, color, name=f"cube_{i}") for i in range(self.settings.num_cubes)]

    def check_actions(self, actions: Actions) -> None:
        """Refuse cubes that drones without moves up and down never touch."""
        if self.settings.must_climb and not {"up", "down"} <= {*actions.names}:
            raise InputError(
                f"task.vertical_bound={self.settings.vertical_bound} puts cubes where a drone that "
                f"keeps its altitude never touches them; give at most "
                f"{self.settings.touch_distance} (half of cube_size + drone_size), or "
                "actions=moves_3d"
            )

    # Reset and rules

    def sample(self, random_state: np.random.RandomState) -> Tensor:
        """Sample the positions of the cubes (Algorithm 2). Shape: (C, 3), metres."""
        s = self.settings
        bounds = (s.lateral_bound, s.vertical_bound)
        offsets = random_state.uniform(-1.0, 1.0, size=(s.num_cubes, 2)) * bounds
        offsets += (0.0, s.altitude)
        x = s.first_distance + s.spacing * np.arange(s.num_cubes)
        return torch.from_numpy(np.column_stack([x, offsets]))

    def start(self, sampled: Tensor, body: BodyState | None = None) -> WorldState:
        """Return states at the start of episodes, at rest by default; `sampled` are the cubes."""
        if body is None:
            body = BodyState.at_rest(sampled.new_tensor(self.origin).repeat(len(sampled), 1))
        no_cube = torch.zeros_like(sampled[..., 0], dtype=torch.bool)
        state = WorldState(
            body=body,
            cubes=sampled,
            collected=no_cube,
            passed=no_cube.clone(),
            side=no_cube.long() - 1,
            lateral=torch.full_like(sampled[..., 1], torch.nan),
            steps=no_cube[:, 0].long(),
            end_reason=no_cube[:, 0].long(),
        )
        launch(start_all, self.settings, state)
        return state

    def step(self, state: WorldState, body: BodyState) -> tuple[WorldState, Tensor]:
        """Apply Algorithms 1 and 3, see `collect_cubes_kernel.step`."""
        written = ("collected", "passed", "side", "lateral")
        copies = {name: getattr(state, name).clone() for name in written}
        end = torch.empty_like(state.steps)
        new = dataclasses.replace(state, body=body, steps=state.steps + 1, end_reason=end, **copies)
        reward = torch.empty(len(state), dtype=torch.float64, device=new.steps.device)
        others = (body.is_lost, new.steps, new.end_reason, reward)
        launch(step_all, self.settings, new, *others)
        return new, reward

    def touch(self, state: WorldState, position: Tensor, before: Tensor | None = None) -> Tensor:
        """Collect the cubes that the drones touch, see `Task.touch`."""
        before, reach = position if before is None else before, self.settings.touch_distance
        contact = first_contact(reach, before, position, state.cubes)
        contact = contact.masked_fill(~state.present, torch.inf)
        state.collected |= contact.isfinite()
        return contact

    def fused_rules(self, dynamics: Dynamics, num_envs: int) -> FusedCubes | None:
        """See `Task.fused_rules`."""
        fused = ("step", "places", "obstacles")
        is_own = all(getattr(type(self), name) is getattr(CollectCubes, name) for name in fused)
        if is_own and FusedCubes.supports(dynamics):
            return FusedCubes(self.settings, dynamics, num_envs)
        return None

    def info(self, state: WorldState) -> dict[str, Tensor]:
        """See `entries`."""
        return {
            "cubes": state.collected.sum(-1, keepdim=True),
            **{name: getattr(state, name) for name in ("collected", "side", "lateral")},
            "next_cube": state.next_cube[:, None],
            "end_reason": state.end_reason[:, None],
            "cube_positions": state.cubes.float(),
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

    # Explanations

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
        """Return the number of cubes collected, and of cubes left behind."""
        collected, next_cube = info["collected"], info["next_cube"]
        is_behind = torch.arange(collected.shape[-1], device=next_cube.device) < next_cube
        return collected.sum(-1), (is_behind & ~collected).sum(-1)

    def recall(self, kept: Mapping[str, Tensor], body: BodyState) -> WorldState:
        """Return states as they were, except side and lateral, which are not kept."""
        present, collected = kept["present"], kept["collected"]
        state = self.start(kept["cubes"].double(), body)
        return dataclasses.replace(
            state,
            collected=collected,
            passed=~present & ~collected,
            side=torch.full_like(state.side, -1),
            lateral=torch.full_like(state.lateral, torch.nan),
            steps=kept["step"].clone(),
        )

    def next_target(self, state: WorldState) -> Tensor:
        """Return the next cube."""
        return state.next_cube

    def is_reached(self, state: WorldState, target: Tensor) -> Tensor:
        """Return whether it is collected."""
        return state.collected[torch.arange(len(state), device=target.device), target]

    def needed(self, offset: Tensor) -> Tensor:
        """Return a turn where flying straight on would miss."""
        return turn_towards(offset[..., 1], self.settings.touch_distance)

    def stratum_at(self, offset: Tensor) -> Tensor:
        """Return its side."""
        return side_of(offset[..., 1], self.settings.touch_distance)

    def grid(self, num_forward: int, num_lateral: int) -> Grid:
        """Return where next cubes can stand: ahead up to an episode's first cube."""
        s = self.settings
        reach = 2.0 * s.lateral_bound or s.touch_distance * 2
        nearest, bound = s.touch_distance + 0.5 * s.step_length, s.vertical_bound
        height = torch.tensor([-bound, 0.0, bound] if bound else [0.0], dtype=torch.float64)
        forward = torch.linspace(nearest, s.first_distance, num_forward).double()
        return Grid(height, forward, torch.linspace(reach, -reach, num_lateral).double())

    def one_target(self, body: BodyState, offset: Tensor) -> WorldState:
        """Return states with a single cube; the others are passed."""
        cubes = body.position[:, None].repeat(1, self.settings.num_cubes, 1)
        cubes[:, 0] += offset.to(cubes)
        state = self.start(cubes, body)
        state.passed[:, 1:] = True
        return state

    def without_targets(self, state: WorldState) -> WorldState:
        """Remove all cubes."""
        return dataclasses.replace(state, passed=torch.ones_like(state.passed))

    def without_next(self, state: WorldState) -> WorldState:
        """Remove the next cube."""
        return dataclasses.replace(state, passed=state.passed | self._is_next(state))

    def elsewhere(
        self, state: WorldState, camera: CameraSettings, generator: torch.Generator
    ) -> WorldState:
        """Put all cubes at random positions in view, as far ahead and aside as cubes ever are."""
        s = self.settings
        draw = torch.rand(*state.cubes.shape, generator=generator, dtype=torch.float64)
        nearest, widest = s.touch_distance + s.cube_size, 2 * s.lateral_bound
        away = place_in_view(draw[..., :2], camera, nearest, s.first_distance, widest)
        up = (2 * draw[..., 2:] - 1) * s.vertical_bound
        cubes = state.drone[:, None] + torch.cat([away, up], -1).to(state.drone)
        nearest_first = cubes[..., :1].argsort(1).expand_as(cubes)
        cubes = cubes.gather(1, nearest_first)
        standing = torch.zeros_like(state.passed)
        return dataclasses.replace(state, cubes=cubes, passed=standing, collected=standing.clone())


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

    def sample(self, random_state: np.random.RandomState) -> Tensor:
        """Sample the positions of the cubes. Shape: (num_cubes, 3)."""
        cubes = super().sample(random_state)
        chance, which, *parts = random_state.uniform(size=2 + len(cubes))
        if chance < self.share:
            lower, upper = self.boxes[int(which * len(self.boxes))].T
            cubes[:, 1] = torch.from_numpy(lower + np.array(parts) * (upper - lower))
        return cubes


def turn_towards(lateral: Tensor, tolerance: float) -> Tensor:
    """Return the move towards a cube so many metres to the left of the drone. Shape kept."""
    moves = torch.tensor([Move.LEFT, Move.FORWARD, Move.RIGHT], device=lateral.device)
    return moves[side_of(lateral, tolerance)]


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
