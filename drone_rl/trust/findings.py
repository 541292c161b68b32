"""Findings on what a policy's success depends on, the largest effect first.

Verdicts, model cards and reports begin with them, and what no finding tests is "not shown". They
come from `Verdict.own_findings`, `SavedShifts.finding` and `Outcomes.finding`; `find` in
`shifts_results.py` merges them.
"""

from collections.abc import Iterable

from drone_rl.utils.models import Stored

_PLURALS = {"color": "colors", "light": "light", "object size": "sizes"}


class Finding(Stored):
    """One finding, as a sentence."""

    text: str
    effect: float = 0.0
    """Fraction of episodes that fail, or end otherwise than unperturbed ones."""
    tested: frozenset[str] = frozenset()
    """Properties of the scene that it tests: groups of `axes.toml`."""
    section: str = "verdict"
    """Section of an explanation with the details."""


def untested(findings: Iterable[Finding]) -> list[str]:
    """Return which of colors, light and sizes no finding tests."""
    tested = frozenset[str]().union(*(finding.tested for finding in findings))
    return [name for group, name in _PLURALS.items() if group not in tested]
