"""Every axis at every strength: how often a policy succeeds, against itself where nothing differs.

The worlds are the same at every strength, so that differences are paired.
"""

import base64
import functools
import math
import zlib
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.robustness.agents import OracleAgent, StepContext, has_oracle
from drone_rl.robustness.axes import TOGETHER, Axis
from drone_rl.robustness.paired_evaluation import ConditionResult, PairedEvaluator
from drone_rl.robustness.perturbations import Condition, Mode
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import mean_bounds, proportion

Told = Callable[[str], None]


class Suite:
    """A policy's flights under all conditions."""

    def __init__(self, bed: PairedEvaluator, modes: Sequence[Mode], possible_share: float) -> None:
        """Flies where nothing is different.

        Args:
            bed: Where.
            modes: When conditions hold; constantly among them.
            possible_share: Who sees where everything is and surely succeeds less often than this
                shows that a strength is impossible.
        """
        self._bed, self._modes, self._possible = bed, modes, possible_share
        self.plain = bed.fly(Condition())
        self._knows = has_oracle(self.plain.episodes.task)
        self.oracle = self._fly_oracle(Condition()) if self._knows else None

    def run(self, axes: Sequence[Axis], numbers: Iterable[int], tell: Told) -> dict[str, Any]:
        """All axes, one at a time, and all together.

        Args:
            axes: Which.
            numbers: Which of their strengths, from 1.
            tell: Called with what is being flown.

        Returns:
            Plain values: "plain", what it does where nothing is different, "axes" by name, and
            "together", all at once at their third strength.
        """
        found = {axis.name: self.along(axis, numbers, tell) for axis in axes}
        tell("all together")
        parts = (axis.make(axis.strengths[TOGETHER - 1], self._bed.subject) for axis in axes)
        together = functools.reduce(lambda a, b: a | b, parts, Condition())
        plain = {"oracle": _success(self.oracle), **self._figures(self.plain)}
        return {"plain": plain, "axes": found, "together": self.level(together)}

    def along(self, axis: Axis, numbers: Iterable[int], tell: Told) -> dict[str, Any]:
        """One axis at some of its strengths."""
        levels = []
        for number in numbers:
            strength = axis.strengths[number - 1]
            tell(f"{axis.name} {number}")
            value = axis.value(strength, self._bed.subject)
            condition = axis.make(strength, self._bed.subject)
            levels.append(
                {
                    "number": number,
                    "value": value,
                    "position": axis.position(strength),
                    **self.level(condition),
                }
            )
        plain = float(self.plain.episodes.success.mean())
        return {
            "group": axis.group,
            "unit": axis.unit,
            "neutral": finite(axis.value(axis.neutral, self._bed.subject)),
            "areas": {mode.value: success_area(levels, plain, mode) for mode in self._modes},
            "levels": levels,
        }

    def level(self, condition: Condition) -> dict[str, Any]:
        """What becomes of flights under one condition.

        Returns:
            "refused": why the task or camera can't be so, or None. Else "oracle": the success of
            who sees where everything is, if the task has one; "impossible": whether that is surely
            too little; "modes": figures by mode, those that it has.
        """
        try:
            self._bed.settings(condition)
        except InputError as error:
            return {"refused": str(error), "oracle": None, "impossible": None, "modes": {}}
        oracle = _success(self._fly_oracle(condition) if self._knows else None)
        drifts = sum(condition.dimensions) > 0
        return {
            "refused": None,
            "oracle": oracle,
            "impossible": None if oracle is None else oracle["upper95"] < self._possible,
            "modes": {
                mode.value: self._figures(self._bed.fly(condition, mode))
                for mode in self._modes
                if drifts or mode is not Mode.DRIFTING
            },
        }

    def _fly_oracle(self, condition: Condition) -> ConditionResult:
        """Who knows where all is that shows: light, colours and noise are all the same to it."""
        faults = tuple(fault for fault in condition.faults if fault.hides)
        differs = (
            condition.task
            or condition.camera
            or condition.mounts
            or condition.delay
            or condition.clutter
        )
        if not (differs or faults) and hasattr(self, "oracle") and self.oracle is not None:
            return self.oracle
        return self._bed.fly(condition, eyes=OracleAgent())

    def _figures(self, flown: ConditionResult) -> dict[str, Any]:
        episodes, plain = flown.episodes, self.plain.episodes
        task = episodes.task
        shares = {"all": mean_bounds(episodes.share)}
        for i, name in enumerate(task.strata):
            shares[name] = mean_bounds(episodes.stratum_share(i))
        ends = torch.bincount(episodes.end_reason, minlength=len(task.ends)).tolist()
        return {
            "success": proportion(int(episodes.success.sum()), len(episodes)),
            "difference": mean_bounds(episodes.success - plain.success, -1.0, 1.0),
            "paired": mcnemar(plain.success, episodes.success),
            "shares": shares,
            "ends": {end.name.lower(): ends[end] for end in task.ends if end != 0},
            "unchanged": bool(torch.equal(flown.trace, self.plain.trace))
            and bool(torch.equal(episodes.length, plain.length)),
        }


def finite(value: float) -> float | None:
    """A value for a file; none for what is infinite, as the view without fog."""
    return value if math.isfinite(value) else None


def mcnemar(before: Tensor, after: Tensor) -> dict[str, Any]:
    """Exact test (McNemar) of whether the same worlds are flown as successfully.

    Args:
        before: 1 for success, else 0. Shape: (n,).
        after: The same.

    Returns:
        "lost": worlds that succeeded only before, "gained": only after; "p": probability of a
        difference at least as large if neither were likelier.
    """
    lost, gained = int((before > after).sum()), int((after > before).sum())
    return {"lost": lost, "gained": gained, "p": mcnemar_p(lost, gained)}


def mcnemar_p(lost: int, gained: int) -> float:
    """The probability of `mcnemar` from its counts."""
    from scipy.special import bdtr  # slow to import

    tail = float(bdtr(min(lost, gained), lost + gained, 0.5)) if lost + gained else 0.5
    return min(1.0, 2 * tail)


def area(positions: Sequence[float], shares: Sequence[float]) -> float:
    """Area under the curve through points, as a share of the range's width.

    Args:
        positions: Rising.
        shares: From 0 to 1.
    """
    width = positions[-1] - positions[0]
    return float(np.trapezoid(shares, positions)) / width if width else float(shares[0])


def success_area(levels: Iterable[dict[str, Any]], plain: float, mode: Mode) -> float | None:
    """Area under success over strength, nothing different among them; None without another one."""
    points = [(0.0, plain)] + [
        (level["position"], level["modes"][mode.value]["success"]["share"])
        for level in levels
        if mode.value in level["modes"]
    ]
    if len(points) == 1:
        return None
    positions, shares = zip(*sorted(points), strict=True)
    return area(positions, shares)


def _success(flown: ConditionResult | None) -> dict[str, Any] | None:
    if flown is None:
        return None
    success = flown.episodes.success
    return proportion(int(success.sum()), len(success))


STEP = 8
"""The step whose picture is shown: the first cube is near, and late pictures show it late."""


class FrameRecorder:
    """Flies straight on and keeps one picture, in colour, as the camera gave it."""

    knows_truth = False

    def __init__(self) -> None:
        """Has kept none yet."""
        self._step = 0
        self.picture: Tensor | None = None

    def act(self, sight: StepContext) -> tuple[Tensor, Tensor | None]:
        """See `Agent`."""
        pictures = sight.draw("rgb").movedim(-1, 1).float() / 255.0
        pictures = sight.spoil(pictures, sight.flying)
        if self._step <= STEP:  # some flights end before
            self.picture = (pictures[0] * 255).round().to(torch.uint8).movedim(0, -1)
        self._step += 1
        return torch.zeros_like(sight.flying), None


def make_strip(bed: PairedEvaluator, axis: Axis) -> list[NDArray | None]:
    """The policy's camera with nothing different, then at each strength; None where it can't be.

    Args:
        bed: Of one world.
        axis: Which.

    Returns:
        Shapes: (H, W, 3), uint8.
    """
    made = (axis.make(strength, bed.subject) for strength in axis.strengths)
    return [_picture(bed, condition) for condition in (Condition(), *made)]


def _picture(bed: PairedEvaluator, condition: Condition) -> NDArray | None:
    eyes = FrameRecorder()
    try:
        bed.fly(condition, eyes=eyes)
    except InputError:
        return None
    return None if eyes.picture is None else eyes.picture.cpu().numpy()


def packed(picture: NDArray) -> str:
    """A picture as text for a file."""
    return base64.b64encode(zlib.compress(picture.tobytes(), 9)).decode()


def unpacked(text: str, shape: tuple[int, ...], where: str) -> NDArray:
    """A picture out of such text.

    Args:
        text: From `packed`, perhaps.
        shape: That it must have, as uint8.
        where: Its name, for people.

    Raises:
        InputError: It is none, or of another shape.
    """
    size = math.prod(shape)
    try:
        unpacking = zlib.decompressobj()
        content = unpacking.decompress(base64.b64decode(text, validate=True), size + 1)
    except (ValueError, zlib.error):
        content = b""
    if len(content) != size:
        raise InputError(f"{where} is no picture of {shape[0]} rows and {shape[1]} columns")
    return np.frombuffer(content, np.uint8).reshape(shape)
