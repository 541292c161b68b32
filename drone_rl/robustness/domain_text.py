"""Sentences that quote a robustness evaluation, and its comparison with requirements.

Evidence: "shifts", as in `shifts.json` or with the reason why it is "refused", and "verdict", as in
`verdict.json`.
"""

import math
from collections.abc import Mapping

from drone_rl.robustness.shifts_text import MOST_NAMED, NAMES, SHIFTS, is_tested
from drone_rl.utils.text import Evidence, Sentence, listed, percent, plural, say

_OTHERS = {"color": "colours", "light": "light", "object size": "sizes"}
"""What a verdict does not cover, by the kind of shift that does."""
NEARLY = 1e-9
"""Relative rounding of a limit."""


def is_quoted(evidence: Evidence) -> bool:
    """Return whether there is such an evaluation that is not refused."""
    return bool(evidence.get("shifts")) and why_not(evidence) is None


def why_not(evidence: Evidence) -> str | None:
    """Return the reason why an evaluation is refused, or None."""
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


def untested(evidence: Evidence) -> list[str]:
    """Return which of colours, light and sizes were not evaluated."""
    axes = evidence["shifts"]["axes"].values() if is_quoted(evidence) else ()
    flown = {along["group"] for along in axes}
    return [name for group, name in _OTHERS.items() if group not in flown]


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
    count = plural(len(names), "axis").replace("axiss", "axes")
    return f"{count} ({listed(names)})" if len(names) <= MOST_NAMED else count


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


def needed_range(along: Evidence, need: Mapping[str, float | None]) -> tuple[float, float]:
    """Return the ends of a required range on an axis, as in `shifts.json`; see `lacking`."""
    neutral = _number(along["neutral"])
    given = [end for end in (need["low"], need["high"]) if end is not None]
    low = min([neutral, *given]) if need["low"] is None else need["low"]
    high = max([neutral, *given]) if need["high"] is None else need["high"]
    return low, high


def contradicted(name: str | None, value: float, unit: str, probed: Evidence) -> str:
    """Return how new episodes contradict a file.

    Args:
        name: Of the axis; None without perturbation.
        value: Of the axis.
        unit: Of the axis.
        probed: See `drone_rl.robustness.domain.Prober.probe`.
    """
    where = "without perturbation" if name is None else f"{NAMES[name]} at {value:.4g} {unit}"
    if probed["refused"] is not None:
        return f"{where}: the task does not allow it ({probed['refused']})"
    return (
        f"{where}: {percent(probed['success'])} of new episodes succeed, so the policy is "
        "certainly not good there; the file states that it is"
    )


def lacking(shifts: Evidence, name: str, need: Mapping[str, float | None]) -> str | None:
    """Return what an operating domain lacks of a required range, or None.

    Args:
        shifts: As in `shifts.json`, with ranges.
        name: Of the axis.
        need: Its "low" and "high"; None for the value without perturbation, or the other end.
    """
    found, along = shifts["domain"]["ranges"].get(name), shifts["axes"].get(name)
    if found is None or along is None:
        return f"{NAMES[name]}: not evaluated; run drone-rl shifts with axes=[{name}] among others"
    low, high = needed_range(along, need)
    needed = f"{NAMES[name]}: needed {_span(low, high, along['unit'])}"
    if found["positions"] is None:
        return f"{needed}; it is not certainly good even without perturbation"
    if not is_tested(shifts, name):
        return f"{needed}; not tested, because it had no effect"
    good = _number(found["low"]), _number(found["high"])
    short = {
        "low": good[0] > low + NEARLY * abs(low),
        "high": math.isfinite(good[1]) and good[1] < high - NEARLY * abs(high),
    }
    if not any(short.values()):
        return None
    lost = [f for f in found["failed"] if f["impossible"] and short[f["end"]]]
    more = "; more is impossible even for the oracle" if lost else ""
    return f"{needed}, good {_span(*good, along['unit'])}{more}"


def _number(value: float | None) -> float:
    return math.inf if value is None else value


def _span(low: float, high: float, unit: str) -> str:
    ends = f"{low:.4g} and more" if math.isinf(high) else f"{low:.4g} to {high:.4g}"
    return f"{ends} {unit}"
