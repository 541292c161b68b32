"""Cube collection as verdicts know it: each cube is a goal, and its side a stratum."""

import dataclasses
import functools
from collections.abc import Iterator, Mapping

from torch import Tensor

from drone_rl.config import TaskSettings
from drone_rl.sim.actions import MOVES
from drone_rl.sim.tasks.collect_cubes.goals import CubeGoals, classes
from drone_rl.sim.tasks.collect_cubes.oracle import READS, line_up
from drone_rl.sim.tasks.collect_cubes.rules import EndReason, Side
from drone_rl.sim.tasks.judgeable import OracleRule
from drone_rl.sim.vocabulary import CUBES, Terms, some_cubes


class Judging:
    """See `Judgeable`."""

    settings: TaskSettings
    success_end: int = EndReason.ALL_CUBES
    expected_end: int = EndReason.FRONT_BOUNDARY
    strata: tuple[str, ...] = tuple(side.name.lower() for side in Side)
    luck: tuple[str, ...] = ("random", "forward", "left", "right")
    scored: tuple[str, ...] = ("collected", "side", "lateral", "cube_positions", "drone")

    @property
    def terms(self) -> Terms:
        """Cubes are flown to and collected."""
        return dataclasses.replace(CUBES, tested=some_cubes(self.settings.values()))

    @property
    def oracle(self) -> OracleRule:
        """Lines up with the next cube, then flies at it."""
        return OracleRule(READS, functools.partial(line_up, self.settings), MOVES)

    def score(self, info: Mapping[str, Tensor]) -> CubeGoals:
        """Each cube is a goal, which is reached by collecting it."""
        return CubeGoals(
            reached=info["collected"],
            stratum=info["side"],
            world=info["cube_positions"].flatten(1),
            lateral=info["lateral"],
            height=(info["cube_positions"][..., 2] - info["drone"][:, None, 2]).double(),
        )

    def classes(self, goals: CubeGoals) -> Iterator[tuple[str, str, Tensor]]:
        """By number, side, sideways distance and height."""
        return classes(self.settings, goals)
