"""Report section "places": the exact map of the action over one cube's place."""

from collections.abc import Sequence
from typing import Any

from drone_rl.explanations.report.explanation import Explanation, Figures, Part
from drone_rl.sim.vocabulary import shown_actions
from drone_rl.trust.plots import regions
from drone_rl.utils.text import Claims, Evidence, exact_percent, listed

WHERE = {"left": "on its left", "ahead": "straight ahead", "right": "on its right"}


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
    if places["blind"] == 0 and {"left", "right"} & places["sides"].keys():
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


def draw_places(explanation: Explanation) -> Figures:
    """Draw the exact map, if there is one."""
    places = explanation.numbers["places"]
    if "refused" in places:
        return {}
    outlines = {n: explanation.arrays[f"places_{n}"] for n in ("points", "ends", "labels")}
    return {"places": regions.chart(places, outlines, explanation.actions)}


def _extras(explanation: Explanation) -> dict[str, Any]:
    places = explanation.numbers["places"]
    return {} if "refused" in places else {"rows": rows(places, explanation.actions.names)}


PART = Part(
    title="Exact action map of one cube",
    label="Exact map",
    needs=("places",),
    text={"places": say_places},
    draw=draw_places,
    extras=_extras,
)
