"""Mutations that Cosmic Ray lacks: swap a name with its counterpart, halve a number."""

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
"""Smaller numbers are tolerances for rounding, and half of a tolerance works as well."""


class SwapName(Operator):
    """Replace a name or key by its counterpart: `min` for `max`, "lower95" for "upper95"."""

    def mutation_positions(self, node: Any) -> Iterator[tuple]:
        """Yield names that are called or are attributes, and strings equal to such a name."""
        if _counterpart(node):
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """Replace the name by its counterpart."""
        node.value = _counterpart(node)
        return node

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        """Return examples for Cosmic Ray's own tests."""
        return (Example("min(x)", "max(x)"),)


class HalveNumber(Operator):
    """Halve a number with a decimal point, which Cosmic Ray only changes by 1."""

    def mutation_positions(self, node: Any) -> Iterator[tuple]:
        """Yield numbers with a decimal point, except tolerances."""
        if isinstance(node, Number) and "." in node.value and abs(float(node.value)) >= SMALLEST:
            yield node.start_pos, node.end_pos

    def mutate(self, node: Any, index: int) -> Any:
        """Replace the number by half of it."""
        return parso.python.tree.Number(str(float(node.value) / 2), node.start_pos, node.prefix)

    @classmethod
    def examples(cls) -> tuple[Example, ...]:
        """Return examples for Cosmic Ray's own tests."""
        return (Example("x = 0.5", "x = 0.25"),)


class Provider:
    """Cosmic Ray's provider interface to our operators."""

    _operators = {"SwapName": SwapName, "HalveNumber": HalveNumber}  # noqa: RUF012

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the operators."""
        return iter(self._operators)

    def __getitem__(self, name: str) -> type[Operator]:
        """Return an operator by name."""
        return self._operators[name]


class SameKindProvider:
    """The operators of a provider that keep the kind of a token; trying the rest takes a minute.

    Args:
        provider: Cosmic Ray's provider of its own operators.
    """

    def __init__(self, provider: Any) -> None:
        self._provider = provider

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names of the operators."""
        return (name for name in self._provider if is_of_one_kind(f"core/{name}"))

    def __getitem__(self, name: str) -> type[Operator]:
        """Return an operator by name."""
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
