"""Report text about exact maps and proofs; imports nothing heavy."""

import functools
from collections.abc import Mapping, Sequence
from typing import Any

from drone_rl.sim.vocabulary import shown_actions
from drone_rl.utils.text import Claims, Evidence, all_cubes, exact, listed, percent

WHERE = {"left": "on its left", "ahead": "straight ahead", "right": "on its right"}


exact_percent = functools.partial(percent, digits=2)
"""Returns a known fraction in percent with two decimals."""


def rows(places: Evidence, names: Sequence[str]) -> list[list[str]]:
    """Return a map of actions by positions as rows of a table, one for each side, the header first.

    `places` is "places" of an explanation, or `places.json`.
    """
    head = ["one cube", "share of places", *names, "not seen", "blind"]
    every = {**{n: places[n] for n in ("actions", "unseen", "blind")}, "share": 1.0}
    by_side = {WHERE[s]: of for s, of in places["sides"].items()} | {"anywhere": every}
    return [
        head,
        *(
            [where, *map(exact_percent, (of["share"], *of["actions"], of["unseen"], of["blind"]))]
            for where, of in by_side.items()
        ),
    ]


def say_places(evidence: Evidence) -> Claims:
    """Say what the exact map shows, or why there is none."""
    places = evidence["places"]
    if "refused" in places:
        return {"places.refused": f"There is no exact map of this policy: {places['refused']}."}
    names, window, claims = shown_actions(evidence).names, places["window"], Claims()
    parts, blind = [], []
    for side, of in places["sides"].items():
        needed = "forward" if side == "ahead" else side
        share = of["actions"][names.index(needed)]
        parts.append(f"{needed} for {exact_percent(share)} of those {WHERE[side]}")
        if of["blind"]:
            blind.append(f"{exact_percent(of['blind'])} of those {WHERE[side]}")
    claims["places.does"] = (
        f"With one cube {window['nearest']:g} to {window['farthest']:g} m ahead of its camera and "
        f"up to {window['sideways']:g} m to either side (exact, over all places), it goes "
        f"{listed(parts)}."
    )
    if places["unseen"] > 0:
        claims["places.unseen"] = (
            f"At {exact_percent(places['unseen'])} of the places not one pixel shows the cube."
        )
    if places["blind"] > 0:
        claims["places.blind"] = (
            f"It does not react to {listed(blind)}: a turn is needed, and it goes "
            f"{names[places['alone']]}, as without a cube. It may react when the cube is nearer."
        )
    if places["blind"] == 0:
        claims["places.sees"] = (
            "Wherever a turn is needed, the cube changes its action, or its action without a cube "
            "is that turn."
        )
    return claims | _say_closeness(places)


def _say_closeness(places: Evidence) -> Claims:
    left, claims = places["least_gap_left"], Claims()
    claims["places.gap"] = (
        f"Its two highest logits come closest, to {places['least_gap']:.2g}, with the cube "
        f"{places['least_gap_ahead']:.2f} m ahead and {abs(left):.2f} m to the "
        f"{'left' if left > 0 else 'right'}."
    )
    if places["close"] > 0:
        claims["places.close"] = (
            f"At {exact_percent(places['close'])} of the places they are no farther apart than "
            f"{places['logit_gap']:g}, where rounding may decide between the two actions."
        )
    if places["in_doubt"] > 0:
        claims["places.doubt"] = (
            f"At most {exact_percent(places['in_doubt'])} of the places lie so near to a border "
            "between two images that the renderer, by rounding, may show the other one."
        )
    return claims


def describe_proof(certificate: Mapping[str, Any]) -> str:
    """Summarize a certificate, see `proof_files`, in a sentence that claims only what it proves."""
    task = certificate["policy"]["description"]["task"]
    cubes = all_cubes(task["num_cubes"])
    outcomes, undecided = certificate["outcomes"], certificate["undecided"]
    success = sum(o["share"] for o in outcomes if o["end"] == "all_cubes")
    text = f"Proved: with its most probable actions it collects {cubes} from"
    if not undecided["boxes"] and {o["end"] for o in outcomes} == {"all_cubes"}:
        return f"{text} every placement."
    lost = sum(o["share"] for o in outcomes if o["end"] != "all_cubes")
    lost = exact(lost, is_all=not success and not undecided["boxes"])
    text += f" {exact(success)} of all placements; from {lost} it does not"
    if undecided["boxes"]:
        text += f", and {exact(undecided['share'], is_all=not outcomes)} are undecided"
    if not certificate["finished"]:
        text += f" so far ({why_stopped(certificate['found'].get('stopped_by'))})"
    return text + "."


def why_stopped(setting: str | None) -> str:
    """Return why a proof has not finished and, by the setting that stopped it, the remedy."""
    if setting != "most_boxes":
        return "the proof was stopped"
    return (
        "the proof stopped at most_boxes open boxes; restart it with a smaller most_combinations, "
        "which divides it into smaller parts"
    )


def describe_round(search: Mapping[str, Any]) -> str:
    """Describe the search for failures of one round, see `drone_rl.verification.provable.Round`."""
    text = f"at frame {search['frames']:,}: {search['failures']} of {search['flights']:,} episodes"
    if search["losing"] is None:
        return f"{text} failed"
    losing, undecided = exact(search["losing"]), exact(search["undecided"])
    text += f" failed; proof in {search['proof_s']:.0f} s: fails from {losing} of all placements"
    return f"{text}, {undecided} undecided"
