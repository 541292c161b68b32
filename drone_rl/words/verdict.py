"""What a verdict says. Evidence: `verdict.json`."""

from typing import Any

from drone_rl.words.licence import Evidence, Sentence, percent

FREQUENT = 0.05
"""An end is worth a word if surely more than this share of episodes end so."""
_LUCK = {
    "random": "acting at random",
    "forward": "flying straight on",
    "left": "flying left",
    "right": "flying right",
}
_SIDES = {"left": "on its left", "ahead": "ahead", "right": "on its right"}
_ENDS = {
    "front_boundary": "behind the last cube",
    "side_boundary": "outside the field, left or right",
    "step_limit": "at the step limit",
}
_EXPECTED_END = "front_boundary"
"""Where an episode ends that has passed a cube and flown on: no news."""


def _success(flights: Evidence) -> str:
    return percent(flights["success"]["share"])


def _cubes(flights: Evidence) -> str:
    return percent(flights["shares"]["all"]["mean"])


def best_luck(evidence: Evidence) -> str:
    """The baseline that sees nothing and collected most."""
    flown = evidence["baselines"]
    return max(_LUCK, key=lambda name: flown[name]["shares"]["all"]["mean"])


def _kind(evidence: Evidence) -> str:
    kind = evidence["kind"]
    every = f"it collects every cube in {_success(evidence['greedy'])} of episodes"
    blind = {"one-sided (left)": "right", "one-sided (right)": "left"}.get(kind)
    if blind:
        return f"This policy can't be trusted with cubes on its {blind}: {every}."
    return {
        "good": f"This policy does its task: {every}.",
        "poor": f"This policy does not do its task, no better than luck or hardly so: {every}.",
        "none of these": f"This policy is neither good nor poor nor one-sided: {every}.",
    }[kind]


def _open(evidence: Evidence) -> str:
    flown, enough = evidence["greedy"], evidence["enough"]
    more = f"about {enough:,} would do" if enough else "even many times as many might not do"
    return (
        f"Whether this policy is {evidence['kind']!r} is not certain after {flown['episodes']:,} "
        f"episodes ({more}): it collected every cube in {_success(flown)} of them."
    )


def _shares(evidence: Evidence) -> str:
    shares = evidence["greedy"]["shares"]
    met = [f"{percent(shares[k]['mean'])} {v}" for k, v in _SIDES.items() if shares[k]["count"]]
    none = [v for k, v in _SIDES.items() if not shares[k]["count"]]
    text = f"Of the cubes that it met it collects {_list(met)}"
    return text + (f"; none were offered {_list(none, 'or')}." if none else ".")


def _list(parts: list[str], last: str = "and") -> str:
    return f" {last} ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)


def _baselines(evidence: Evidence) -> str:
    flown, luck = evidence["baselines"], best_luck(evidence)
    return (
        f"In the same worlds it collects {_cubes(evidence['greedy'])} of all cubes, "
        f"{_LUCK[luck]} {_cubes(flown[luck])}, the oracle {_cubes(flown['oracle'])}."
    )


def _luck_suffices(evidence: Evidence) -> bool:
    flown = evidence["baselines"]
    luck = max(flown[name]["success"]["share"] for name in _LUCK)
    return luck > 0 and luck >= evidence["good_share"] * flown["oracle"]["success"]["share"]


def _pointless(evidence: Evidence) -> str:
    flown = evidence["baselines"]
    luck = max(_LUCK, key=lambda name: flown[name]["success"]["share"])
    return (
        f"That proves little, for luck is enough here: {_LUCK[luck]} collects every cube in "
        f"{_success(flown[luck])} of episodes."
    )


def _hopeless(evidence: Evidence) -> str:
    oracle = evidence["baselines"]["oracle"]
    return f"Even the oracle collects every cube in only {_success(oracle)} of episodes."


def _largest(evidence: Evidence) -> str:
    row: dict[str, Any] = evidence["failures"]["largest"]
    by, value = row["by"], row["value"]
    which, of = {
        "cube": (f"at the {value} cube", "that got so far"),
        "side": (f"with cubes {_SIDES.get(value, value)}", "that offered one"),
        "sideways": (f"with cubes {value} to its side", "that offered one"),
        "height": (f"with cubes {_HEIGHTS.get(value, value)}", "that offered one"),
        "end": (f"by ending {_ENDS.get(value, value)}", "in all"),
    }[by]
    return (
        f"It fails most {which}: in {row['failed']} of the {row['episodes']} episodes {of} "
        f"({percent(row['share'])}){_other_ends(evidence)}."
    )


_HEIGHTS = {
    "lower": "lower than itself",
    "level": "at its own height",
    "higher": "higher than itself",
}


def _other_ends(evidence: Evidence) -> str:
    """Ends by which many episodes fail, but for the usual one and what has just been said."""
    largest = evidence["failures"]["largest"]
    rows = [
        row
        for row in evidence["failures"]["rows"]
        if row["by"] == "end" and row["lower95"] > FREQUENT and row["value"] != _EXPECTED_END
    ]
    rows = [row for row in rows if (row["by"], row["value"]) != (largest["by"], largest["value"])]
    ends = [f"{percent(row['share'])} of all end {_ENDS[row['value']]}" for row in rows]
    return f"; {_list(ends)}" if ends else ""


def _never(evidence: Evidence) -> str:
    bound = evidence["failures"]["bound"]
    upper = f"{100 * bound['upper95']:.1f}%"
    return f"It failed in none of {bound['trials']:,} episodes, so it fails in at most {upper}."


def _differs(evidence: Evidence) -> bool:
    found = evidence["drawing"]
    return found is not None and (found["lower95"] > 0 or found["upper95"] < 0)


def _drawing(evidence: Evidence) -> str:
    sampled, greedy = _success(evidence["sampled"]), _success(evidence["greedy"])
    return (
        f"That holds for its most probable actions only: with actions drawn by their "
        f"probabilities every cube is collected in {sampled} of episodes, not {greedy}."
    )


SENTENCES = (
    Sentence("kind", "the kind is certain", lambda e: e["certain"], _kind),
    Sentence("open", "the kind is not certain", lambda e: not e["certain"], _open),
    Sentence(
        "shares",
        "not every cube that was met was collected, or a side was not offered",
        lambda e: any(e["greedy"]["shares"][side]["mean"] != 1.0 for side in _SIDES),
        _shares,
    ),
    Sentence(
        "baselines",
        "luck is not enough",
        lambda e: not _luck_suffices(e),
        _baselines,
    ),
    Sentence(
        "pointless",
        "some luck succeeds in the share of the oracle's episodes that makes a policy good",
        _luck_suffices,
        _pointless,
    ),
    Sentence(
        "hopeless",
        "the oracle surely succeeds in less than half of the episodes",
        lambda e: e["baselines"]["oracle"]["success"]["upper95"] < 0.5,
        _hopeless,
    ),
    Sentence(
        "failures.largest",
        "some episode failed",
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
        "greedy and sampled flights surely differ in how many succeed (paired, 95%)",
        _differs,
        _drawing,
    ),
)
