"""The seed of an analysis. Evidence: "seed" and "seed_is_fixed", which every result has.

Results of version 0.1 have no "seed_is_fixed". Their seed was 0 or chosen by the user, and thus
known before the analysis: they count as fixed.
"""

from collections.abc import Mapping

from drone_rl.utils.sentences import Evidence, Sentence

SEED_KEYS = ("seed", "seed_is_fixed")
"""Entries of every result that states a claim."""


def is_fixed(evidence: Evidence) -> bool:
    """Whether the seed was known before the analysis; results that do not say so count as fixed."""
    return bool(evidence.get("seed_is_fixed", True))


def seed_of(evidence: Evidence) -> int | None:
    """The seed, which older results have among their settings; None if it is not recorded."""
    settings = evidence.get("settings")
    older = settings.get("seed") if isinstance(settings, Mapping) else None
    return evidence.get("seed", older)


def seed_line(evidence: Evidence, what: str = "environments") -> str:
    """The seed and where it comes from, for a terminal or a page.

    Args:
        evidence: A result.
        what: The seed's streams were used for.
    """
    seed, kind = seed_of(evidence), "fixed" if is_fixed(evidence) else "fresh"
    return f"{what}: seed {'not recorded' if seed is None else seed} ({kind})"


def fixed_seed(name: str, what: str = "environments") -> Sentence:
    """The warning that belongs to each claim from a seed that was known before.

    Args:
        name: Of the sentence.
        what: The seed's streams were used for.
    """

    def text(evidence: Evidence) -> str:
        seed = seed_of(evidence)
        known = f"Fixed {what}" if seed is None else f"Fixed seed {seed}"
        return f"{known}: a policy could have been fitted to these {what}."

    return Sentence(name, "the seed was known before the analysis", is_fixed, text)


BODIES = (fixed_seed("bodies.fixed_seed"),)
"""Evidence: `bodies.json`."""
LOOPED = (fixed_seed("looped.fixed_seed"),)
"""Evidence: see `drone_rl.robustness.sitl.LoopedFlights.as_dict`."""
CHANCES = (fixed_seed("chances.fixed_seed", "placements"),)
"""Evidence: `chances.json` of held-out placements; those that a user gives have no seed."""
CHECK = (fixed_seed("check.fixed_seed", "placements"),)
"""Evidence: `check.json`."""
