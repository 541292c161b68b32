"""Conditions of sentences: each must change or disappear when a change makes it false."""

import dataclasses
import importlib
import inspect
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from benchmarks import evidence_changes
from benchmarks.evidence import (
    CARD,
    EVALUATION,
    EXPLANATION,
    FIXED_SEED,
    GROUP,
    SHIFTS,
    SWEEP,
    VERDICT,
    changed,
)
from drone_rl.explanations.report.behavior import say_source
from drone_rl.explanations.report.page import PARTS
from drone_rl.explanations.report.summary import say_summary
from drone_rl.sweeps import text as sweep
from drone_rl.trust import evaluate as evaluation
from drone_rl.trust import export as card
from drone_rl.trust import shifts_text as shifts
from drone_rl.trust import verdict_text as verdict
from drone_rl.trust.quoted_text import BRIEF
from drone_rl.utils import text as seeds
from drone_rl.utils.text import Claims, Paragraph, said

Changes = Mapping[str, Any]
SENTENCES: dict[str, tuple[tuple[Paragraph, ...], Mapping[str, Any]]] = {
    "verdict": ((verdict.SENTENCES,), VERDICT),
    "evaluation": ((evaluation.EVALUATION,), EVALUATION),
    "explanation": (
        (
            say_source,
            say_summary,
            BRIEF[:1],
            *(paragraph for part in PARTS.values() for paragraph in part.text.values()),
        ),
        EXPLANATION,
    ),
    "card": ((card.SENTENCES,), CARD),
    "shifts": ((shifts.SHIFTS,), SHIFTS),
    "sweep": ((sweep.SENTENCES,), SWEEP),
    "setting": ((sweep.GROUP_SENTENCES,), GROUP),
    "bodies": ((seeds.BODIES,), FIXED_SEED),
    "looped": ((seeds.LOOPED,), FIXED_SEED),
    "chances": ((seeds.CHANCES,), FIXED_SEED),
    "check": ((seeds.CHECK,), FIXED_SEED),
}
"""All paragraphs of the program and evidence for them, by subject."""
NO_CLAIMS = {"card.intervals", "card.use"}
"""Sentences that explain terms or usage and state no finding."""


def said_of(paragraphs: Iterable[Paragraph], evidence: Mapping[str, Any]) -> Claims:
    """The permitted sentences of several paragraphs by name."""
    return {n: text for paragraph in paragraphs for n, text in said(paragraph, evidence).items()}


def sentence_names(paragraphs: Iterable[Paragraph]) -> list[str]:
    """Names of all sentences, permitted or not; those of functions are read from their source."""
    names, modules = list[str](), set[str]()
    for paragraph in paragraphs:
        if isinstance(paragraph, Sequence):
            names += [sentence.name for sentence in paragraph]
        else:
            modules.add(paragraph.__module__)
    sources = [inspect.getsource(importlib.import_module(name)) for name in sorted(modules)]
    return [*names, *(n for s in sources for n in re.findall(r'"(\w+\.\w+)"(?:\] =|: )', s))]


@dataclasses.dataclass(frozen=True)
class EvidenceChange:
    """A change of evidence that makes one sentence false."""

    subject: str
    """A key of `SENTENCES`."""
    name: str
    """Name of the sentence."""
    change: Changes
    """New values that make the sentence false; see `changed`."""
    given: Changes = dataclasses.field(default_factory=dict)
    """New values that are set first, so that the sentence appears."""

    @property
    def texts(self) -> tuple[str | None, str | None]:
        """The sentence before and after the change; None if it does not appear."""
        paragraphs, evidence = SENTENCES[self.subject]
        before = changed(evidence, self.given)
        after = changed(before, self.change)
        return said_of(paragraphs, before).get(self.name), said_of(paragraphs, after).get(self.name)

    @property
    def is_flipped(self) -> bool:
        """Whether the sentence appears before the change and disappears or differs after it."""
        before, after = self.texts
        return before is not None and before != after


def _changes(subject: str, rows: Iterable[tuple[Any, ...]]) -> list[EvidenceChange]:
    return [EvidenceChange(subject, *row) for row in rows]


_FIXED_SEEDS = ("evaluation", "bodies", "looped", "chances", "check")
CHANGES = (
    *(
        EvidenceChange(subject, f"{subject}.fixed_seed", change)
        for subject in _FIXED_SEEDS
        for change in (evidence_changes.FRESH_SEED, evidence_changes.OTHER_SEED)
    ),
    *_changes("verdict", evidence_changes.OF_VERDICTS),
    *_changes("evaluation", evidence_changes.OF_EVALUATIONS),
    *_changes("explanation", (*evidence_changes.OF_REPORTS, *evidence_changes.OF_MAPS)),
    *_changes("card", evidence_changes.OF_CARDS),
    *_changes("shifts", evidence_changes.OF_SHIFTS),
    *_changes("sweep", evidence_changes.OF_SWEEPS),
    *_changes("setting", evidence_changes.OF_SETTINGS),
)


def bench_sentences() -> dict[str, int]:
    """Count the changes whose sentence changes or disappears.

    Returns:
        "sentences_flipped", and "sentences_total", the number of all changes.
    """
    return {
        "sentences_flipped": sum(change.is_flipped for change in CHANGES),
        "sentences_total": len(CHANGES),
    }
