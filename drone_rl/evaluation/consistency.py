"""Check verdicts read from files: whatever can be computed again must agree."""

from collections.abc import Mapping
from typing import Any

from drone_rl.evaluation.rule import SIDES, Kind, Quantity, Rule, decide, kinds_within
from drone_rl.utils.consistency import (
    COUNT,
    MOST_VALUES,
    check_mean,
    check_mean_width,
    check_order,
    check_proportion,
    check_same,
    check_width,
    read_entry,
)
from drone_rl.utils.errors import InputError
from drone_rl.utils.exit_codes import NOT_CERTAIN
from drone_rl.utils.intervals import proportion
from drone_rl.utils.schema import Flag, OneOf, Plain, Real, Several, Whole, as_mapping, shown

_KIND = OneOf(tuple(kind.value for kind in Kind))
_ROUNDING = 1e-6


def check_verdict(given: Any) -> None:
    """Check a verdict that was read from a file, as in `verdict.json`.

    Raises:
        InputError: A number is out of range, or its parts contradict one another.
    """
    verdict = as_mapping(Plain().read(given, "verdict"), "verdict")
    rule = _rule(verdict)
    evaluations = [("greedy", verdict.get("greedy")), *verdict["baselines"].items()]
    if verdict.get("sampled") is not None:
        evaluations.append(("sampled", verdict["sampled"]))
    for name, flights in evaluations:  # pairs: a baseline may have any name
        _check_flights(verdict, flights, name[:40], rule)
        check_same(flights["episodes"], verdict["greedy"]["episodes"], f"{name[:40]}.episodes")
    found = [
        _quantity(verdict, name, thresholds, rule)
        for name, thresholds in zip(rule.quantities, rule.thresholds, strict=True)
    ]
    _check_kind(verdict, found, rule)
    _check_differences(verdict)
    _check_proof(verdict)
    _check_rounding(verdict)
    if "failures" in verdict:
        _check_failures(verdict)


def _rule(verdict: Mapping[str, Any]) -> Rule:
    """Return the rule of the verdict, for its strata and baselines."""
    error_rate, good_share = (verdict.get(key) for key in ("error_rate", "good_share"))
    strata = [name for name in _shares(verdict.get("greedy"), "greedy") if name != "all"]
    if set(strata) == set(SIDES):
        strata = list(SIDES)
    baselines = as_mapping(verdict.get("baselines"), "baselines")
    blind = [name for name in baselines if name != "oracle"]
    if len(blind) == len(baselines):
        raise InputError("verdict.baselines has no oracle; judge again")
    for what, count, most in (("strata", len(strata), 32), ("blind baselines", len(blind), 32)):
        if not 0 < count <= most:
            raise InputError(f"verdict has {count} {what}, not 1 to {most}; judge again")
    rule = Rule(
        error_rate=Real(0.0, 1.0).read(error_rate, "verdict.error_rate"),
        good_share=Real(0.0, 1.0).read(good_share, "verdict.good_share"),
        strata=tuple(strata),
        blind_baselines=tuple(blind),
    )
    if verdict.get("rule") != rule.text:
        raise InputError("verdict.rule is not the rule of this version; judge the policy again")
    return rule


def _shares(flights: Any, of: str) -> Mapping[str, Any]:
    return as_mapping(as_mapping(flights, of).get("shares"), f"{of}.shares")


def _check_flights(verdict: Mapping[str, Any], flights: Any, of: str, rule: Rule) -> None:
    """Check the summary of one evaluation."""
    episodes = read_entry(flights, "episodes", Whole(1, MOST_VALUES), of)
    successes = check_proportion(flights.get("success"), f"{of}.success", episodes)
    shares = _shares(flights, of)
    if {*shares} != {"all", *rule.strata}:
        raise InputError(f"{of}.shares are of {shown(', '.join(shares))}; judge again")
    for name, share in shares.items():
        check_mean(share, f"{of}.shares.{name}", count=episodes if name == "all" else None)
        if share["count"] > episodes:
            raise InputError(f"{of}.shares.{name} counts more than {episodes} episodes")
    _check_goals(verdict, flights, successes / episodes, of)
    ended = [
        check_proportion(end, f"{of}.ends", episodes)
        for end in as_mapping(flights.get("ends", {}), f"{of}.ends").values()
    ]
    if sum(ended) > episodes:
        raise InputError(f"{of}.ends are of {sum(ended)} episodes, not of {episodes}")
    if "never_reached" in flights:
        check_mean(flights["never_reached"], f"{of}.never_reached", count=episodes)


def _check_goals(
    verdict: Mapping[str, Any], flights: Mapping[str, Any], success: float, of: str
) -> None:
    """Check success rates: a success reaches all goals."""
    goals = read_entry(verdict, "num_cubes", Whole(1, 10_000), "verdict")
    every = float(flights["shares"]["all"]["mean"])
    if not success - _ROUNDING <= every:
        raise InputError(f"{of}: {success:.3f} succeed, but {every:.3f} of all goals are reached")
    if "mean_goals" in flights:
        check_same(flights["mean_goals"], goals * every, f"{of}.mean_goals")
    if "mean_length" in flights and "max_length" in flights:
        longest = read_entry(flights, "max_length", Whole(0, 10**9), of)
        read_entry(flights, "mean_length", Real(0.0, longest), of)


def _quantity(
    verdict: Mapping[str, Any], name: str, thresholds: tuple[float, ...], rule: Rule
) -> Quantity:
    """Check one quantity of the rule against the evaluations that it is computed from."""
    where = f"verdict.quantities.{name}"
    quantities = as_mapping(verdict.get("quantities"), "verdict.quantities")
    given = as_mapping(quantities.get(name), where)
    value, bounds, count = _expected(verdict, name, rule)
    check_same(given.get("value"), value, f"{where}.value")
    lower, upper = (read_entry(given, key, Real(*bounds), where) for key in ("lower", "upper"))
    interval = {"lower95": lower, "upper95": upper}
    if value is not None:
        check_order(interval, value, where)
    if name.startswith("offered "):
        offered = proportion(round((value or 0.0) * count), count, rule.confidence)
        check_width(interval, offered, where)
    else:
        check_mean_width((lower, upper), value, count, bounds, rule.confidence, where)
    count = len(thresholds)
    Several(Real(-1.0, 1.0), count, count).read(given.get("thresholds"), f"{where}.thresholds")
    for one, other in zip(given["thresholds"], thresholds, strict=True):
        check_same(one, other, f"{where}.thresholds")
    return Quantity(value, lower, upper, thresholds)


def _expected(
    verdict: Mapping[str, Any], name: str, rule: Rule
) -> tuple[Any, tuple[float, float], int]:
    """Return the expected value of a quantity, its range, and its number of values."""
    greedy, baselines, good = verdict["greedy"], verdict["baselines"], rule.good_share
    ours, best = (of["success"]["share"] for of in (greedy, baselines["oracle"]))
    every, most = (of["shares"]["all"]["mean"] for of in (greedy, baselines["oracle"]))
    episodes, (kind, _, what) = greedy["episodes"], name.partition(" ")
    if kind == "success":
        return ours - good * best, (-good, 1.0), episodes
    if kind == "offered":
        return greedy["shares"][what]["count"] / episodes, (0.0, 1.0), episodes
    if kind == "collected":
        stratum = greedy["shares"][what]
        return stratum["mean"], (0.0, 1.0), stratum["count"]
    if kind == "above":
        blind = baselines[what]["shares"]["all"]["mean"]
        share = every - (1 - rule.poor_margin) * blind - rule.poor_margin * most
        return share, (-1.0, 1.0), episodes
    rate = baselines[what.removeprefix("by ")]["success"]["share"]
    return good * best - rate, (-1.0, good), episodes


def _check_kind(verdict: Mapping[str, Any], found: list[Quantity], rule: Rule) -> None:
    """Check that the rule gives this kind, and that it is certain."""
    kind = Kind(read_entry(verdict, "kind", _KIND, "verdict"))
    is_certain = read_entry(verdict, "certain", Flag(), "verdict")
    expected = decide([quantity.level for quantity in found], len(rule.strata))
    if kind != expected:
        raise InputError(f"verdict.kind={kind} is not what its figures give ({expected})")
    box = tuple(quantity.levels for quantity in found)
    if is_certain and len(kinds_within(box, len(rule.strata))) > 1:
        raise InputError(f"verdict.certain=true, but its intervals allow for more than {kind}")
    status = read_entry(verdict, "exit_code", Whole(0, 255), "verdict")
    if status != (kind.exit_code if is_certain else NOT_CERTAIN):
        raise InputError(f"verdict.exit_code={status} is not that of its kind; judge again")


def _check_differences(verdict: Mapping[str, Any]) -> None:
    """Check paired differences."""
    greedy = verdict["greedy"]
    for name, gain in as_mapping(verdict.get("skill", {}), "verdict.skill").items():
        mean = check_mean(gain, f"skill.{name[:40]}", (-1.0, 1.0), greedy["episodes"])
        other = as_mapping(verdict["baselines"].get(name), f"baselines.{name[:40]}")
        check_same(
            mean,
            greedy["shares"]["all"]["mean"] - other["shares"]["all"]["mean"],
            f"skill.{name[:40]}",
        )
    if verdict.get("drawing") is not None:
        mean = check_mean(verdict["drawing"], "drawing", (-1.0, 1.0), greedy["episodes"])
        sampled = as_mapping(verdict.get("sampled"), "sampled")
        check_same(mean, sampled["success"]["share"] - greedy["success"]["share"], "drawing.mean")


def _check_proof(verdict: Mapping[str, Any]) -> None:
    """Check what is quoted of a certificate against itself and the greedy episodes."""
    proof = verdict.get("proof")
    if proof is None or as_mapping(proof, "proof").get("refused") is not None:
        return
    episodes = verdict["greedy"]["episodes"]
    parts = [read_entry(proof, k, Real(0.0), "proof") for k in ("share", "lost", "undecided")]
    check_same(sum(parts), 1.0, "the sum of proof.share, lost and undecided")
    agreeing = read_entry(proof, "agreeing", Whole(0, episodes), "proof")
    won = verdict["greedy"]["success"]["successes"]
    is_whole = not (parts[1] or parts[2]) and agreeing == won == episodes
    if read_entry(proof, "every", Flag(), "proof") and not is_whole:
        raise InputError("proof.every=true, but other figures exclude that; judge again")
    if proof.get("wrong_at_most") is not None:
        bound = read_entry(proof, "wrong_at_most", Real(0.0, 1.0), "proof")
        checked = read_entry(proof, "checked", Whole(1, MOST_VALUES), "proof")
        if bound < 1.0 - 0.05 ** (1.0 / checked) - _ROUNDING**2:
            raise InputError(f"proof.wrong_at_most={bound:g} is less than {checked} rollouts show")


def _check_rounding(verdict: Mapping[str, Any]) -> None:
    """Check what is stated of rounding, and the number of episodes that would be enough."""
    if verdict.get("enough") is not None:
        read_entry(verdict, "enough", Whole(verdict["greedy"]["episodes"]), "verdict")
    if verdict.get("rounding") is None:
        return
    found = as_mapping(verdict["rounding"], "rounding")
    for some, of in (("fragile", "frames"), ("fragile_episodes", "episodes")):
        if {some, of, f"{some}_rate"} <= found.keys():
            part, whole = (read_entry(found, key, COUNT, "rounding") for key in (some, of))
            check_same(found[f"{some}_rate"], part / max(1, whole), f"rounding.{some}_rate")
    if verdict["certain"] and (found.get("excessive") or found.get("decides")):
        raise InputError("verdict.certain=true, but rounding can change its kind; judge again")


def _check_failures(verdict: Mapping[str, Any]) -> None:
    """Check the table of failures."""
    failures = as_mapping(verdict["failures"], "failures")
    episodes = verdict["greedy"]["episodes"]
    failed = check_proportion(failures.get("bound"), "failures.bound", episodes)
    greedy = verdict["greedy"]
    least = (1.0 - greedy["shares"]["all"]["mean"]) * episodes  # if each missed every goal
    most = episodes - greedy["success"]["successes"]
    if not least - 1e-3 <= failed <= most + 1e-3:
        raise InputError(f"failures.bound: {failed} failures contradict the goals that were missed")
    rows = failures.get("rows")
    if not isinstance(rows, list) or not 0 < len(rows) <= 1000:
        raise InputError("failures.rows is not a list of at most 1000 rows; judge again")
    for row in rows:
        row = as_mapping(row, "a row of failures")
        share = {**row, "successes": row.get("failed"), "trials": row.get("episodes")}
        check_proportion(share, "a row of failures")
        if row["episodes"] > episodes or row["failed"] > failed:
            raise InputError(f"a row of failures counts more than {failed} of {episodes} episodes")
    if failures.get("largest") is not None and failures["largest"] not in rows:
        raise InputError("failures.largest is none of its rows; judge again")
