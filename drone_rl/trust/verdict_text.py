"""Sentences of a verdict. Evidence: `verdict.json`."""

import json
from collections.abc import Callable
from typing import Any

from drone_rl.sim.vocabulary import terms_of
from drone_rl.utils.text import (
    Evidence,
    Sentence,
    all_cubes,
    exact,
    fixed_seed,
    hundredfold,
    listed,
    percent,
)

MAX_WRONG = 0.01
"""Largest fraction of placements with a wrong statement, with 95% confidence."""
FREQUENT = 0.02
"""Fraction of episodes above which an end is mentioned."""
_ACTING = {
    "random": "acting at random",
    "forward": "flying straight on",
    "left": "flying left",
    "right": "flying right",
}
_MAX_NAMED = 4
"""Greatest number of items in a sentence; the last one counts the settings that do not fit."""


def is_quoted(evidence: Evidence) -> bool:
    """Return whether a certificate is quoted."""
    return bool(proof := evidence.get("proof")) and proof["refused"] is None


def is_stated(evidence: Evidence) -> bool:
    """Return whether the certificate states success from every placement."""
    return is_quoted(evidence) and evidence["proof"]["every"]


def is_proved(evidence: Evidence) -> bool:
    """Return whether a certificate states so, and enough rollouts re-checked it."""
    bound = evidence["proof"].get("wrong_at_most") if is_stated(evidence) else None
    return bound is not None and bound <= MAX_WRONG


def _fraction(evidence: Evidence) -> str:
    proof, cubes = evidence["proof"], all_cubes(evidence["num_cubes"])
    share, lost, undecided = (proof[name] for name in ("share", "lost", "undecided"))
    so_far = "" if proof["finished"] else " so far, for the proof was stopped"
    text = (
        f"A certificate states{so_far}: with its most probable actions it collects {cubes} from "
        f"{exact(share)} of all placements; from "
        f"{exact(lost, is_all=share == undecided == 0)} it does not"
    )
    if undecided:
        text += f", and {exact(undecided, is_all=share == lost == 0)} is undecided"
    return f"{text}."


def _basis(evidence: Evidence) -> str:
    agreeing = evidence["proof"]["agreeing"]
    own = f" All {agreeing:,} greedy episodes of this verdict whose end it states ended that way."
    return (
        "The certificate is of this network and task, and its boxes are a partition of the "
        f"placements. {_checked(evidence['proof'])}{own if agreeing else ''}"
    )


def _checked(proof: Evidence) -> str:
    bound = proof.get("wrong_at_most")
    if bound is None:
        return "It was read from its file and not re-checked, so it proves nothing here."
    fitted = ", to which a certificate could have been fitted" if proof["seed_is_fixed"] else ""
    start = "placements of the fixed" if proof["seed_is_fixed"] else "fresh placements,"
    text = (
        f"It was re-checked by {proof['checked']:,} rollouts from {start} seed {proof['seed']}"
        f"{fitted}: all ended as it states, so that with 95% confidence it is wrong about at most "
        f"{100 * bound:.2g}% of the placements"
    )
    if bound > MAX_WRONG:
        return f"{text}, which is too much for a proof."
    return f"{text} (to prove it again, run drone-rl prove)."


PROOF = (
    Sentence(
        "proof.every",
        "a valid certificate states so, and no episode contradicts it",
        is_stated,
        lambda e: (
            "A certificate states for every placement: with its most probable actions it collects "
            f"{all_cubes(e['num_cubes'])} from all places where they may stand."
        ),
    ),
    Sentence(
        "proof.share",
        "the same, but some placements are lost or undecided",
        lambda e: is_quoted(e) and not e["proof"]["every"],
        _fraction,
    ),
    Sentence("proof.basis", "a certificate is quoted", is_quoted, _basis),
    Sentence(
        "proof.refused",
        "a certificate is refused",
        lambda e: e.get("proof") is not None and not is_quoted(e),
        lambda e: f"A certificate is not quoted: {e['proof']['refused']}.",
    ),
)


def _success(flights: Evidence) -> str:
    return percent(flights["success"]["share"])


def _all(flights: Evidence) -> str:
    return percent(flights["shares"]["all"]["mean"])


def _every(evidence: Evidence) -> str:
    terms = terms_of(evidence)
    return f"{terms.reaches} every {terms.goal}"


def best_baseline(evidence: Evidence, figure: Callable[[Evidence], float] | None = None) -> str:
    """Return the random or constant baseline that collects most, or with the greatest figure."""
    figure = figure or (lambda figures: figures["shares"]["all"]["mean"])
    blind = {name: figure(f) for name, f in evidence["baselines"].items() if name != "oracle"}
    return max(blind, key=lambda name: blind[name])


def _acting(baseline: str) -> str:
    return _ACTING.get(baseline, f"always choosing {baseline}")


def _sides(evidence: Evidence) -> dict[str, str]:
    """Strata by name, and where they are."""
    names = [str(name) for name in evidence["greedy"]["shares"] if name != "all"]
    return {name: terms_of(evidence).side(name) for name in names}


def _lost_side(evidence: Evidence) -> str:
    """Goals on the side where a one-sided policy fails, else empty."""
    ends = {"one-sided (left)": ("right", -1), "one-sided (right)": ("left", 0)}
    if evidence["kind"] not in ends:
        return ""
    (name, place), names = ends[evidence["kind"]], [*_sides(evidence)]
    terms = terms_of(evidence)
    return f"{terms.goals} {terms.side(name if name in names else names[place])}"


def _looks(evidence: Evidence) -> str:
    if lost := _lost_side(evidence):
        return f"blind to {lost}"
    return {
        "none of these": "neither good nor poor nor one-sided",
        "good, but trivial": "good in a trivial task",
    }.get(evidence["kind"], str(evidence["kind"]))


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
    baseline, figures = _most_successful(evidence), evidence["baselines"]
    ours, theirs = (f["success"]["share"] for f in (evidence["greedy"], figures[baseline]))
    is_as_good = theirs >= evidence["good_share"] * ours
    does = "does as well" if is_as_good else "is good by this rule, too"
    return (
        f"{_acting(baseline).capitalize()} {does}: it {_every(evidence)} in "
        f"{_success(figures[baseline])} of episodes, this policy in {_success(evidence['greedy'])}."
    )


def _most_successful(evidence: Evidence) -> str:
    return best_baseline(evidence, lambda figures: figures["success"]["share"])


def _no_better(evidence: Evidence) -> str:
    ours, best = evidence["greedy"], best_baseline(evidence)
    theirs = evidence["baselines"][best]
    is_more = ours["shares"]["all"]["mean"] > theirs["shares"]["all"]["mean"]
    return f"{'hardly' if is_more else 'no'} better than {_acting(best)}"


def _open(evidence: Evidence) -> str:
    greedy, enough, terms = evidence["greedy"], evidence["enough"], terms_of(evidence)
    more = f"about {enough:,} would do" if enough else "many times as many might not do"
    return (
        f"This policy looks {_looks(evidence)}, but {greedy['episodes']:,} episodes are too few to "
        f"be certain ({more}): it {terms.reached} every {terms.goal} in {_success(greedy)} of them."
    )


def depends_on_rounding(evidence: Evidence) -> bool:
    """Return whether the episodes are enough, but too many decisions depend on rounding."""
    return bool((evidence.get("rounding") or {}).get("decides"))


def _rounding(evidence: Evidence) -> str:
    check = evidence["rounding"]
    text = (
        "Not certain: decisions depend on rounding. In "
        f"{check['fragile']:,} of {check['frames']:,} frames ({percent(check['fragile_rate'])}) "
        "the order in which float32 sums are computed can change the action, in "
        f"{check['fragile_episodes']:,} of {check['episodes']:,} episodes"
    )
    if check["unexplained"]:
        count = f"{check['unexplained']:,} of {check['compared_episodes']:,} episodes"
        took = "took other actions" if check.get("bound", True) else "gave other results"
        text += f"; {check['compared']} {took} in {count} for no such reason"
    return f"{text}."


def _arithmetic(evidence: Evidence) -> str:
    check = evidence["rounding"]
    tried = "" if check.get("bound", True) else "; effects of rounding were estimated, not bounded"
    return f"The verdict holds for {check['arithmetic']}{tried}."


def _shares(evidence: Evidence) -> str:
    shares, sides = evidence["greedy"]["shares"], _sides(evidence)
    met = [(percent(shares[k]["mean"]), v) for k, v in sides.items() if shares[k]["count"]]
    none = [v for k, v in sides.items() if not shares[k]["count"]]
    terms = terms_of(evidence)
    goals = f"the {terms.goals}"
    parts = [f"{p} of {'those' if i else goals} {v}" for i, (p, v) in enumerate(met)]
    if not met:
        return f"No {terms.goals} were offered {listed(none, 'or')}."
    text = f"It {terms.reaches} {listed(parts)}"
    return text + (f"; none were offered {listed(none, 'or')}." if none else ".")


def _baselines(evidence: Evidence) -> str:
    figures, best, terms = evidence["baselines"], best_baseline(evidence), terms_of(evidence)
    return (
        f"From the same initial states it {terms.reaches} {_all(evidence['greedy'])} of all "
        f"{terms.goals}, {_acting(best)} {_all(figures[best])} and the oracle "
        f"{_all(figures['oracle'])}."
    )


def _is_trivial(evidence: Evidence) -> bool:
    figures = evidence["baselines"]
    best = figures[_most_successful(evidence)]["success"]["share"]
    return best > 0 and best >= evidence["good_share"] * figures["oracle"]["success"]["share"]


def _pointless(evidence: Evidence) -> str:
    best = _most_successful(evidence)
    rate = _success(evidence["baselines"][best])
    return f"This task is trivial: {_acting(best)} {_every(evidence)} in {rate} of episodes."


def _largest(evidence: Evidence) -> str:
    row: dict[str, Any] = evidence["failures"]["largest"]
    by, terms = row["by"], terms_of(evidence)
    whole = row["failed"] == row["episodes"]
    count = f"all {row['episodes']:,}" if whole else f"{row['failed']:,} of {row['episodes']:,}"
    offered = {terms.goal: " that got so far", "end": ""}.get(by, " that offered one")
    if row["episodes"] == evidence["greedy"]["episodes"]:
        offered = ""
    count += f" episodes{offered}" + ("" if whole else f" ({percent(row['share'])})")
    return f"It fails most {terms.failing(by, row['value'])}: in {count}{_other_ends(evidence)}."


def _other_ends(evidence: Evidence) -> str:
    """Ends by which many episodes fail, except the expected one and the one just named."""
    largest = evidence["failures"]["largest"]
    named = largest["value"] if largest["by"] == "end" else None
    said = (evidence["failures"].get("expected_end"), named)
    rows = [
        row
        for row in evidence["failures"]["rows"]
        if row["by"] == "end" and row["lower95"] > FREQUENT and row["value"] not in said
    ]
    terms = terms_of(evidence)
    ends = [f"{percent(row['share'])} of all end {terms.ending(row['value'])}" for row in rows]
    return f"; {listed(ends)}" if ends else ""


def _never(evidence: Evidence) -> str:
    bound = evidence["failures"]["bound"]
    upper = f"{hundredfold(bound['upper95'])}% (95% CI)"
    return f"It failed in none of {bound['trials']:,} episodes, so it fails in at most {upper}."


def _sampled_difference(evidence: Evidence) -> str:
    sampled, greedy = _success(evidence["sampled"]), _success(evidence["greedy"])
    return (
        f"That is for its most probable actions: with sampled actions it {_every(evidence)} in "
        f"{sampled} of episodes, not in {greedy}."
    )


def unlike(evidence: Evidence) -> str:
    """Return how dynamics and appearance (dotted names) differ from those of training."""
    differences = evidence["unlike"]
    parts = [
        f"{name if '.' in name else f'dynamics.{name}'}={_said(of['flown'])} instead of "
        f"{_said(of['own'])}"
        for name, of in differences.items()
    ]
    if len(parts) > _MAX_NAMED:
        parts[_MAX_NAMED - 1 :] = [f"{len(parts) - _MAX_NAMED + 1} other changed settings"]
    moved = [] if all("." in name for name in differences) else ["other dynamics"]
    seen = ["another appearance"] if any("." in name for name in differences) else []
    return f"It was trained with {listed(moved + seen)}: here it flew with {listed(parts)}."


def _said(value: Any) -> str:
    """Return a value as one types it in a setting."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_said, value))}]"
    if isinstance(value, float):
        return f"{value:.12g}"  # without ".0"
    return value if isinstance(value, str) else json.dumps(value)


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
        "the episodes are enough, but too many decisions depend on rounding",
        lambda e: not e["certain"] and depends_on_rounding(e),
        _rounding,
    ),
    Sentence(
        "unlike",
        "dynamics or appearance are not those that the policy was trained with",
        lambda e: bool(e.get("unlike")),
        unlike,
    ),
    fixed_seed("fixed_seed"),
    *PROOF,
    Sentence(
        "shares",
        "a goal was missed, or a side not offered",
        lambda e: any(e["greedy"]["shares"][side]["mean"] != 1.0 for side in _sides(e)),
        _shares,
    ),
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
        lambda e: (
            f"Even the oracle {_every(e)} in only {_success(e['baselines']['oracle'])} of episodes."
        ),
    ),
    Sentence(
        "failures.largest",
        "an episode failed in a way that the table names",
        lambda e: e["failures"]["largest"] is not None,
        _largest,
    ),
    Sentence(
        "failures.never",
        "no episode failed",
        lambda e: not e["failures"]["bound"]["successes"] and e["failures"]["largest"] is None,
        _never,
    ),
    Sentence(
        "drawing",
        "success rates of greedy and sampled episodes differ (paired, 95%)",
        lambda e: (
            bool(e["drawing"]) and not e["drawing"]["lower95"] <= 0 <= e["drawing"]["upper95"]
        ),
        _sampled_difference,
    ),
    Sentence(
        "unchecked",
        "rounding was not checked",
        lambda e: "rounding" in e and e["rounding"] is None,
        lambda e: "Whether rounding could change actions was not checked.",
    ),
    Sentence(
        "arithmetic",
        "rounding was checked",
        lambda e: e.get("rounding") is not None,
        _arithmetic,
    ),
)
