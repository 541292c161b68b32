"""What an evaluation says of its seed and its arithmetic. Evidence: `evaluation.json`."""

from drone_rl.utils.text import Evidence, Sentence, fixed_seed, percent


def _computed(evidence: Evidence) -> str:
    return f"Computed in {evidence['rounding']['arithmetic']}."


def _counts(evidence: Evidence) -> str:
    found = evidence["rounding"]
    return f"{found['differing']:,} of the first {found['compared_episodes']:,} greedy episodes"


def _same(evidence: Evidence) -> str:
    found = evidence["rounding"]
    return (
        f"The same actions in all of the first {found['compared_episodes']:,} greedy episodes "
        f"when computed again ({found['compared']})."
    )


def _other(evidence: Evidence) -> str:
    found = evidence["rounding"]
    return (
        f"Other actions in {_counts(evidence)} when computed again ({found['compared']}): "
        "decisions depend on rounding."
    )


def _is_fragile(evidence: Evidence) -> bool:
    found = evidence.get("rounding")
    return bool(found) and bool(found.get("excessive")) and found["fragile"] > 0


def _fragile(evidence: Evidence) -> str:
    found = evidence["rounding"]
    return (
        f"These figures hold for this arithmetic only: in {found['fragile']:,} of "
        f"{found['frames']:,} of these episodes' frames ({percent(found['fragile_rate'])}) the "
        "order in which float32 sums are computed can change the action."
    )


EVALUATION = (
    fixed_seed("evaluation.fixed_seed"),
    Sentence(
        "computed",
        "it is known what computed the actions",
        lambda e: bool(e.get("rounding")),
        _computed,
    ),
    Sentence(
        "computed.same",
        "another implementation took the same actions",
        lambda e: bool(e.get("rounding")) and not e["rounding"]["differing"],
        _same,
    ),
    Sentence(
        "computed.other",
        "another implementation took other actions",
        lambda e: bool(e.get("rounding")) and e["rounding"]["differing"] > 0,
        _other,
    ),
    Sentence(
        "computed.fragile",
        "rounding can change the action in more frames or episodes than a verdict allows",
        _is_fragile,
        _fragile,
    ),
)
