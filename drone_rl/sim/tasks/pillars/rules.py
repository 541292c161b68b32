"""The rules of flying through pillars, written once for one world and for thousands.

Pure functions of tensors whose first dimension counts worlds. They know nothing of how the drone
came to where it is: `judge` is handed its new state by any dynamics.

World frame, metres: x forward, y left, z up. N worlds, R rows of K pillars, P = R K pillars.
"""

import dataclasses
import enum

import torch
from torch import Tensor

from drone_rl.config import PillarsSettings
from drone_rl.sim.dynamics.body import BodyState
from drone_rl.utils.batch import Batch


class Side(enum.IntEnum):
    """Where the nearest way through a row led, seen from the drone, when the row came up."""

    LEFT = 0
    AHEAD = 1
    RIGHT = 2


class EndReason(enum.IntEnum):
    """Why an episode ended."""

    RUNNING = 0
    FINISH_LINE = 1
    PILLAR_TOUCHED = 2
    SIDE_BOUNDARY = 3
    STEP_LIMIT = 4
    LOST_CONTROL = 5
    """Its motion diverged, see `BodyState.is_lost`: counts most of all reasons."""


@dataclasses.dataclass
class FieldState(Batch):
    """The whole state of N worlds."""

    body: BodyState
    """The drone's."""
    pillars: Tensor  # (N, P, 3) float64
    """Positions of the pillars' middles, metres, row after row."""
    present: Tensor  # (N, P) bool
    """Which of them stand; in an episode all do."""
    touched: Tensor  # (N, P) bool
    """Pillars that the drone has touched."""
    passed: Tensor  # (N, R) bool
    """Rows that the drone has passed; of the last one, the line behind it."""
    side: Tensor  # (N, R) int64
    """`Side` of each row when it came up; -1 before that."""
    gap: Tensor  # (N, R) float64
    """Metres between the pillars beside the nearest way through, then; NaN before that."""
    steps: Tensor  # (N,) int64
    """Steps taken in this episode."""
    end_reason: Tensor  # (N,) int64
    """`EndReason` of each world."""

    @property
    def drone(self) -> Tensor:
        """Position of the drone, metres. Shape: (N, 3)."""
        return self.body.position

    @property
    def next_row(self) -> Tensor:
        """Index of the first row that is not passed, R when none is left. Shape: (N,)."""
        return self.passed.long().cumprod(-1).sum(-1)

    @property
    def rows(self) -> Tensor:
        """The y of the pillars, row by row; far away where none stands. Shape: (N, R, K)."""
        y = torch.where(self.present, self.pillars[..., 1], torch.inf)
        return y.unflatten(-1, (self.passed.shape[-1], -1))


def start(settings: PillarsSettings, rows: Tensor, body: BodyState) -> FieldState:
    """The state at the start of an episode.

    Args:
        settings: The task's.
        rows: The y of the pillars, metres. Shape: (N, R, K).
        body: The drone's.
    """
    ahead = settings.first_distance + settings.spacing * torch.arange(
        rows.shape[1], dtype=rows.dtype, device=rows.device
    )
    x = ahead[:, None].expand_as(rows)
    z = torch.full_like(rows, 0.5 * settings.height)
    pillars = torch.stack([x, rows, z], -1).flatten(1, 2)
    none = torch.zeros(pillars.shape[:2], dtype=torch.bool, device=rows.device)
    state = FieldState(
        body=body,
        pillars=pillars,
        present=~none,
        touched=none,
        passed=none[:, : rows.shape[1]].clone(),
        side=none[:, : rows.shape[1]].long() - 1,
        gap=torch.full_like(rows[..., 0], torch.nan),
        steps=none[:, 0].long(),
        end_reason=none[:, 0].long(),
    )
    state.side, state.gap = _sightings(settings, state)
    return state


def judge(
    settings: PillarsSettings, state: FieldState, body: BodyState
) -> tuple[FieldState, Tensor]:
    """What comes of a move.

    The way from here to the line is worth 1, each metre as much; a touched pillar costs the
    penalty. The episode ends at the line, at a pillar, outside the field, or at the step limit, and
    of several for the last of these that is no step limit: who touches a pillar has not crossed.

    Args:
        settings: The task's.
        state: Before the move.
        body: The drone after the move.

    Returns:
        The new state and the reward. Reward shape: (N,), float64.
    """
    before, now = state.drone, body.position
    touched = state.touched | (state.present & meets(settings, before, now, state.pillars))
    new = dataclasses.replace(state, body=body, touched=touched, steps=state.steps + 1)
    new.passed = state.passed | (now[:, :1] > _passing(settings, state.passed.shape[1], now))
    new.side, new.gap = _sightings(settings, new)
    new.end_reason = _end_reason(settings, new)
    finish = settings.finish
    progress = (now[:, 0].clamp(max=finish) - before[:, 0].clamp(max=finish)) / finish
    is_hit = (touched & ~state.touched).any(-1)
    return new, progress - settings.collision_penalty * is_hit


def meets(settings: PillarsSettings, before: Tensor, now: Tensor, pillars: Tensor) -> Tensor:
    """Whether a drone that flies straight from one place to another touches pillars on its way.

    Its box and a pillar's touch where the drone's centre is within a square around the pillar's;
    the way enters all slabs of that square before it leaves any.

    Args:
        settings: The task's.
        before: Metres. Shape: (N, 3).
        now: Shape: (N, 3).
        pillars: Shape: (N, P, 3).

    Returns:
        Shape: (N, P).
    """
    away, way = pillars[..., :2] - before[:, None, :2], (now - before)[:, None, :2]
    touch = settings.touch_distance
    is_still = way == 0
    pace = torch.where(is_still, 1.0, way)
    ends = torch.stack([(away - touch) / pace, (away + touch) / pace])
    low, high = ends.amin(0), ends.amax(0)
    inside = away.abs() <= touch
    low = torch.where(is_still, torch.where(inside, 0.0, torch.inf), low)
    high = torch.where(is_still, torch.where(inside, 1.0, -torch.inf), high)
    return low.amax(-1).clamp(min=0.0) <= high.amin(-1).clamp(max=1.0)


def side_of(settings: PillarsSettings, turn: Tensor) -> Tensor:
    """`Side` of a way through that leads so many metres to the left. Shape kept."""
    right = torch.where(turn < -0.5 * settings.step_length, Side.RIGHT.value, Side.AHEAD.value)
    return torch.where(turn > 0.5 * settings.step_length, Side.LEFT.value, right)


def ways(settings: PillarsSettings, rows: Tensor, y: Tensor) -> tuple[Tensor, Tensor]:
    """Lanes seen from drones, and which of them lead through rows.

    Args:
        settings: The task's.
        rows: The y of their pillars, metres. Shape: (N, R, K).
        y: Of the drones. Shape: (N,).

    Returns:
        Metres to the left of the drone, shape (N, L); whether open and within the field, shape
        (N, R, L).
    """
    step, edge = settings.step_length, settings.spread + 1e-9
    count = int(2.0 * edge / step) + 1
    first = step * torch.ceil((-edge - y) / step)
    turns = first[:, None] + step * torch.arange(count, dtype=y.dtype, device=y.device)
    lane = y[:, None] + turns
    away = (rows[:, :, None] - lane[:, None, :, None]).abs().amin(-1)
    return turns, (away > settings.touch_distance) & (lane <= edge)[:, None]


def _sightings(settings: PillarsSettings, state: FieldState) -> tuple[Tensor, Tensor]:
    """Side and width of gap, now recorded of every row up to the next one. Shapes: (N, R)."""
    index = torch.arange(state.side.shape[1], device=state.side.device)
    is_new = (state.side < 0) & (index <= state.next_row[:, None])
    worlds, rows = is_new.nonzero(as_tuple=True)
    if not len(worlds):
        return state.side, state.gap
    turn, width = _nearest_way(settings, state.rows[worlds, rows], state.drone[worlds, 1])
    side, gap = state.side.clone(), state.gap.clone()
    side[worlds, rows], gap[worlds, rows] = side_of(settings, turn), width
    return side, gap


def _nearest_way(settings: PillarsSettings, rows: Tensor, y: Tensor) -> tuple[Tensor, Tensor]:
    """The nearest lane through a row; of two that are as near, that whose gap's middle is nearer.

    Args:
        settings: The task's.
        rows: The y of their pillars, metres. Shape: (n, K).
        y: Of the drones. Shape: (n,).

    Returns:
        How far it leads to the left, and how wide the gap is. Metres, two of shape (n,).
    """
    turns, is_open = ways(settings, rows[:, None], y)
    left, right = _gap(settings, rows, y[:, None] + turns)
    off_centre = (0.5 * (left + right) - y[:, None]).abs()
    cost = turns.abs() + 1e-3 * off_centre / settings.spread
    best = torch.where(is_open[:, 0], cost, torch.inf).argmin(-1, keepdim=True)
    width = (left - right).gather(-1, best)[:, 0] - settings.width
    return turns.gather(-1, best)[:, 0], width


def _gap(settings: PillarsSettings, rows: Tensor, lane: Tensor) -> tuple[Tensor, Tensor]:
    """Middles of the pillars to the left and right of lanes, or where the field ends.

    Args:
        settings: The task's.
        rows: Shape: (n, K).
        lane: Their y. Shape: (n, L).

    Returns:
        Two tensors of shape (n, L), metres.
    """
    edge = settings.spread + 0.5 * settings.width
    there = rows[:, None].expand(*lane.shape, rows.shape[-1])
    is_left = there >= lane[..., None]
    left = torch.where(is_left, there, torch.inf).amin(-1).clamp(max=edge)
    right = torch.where(is_left, -torch.inf, there).amax(-1).clamp(min=-edge)
    return left, right


def _passing(settings: PillarsSettings, rows: int, like: Tensor) -> Tensor:
    """Metres ahead beyond which each row is passed; behind the last one, the line. Shape: (R,)."""
    x = settings.first_distance + settings.spacing * torch.arange(rows, device=like.device)
    passing = x.to(like) + settings.touch_distance
    passing[-1] = settings.finish - 1e-9
    return passing


def _end_reason(settings: PillarsSettings, state: FieldState) -> Tensor:
    """The reason that counts most of those that hold. Shape: (N,)."""
    x, y, _ = state.drone.unbind(-1)
    reason = (
        torch.zeros_like(state.steps)
        .masked_fill(state.steps >= settings.step_limit, EndReason.STEP_LIMIT)
        .masked_fill(x >= settings.finish, EndReason.FINISH_LINE)
        .masked_fill(y.abs() > settings.spread, EndReason.SIDE_BOUNDARY)
        .masked_fill(state.touched.any(-1), EndReason.PILLAR_TOUCHED)
    )
    if type(state.body) is BodyState:  # whose motion can't diverge
        return reason
    return reason.masked_fill(state.body.is_lost, EndReason.LOST_CONTROL)
