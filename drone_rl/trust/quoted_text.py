"""Sentences that quote a robustness evaluation. Evidence: `shifts.json` and `verdict.json`."""

from drone_rl.trust.shifts_text import MAX_NAMED, NAMES, SHIFTS, range_text, wide
from drone_rl.utils.text import Evidence, Sentence, listed, plural, say

_OTHERS = {"color": "colors", "light": "light", "object size": "sizes"}
"""Names in sentences of the groups of axes that a verdict alone does not cover."""


def is_quoted(evidence: Evidence) -> bool:
    """Return whether the evidence has a robustness evaluation that is not refused."""
    return bool(evidence.get("shifts")) and why_not(evidence) is None


def why_not(evidence: Evidence) -> str | None:
    """Return the reason why the robustness evaluation is refused, or None."""
    shifts, verdict = evidence["shifts"], evidence["verdict"]
    if "refused" in shifts:
        return shifts["refused"]
    share = shifts["settings"]["good_share"]
    if share != verdict["good_share"]:
        return (
            f"it requires {share:g} of the oracle's success rate for a good policy, this verdict "
            f"{verdict['good_share']:g}"
        )
    is_other = verdict["certain"] and verdict["kind"] != "good"
    if is_other and shifts["domain"] is not None and shifts["domain"]["plain"]["good"]:
        return "it states that the policy is good without perturbation, and this verdict does not"
    return None


def not_evaluated(evidence: Evidence) -> list[str]:
    """Return which of colors, light and sizes were not evaluated."""
    axes = evidence["shifts"]["axes"].values() if is_quoted(evidence) else ()
    tested = {along["group"] for along in axes}
    return [name for group, name in _OTHERS.items() if group not in tested]


def _quote(evidence: Evidence) -> str:
    shifts = evidence["shifts"]
    settings = shifts["settings"]
    if shifts["domain"] is None:
        count = f"{settings['episodes']:,}"
    else:
        count = f"{settings['domain_episodes']:,} (ranges) and {settings['episodes']:,} (others)"
    basis = (
        f"By drone-rl shifts, of this network, camera and task: {count} episodes at each strength "
        f"(seed {settings['seed']}) of {_axes(shifts)}."
    )
    file = shifts["file"]
    read = f"Read from {file['path']}, dated {file['dated']}, not measured again here:"
    return " ".join(filter(None, (read, say(SHIFTS, shifts), basis)))


def _axes(shifts: Evidence) -> str:
    names = [NAMES[name] for name in shifts["axes"]]
    count = plural(len(names), "axis", "axes")
    return f"{count} ({listed(names)})" if len(names) <= MAX_NAMED else count


def _brief(evidence: Evidence) -> str:
    shifts, file = evidence["shifts"], evidence["shifts"]["file"]
    named = [range_text(shifts, name) for name in wide(shifts)]
    others = len(named) - MAX_NAMED
    ranges = named[:MAX_NAMED] + ([f"ranges of {others} more"] if others > 0 else [])
    found = f"good with {listed(ranges)}" if ranges else f"success rates on {_axes(shifts)}"
    fixed = say(SHIFTS[-1:], shifts)
    read = f"Read from {file['path']}, dated {file['dated']}, not measured again here: {found}."
    return f"{read} {fixed}".rstrip()


QUOTED = (
    Sentence(
        "domain.quoted",
        "a robustness evaluation is of this network and task, and not refused",
        is_quoted,
        _quote,
    ),
    Sentence(
        "domain.refused",
        "a robustness evaluation is refused",
        lambda e: bool(e.get("shifts")) and not is_quoted(e),
        lambda e: f"A robustness evaluation is not quoted: {why_not(e)}.",
    ),
)

BRIEF = (
    Sentence(
        "domain.brief",
        "a robustness evaluation is of this network and task, and not refused",
        is_quoted,
        _brief,
    ),
    QUOTED[1],
)
"""Like `QUOTED`, in one line for a terminal."""
