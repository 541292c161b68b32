"""A sentence and the condition under which it may be said.

The program says nothing in prose but through these: a claim whose evidence is missing or speaks
against it is not made. Evidence is plain data, as in the JSON files, so that sentences can be made
again from files, and so that a test can change the evidence and see the sentence change or go.
"""

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from typing import Any

Evidence = Mapping[str, Any]
"""Plain numbers, texts, lists and mappings."""


@dataclasses.dataclass(frozen=True)
class Sentence:
    """One claim."""

    name: str
    """Section and claim, such as "loops.never"."""
    condition: str
    """The condition in English, for readers of the code or the page."""
    may: Callable[[Evidence], bool]
    """Whether the condition holds."""
    text: Callable[[Evidence], str]
    """The claim; called only if the condition holds."""


def say(sentences: Iterable[Sentence], evidence: Evidence) -> str:
    """All that may be said, in order, as one paragraph."""
    return " ".join(s.text(evidence) for s in sentences if s.may(evidence))


def said(sentences: Iterable[Sentence], evidence: Evidence) -> dict[str, str]:
    """All that may be said, by the sentences' names."""
    return {s.name: s.text(evidence) for s in sentences if s.may(evidence)}


def percent(share: float) -> str:
    """A share for people; never 0% or 100% of what is only nearly none or nearly all."""
    text = f"{100 * share:.0f}%"
    if text == "100%" and share < 1:
        return "more than 99%"
    return "less than 1%" if text == "0%" and share > 0 else text
