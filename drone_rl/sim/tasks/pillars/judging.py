"""Flying through pillars as verdicts know it: each row is a goal, and its side a stratum."""

import functools
from collections.abc import Iterator, Mapping

from torch import Tensor

from drone_rl.config import PillarsSettings
from drone_rl.sim.actions import MOVES
from drone_rl.sim.tasks.judgeable import OracleRule
from drone_rl.sim.tasks.pillars.goals import RowGoals, classes
from drone_rl.sim.tasks.pillars.planner import READS, fly_through
from drone_rl.sim.tasks.pillars.rules import EndReason, Side
from drone_rl.sim.tasks.pillars.terms import terms
from drone_rl.sim.vocabulary import Terms


class Judging:
    """See `Judgeable`."""

    settings: PillarsSettings
    success_end: int = EndReason.FINISH_LINE
    expected_end: int = EndReason.PILLAR_TOUCHED
    strata: tuple[str, ...] = tuple(side.name.lower() for side in Side)
    luck: tuple[str, ...] = ("random", "forward", "left", "right")
    scored: tuple[str, ...] = ("passed", "side", "gap", "rows")

    @property
    def terms(self) -> Terms:
        """Rows are passed, pillars are flown around."""
        return terms(self.settings)

    @property
    def oracle(self) -> OracleRule:
        """Plans a way through the field."""
        return OracleRule(READS, functools.partial(fly_through, self.settings), MOVES)

    def score(self, info: Mapping[str, Tensor]) -> RowGoals:
        """Each row is a goal, which is reached by passing it."""
        return RowGoals(
            reached=info["passed"],
            stratum=info["side"],
            world=info["rows"].flatten(1),
            gap=info["gap"],
        )

    def classes(self, goals: RowGoals) -> Iterator[tuple[str, str, Tensor]]:
        """By number, side and width of the gap."""
        return classes(self.settings, goals)
