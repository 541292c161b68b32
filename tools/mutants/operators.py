"""Mutations that Cosmic Ray has not: a name for its counterpart, half of a number."""

from collections.abc import Iterator
from typing import Any

import parso
from cosmic_ray.operators.operator import Example, Operator
from parso.python.tree import Name, Number, String

from tools.mutants.filters import is_of_one_kind

PAIRS = (
    ("min", "max"),
    ("amin", "amax"),
    ("argmin", "argmax"),
    ("minimum", "maximum"),
    ("floor", "ceil"),
    ("any", "all"),
    ("sum", "mean"),
    ("cumsum", "cumprod"),
    ("zeros", "ones"),
    ("lower95", "upper95"),
    ("left", "right"),
    ("LEFT", "RIGHT"),
    ("first", "last"),
)
COUNTERPART = {a: b for pair in PAIRS for a, b in (pair, pair[::-1])}
SMALLEST = 1e-3
"""Smaller numbers are tolerances against rounding; half of one is as good."""


class SwapName(Operator):
    """Calls, reads or names the counterpart: `min` for `max`, "lower95" for "upper95"."""

    def mutation_positions(self, node: Any) -> Iterator[tuple]:
        """Names that are called or are an attribute, and strings that are such a word."""
        if _counterpart(node):
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """Puts the counterpart in its place."""
        node.value = _counterpart(node)
        return node

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        """For Cosmic Ray's own tests."""
        return (Example("min(x)", "max(x)"),)


class HalveNumber(Operator):
    """Halves a number with a point, which Cosmic Ray moves by a whole 1 only."""

    def mutation_positions(self, node: Any) -> Iterator[tuple]:
        """Numbers with a point, tolerances left out."""
        if isinstance(node, Number) and "." in node.value and abs(float(node.value)) >= SMALLEST:
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """Puts half of it in its place."""
        return parso.python.tree.Number(str(float(node.value) / 2), node.start_pos, node.prefix)

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        """For Cosmic Ray's own tests."""
        return (Example("x = 0.5", "x = 0.25"),)


class Provider:
    """What Cosmic Ray asks for operators."""

    _operators = {"SwapName": SwapName, "HalveNumber": HalveNumber}  # noqa: RUF012

    def __iter__(self) -> Iterator[str]:
        """Their names."""
        return iter(self._operators)

    def __getitem__(self, name: str) -> type[Operator]:
        """One of them."""
        return self._operators[name]


class OfOneKind:
    """Those operators of another provider that replace like by like; the rest take a minute to try.

    Args:
        provider: What Cosmic Ray asks for its own operators.
    """

    def __init__(self, provider: Any) -> None:
        self._provider = provider

    def __iter__(self) -> Iterator[str]:
        """Their names."""
        return (name for name in self._provider if is_of_one_kind(f"core/{name}"))

    def __getitem__(self, name: str) -> type[Operator]:
        """One of them."""
        return self._provider[name]


def _counterpart(node: Any) -> str | None:
    if isinstance(node, String):
        word = node.value[1:-1]
        return f'"{COUNTERPART[word]}"' if word in COUNTERPART else None
    if not isinstance(node, Name) or node.value not in COUNTERPART:
        return None
    before, after = node.get_previous_leaf(), node.get_next_leaf()
    is_used = "." in (before.value if before else "") or (after is not None and after.value == "(")
    return COUNTERPART[node.value] if is_used else None
