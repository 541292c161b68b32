"""Fly through a field of pillars to the line behind it: R rows of K pillars, P = R K."""

import dataclasses
import enum
from collections.abc import Iterator, Mapping

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import CameraSettings, PillarsSettings
from drone_rl.sim.actions import MOVES, Entry, Move
from drone_rl.sim.dynamics import BodyState, FlightState, Obstacles
from drone_rl.sim.entities import Pillar
from drone_rl.sim.tasks import common
from drone_rl.sim.tasks.pillars_lanes import EDGE, Lanes, meets, nearest_pillar
from drone_rl.sim.tasks.task import Goals, Grid, OracleRule, State, register_task
from drone_rl.sim.vocabulary import PILLARS
from drone_rl.utils.text import plural


class PillarsEnd(enum.IntEnum):
    """Why an episode ended."""

    RUNNING = 0
    FINISH_LINE = 1
    PILLAR_TOUCHED = 2
    SIDE_BOUNDARY = 3
    STEP_LIMIT = 4
    LOST_CONTROL = 5


@dataclasses.dataclass
class FieldState(State):
    """State of N environments."""

    pillars: Tensor  # (N, P, 3) float64
    """Positions of the pillars' centres in metres, row by row."""
    present: Tensor  # (N, P) bool
    """Whether each pillar is present; always true in episodes."""
    touched: Tensor  # (N, P) bool
    """Pillars that the drone has touched."""
    passed: Tensor  # (N, R) bool
    """Rows that the drone has passed; the last row is passed at the finish line."""
    side: Tensor  # (N, R) int64
    """`Side` of the nearest open lane when the row became the next one; -1 before that."""
    gap: Tensor  # (N, R) float64
    """Width in metres of the gap with the nearest open lane at that time; NaN before that."""

    @property
    def next_row(self) -> Tensor:
        """Index of the first row that is not yet passed; R if all are passed. Shape: (N,)."""
        return self.passed.long().cumprod(-1).sum(-1)

    @property
    def rows(self) -> Tensor:
        """The y of the pillars in metres; infinite for absent pillars. Shape: (N, R, K)."""
        y = torch.where(self.present, self.pillars[..., 1], torch.inf)
        return y.unflatten(-1, (self.passed.shape[-1], -1))


@dataclasses.dataclass
class RowGoals(Goals):
    """The rows as goals; the stratum of a row is the side of its nearest open lane."""

    gap: Tensor  # (n, R) float64
    """Width in metres of the gap with the nearest open lane; NaN if never the next row."""


class Pillars(common.PropTask[FieldState]):
    """Reach the finish line without touching a pillar. The reward is progress, 1 in total."""

    name = PillarsSettings.name
    ends = PillarsEnd
    truncation = PillarsEnd.STEP_LIMIT
    success_end = PillarsEnd.FINISH_LINE
    expected_end = PillarsEnd.PILLAR_TOUCHED
    observed = ("passed", "side", "end_reason")
    props = "pillars"
    scored = ("passed", "side", "gap", "rows")
    remembered: Mapping[str, str] = {
        "rows": "y of the pillars, metres, row by row; infinite if absent (T, R, K)",
        "passed": "whether each row has been passed, bool (T, R)",
        "next_target": "index of the next row's pillar nearest to the path, P if none (T,)",
    }

    def __init__(self, settings: PillarsSettings | None = None) -> None:
        self.settings = s = settings or PillarsSettings()
        self.lanes = Lanes(s)
        self.drone_size, self.origin = s.drone_size, (0.0, 0.0, s.altitude)
        tested = (
            f"{plural(s.num_rows, 'row')} of pillars {s.width:g} m wide, {s.density:g} per metre "
            f"of row width, {s.spacing:g} m from row to row"
        )
        self.vocabulary = PILLARS.replace(tested=tested)
        self.oracle = OracleRule(("drone", "rows", "next_row"), self.lanes.fly_through, MOVES)

    @property
    def entries(self) -> Mapping[str, Entry]:
        """See `FieldState`; "rows" are the y of pillars, metres, infinite where none stands."""
        s = self.settings
        rows, pillars = s.num_rows, s.num_pillars
        return {
            "passed": Entry((rows,), torch.bool),
            "touched": Entry((pillars,), torch.bool),
            "side": Entry((rows,), torch.int64, -1, len(common.Side) - 1),
            "gap": Entry((rows,), torch.float64),
            "next_row": Entry((1,), torch.int64, 0, rows),
            "end_reason": Entry((1,), torch.int64, 0, len(PillarsEnd) - 1),
            "rows": Entry((rows, s.row_size), torch.float32),
        }

    def make_props(self) -> list[Pillar]:
        """Return the pillars, row by row."""
        s = self.settings
        names = (f"pillar_{i}" for i in range(s.num_pillars))
        return [Pillar(s.width, s.height, s.pillar_color, name=name) for name in names]

    # Reset and rules

    def sample(self, random_state: np.random.RandomState) -> Tensor:
        """Sample the y of the pillars of a field that can be crossed. Shape: (R, K), metres."""
        return torch.from_numpy(self.lanes.sample_field(random_state))

    def start(self, sampled: Tensor, body: BodyState) -> FieldState:
        """Return initial states; `sampled` are the y of the pillars, (N, R, K)."""
        s = self.settings
        row = torch.arange(sampled.shape[1], dtype=sampled.dtype, device=sampled.device)
        x = (s.first_distance + s.spacing * row)[:, None].expand_as(sampled)
        z = torch.full_like(sampled, 0.5 * s.height)
        pillars = torch.stack([x, sampled, z], -1).flatten(1, 2)
        none = torch.zeros(pillars.shape[:2], dtype=torch.bool, device=sampled.device)
        state = FieldState(
            body=body,
            pillars=pillars,
            present=~none,
            touched=none,
            passed=none[:, : sampled.shape[1]].clone(),
            side=none[:, : sampled.shape[1]].long() - 1,
            gap=torch.full_like(sampled[..., 0], torch.nan),
            steps=none[:, 0].long(),
            end_reason=none[:, 0].long(),
        )
        state.side, state.gap = self._sightings(state)
        return state

    def step(self, state: FieldState, body: BodyState) -> tuple[FieldState, Tensor]:
        """Apply the rules after a step.

        The distance to the line is worth 1, evenly; a touched pillar costs the penalty. Of several
        end reasons a lost drone precedes a touched pillar, the side boundary, line and step limit.
        """
        s, before, now = self.settings, state.drone, body.position
        hit = meets(s.touch_distance, before, now, state.pillars)
        if isinstance(body, FlightState):  # it may have bounced off between the two positions
            number = torch.arange(s.num_pillars, device=now.device)
            hit = hit | (body.contact.thing[:, None] == number)
        touched = state.touched | (state.present & hit)
        new = dataclasses.replace(state, body=body, touched=touched, steps=state.steps + 1)
        passing = s.first_distance + s.spacing * torch.arange(s.num_rows, device=now.device)
        passing = passing.to(now) + s.touch_distance
        passing[-1] = s.finish - 1e-9  # the line
        new.passed = state.passed | (now[:, :1] > passing)
        new.side, new.gap = self._sightings(new)
        new.end_reason = self._end_reason(new)
        progress = (now[:, 0].clamp(max=s.finish) - before[:, 0].clamp(max=s.finish)) / s.finish
        is_hit = (touched & ~state.touched).any(-1)
        return new, progress - s.collision_penalty * is_hit

    def _sightings(self, state: FieldState) -> tuple[Tensor, Tensor]:
        """Return the recorded side and gap width of each row up to the next one. (N, R)."""
        index = torch.arange(state.side.shape[1], device=state.side.device)
        is_new = (state.side < 0) & (index <= state.next_row[:, None])
        envs, rows = is_new.nonzero(as_tuple=True)
        if not len(envs):
            return state.side, state.gap
        turn, width = self.lanes.nearest(state.rows[envs, rows], state.drone[envs, 1])
        side, gap = state.side.clone(), state.gap.clone()
        side[envs, rows] = common.side_of(turn, 0.5 * self.settings.step_length)
        gap[envs, rows] = width
        return side, gap

    def _end_reason(self, state: FieldState) -> Tensor:
        """Return the end reason; later lines take precedence. Shape: (N,)."""
        s, (x, y, _) = self.settings, state.drone.unbind(-1)
        return (
            torch.zeros_like(state.steps)
            .masked_fill(state.steps >= s.step_limit, PillarsEnd.STEP_LIMIT)
            .masked_fill(x >= s.finish, PillarsEnd.FINISH_LINE)
            .masked_fill(y.abs() > s.spread + EDGE, PillarsEnd.SIDE_BOUNDARY)
            .masked_fill(state.touched.any(-1), PillarsEnd.PILLAR_TOUCHED)
            .masked_fill(state.body.is_lost, PillarsEnd.LOST_CONTROL)
        )

    def obstacles(self, state: FieldState) -> Obstacles:
        """Return the pillars as obstacles."""
        s = self.settings
        return Obstacles(self.places(state), (s.width / 2, s.width / 2, s.height / 2))

    def info(self, state: FieldState) -> dict[str, Tensor]:
        """Return the values of `entries`."""
        names = ("passed", "touched", "side", "gap")
        return {
            **{name: getattr(state, name) for name in names},
            "next_row": state.next_row[:, None],
            "end_reason": state.end_reason[:, None],
            "rows": state.rows.float(),
        }

    # Goals

    def score(self, info: Mapping[str, Tensor]) -> RowGoals:
        """Return the rows as goals; a goal is reached when its row is passed."""
        world = info["rows"].flatten(1)
        return RowGoals(info["passed"], info["side"], world, gap=info["gap"])

    def classes(self, goals: RowGoals) -> Iterator[tuple[str, str, Tensor]]:
        """Yield the classes of goals: by row number, side and gap width."""
        yield from common.number_classes("row", goals)
        yield from super().classes(goals)
        narrow, step = self.settings.drone_size, self.settings.step_length
        edges = [narrow, narrow + step, narrow + 3 * step]
        yield from common.interval_classes("gap", goals.gap, edges)

    # Explanations

    def remember(self, info: Mapping[str, Tensor]) -> dict[str, Tensor]:
        """Return the values of `remembered`."""
        drone_y, next_row = info["drone"][:, 1], info["next_row"][:, 0]
        pillar = nearest_pillar(info["rows"], drone_y, next_row)
        return {"rows": info["rows"], "passed": info["passed"], "next_target": pillar}

    def tally(self, info: Mapping[str, Tensor]) -> tuple[Tensor, Tensor]:
        """Return the numbers of rows passed and missed; no row can be missed."""
        passed = info["passed"].sum(-1)
        return passed, torch.zeros_like(passed)

    def recall(self, kept: Mapping[str, Tensor], body: BodyState) -> FieldState:
        """Return the recorded states; `side` and `gap` are not recorded and stay unset."""
        rows = kept["rows"].double()
        standing = rows.isfinite()
        state = self.start(torch.where(standing, rows, 0.0), body)
        return dataclasses.replace(
            state,
            present=standing.flatten(1),
            passed=kept["passed"].clone(),
            side=torch.full_like(state.side, -1),
            gap=torch.full_like(state.gap, torch.nan),
            steps=kept["step"].clone(),
        )

    def next_target(self, state: FieldState) -> Tensor:
        """Return the present pillar of the next row that is nearest to the drone's lane."""
        return nearest_pillar(state.rows, state.drone[:, 1], state.next_row)

    def next_offset(self, state: FieldState) -> Tensor:
        """Return the offset of the target from the drone in the horizontal plane."""
        return super().next_offset(state) * torch.tensor([1.0, 1.0, 0.0]).to(state.pillars)

    def is_reached(self, state: FieldState, target: Tensor) -> Tensor:
        """Return whether the drone has passed the target and touched no pillar."""
        return self.is_behind(state, target) & ~state.touched.any(-1)

    def needed(self, offset: Tensor) -> Tensor:
        """Return a move away from the pillar if flying straight on would touch it."""
        lateral = offset[..., 1]
        is_in_way = lateral.abs() <= self.settings.touch_distance
        turn = torch.where(lateral > 0, Move.RIGHT, Move.LEFT)
        return torch.where(is_in_way, turn, Move.FORWARD)

    def stratum_at(self, offset: Tensor) -> Tensor:
        """Return the side on which the drone passes it; ahead if it is not in the way."""
        sides = torch.tensor(
            [common.Side.AHEAD, common.Side.LEFT, common.Side.RIGHT], device=offset.device
        )
        return sides[self.needed(offset)]

    def grid(self, num_forward: int, num_lateral: int) -> Grid:
        """Return where pillars can stand: up to the first row, over the width of the field."""
        s = self.settings
        nearest = s.touch_distance + 0.5 * s.step_length
        forward = torch.linspace(nearest, s.first_distance, num_forward).double()
        lateral = torch.linspace(s.spread, -s.spread, num_lateral).double()
        return Grid(torch.zeros(1, dtype=torch.float64), forward, lateral)

    def one_target(self, body: BodyState, offset: Tensor) -> FieldState:
        """Return states with a single pillar, in the first row."""
        rows = offset.new_zeros(len(offset), self.settings.num_rows, self.settings.row_size)
        state = self.start(rows.double(), body)
        state.pillars[:, 0, :2] = body.position[:, :2] + offset[:, :2].to(body.position)
        state.present[:, 1:] = False
        return state

    def without_targets(self, state: FieldState) -> FieldState:
        """Remove all pillars."""
        return dataclasses.replace(state, present=torch.zeros_like(state.present))

    def without_next(self, state: FieldState) -> FieldState:
        """Remove the next pillar."""
        return dataclasses.replace(state, present=state.present & ~self._is_next(state))

    def elsewhere(
        self, state: FieldState, camera: CameraSettings, generator: torch.Generator
    ) -> FieldState:
        """Put all pillars at random positions in view, up to the second row, two fields wide."""
        s = self.settings
        draw = torch.rand(*state.pillars.shape[:2], 2, generator=generator, dtype=torch.float64)
        nearest, farthest = s.touch_distance + s.width, s.first_distance + s.spacing
        away = common.place_in_view(draw, camera, nearest, farthest, 2 * s.spread).to(state.pillars)
        pillars = state.pillars.clone()
        pillars[..., :2] = state.drone[:, None, :2] + away
        return dataclasses.replace(state, pillars=pillars, present=torch.ones_like(state.present))


register_task(PillarsSettings, Pillars)
