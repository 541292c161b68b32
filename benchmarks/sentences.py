"""Does each sentence change or go when its evidence does? Liars are planted under every one."""

import dataclasses
from collections.abc import Iterable, Mapping
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
from drone_rl.evaluation import evaluate as evaluation
from drone_rl.evaluation import verdict_text as verdict
from drone_rl.explanations.report.behavior import SOURCE
from drone_rl.explanations.report.page import PARTS
from drone_rl.robustness import shifts_text as shifts
from drone_rl.sweeps import text as sweep
from drone_rl.utils import text as seeds
from drone_rl.utils.text import Sentence, said
from drone_rl.verdicts import export as card

Changes = Mapping[str, Any]
SPOKEN: dict[str, tuple[tuple[Sentence, ...], Mapping[str, Any]]] = {
    "verdict": (verdict.SENTENCES, VERDICT),
    "evaluation": (evaluation.EVALUATION, EVALUATION),
    "explanation": (
        (*SOURCE, *(s for part in PARTS.values() for group in part.text.values() for s in group)),
        EXPLANATION,
    ),
    "card": (card.SENTENCES, CARD),
    "shifts": (shifts.SHIFTS, SHIFTS),
    "sweep": (sweep.SENTENCES, SWEEP),
    "setting": (sweep.GROUP_SENTENCES, GROUP),
    "bodies": (seeds.BODIES, FIXED_SEED),
    "looped": (seeds.LOOPED, FIXED_SEED),
    "chances": (seeds.CHANCES, FIXED_SEED),
    "check": (seeds.CHECK, FIXED_SEED),
}
"""All sentences of the program, by what they are said of, with evidence of that kind."""
NO_CLAIMS = {"card.intervals", "card.use"}
"""Sentences that say what is meant or how to read, and not what was found."""


@dataclasses.dataclass(frozen=True)
class Plant:
    """A change of evidence that makes one sentence false."""

    of: str
    """A key of `SPOKEN`."""
    name: str
    """The sentence."""
    lie: Changes
    """What becomes of the evidence; see `changed`."""
    given: Changes = dataclasses.field(default_factory=dict)
    """What must be so before, so that the sentence is said."""

    @property
    def said(self) -> tuple[str | None, str | None]:
        """What the sentence says before and after; None where it is not said."""
        sentences, evidence = SPOKEN[self.of]
        before = changed(evidence, self.given)
        after = changed(before, self.lie)
        return said(sentences, before).get(self.name), said(sentences, after).get(self.name)

    @property
    def is_flipped(self) -> bool:
        """Whether it was said, and then no more or otherwise."""
        before, after = self.said
        return before is not None and before != after


def _plants(of: str, rows: Iterable[tuple[Any, ...]]) -> list[Plant]:
    return [Plant(of, *row) for row in rows]


_FIXED_SEEDS = ("evaluation", "bodies", "looped", "chances", "check")
PLANTS = (
    *(
        Plant(of, f"{of}.fixed_seed", lie)
        for of in _FIXED_SEEDS
        for lie in (evidence_changes.FRESH, evidence_changes.OTHER_SEED)
    ),
    *_plants("verdict", evidence_changes.OF_VERDICTS),
    *_plants("evaluation", evidence_changes.OF_EVALUATIONS),
    *_plants("explanation", (*evidence_changes.OF_REPORTS, *evidence_changes.OF_MAPS)),
    *_plants("card", evidence_changes.OF_CARDS),
    *_plants("shifts", evidence_changes.OF_SHIFTS),
    *_plants("sweep", evidence_changes.OF_SWEEPS),
    *_plants("setting", evidence_changes.OF_SETTINGS),
)


def bench_sentences() -> dict[str, int]:
    """How many of the planted changes turn or take the sentence that they make false."""
    return {
        "sentences_flipped": sum(plant.is_flipped for plant in PLANTS),
        "sentences_total": len(PLANTS),
    }
