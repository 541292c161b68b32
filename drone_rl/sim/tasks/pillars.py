"""Fly through a field of pillars to the line behind it: R rows of K pillars, P = R K."""

import dataclasses
from collections.abc import Iterator, Mapping

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import PillarsSettings
from drone_rl.config.term_task import ObjectSettings
from drone_rl.sim.actions import MOVES, Entry
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.tasks.applied_rules import AppliedRules, largest_reward, reward_terms
from drone_rl.sim.tasks.common import Side, interval_classes, number_classes
from drone_rl.sim.tasks.objects import ObjectState, ObjectTask
from drone_rl.sim.tasks.pillars_kernel import (
    ENDS,
    FINISH_LINE,
    PillarsEnd,
    choose_pillar,
    touch_pillars,
)
from drone_rl.sim.tasks.pillars_lanes import EDGE, Lanes
from drone_rl.sim.tasks.rules_kernel import make_rules
from drone_rl.sim.tasks.scene_edits import Range, SceneEdits
from drone_rl.sim.tasks.task import Goals, OracleRule, register_task
from drone_rl.sim.vocabulary import shipped_vocabulary
from drone_rl.utils.text import plural


@dataclasses.dataclass
class RowGoals(Goals):
    """The rows as goals; the stratum of a row is the side of its nearest open lane."""

    gap: Tensor  # (n, R) float64
    """Width in metres of the gap with the nearest open lane; NaN if never the next row."""


class Pillars(ObjectTask):
    """Reach the finish line without touching a pillar.

    By default the reward is progress, 1 in total, minus 0.5 for a touch.
    """

    name = PillarsSettings.name
    ends = PillarsEnd
    truncation = PillarsEnd.STEP_LIMIT
    success_end = PillarsEnd.FINISH_LINE
    expected_end = PillarsEnd.PILLAR_TOUCHED
    observed = ("passed", "side", "end_reason")
    scored = ("passed", "side", "gap", "rows")

    def __init__(self, settings: PillarsSettings | None = None) -> None:
        s = settings or PillarsSettings()
        lines = s.first_distance + s.spacing * torch.arange(s.num_rows)
        lines = lines.double() + s.touch_distance
        lines[-1] = s.finish - 1e-9
        size = (s.width, s.width, s.height)
        pillar = ObjectSettings(shape="box", role="obstacle", size=size, color=s.pillar_color)
        pillars = {f"pillar_{i}": pillar for i in range(s.num_pillars)}
        terms = (reward_terms(s.reward), ENDS, FINISH_LINE)
        rules = AppliedRules(
            make_rules(*terms, touch=touch_pillars, choose=choose_pillar),
            s,
            [*pillars.values()],
            rewards=s.reward,
            parameters=(s.spread + EDGE, s.finish),
            numbers=(s.finish, s.step_length, s.spread, s.spread + EDGE, *lines.tolist()),
        )
        super().__init__(s, pillars, rules, num_goals=s.num_rows)
        self.largest_reward = largest_reward(s.reward, reached=s.num_rows, progress=1.0)
        self.lanes = Lanes(s)
        self.origin = (0.0, 0.0, s.altitude)
        tested = (
            f"{plural(s.num_rows, 'row')} of pillars {s.width:g} m wide, {s.density:g} per metre "
            f"of row width, {s.spacing:g} m from row to row"
        )
        self.vocabulary = shipped_vocabulary(PillarsSettings.name).replace(tested=tested)
        self.oracle = OracleRule(("drone", "rows", "next_row"), self.lanes.fly_through, MOVES)
        reach = s.touch_distance
        self.edits = SceneEdits(
            task=self,
            reach=reach,
            ahead=Range(reach + 0.5 * s.step_length, s.first_distance, s.spread),
            around=Range(reach + s.width, s.first_distance + s.spacing, 2 * s.spread),
        )

    @property
    def entries(self) -> Mapping[str, Entry]:
        """See `info`."""
        s = self.settings
        rows, pillars = s.num_rows, s.num_pillars
        return {
            "passed": Entry((rows,), torch.bool),
            "touched": Entry((pillars,), torch.bool),
            "side": Entry((rows,), torch.int64, -1, len(Side) - 1),
            "gap": Entry((rows,), torch.float64),
            "next_row": Entry((1,), torch.int64, 0, rows),
            "end_reason": Entry((1,), torch.int64, 0, len(PillarsEnd) - 1),
            "rows": Entry((rows, s.row_size), torch.float32),
        }

    def sample(self, random_state: np.random.RandomState) -> Tensor:
        """Sample the y of the pillars of a field that can be crossed. Shape: (R, K), metres."""
        return torch.from_numpy(self.lanes.sample_field(random_state))

    def start(self, sampled: Tensor, body: BodyState) -> ObjectState:
        """Return initial states; `sampled` are the y of the pillars, (N, R, K)."""
        s = self.settings
        row = torch.arange(sampled.shape[1], dtype=sampled.dtype, device=sampled.device)
        x = (s.first_distance + s.spacing * row)[:, None].expand_as(sampled)
        z = torch.full_like(sampled, 0.5 * s.height)
        return self.begun(body, torch.stack([x, sampled, z], -1).flatten(1, 2))

    def info(self, state: ObjectState) -> dict[str, Tensor]:
        """Return the rows passed, the pillars touched, and how the rows came up.

        "side" is that of a row's nearest open lane when it came up, "gap" the width there, metres;
        "rows" are the y of pillars, metres, infinite where none stands.
        """
        y = torch.where(state.present, state.places[..., 1], torch.inf)
        return {
            "passed": state.reached,
            "touched": state.touched,
            "side": state.sides.long(),
            "gap": state.noted,
            "next_row": state.reached.long().cumprod(-1).sum(-1)[:, None],
            "end_reason": state.end_reason[:, None],
            "rows": y.unflatten(-1, (self.num_goals, -1)).float(),
        }

    # Goals

    def score(self, info: Mapping[str, Tensor]) -> RowGoals:
        """Return the rows as goals; a goal is reached when its row is passed."""
        world = info["rows"].flatten(1)
        return RowGoals(info["passed"], info["side"], world, gap=info["gap"])

    def classes(self, goals: RowGoals) -> Iterator[tuple[str, str, Tensor]]:
        """Yield the classes of goals: by row number, side and gap width."""
        yield from number_classes("row", goals)
        yield from super().classes(goals)
        narrow, step = self.settings.drone_size, self.settings.step_length
        edges = [narrow, narrow + step, narrow + 3 * step]
        yield from interval_classes("gap", goals.gap, edges)


register_task(PillarsSettings, Pillars)
