"""Measure success rates along every axis, paired with those without perturbation."""

import contextlib
import functools
import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.config.commands import Mode
from drone_rl.envs.rollout import Act, StepContext
from drone_rl.trust.axes import TOGETHER, Axis
from drone_rl.trust.metrics import summarise
from drone_rl.trust.paired_evaluation import ConditionResult, PairedEvaluator
from drone_rl.trust.perturbations import Condition
from drone_rl.trust.shifts_results import AlongAxis, ConditionFigures, Level, ModeFigures, Plain
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import mean_bounds

Report = Callable[[str], None]
STEP = 8
"""Step of the example images: the first cube is near, and delays are visible."""


class Suite:
    """Run a policy and the oracle under all conditions."""

    def __init__(
        self, evaluator: PairedEvaluator, modes: Sequence[Mode], possible_share: float
    ) -> None:
        """Run both without perturbation.

        A strength is impossible if the oracle's success rate is certainly below `possible_share`.
        """
        self._evaluator, self._modes, self._possible = evaluator, modes, possible_share
        self.plain = evaluator.run(Condition())

    def run(self, axes: Sequence[Axis], numbers: Sequence[int], report: Report) -> dict[str, Any]:
        """Measure axes at the strengths with these numbers (from 1), alone and combined.

        Returns:
            "plain", "axes" and "together" of `Shifts`.
        """
        by_axis = {axis.name: self.along(axis, numbers, report) for axis in axes}
        report("all together")
        parts = (axis.make(axis.strengths[TOGETHER - 1], self._evaluator.subject) for axis in axes)
        together = functools.reduce(lambda a, b: a | b, parts, Condition())
        plain = Plain(
            oracle=self._evaluator.rate_of_oracle(Condition()), **dict(self._figures(self.plain))
        )
        return {"plain": plain, "axes": by_axis, "together": self.level(together)}

    def along(self, axis: Axis, numbers: Sequence[int], report: Report) -> AlongAxis:
        """Measure one axis at some of its strengths."""
        levels, subject = [], self._evaluator.subject
        for number in numbers:
            strength = axis.strengths[number - 1]
            report(f"{axis.name} {number}")
            level = Level(
                **dict(self.level(axis.make(strength, subject))),
                number=number,
                value=axis.value(strength, subject),
                position=axis.position(strength),
            )
            levels.append(level)
        plain = float(self.plain.episodes.success.mean())
        return AlongAxis(
            group=axis.group,
            unit=axis.unit,
            neutral=finite(axis.value(axis.neutral, subject)),
            areas={mode: success_area(levels, plain, mode) for mode in self._modes},
            levels=tuple(levels),
        )

    def level(self, condition: Condition) -> ConditionFigures:
        """Measure one condition."""
        try:
            self._evaluator.settings(condition)
        except InputError as error:
            return ConditionFigures(refused=str(error))
        oracle = self._evaluator.rate_of_oracle(condition)
        drifts = sum(condition.dimensions) > 0
        modes = {
            mode: self._figures(self._evaluator.run(condition, mode))
            for mode in self._modes
            if drifts or mode != "drifting"
        }
        impossible = None if oracle is None else oracle.upper95 < self._possible
        return ConditionFigures(oracle=oracle, impossible=impossible, modes=modes)

    def _figures(self, result: ConditionResult) -> ModeFigures:
        episodes, plain = result.episodes, self.plain.episodes
        figures = summarise(episodes)
        return ModeFigures(
            success=figures.success,
            difference=mean_bounds(episodes.success - plain.success, -1.0, 1.0),
            shares=figures.shares,
            ends={name: of.successes for name, of in figures.ends.items()},
            unchanged=torch.equal(result.trace, self.plain.trace)
            and torch.equal(episodes.length, plain.length),
        )


class FrameRecorder:
    """Fly straight on and record the color image of the last step."""

    image: Tensor | None = None

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        images = context.render("rgb").movedim(-1, 1).float() / 255.0
        images = context.observer.image.faults(images, context.rows, context.starts)
        self.image = (images[0] * 255).round().to(torch.uint8).movedim(0, -1)
        ahead = context.actions.always(context.actions.names[0])
        return Act(ahead.expand(len(context.rows), *ahead.shape).to(context.rows.device))


def make_strip(evaluator: PairedEvaluator, axis: Axis) -> list[NDArray | None]:
    """Record the camera of one environment without perturbation and at each strength of an axis.

    Shapes: (H, W, 3), uint8; None where task or camera do not allow a strength.
    """
    conditions = (axis.make(strength, evaluator.subject) for strength in axis.strengths)
    strip: list[NDArray | None] = []
    for condition in (Condition(), *conditions):
        agent = FrameRecorder()
        with contextlib.suppress(InputError):
            evaluator.run(condition, agent=agent, num_steps=STEP + 1)
        strip.append(None if agent.image is None else agent.image.cpu().numpy())
    return strip


def finite(value: float) -> float | None:
    """Return a finite value unchanged and None for infinity, such as visibility without fog."""
    return value if math.isfinite(value) else None


def area(positions: Sequence[float], shares: Sequence[float]) -> float:
    """Return the mean height of the curve through points sorted by position."""
    width = positions[-1] - positions[0]
    return float(np.trapezoid(shares, positions)) / width if width else float(shares[0])


def success_area(levels: Iterable[Level], plain: float, mode: Mode) -> float | None:
    """Return the mean height of the curve of success rate against strength; None without levels."""
    points = [(0.0, plain)] + [
        (level.position, level.modes[mode].success.share or 0.0)
        for level in levels
        if mode in level.modes
    ]
    if len(points) == 1:
        return None
    positions, shares = zip(*sorted(points), strict=True)
    return area(positions, shares)
