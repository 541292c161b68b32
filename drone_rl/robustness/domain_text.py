"""What is quoted of a policy's flights under other conditions, beside a verdict or a need.

Evidence: "shifts", as in `shifts.json`, or why they are "refused", and "verdict", as in
`verdict.json`.
"""

import math
from collections.abc import Mapping

from drone_rl.robustness.shifts_text import MOST_NAMED, NAMES, SHIFTS, is_tested
from drone_rl.utils.text import Evidence, Sentence, listed, percent, plural, say

_OTHERS = {"color": "colours", "light": "light", "object size": "sizes"}
"""What a verdict is told to say nothing of, by the kind of shift that does."""
NEARLY = 1e-9
"""Rounding of a limit, relative."""


def is_quoted(evidence: Evidence) -> bool:
    """Whether there are such flights, and nothing speaks against them."""
    return bool(evidence.get("shifts")) and why_not(evidence) is None


def why_not(evidence: Evidence) -> str | None:
    """What speaks against flights that are there; None if nothing does."""
    shifts, verdict = evidence["shifts"], evidence["verdict"]
    if "refused" in shifts:
        return shifts["refused"]
    share = shifts["settings"]["good_share"]
    if share != verdict["good_share"]:
        return (
            f"they call good who has a share of {share:g} of the oracle's success, this verdict "
            f"one of {verdict['good_share']:g}"
        )
    is_other = verdict["certain"] and verdict["kind"] != "good"
    if is_other and shifts["domain"] is not None and shifts["domain"]["plain"]["good"]:
        return "they say that it is good where nothing is different, and this verdict's do not"
    return None


def untested(evidence: Evidence) -> list[str]:
    """Of colours, light and sizes, those in which it was not flown."""
    axes = evidence["shifts"]["axes"].values() if is_quoted(evidence) else ()
    flown = {along["group"] for along in axes}
    return [told for group, told in _OTHERS.items() if group not in flown]


def _quote(evidence: Evidence) -> str:
    shifts = evidence["shifts"]
    settings = shifts["settings"]
    if shifts["domain"] is None:
        count = f"{settings['episodes']:,}"
    else:
        count = f"{settings['domain_episodes']:,} (ranges) and {settings['episodes']:,} (others)"
    basis = (
        f"By drone-rl shifts, of this network, camera and task: {count} flights at each strength "
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
        "flights under other conditions are of this network and task, and none speak against them",
        is_quoted,
        _quote,
    ),
    Sentence(
        "domain.refused",
        "there are such flights, and something speaks against them",
        lambda e: bool(e.get("shifts")) and not is_quoted(e),
        lambda e: f"Flights under other conditions are not quoted: {why_not(e)}.",
    ),
)


def needed_range(along: Evidence, need: Mapping[str, float | None]) -> tuple[float, float]:
    """The ends of a range that is needed.

    Args:
        along: Of the axis, as in `shifts.json`.
        need: See `lacking`.
    """
    neutral = _number(along["neutral"])
    given = [end for end in (need["low"], need["high"]) if end is not None]
    low = min([neutral, *given]) if need["low"] is None else need["low"]
    high = max([neutral, *given]) if need["high"] is None else need["high"]
    return low, high


def contradicted(name: str | None, value: float, unit: str, probed: Evidence) -> str:
    """What new episodes say against a file.

    Args:
        name: Of the axis; None where nothing is different.
        value: At which they were flown.
        unit: Of the axis.
        probed: See `drone_rl.robustness.domain.Prober.probe`.
    """
    where = "where nothing is different" if name is None else f"{NAMES[name]} at {value:.4g} {unit}"
    if probed["refused"] is not None:
        return f"{where}: the task can't be so ({probed['refused']})"
    return (
        f"{where}: new episodes succeed in {percent(probed['success'])}, so that it is surely not "
        "good there; the file says that it is"
    )


def lacking(shifts: Evidence, name: str, need: Mapping[str, float | None]) -> str | None:
    """What an operating domain lacks of a range that is needed; None if nothing.

    Args:
        shifts: As in `shifts.json`, with ranges.
        name: Of the axis.
        need: Its "low" and "high"; None for as far as no difference is, or as the other end.
    """
    found, along = shifts["domain"]["ranges"].get(name), shifts["axes"].get(name)
    if found is None or along is None:
        return f"{NAMES[name]}: not flown; run drone-rl shifts with axes=[{name}] among others"
    low, high = needed_range(along, need)
    needed = f"{NAMES[name]}: needed {_span(low, high, along['unit'])}"
    if found["positions"] is None:
        return f"{needed}; it is not even surely good where nothing is different"
    if not is_tested(shifts, name):
        return f"{needed}; it notices nothing of it, so that nothing was tested"
    good = _number(found["low"]), _number(found["high"])
    short = {
        "low": good[0] > low + NEARLY * abs(low),
        "high": math.isfinite(good[1]) and good[1] < high - NEARLY * abs(high),
    }
    if not any(short.values()):
        return None
    lost = [f for f in found["failed"] if f["impossible"] and short[f["end"]]]
    more = "; further nobody can who knows no more than the camera shows" if lost else ""
    return f"{needed}, good {_span(*good, along['unit'])}{more}"


def _number(value: float | None) -> float:
    return math.inf if value is None else value


def _span(low: float, high: float, unit: str) -> str:
    ends = f"{low:.4g} and more" if math.isinf(high) else f"{low:.4g} to {high:.4g}"
    return f"{ends} {unit}"
