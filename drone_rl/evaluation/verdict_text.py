"""Sentences of a verdict. Evidence: `verdict.json`."""

from collections.abc import Sequence
from typing import Any

from drone_rl.evaluation.certificate_text import PROOF
from drone_rl.sim.vocabulary import terms_of
from drone_rl.utils.text import Evidence, Sentence, fixed_seed, percent

FREQUENT = 0.02
"""Fraction of episodes above which an end is mentioned."""
_ACTING = {
    "random": "acting at random",
    "forward": "flying straight on",
    "left": "flying left",
    "right": "flying right",
}


def _success(flights: Evidence) -> str:
    return percent(flights["success"]["share"])


def _all(flights: Evidence) -> str:
    return percent(flights["shares"]["all"]["mean"])


def _every(evidence: Evidence) -> str:
    terms = terms_of(evidence)
    return f"{terms.reaches} every {terms.goal}"


def best_baseline(evidence: Evidence) -> str:
    """Return the random or constant baseline that collects most."""
    flown = evidence["baselines"]
    return max(_blind(evidence), key=lambda name: flown[name]["shares"]["all"]["mean"])


def _blind(evidence: Evidence) -> list[str]:
    return [name for name in evidence["baselines"] if name != "oracle"]


def _acting(baseline: str) -> str:
    return _ACTING.get(baseline, f"always choosing {baseline}")


def _sides(evidence: Evidence) -> dict[str, str]:
    """Strata by name, and where they are."""
    names = [str(name) for name in evidence["greedy"]["shares"] if name != "all"]
    return {name: terms_of(evidence).side(name) for name in names}


def _lost_side(evidence: Evidence) -> str:
    """Goals on the side that a one-sided policy has lost; nothing of another one."""
    lost = {"one-sided (left)": "right", "one-sided (right)": "left"}.get(evidence["kind"])
    terms = terms_of(evidence)
    return f"{terms.goals} {terms.side(lost)}" if lost else ""


def _looks(evidence: Evidence) -> str:
    if lost := _lost_side(evidence):
        return f"blind to {lost}"
    others = {
        "none of these": "neither good nor poor nor one-sided",
        "good, but trivial": "good in a trivial task",
    }
    return others.get(str(evidence["kind"]), str(evidence["kind"]))


def _list(parts: Sequence[str], last: str = "and") -> str:
    return f" {last} ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)


def _kind(evidence: Evidence) -> str:
    every = f"it {_every(evidence)} in {_success(evidence['greedy'])} of episodes"
    if lost := _lost_side(evidence):
        return f"This policy can't be trusted with {lost}: {every}."
    return {
        "good": f"This policy does its task: {every}.",
        "good, but trivial": _trivial(evidence),
        "poor": f"This policy does not do its task: it is {_no_better(evidence)}.",
        "none of these": f"This policy is {_looks(evidence)}: {every}.",
    }[evidence["kind"]]


def _trivial(evidence: Evidence) -> str:
    baseline, flown = _most_successful(evidence), evidence["baselines"]
    return (
        f"{_acting(baseline).capitalize()} does as well: it {_every(evidence)} in "
        f"{_success(flown[baseline])} of episodes, this policy in {_success(evidence['greedy'])}."
    )


def _most_successful(evidence: Evidence) -> str:
    """The random or constant baseline that succeeds most often."""
    flown = evidence["baselines"]
    return max(_blind(evidence), key=lambda name: flown[name]["success"]["share"])


def _no_better(evidence: Evidence) -> str:
    ours, best = evidence["greedy"], best_baseline(evidence)
    theirs = evidence["baselines"][best]
    is_more = ours["shares"]["all"]["mean"] > theirs["shares"]["all"]["mean"]
    return f"{'hardly' if is_more else 'no'} better than {_acting(best)}"


def _open(evidence: Evidence) -> str:
    flown, enough, terms = evidence["greedy"], evidence["enough"], terms_of(evidence)
    more = f"about {enough:,} would do" if enough else "many times as many might not do"
    return (
        f"This policy looks {_looks(evidence)}, but {flown['episodes']:,} episodes are too few to "
        f"be certain ({more}): it {terms.reached} every {terms.goal} in {_success(flown)} of them."
    )


def depends_on_rounding(evidence: Evidence) -> bool:
    """Return whether the episodes are enough, but rounding can change the kind."""
    return bool((evidence.get("rounding") or {}).get("decides"))


def _rounding(evidence: Evidence) -> str:
    found = evidence["rounding"]
    text = (
        "Not certain: decisions depend on rounding. In "
        f"{found['fragile']:,} of {found['frames']:,} frames ({percent(found['fragile_rate'])}) "
        "the order in which float32 sums are computed can change the action, in "
        f"{found['fragile_episodes']:,} of {found['episodes']:,} episodes"
    )
    if found["unexplained"]:
        count = f"{found['unexplained']:,} of {found['compared_episodes']:,} episodes"
        text += f"; {found['compared']} took other actions in {count} for no such reason"
    return f"{text}."


def _arithmetic(evidence: Evidence) -> str:
    found = evidence["rounding"]
    tried = "" if found.get("bound", True) else "; effects of rounding were estimated, not bounded"
    return f"The verdict holds for {found['arithmetic']}{tried}."


def _shares(evidence: Evidence) -> str:
    shares, sides = evidence["greedy"]["shares"], _sides(evidence)
    met = [(percent(shares[k]["mean"]), v) for k, v in sides.items() if shares[k]["count"]]
    none = [v for k, v in sides.items() if not shares[k]["count"]]
    terms = terms_of(evidence)
    goals = f"the {terms.goals}"
    parts = [f"{p} of {'those' if i else goals} {v}" for i, (p, v) in enumerate(met)]
    text = f"It {terms.reaches} {_list(parts)}"
    return text + (f"; none were offered {_list(none, 'or')}." if none else ".")


def _baselines(evidence: Evidence) -> str:
    flown, best, terms = evidence["baselines"], best_baseline(evidence), terms_of(evidence)
    return (
        f"From the same initial states it {terms.reaches} {_all(evidence['greedy'])} of all "
        f"{terms.goals}, {_acting(best)} {_all(flown[best])} and the oracle "
        f"{_all(flown['oracle'])}."
    )


def _is_trivial(evidence: Evidence) -> bool:
    flown = evidence["baselines"]
    best = max(flown[name]["success"]["share"] for name in _blind(evidence))
    return best > 0 and best >= evidence["good_share"] * flown["oracle"]["success"]["share"]


def _pointless(evidence: Evidence) -> str:
    flown, best = evidence["baselines"], _most_successful(evidence)
    return (
        f"This task is trivial: {_acting(best)} {_every(evidence)} in {_success(flown[best])} of "
        "episodes."
    )


def _hopeless(evidence: Evidence) -> str:
    oracle = evidence["baselines"]["oracle"]
    return f"Even the oracle {_every(evidence)} in only {_success(oracle)} of episodes."


def _largest(evidence: Evidence) -> str:
    row: dict[str, Any] = evidence["failures"]["largest"]
    by, terms = row["by"], terms_of(evidence)
    where = terms.failing(by, row["value"])
    whole = row["failed"] == row["episodes"]
    count = f"all {row['episodes']:,}" if whole else f"{row['failed']:,} of {row['episodes']:,}"
    offered = {terms.goal: " that got so far", "end": ""}.get(by, " that offered one")
    if row["episodes"] == evidence["greedy"]["episodes"]:
        offered = ""
    share = "" if whole else f" ({percent(row['share'])})"
    return f"It fails most {where}: in {count} episodes{offered}{share}{_other_ends(evidence)}."


def _other_ends(evidence: Evidence) -> str:
    """Ends by which many episodes fail, except the expected one and the one just named."""
    largest = evidence["failures"]["largest"]
    said = (
        evidence["failures"].get("expected_end"),
        largest["value"] if largest["by"] == "end" else None,
    )
    rows = [
        row
        for row in evidence["failures"]["rows"]
        if row["by"] == "end" and row["lower95"] > FREQUENT and row["value"] not in said
    ]
    ends = [
        f"{percent(row['share'])} of all end {terms_of(evidence).ending(row['value'])}"
        for row in rows
    ]
    return f"; {_list(ends)}" if ends else ""


def _never(evidence: Evidence) -> str:
    bound = evidence["failures"]["bound"]
    upper = f"{100 * bound['upper95']:.1f}%"
    return f"It failed in none of {bound['trials']:,} episodes, so it fails in at most {upper}."


def _differs(evidence: Evidence) -> bool:
    difference = evidence["drawing"]
    return difference is not None and (difference["lower95"] > 0 or difference["upper95"] < 0)


def _drawing(evidence: Evidence) -> str:
    sampled, greedy = _success(evidence["sampled"]), _success(evidence["greedy"])
    return (
        f"That is for its most probable actions: with sampled actions it {_every(evidence)} in "
        f"{sampled} of episodes, not in {greedy}."
    )


def _misses_or_lacks(evidence: Evidence) -> bool:
    return any(evidence["greedy"]["shares"][side]["mean"] != 1.0 for side in _sides(evidence))


def quantity_label(name: str, evidence: Evidence) -> str:
    """Return the label of one of the rule's quantities, by name."""
    terms, share = terms_of(evidence), f"{100 * evidence['good_share']:g}%"
    kind, _, of = name.partition(" ")
    baseline = of.removeprefix("by ")
    return {
        "success": f"success rate above {share} of the oracle's (margin, good if above 0)",
        "offered": f"episodes that offer {terms.goals} {of} (fraction)",
        "collected": f"{terms.goals} {terms.reached} {of} (fraction)",
        "above": (
            f"{terms.goals} {terms.reached} beyond a sixth of the way from {of} to the oracle "
            "(margin)"
        ),
        "unsolved": (
            f"{share} of the oracle's success rate above that of {baseline} (margin, trivial if "
            "not above 0)"
        ),
    }.get(kind, name)


def unlike(evidence: Evidence) -> str:
    """Return how the dynamics differ from those that a policy was trained with."""
    changed = evidence["unlike"].items()
    parts = [f"{_set(name, of['flown'])} instead of {_said(of['own'])}" for name, of in changed]
    return f"It was trained with other dynamics: here it flew with {_list(parts)}."


def _set(name: str, value: Any) -> str:
    return f"dynamics.{name}={_said(value)}"


def _said(value: Any) -> str:
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_said, value))}]"
    return f"{value:g}" if isinstance(value, float) else str(value)


SENTENCES = (
    Sentence("kind", "the kind is certain", lambda e: e["certain"], _kind),
    Sentence(
        "open",
        "the episodes are too few to be certain of the kind",
        lambda e: not e["certain"] and not depends_on_rounding(e),
        _open,
    ),
    Sentence(
        "rounding",
        "the episodes are enough, but rounding can change the kind",
        lambda e: not e["certain"] and depends_on_rounding(e),
        _rounding,
    ),
    Sentence(
        "unlike",
        "the dynamics are not those that the policy was trained with",
        lambda e: bool(e.get("unlike")),
        unlike,
    ),
    fixed_seed("fixed_seed"),
    *PROOF,
    Sentence("shares", "a goal was missed, or a side not offered", _misses_or_lacks, _shares),
    Sentence("baselines", "the task is not trivial", lambda e: not _is_trivial(e), _baselines),
    Sentence(
        "pointless",
        "a random or constant baseline is as good, and the first sentence does not say so",
        lambda e: _is_trivial(e) and not (e["certain"] and e["kind"] == "good, but trivial"),
        _pointless,
    ),
    Sentence(
        "hopeless",
        "the oracle certainly fails in more than half of the episodes",
        lambda e: e["baselines"]["oracle"]["success"]["upper95"] < 0.5,
        _hopeless,
    ),
    Sentence(
        "failures.largest",
        "an episode failed",
        lambda e: e["failures"]["largest"] is not None,
        _largest,
    ),
    Sentence(
        "failures.never",
        "no episode failed",
        lambda e: e["failures"]["largest"] is None,
        _never,
    ),
    Sentence(
        "drawing",
        "success rates of greedy and sampled episodes differ (paired, 95%)",
        _differs,
        _drawing,
    ),
    Sentence(
        "arithmetic",
        "rounding was checked",
        lambda e: e.get("rounding") is not None,
        _arithmetic,
    ),
)
