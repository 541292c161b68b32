"""Check whether the figures of `shifts.json` agree: counts, intervals, areas and ranges.

These checks do not prove that a file is genuine; `drone_rl.verdicts.coverage` re-runs a sample.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from drone_rl.robustness.axes import Axis
from drone_rl.robustness.domain import range_of, walk
from drone_rl.robustness.perturbations import Mode
from drone_rl.robustness.suite import finite, mcnemar_p, success_area
from drone_rl.sim.tasks import Task
from drone_rl.utils.errors import InputError
from drone_rl.utils.intervals import proportion

CLOSE = 1e-9
"""Relative rounding of values."""
UNLIKELY = 1e-6
"""Probability of a chance difference between two samples that counts as a contradiction."""
_REMEDY = "run drone-rl shifts again"


def check_counts(numbers: Mapping[str, Any], task: Task[Any]) -> None:
    """Check the figures of all conditions of `shifts.json`, of episodes of a task.

    Raises:
        InputError: A count, a rate, an interval or an area contradicts another one.
    """
    settings, plain = numbers["settings"], numbers["plain"]
    _refuse(_wrong_oracle(plain["oracle"], settings["episodes"]), "plain")
    _refuse(next(_problems(plain, plain, settings["episodes"], task), None), "plain")
    for name, along in numbers["axes"].items():
        where = f"axes.{name}"
        if [level["number"] for level in along["levels"]] != [*settings["strengths"]]:
            raise InputError(f"{where} has other strengths than settings.strengths; {_REMEDY}")
        for i, level in enumerate(along["levels"]):
            _refuse(_wrong_level(level, numbers, task), f"{where}.levels.{i}")
        share = plain["success"]["share"]
        areas = {mode: success_area(along["levels"], share, Mode(mode)) for mode in along["areas"]}
        is_same = all(_is_same(areas[mode], along["areas"][mode]) for mode in areas)
        if not is_same or "constant" not in areas:
            raise InputError(f"{where}.areas is not that of its shares; {_REMEDY}")
    _refuse(_wrong_level(numbers["together"], numbers, task), "together")


def check_range(axis: Axis, found: Mapping[str, Any], of: Any, numbers: Mapping[str, Any]) -> None:
    """Check a range of `domain.ranges` by replaying the search with the stored answers.

    The axis has the policy's own neutral strength; `of` is the policy's description.

    Raises:
        InputError: The search gives another limit or other strengths, or `axes` contradicts them.
    """
    if not _is_sound(axis, found, of, numbers):
        raise InputError(f"domain.ranges.{axis.name} contradicts its tested strengths; {_REMEDY}")
    levels = numbers["axes"][axis.name]["levels"]
    for level, at in ((v, at) for v in levels for at in found["flown"]):
        is_there = _is_same(at["position"], level["position"]) and level["refused"] is None
        success = level["modes"]["constant"]["success"] if is_there else None
        if success and at["good"] and _is_surely_bad(success, numbers):
            raise InputError(
                f"domain.ranges.{axis.name} says good at {level['value']:g}, and axes.{axis.name} "
                f"counts {success['share']:.0%} there; {_REMEDY}"
            )

    possible = numbers["settings"]["possible_share"]
    for failure in found["failed"]:
        if failure["impossible"] != _is_impossible(failure["oracle"], possible):
            raise InputError(
                f"domain.ranges.{axis.name}.failed: impossible does not follow from its oracle; "
                f"{_REMEDY}"
            )


def _is_impossible(oracle: Mapping[str, Any] | None, possible: float) -> bool:
    """Return whether the oracle certainly fails too often."""
    return oracle is not None and oracle["upper95"] < possible


def check_plain(numbers: Mapping[str, Any]) -> None:
    """Check the answer of `domain` without perturbation against the counts there.

    Raises:
        InputError: It is good, and too few of its own episodes or of those of `plain` succeed.
    """
    found, episodes = numbers["domain"]["plain"], numbers["settings"]["domain_episodes"]
    if not found["good"]:
        return
    own = {"successes": round(found["success"] * episodes), "trials": episodes}
    for where, success in (("domain.plain", own), ("plain", numbers["plain"]["success"])):
        if _is_surely_bad(success, numbers):
            share = success["successes"] / success["trials"]
            raise InputError(f"domain.plain says good, and {where} counts {share:.0%}; {_REMEDY}")


def check_probe(found: Mapping[str, Any], episodes: int, where: str) -> None:
    """Check the result of a search with so many episodes at one strength.

    Raises:
        InputError: It contradicts itself.
    """
    for name in ("success", "fragile", "worst"):
        if found["refused"] is None and name not in found:
            raise InputError(f"{where} is not refused, and has no {name}; {_REMEDY}")
    success = found.get("success")
    if success is not None and abs(success * episodes - round(success * episodes)) > 1e-6:
        raise InputError(f"{where}.success is not a fraction of {episodes} episodes; {_REMEDY}")
    if found.get("fragile", 0) > episodes:
        raise InputError(f"{where}.fragile is more than its {episodes} episodes; {_REMEDY}")
    if found["good"] and (found["bad"] or found["refused"] is not None):
        raise InputError(f"{where} is good, but also bad or refused; {_REMEDY}")
    _refuse(_wrong_oracle(found.get("oracle"), episodes), where)


def _refuse(problem: str | None, where: str) -> None:
    if problem is not None:
        raise InputError(f"{where}{problem}; {_REMEDY}")


def _wrong_oracle(oracle: Mapping[str, Any] | None, episodes: int) -> str | None:
    if oracle is not None and oracle["trials"] != episodes:
        return f".oracle is of {oracle['trials']} episodes, not of {episodes}"
    return None


def _wrong_level(
    level: Mapping[str, Any], numbers: Mapping[str, Any], task: Task[Any]
) -> str | None:
    settings, oracle = numbers["settings"], level["oracle"]
    if level["refused"] is not None:
        is_empty = oracle is None and level["impossible"] is None and not level["modes"]
        return None if is_empty else " is refused, and has figures"
    if not {*level["modes"]} <= {*settings["modes"]} or "constant" not in level["modes"]:
        return ".modes are not those of settings.modes"
    if (oracle is None) != (numbers["plain"]["oracle"] is None):
        return " has an oracle only with or only without perturbation"
    impossible = None if oracle is None else _is_impossible(oracle, settings["possible_share"])
    if level["impossible"] != impossible:
        return ".impossible does not follow from its oracle"
    episodes = settings["episodes"]
    problems = (
        problem
        for figures in level["modes"].values()
        for problem in _problems(figures, numbers["plain"], episodes, task)
    )
    return _wrong_oracle(oracle, episodes) or next(problems, None)


def _problems(
    figures: Mapping[str, Any], plain: Mapping[str, Any], episodes: int, task: Task[Any]
) -> Iterator[str]:
    success, ends, every = figures["success"], figures["ends"], figures["shares"].get("all")
    count, before = success["successes"], plain["success"]["successes"]
    if success["trials"] != episodes:
        yield f".success is of {success['trials']} episodes, not of {episodes}"
    success_end = task.ends(task.success_end).name.lower()
    if sum(ends.values()) != episodes or ends.get(success_end) != count:
        yield ".ends do not add up to its episodes and successes"
    if every is None or any(not _is_mean(share, episodes) for share in figures["shares"].values()):
        yield ".shares holds something else than means of its episodes"
    elif every["count"] != episodes or every["mean"] < count / episodes - CLOSE:
        yield ".shares.all has another count than its episodes, or less than its successes"
    lost, gained = figures["paired"]["lost"], figures["paired"]["gained"]
    if gained - lost != count - before or lost > before or gained > episodes - before:
        yield ".paired: gained - lost is not the difference to the unperturbed successes"
    yield from _pair_problems(figures, lost, gained, episodes)


def _pair_problems(
    figures: Mapping[str, Any], lost: int, gained: int, episodes: int
) -> Iterator[str]:
    if not _is_same(figures["paired"]["p"], mcnemar_p(lost, gained)):
        yield ".paired.p is not that of its counts"
    if figures["unchanged"] and (lost or gained):
        yield ".unchanged, although episodes were lost or gained"
    difference = figures["difference"]
    low, mean, high = (difference[key] for key in ("lower95", "mean", "upper95"))
    if not low - CLOSE <= mean <= high + CLOSE or not _is_same(mean, (gained - lost) / episodes):
        yield ".difference is not that of its pairs"


def _is_mean(share: Mapping[str, Any], episodes: int) -> bool:
    """Return whether a mean of at most one value per episode lies in its interval."""
    if share["count"] > episodes:
        return False
    if share["mean"] is None:
        return share["count"] == 0
    low, mean, high = (share[key] for key in ("lower95", "mean", "upper95"))
    return share["count"] > 0 and low - CLOSE <= mean <= high + CLOSE


def _is_surely_bad(success: Mapping[str, Any], numbers: Mapping[str, Any]) -> bool:
    """Whether the counts at a strength leave no doubt that the policy is not good there."""
    oracle = numbers["plain"]["oracle"]
    least = 0.0 if oracle is None else oracle["lower95"]
    found = proportion(success["successes"], success["trials"], 1 - UNLIKELY)
    return found["upper95"] < numbers["settings"]["good_share"] * least


def _is_sound(axis: Axis, found: Mapping[str, Any], of: Any, numbers: Mapping[str, Any]) -> bool:
    """Whether the search, given these answers, tries these strengths and finds this range."""
    is_plain_good = numbers["domain"]["plain"]["good"]
    if found["positions"] is None or not is_plain_good:
        return found["positions"] is None and not is_plain_good and not found["flown"]
    unused = {at["position"]: at["good"] for at in found["flown"]}

    def is_good(strength: float, _: float) -> bool:
        return unused.pop(next(at for at in unused if _is_same(at, axis.position(strength))))

    seed = numbers["settings"]["seed"]
    try:
        ends = {name: walk(axis, sign, seed, is_good) for name, sign in axis.signs.items()}
    except StopIteration:  # a strength is missing
        return False
    failed = [
        {"end": name, "value": finite(axis.value(end.failed, of))}
        for name, end in ends.items()
        if end.failed is not None
    ]
    return not unused and _agrees(range_of(axis, ends, failed, of), found)


def _agrees(expected: Any, given: Any) -> bool:
    """Whether all entries of the expected plain data are given, up to rounding."""
    if isinstance(expected, Mapping):
        return all(_agrees(value, given[name]) for name, value in expected.items())
    if isinstance(expected, Sequence) and not isinstance(expected, str):
        return len(expected) == len(given) and all(map(_agrees, expected, given))
    if isinstance(expected, str):
        return expected == given
    return _is_same(expected, given)


def _is_same(one: float | None, other: float | None) -> bool:
    if one is None or other is None:
        return one == other
    return math.isclose(one, other, rel_tol=CLOSE, abs_tol=CLOSE)
