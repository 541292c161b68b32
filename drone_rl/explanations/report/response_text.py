"""What a report says of one cube wherever it stands, and of left and right."""

from collections.abc import Sequence

from drone_rl.sim.vocabulary import terms_of
from drone_rl.utils.text import Evidence, Sentence, bounds, listed, percent


def _level(evidence: Evidence, level: bool = True) -> list[Evidence]:
    """Rows of targets at the drone's height, or of all others."""
    return [row for row in evidence["response"]["rows"] if (row["height"] == 0) == level]


def _collected(evidence: Evidence, rows: Sequence[Evidence]) -> str:
    terms = terms_of(evidence)
    parts = [
        f"{row['collected']} of {row['places']} places {terms.place(row['side'])}"
        for row in rows
        if row["places"]
    ]
    return listed(parts)


def _outcomes(evidence: Evidence) -> str:
    terms = terms_of(evidence)
    return (
        f"Put before one {terms.target} alone, and flying on with its most probable actions, it "
        f"{terms.handles} from {_collected(evidence, _level(evidence))}."
    )


def _blind(evidence: Evidence) -> str:
    rows = {row["side"]: row["blind"] for row in _level(evidence)}
    terms = terms_of(evidence)
    parts = [f"{percent(rows[s])} of the places {terms.place(s)}" for s in rows if s != "ahead"]
    return (
        f"It is blind at {listed(parts)}: a turn is called for and not made, and its probabilities "
        f"differ by less than {evidence['response']['blind_below']:g} from those without a "
        f"{terms.target}. Farther on it may see the {terms.target} yet."
    )


def _heights(evidence: Evidence) -> str:
    other = _level(evidence, level=False)
    parts = []
    for height in sorted({row["height"] for row in other}):
        word = "higher" if height > 0 else "lower"
        rows = [row for row in other if row["height"] == height]
        parts.append(f"{abs(height):g} m {word}: from {_collected(evidence, rows)}")
    return f"Where the {terms_of(evidence).target} stands {'; '.join(parts)}."


RESPONSE = (
    Sentence(
        "response.collected",
        "flights from the grid were followed to their outcome",
        lambda e: any(row["places"] for row in _level(e)),
        _outcomes,
    ),
    Sentence(
        "response.heights",
        "targets of the task stand at other heights, too",
        lambda e: bool(_level(e, level=False)),
        _heights,
    ),
    Sentence(
        "response.blind",
        "places on both sides call for a turn",
        lambda e: all(r["blind"] is not None for r in _level(e) if r["side"] != "ahead"),
        _blind,
    ),
)


def _differs(evidence: Evidence) -> str:
    found = evidence["asymmetry"]
    absolute = found["dataset"]["absolute"]
    return (
        f"On these frames it differs from its mirror image by {absolute['mean']:.2f} on average "
        f"(0: perfectly symmetric, 1: always opposite; {bounds(absolute)}), on the grid by "
        f"{found['grid']['absolute']:.2f}."
    )


def _signed(evidence: Evidence) -> Evidence:
    return evidence["asymmetry"]["dataset"]["signed"]


def _prefers(evidence: Evidence) -> str:
    signed = _signed(evidence)
    side = "left" if signed["mean"] > 0 else "right"
    ends = sorted(abs(signed[end]) for end in ("lower95", "upper95"))
    size = {"lower95": ends[0], "upper95": ends[1]}
    return f"It prefers the {side}, by {abs(signed['mean']):.2f} in probability ({bounds(size)})."


def _is_sure(evidence: Evidence) -> bool:
    signed = _signed(evidence)
    return signed["lower95"] > 0 or signed["upper95"] < 0


ASYMMETRY = (
    Sentence("asymmetry.differs", "always: it is what was measured", lambda e: True, _differs),
    Sentence("asymmetry.prefers", "the interval of the preference excludes 0", _is_sure, _prefers),
    Sentence(
        "asymmetry.undecided",
        "it contains 0",
        lambda e: not _is_sure(e),
        lambda e: (
            "These flights do not tell whether it prefers a side "
            f"({_signed(e)['mean']:+.2f}, {bounds(_signed(e))}; above 0: left)."
        ),
    ),
)
