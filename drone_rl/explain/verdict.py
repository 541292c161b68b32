"""Good, poor, one-sided or none of these: by a written rule on exact intervals."""

import dataclasses
import enum
from typing import Any

from drone_rl.utils.intervals import proportion

GOOD_SHARE = 0.9
"""A good policy collects more than this share of all cubes."""
POOR_SHARE = 0.4
"""A poor policy collects less; a random one collects 0.28, one that flies straight on 0.27."""
SIDE_SHARE = 0.7
"""A one-sided policy collects more than this share of the cubes on its side ..."""
OTHER_SHARE = 0.3
"""... and less than this share on the other."""

RULE = f"""\
good: more than {GOOD_SHARE:.0%} of all cubes are collected, and more than {SIDE_SHARE:.0%} of \
those on each side. one-sided: more than {SIDE_SHARE:.0%} of the cubes on one side and less than \
{OTHER_SHARE:.0%} of those on the other. poor: less than {POOR_SHARE:.0%} of all cubes, and not \
one-sided. none of these: anything else. Each share is compared with its threshold; the verdict is \
called certain where the whole exact (Clopper-Pearson) 95% interval lies on the same side of every \
threshold that decided it. Entropy and response map are shown beside it as evidence; they decide \
nothing, for a policy is what it collects."""


class Kind(enum.StrEnum):
    """What a policy is."""

    GOOD = "good"
    POOR = "poor"
    ONE_SIDED_LEFT = "one-sided (left)"
    ONE_SIDED_RIGHT = "one-sided (right)"
    NONE = "none of these"

    @property
    def exit_code(self) -> int:
        """0 for good; 10 poor, 11 one-sided, 12 none of these."""
        if self in (Kind.ONE_SIDED_LEFT, Kind.ONE_SIDED_RIGHT):
            return 11
        return {Kind.GOOD: 0, Kind.POOR: 10, Kind.NONE: 12}[self]


@dataclasses.dataclass(frozen=True)
class Verdict:
    """The kind, whether the sample is large enough to be sure of it, and why."""

    kind: Kind
    certain: bool
    sentence: str
    """For a person."""
    shares: dict[str, dict[str, Any]]
    """Shares collected with exact intervals: of all cubes, and of those on each side."""

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "verdict": self.kind.value,
            "certain": self.certain,
            "sentence": self.sentence,
            "shares": self.shares,
            "exit_code": self.kind.exit_code,
            "rule": RULE,
        }


def judge_policy(summary: dict[str, Any], num_cubes: int) -> Verdict:
    """Applies the rule to an evaluation.

    Args:
        summary: From `drone_rl.evaluation.summarise`.
        num_cubes: Cubes of an episode.
    """
    trials = summary["episodes"] * num_cubes
    everything = proportion(round(summary["mean_cubes"] * summary["episodes"]), trials)
    shares = {"all": everything, **summary["by_side"]}
    kind = _kind(shares, "share")
    bounds = {_kind(shares, which) for which in ("lower95", "upper95")} | {_kind_crossed(shares)}
    return Verdict(kind, bounds == {kind}, _sentence(kind, shares), shares)


def _kind(shares: dict[str, dict[str, Any]], which: str) -> Kind:
    return _decide(*(_value(shares[name], which) for name in ("all", "left", "right")))


def _kind_crossed(shares: dict[str, dict[str, Any]]) -> Kind:
    """The kind when the sides' true shares lie at those ends of their intervals that are nearest.

    The side that is collected more is taken at its lower end, the other one at its upper end.
    """
    left, right = (_value(shares[name], "share") for name in ("left", "right"))
    ends = ("lower95", "upper95") if left >= right else ("upper95", "lower95")
    return _decide(
        _value(shares["all"], "share"),
        _value(shares["left"], ends[0]),
        _value(shares["right"], ends[1]),
    )


def _decide(everything: float, left: float, right: float) -> Kind:
    if everything > GOOD_SHARE and min(left, right) > SIDE_SHARE:
        return Kind.GOOD
    if right > SIDE_SHARE and left < OTHER_SHARE:
        return Kind.ONE_SIDED_RIGHT
    if left > SIDE_SHARE and right < OTHER_SHARE:
        return Kind.ONE_SIDED_LEFT
    return Kind.POOR if everything < POOR_SHARE else Kind.NONE


def _value(share: dict[str, Any], which: str) -> float:
    return 0.0 if share[which] is None else share[which]


def _sentence(kind: Kind, shares: dict[str, dict[str, Any]]) -> str:
    everything, left, right = (
        f"{_value(shares[name], 'share'):.0%}" for name in ("all", "left", "right")
    )
    facts = f"it collects {everything} of the cubes: {left} of those on its left and {right} of "
    facts += "those on its right"
    return {
        Kind.GOOD: f"This policy does its task: {facts}.",
        Kind.POOR: f"This policy does not do its task: {facts}, hardly more than luck would.",
        Kind.ONE_SIDED_LEFT: f"This policy can't be trusted with cubes on the right: {facts}.",
        Kind.ONE_SIDED_RIGHT: f"This policy can't be trusted with cubes on the left: {facts}.",
        Kind.NONE: f"This policy is neither good nor poor nor one-sided: {facts}.",
    }[kind]
