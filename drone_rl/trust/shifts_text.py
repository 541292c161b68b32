"""Sentences and table of a robustness evaluation. Evidence: `shifts.json`."""

import math
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_rl.config.transforms import Fault
from drone_rl.sim.vocabulary import terms_of
from drone_rl.utils.errors import InputError
from drone_rl.utils.text import Evidence, Sentence, fixed_seed, listed, percent, plural, say

TABLE: Mapping[str, Mapping[str, Any]] = tomllib.loads(
    Path(__file__).with_name("axes.toml").read_text(encoding="utf-8")
)
"""Axes by name; `axes.toml` documents the entries."""
NAMES: Mapping[str, str] = {name: axis["label"] for name, axis in TABLE.items()}
"""Axes by name, in reports."""
MAX_NAMED = 6
"""Largest number of axes that a sentence names."""


def rows(numbers: Evidence) -> list[list[str]]:
    """Return success rates at every strength as a table of texts, a row for each axis."""
    head = ["success, constant", "1", "2", "3", "4", "5", "area", ""]
    return [head, *(_row(name, along) for name, along in numbers["axes"].items())]


def _row(name: str, along: Mapping[str, Any]) -> list[str]:
    cells = {level["number"]: _cell(level) for level in along["levels"]}
    area = along["areas"]["constant"]
    return [
        NAMES[name],
        *(cells.get(number, "") for number in range(1, 6)),
        "" if area is None else f"{area:.2f}",
        along["unit"],
    ]


def _cell(level: Mapping[str, Any]) -> str:
    if level["refused"] is not None:
        return f"{level['value']:.3g}: -"
    success = percent(level["modes"]["constant"]["success"]["share"])
    return f"{level['value']:.3g}: {success}{'*' if level['impossible'] else ''}"


def _ranges(e: Evidence) -> Mapping[str, Any]:
    return (e["domain"] or {}).get("ranges", {})


def is_tested(e: Evidence, name: str) -> bool:
    """Return whether the strongest perturbation of an axis changed an image or an episode."""
    results = [v["modes"]["constant"] for v in e["axes"][name]["levels"] if v["refused"] is None]
    return bool(results) and not results[-1]["unchanged"]


def wide(e: Evidence) -> list[str]:
    """Return the axes with a range in which the policy is good."""
    limits = ((name, found["positions"] or (0, 0)) for name, found in _ranges(e).items())
    return [name for name, (low, high) in limits if low < high and is_tested(e, name)]


def _shut(e: Evidence) -> list[str]:
    """Axes on which a policy that is good without perturbation is certainly not good."""
    return [
        name
        for name, found in _ranges(e).items()
        if found["positions"] == [0.0, 0.0] and any(f["bad"] for f in _own_failures(found))
    ]


def _unknown(e: Evidence) -> list[tuple[str, Mapping[str, Any]]]:
    """Axes, with the result at the end of a side where it is neither certainly good nor not."""
    ends = [(name, end) for name, found in _ranges(e).items() for end in _own_failures(found)]
    return [(name, end) for name, end in ends if not end["bad"]]


def _own_failures(found: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Failures at strengths that are possible."""
    return [failure for failure in found["failed"] if not failure["impossible"]]


def inward(value: float, up: bool) -> str:
    """Return a limit in three digits, rounded into the range; `up` for a lower limit."""
    if value == 0:
        return "0"
    unit = 10.0 ** (math.floor(math.log10(abs(value))) - 2)
    count = value / unit
    return f"{(math.ceil(count - 1e-6) if up else math.floor(count + 1e-6)) * unit:.3g}"


def range_text(e: Evidence, name: str) -> str:
    """Return the range of an axis of `wide` in words."""
    found, ends = _ranges(e)[name], {"low": True, "high": False}
    limits = {end: inward(found[end], up) for end, up in ends.items() if found[end] is not None}
    axis = TABLE[name]
    text = axis["range"] if found["high"] is None else axis.get("bounded", axis["range"])
    text = text.format(objects=f"{terms_of(e).target}s", **limits)
    most = {"low": "no less", "high": "no more"}
    tried = listed([most[end] for end in ends if found[f"{end}_open"]])
    lost = listed([f"{most[f['end']]} is possible" for f in found["failed"] if f["impossible"]])
    aside = listed([*([f"{tried} was tried"] if tried else []), *([lost] if lost else [])])
    return f"{text} ({aside})" if aside else text


def _good(e: Evidence) -> str:
    ranges = listed([range_text(e, name) for name in wide(e)])
    return f"Good with {ranges} (95% confidence for each range)."


def _not(e: Evidence) -> str:
    parts = []
    for name in _shut(e):
        found = next(f for f in _own_failures(_ranges(e)[name]) if f["bad"])
        parts.append(f"{_at(e, name, found['value'])}{_why(e, found)}")
    return f"Not with {listed(parts)}."


def _uncertain(e: Evidence) -> str:
    parts = [f"{_at(e, name, end['value'])} ({_counted(end)})" for name, end in _unknown(e)]
    episodes = plural(e["settings"]["domain_episodes"], "episode")
    return f"Not certain, in {episodes}, whether it is good with {listed(parts, 'or')}."


def _counted(end: Mapping[str, Any]) -> str:
    rounding = f"; rounding can change {end['fragile']}" if end["fragile"] else ""
    return f"{percent(end['success'])} succeed{rounding}"


def _at(e: Evidence, name: str, value: float) -> str:
    return f"{NAMES[name]} at {value:.3g} {e['axes'][name]['unit']}"


def _why(e: Evidence, found: Mapping[str, Any]) -> str:
    if found["refused"] is not None:
        return ", which the task does not allow"
    worst = found["worst"]
    if worst is None:
        return f": all {terms_of(e).goals} in {percent(found['success'])} of episodes"
    return f": {terms_of(e).goals} {terms_of(e).side(worst['side'])} {percent(worst['share'])}"


def _impossible(e: Evidence) -> list[str]:
    """Impossible strengths and ends of ranges, with the oracle's success rate."""
    found = {
        _at(e, name, at["value"]): percent(at["oracle"]["share"])
        for name, along in e["axes"].items()
        for at in (*_ranges(e).get(name, {"failed": []})["failed"], *along["levels"])
        if at["impossible"]
    }
    return [f"{at}, {share}" for at, share in found.items()]


def _without_effect(e: Evidence) -> list[str]:
    return [NAMES[n] for n in e["axes"] if not is_tested(e, n) and not _is_refused(e, n)]


def _is_refused(e: Evidence, name: str) -> bool:
    """Return whether the task or the camera allows none of the strengths of an axis."""
    return all(level["refused"] is not None for level in e["axes"][name]["levels"])


def _untested(e: Evidence) -> str:
    barred, same = [NAMES[n] for n in e["axes"] if _is_refused(e, n)], _without_effect(e)
    parts = [f"because without effect: {listed(same)}"] if same else []
    parts += [f"because no strength is allowed: {listed(barred)}"] if barred else []
    return f"Not tested, {'; '.join(parts)}." if parts else ""


def _together(e: Evidence) -> str:
    result, oracle = e["together"]["modes"]["constant"], e["together"]["oracle"]
    other = "" if oracle is None else f", the oracle in {percent(oracle['share'])}"
    return (
        f"With {_every_axis(e)} at once, each at its third strength, it succeeds in "
        f"{percent(result['success']['share'])} of episodes{other}."
    )


def _every_axis(e: Evidence) -> str:
    """All axes by name, or their number if there are many."""
    names = [NAMES[name] for name in e["axes"]]
    return listed(names) if len(names) <= MAX_NAMED else f"all {len(names)} axes of the table"


_FAULTS = frozenset(fault.name for fault in Fault.__subclasses__())


def _own_faults(e: Evidence) -> list[str]:
    described = (e.get("network") or {}).get("description", {})
    return [t["name"] for t in described.get("transforms", ()) if t["name"] in _FAULTS]


SHIFTS = (
    Sentence(
        "shifts.good",
        "certainly good without perturbation and up to both ends of a range with an effect",
        lambda e: bool(wide(e)),
        _good,
    ),
    Sentence(
        "shifts.not",
        "certainly good without perturbation, certainly not at the next strength of an axis",
        lambda e: bool(_shut(e)),
        _not,
    ),
    Sentence(
        "shifts.uncertain",
        "at a possible strength at which a side ends, neither certainly good nor certainly not",
        lambda e: bool(_unknown(e)),
        _uncertain,
    ),
    Sentence(
        "shifts.none",
        "ranges were searched, and the policy is not certainly good without perturbation",
        lambda e: e["domain"] is not None and not e["domain"]["plain"]["good"],
        lambda e: (
            "It is not certainly good even without perturbation, so there is no range in which it "
            "is."
        ),
    ),
    Sentence(
        "shifts.untested",
        "an axis changed neither images nor episodes, or allows no strength",
        lambda e: bool(_untested(e)),
        _untested,
    ),
    Sentence(
        "shifts.impossible",
        "the oracle certainly fails too often at a strength of the table or where a range ends",
        lambda e: bool(_impossible(e)),
        lambda e: f"Impossible even for the oracle: {listed(_impossible(e))}.",
    ),
    Sentence(
        "shifts.together",
        "several axes were perturbed at once",
        lambda e: e["together"]["refused"] is None and len(e["axes"]) > 1,
        _together,
    ),
    Sentence(
        "shifts.scope",
        "a range was found",
        lambda e: bool(wide(e)),
        lambda e: (
            "Tested within each range, with constant perturbations: its limits, the strengths of "
            "the table and a random one between each two; not tested: other strengths, and "
            "combinations of axes except those named here."
        ),
    ),
    Sentence(
        "shifts.own_faults",
        "the policy's transforms simulate camera faults, which these episodes leave out",
        lambda e: bool(_own_faults(e)),
        lambda e: f"Without the camera faults of its training ({listed(_own_faults(e))}).",
    ),
    fixed_seed("shifts.fixed_seed"),
)
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
NEARLY = 1e-9
"""Relative rounding of a limit."""


def needed_range(
    name: str, along: Evidence, need: Mapping[str, float | None]
) -> tuple[float, float]:
    """Return the ends of a required range on an axis, whose entry in `shifts.json` is `along`.

    None stands for the value without perturbation; an `InputError` is raised if that is beyond.
    """
    neutral = _number(along["neutral"])
    low = neutral if need["low"] is None else need["low"]
    high = neutral if need["high"] is None else need["high"]
    if low <= high:
        return low, high
    missing, given = ("low", "high") if need["low"] is None else ("high", "low")
    raise InputError(
        f"{NAMES[name]}: {missing} is missing and therefore {neutral:.4g} {along['unit']}, the "
        f"value without perturbation, but {given} is {need[given]:.4g}; give {missing}, too"
    )


def contradicted(name: str | None, value: float, unit: str, probed: Evidence) -> str | None:
    """Return how new episodes contradict a file, or None if they do not.

    They are at a value of an axis (None without perturbation); `probed` is from `Prober.probe`.
    """
    if not probed["bad"]:
        return None
    where = "without perturbation" if name is None else f"{NAMES[name]} at {value:.4g} {unit}"
    if probed["refused"] is not None:
        return f"{where}: the task does not allow it ({probed['refused']})"
    return (
        f"{where}: {percent(probed['success'])} of new episodes succeed, so the policy is "
        "certainly not good there; the file states that it is"
    )


def lacking(shifts: Evidence, name: str, need: Mapping[str, float | None]) -> str | None:
    """Return what an operating domain lacks of a required range of an axis, or None.

    `shifts` is the content of `shifts.json`, which must have a domain; see `needed_range`.
    """
    found, along = shifts["domain"]["ranges"].get(name), shifts["axes"].get(name)
    if found is None or along is None:
        return f"{NAMES[name]}: not evaluated; run drone-rl shifts with axes=[{name}] among others"
    low, high = needed_range(name, along, need)
    needed = f"{NAMES[name]}: needed {_span(low, high, along['unit'])}"
    if found["positions"] is None:
        return f"{needed}; it is not certainly good even without perturbation"
    if not is_tested(shifts, name):
        why = "no strength is allowed" if _is_refused(shifts, name) else "it had no effect"
        return f"{needed}; not tested, because {why}"
    good = _number(found["low"]), _number(found["high"])
    short = {
        "low": good[0] > low + NEARLY * abs(low),
        "high": math.isfinite(good[1]) and good[1] < high - NEARLY * abs(high),
    }
    if not any(short.values()):
        return None
    lost = [f for f in found["failed"] if f["impossible"] and short[f["end"]]]
    more = "; more is impossible even for the oracle" if lost else ""
    is_clear = math.isinf(good[0])  # only air without fog has an infinite lower limit
    where = f"only without {NAMES[name]}" if is_clear else _span(*good, along["unit"])
    return f"{needed}, good {where}{more}"


def _number(value: float | None) -> float:
    return math.inf if value is None else value


def _span(low: float, high: float, unit: str) -> str:
    ends = f"{low:.4g} and more" if math.isinf(high) else f"{low:.4g} to {high:.4g}"
    return f"{ends} {unit}"
