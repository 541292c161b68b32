"""Report section "truth": tests of heat maps, and the effects of changes to a scene."""

import textwrap
from collections.abc import Callable, Collection, Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from drone_rl.explanations.report.explanation import METHOD_NAMES, Explanation, Part
from drone_rl.sim.vocabulary import terms_of
from drone_rl.trust.plots import images
from drone_rl.trust.plots.saving import new_chart
from drone_rl.utils.palette import (
    FAINT,
    GOOD,
    GROUND,
    INK,
    MUTED,
    NEXT_CUBE,
    OTHER_CUBES,
    SKY,
    css,
)
from drone_rl.utils.text import Claims, Evidence, bounds, listed, percent, plural

_KINDS = {"deletion": "lower is better", "insertion": "higher is better"}
_DASHES = ("-", "--", "-.", ":", (0, (1, 1)))
_REGION_COLORS = [css(color) for color in (NEXT_CUBE, OTHER_CUBES, INK, GROUND, SKY)]
_UNMOVED = "no patch of any frame\naffects this policy"


def _name(method: str) -> str:
    return METHOD_NAMES.get(method, method)


def _color(method: Mapping[str, Any]) -> str:
    return css(GOOD if method.get("trusted") else FAINT)


def truth_charts(explanation: Explanation) -> dict[str, Figure]:
    """Plot the scores of methods and placebos, and the tests that a method must pass."""
    truth = explanation.numbers["truth"]
    scores, axis = new_chart(height=1.2 + 0.3 * (len(truth["methods"]) + len(truth["placebos"])))
    _scores(axis, truth)
    charts = {"scores of methods and placebos": scores}
    tests = (
        ("placebos", 0.0, "score above its strongest placebo\n(must be above 0)"),
        ("pointing", 0.0, "hits above chance\n(must be above 0)"),
        ("likeness", 0.5, "similarity on shuffled weights\n(must be below 0.5)"),
    )
    for test, bar, title in tests:
        of = _hardest if test == "placebos" else lambda method, test=test: method.get(test)
        charts[title.replace("\n", " ")], axis = new_chart()
        _test(axis, truth["methods"], of, bar)
        if not axis.lines[:-1] and not axis.texts:
            why = _UNMOVED if truth["methods"] else "no method was tested"
            axis.text(0.5, 0.5, why, ha="center", va="center", transform=axis.transAxes)
        axis.set_title(title, fontsize=11)
    return charts


def _scores(axis: Axes, truth: Mapping[str, Any]) -> None:
    placebos = sorted(truth["placebos"].items(), key=lambda item: -(item[1]["mean"] or 0.0))
    rows = [(_name(n), m["score"], _color(m)) for n, m in truth["methods"].items()]
    rows += [(f"placebo: {n}", score, css(MUTED)) for n, score in placebos]
    for y, (_, score, color) in enumerate(rows[::-1]):
        if score["mean"] is None:
            continue
        axis.barh(y, score["mean"], color=color, height=0.65)
        axis.plot([score["lower95"], score["upper95"]], [y, y], color="black", lw=1.5)
    if all(score["mean"] is None for _, score, _ in rows):
        axis.text(0.25, len(rows) / 2 - 0.5, _UNMOVED, ha="center", va="center")
    axis.axvline(0, color=css(MUTED), lw=1)
    names = [textwrap.fill(name, 26) for name, *_ in rows[::-1]]
    axis.set(xlim=(-0.5, 1), ylim=(-0.6, len(rows) - 0.4))
    axis.set_yticks(range(len(rows)), names, fontsize=8)
    axis.set_title(
        "agreement with the patches that affect\nthe policy (score; chance: 0; line: 95%)",
        fontsize=11,
    )


def _hardest(method: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Return the comparison with the placebo that the method beats least reliably."""
    comparisons = method.get("placebos", {}).values()
    return min(comparisons, key=lambda b: -1.0 if b["lower"] is None else b["lower"], default=None)


def _test(
    axis: Axes,
    methods: Mapping[str, Mapping[str, Any]],
    of: Callable[[Mapping[str, Any]], Mapping[str, Any] | None],
    bar: float,
) -> None:
    """Plot the median and the bounds of one test for each method, the first on top."""
    for y, method in enumerate([*methods.values()][::-1]):
        test = of(method)
        if test is not None and test["lower"] is None:
            axis.text(bar, y, " too few episodes", va="center", fontsize=9)
        elif test is not None:
            axis.plot([test["lower"], test["upper"]], [y, y], color="black", lw=1.5)
            axis.plot(test["median"], y, "o", color=_color(method))
    axis.axvline(bar, color=css(INK), ls="--", lw=1.2)
    names = [_name(method) for method in [*methods][::-1]]
    axis.set(yticks=range(len(names)), yticklabels=names, ylim=(-0.6, max(len(names), 1) - 0.4))


def heat_chart(explanation: Explanation) -> Figure:
    """Plot the fraction of each method's heat in each region of the frame."""
    figure, axis = new_chart()
    heat = explanation.numbers["truth"]["heat"]
    first, *_ = heat.values()
    bars = [*((shares, "share") for shares in heat.values()), (first, "chance")]
    for y, (shares, of) in zip(range(len(heat), -1, -1), bars, strict=True):
        left = 0.0
        for region, color in zip(first, _REGION_COLORS, strict=True):
            value = shares[region][of]["mean"] or 0.0
            label = region.replace("_", " ") if of == "chance" else None
            axis.barh(y, value, left=left, color=color, height=0.7, label=label)
            left += value
        if not left:
            axis.text(0.5, y, "no heat", ha="center", va="center")
    names = ["the pixels", *(_name(method) for method in reversed(heat))]
    axis.set(yticks=range(len(names)), yticklabels=names, xlim=(0, 1))
    figure.legend(loc="outside lower center", ncols=3, fontsize=9, frameon=False)
    return figure


def curves_charts(explanation: Explanation) -> dict[str, Figure]:
    """Plot the mean effect of each patch, and deletion and insertion by action."""
    curves, actions = explanation.numbers["truth"]["curves"], explanation.actions
    trusted = {n for n, m in explanation.numbers["truth"]["methods"].items() if m.get("trusted")}
    title = "mean effect of each patch on the policy"
    figure, axis = new_chart()
    charts = {title: figure}
    _effects(axis, explanation)
    axis.set_title(title, fontsize=11)
    for kind, better in _KINDS.items():
        for action in (actions.names[action] for action in actions.order):
            figure, axis = new_chart(height=4.2)
            _curves(axis, curves, action, kind, trusted)
            charts[f"{action}, {kind} ({better})"] = figure
            axis.set_title(f"{action}, {kind} ({better})", fontsize=11)
            figure.legend(loc="outside lower center", ncols=2, fontsize=9, frameon=False)
    return charts


def _effects(axis: Axes, explanation: Explanation) -> None:
    effects = explanation.arrays["patch_effects"]
    image = axis.imshow(effects, cmap="magma", vmin=0, vmax=max(float(effects.max()), 1e-6))
    axis.set(xticks=[], yticks=[])
    if not effects.any():
        axis.text(0.5, 0.5, _UNMOVED, color="white", ha="center", va="center",
                  transform=axis.transAxes)  # fmt: skip
    axis.figure.colorbar(image, ax=axis, shrink=0.8, location="bottom")


def _curves(
    axis: Axes, curves: Mapping[str, Any], action: str, kind: str, trusted: Collection[str]
) -> None:
    share = 100 * np.array(curves["shares"])
    dashes = dict(zip(METHOD_NAMES, _DASHES, strict=True))
    methods = {name: by_action[action] for name, by_action in curves.items() if name != "shares"}
    named_placebo = False
    for name, found in methods.items():
        curve = found[kind]["curve"]
        points = curve if curve is not None else np.full(len(share), np.nan)
        if name in METHOD_NAMES:
            color = css(GOOD if name in trusted else INK)
            axis.plot(share, points, ls=dashes[name], color=color, label=METHOD_NAMES[name])
        else:
            label = None if named_placebo else "placebos"
            axis.plot(share, points, color=css(MUTED), lw=0.7, label=label, zorder=0)
            named_placebo = True
    axis.set_xscale("symlog", linthresh=1)
    axis.set(xlim=(0, 100), ylim=(-0.02, 1.02), xlabel="% of the pixels", ylabel="P(chosen action)")
    axis.set_xticks([0, 1, 3, 10, 30, 100], ["0", "1", "3", "10", "30", "100"])
    if all(found["frames"] == 0 for found in methods.values()):
        axis.text(10, 0.5, f"{action} is never taken\nin the tested frames", ha="center")


_FAILED = {
    "pointing": "its hottest patch does not reliably affect the policy more often than chance",
    "likeness": "it does not reliably change when the weights are shuffled",
    "random weights": "it scores as well on shuffled weights",
}


def best_placebo(truth: Mapping[str, Any]) -> str:
    """Return the name of the placebo map with the highest score."""
    return max(truth["placebos"], key=lambda name: truth["placebos"][name]["mean"])


def say_findings(evidence: Evidence) -> Claims:
    """Say what the tests of heat maps, the rollouts and the changes of scenes show."""
    return {**_say_tests(evidence), **_say_outcomes(evidence), **_say_effects(evidence)}


def _say_tests(evidence: Evidence) -> Claims:
    truth, claims = evidence["truth"], Claims()
    affects_any = truth["frames"] > 0
    if (name := truth["trusted"]) is not None:
        method, rival = truth["methods"][name], best_placebo(truth)
        score, pointing = method["score"], method["pointing"]
        claims["truth.trusted"] = (
            f"The heat map to trust is {_name(name)}: it shows which patches of a frame affect the "
            f"policy (score {score['mean']:.2f}, {bounds(score)}) reliably better than every map "
            f"that does not use the policy (the best on the same frames, {rival!r}: "
            f"{truth['placebos'][rival]['mean']:.2f}), and it depends on the weights."
        )
        claims["truth.hits"] = (
            "Its hottest patch is one of those that affect the policy most in "
            f"{percent(pointing['hit'])} of these frames (chance: "
            f"{percent(pointing['chance'])})."
        )
    elif affects_any:
        claims["truth.none"] = "No heat map of this policy can be trusted."
    if not affects_any:
        claims["truth.unmoved"] = (
            "No change of a part of these frames affects this policy, so no heat map of it could "
            "be verified: trust none."
        )
    elif not truth["methods"]:
        claims["truth.untested"] = (
            "No method could be tested: whether a map depends on the weights can't be measured "
            "where they are unknown. Give the policy as a torch module."
        )
    if affects_any and (unmoved := truth["frames_unmoved"]) > 0:
        claims["truth.left_out"] = (
            f"Of {truth['frames'] + unmoved} frames {unmoved} are left out, since no part of them "
            "affects the policy."
        )
    return claims


def _say_outcomes(evidence: Evidence) -> Claims:
    outcomes, terms, claims = evidence["truth"].get("outcomes"), terms_of(evidence), Claims()
    if outcomes is None:
        return claims
    follows, ground = outcomes["follows"], outcomes["ground_changed"]
    if terms.follows and _is_above(follows["lower95"], 0):
        claims["truth.follows"] = (
            f"When the next {terms.target} is moved sideways, "
            f"{plural(outcomes['flights'], 'rollout')} from these frames follow it by "
            f"{follows['mean']:.2f} m per metre ({bounds(follows)})."
        )
    elif terms.follows:
        claims["truth.follows_not"] = (
            f"When the next {terms.target} is moved sideways, rollouts from these frames do not "
            f"reliably follow it ({follows['mean']:.2f} m per metre, {bounds(follows)})."
        )
    claims["truth.ground"] = (
        "Another ground color, which should not matter, changes the outcome of "
        f"{percent(ground['mean'])} of the rollouts from these frames (upper 95% limit: "
        f"{percent(ground['upper95'])})."
    )
    return claims


def _say_effects(evidence: Evidence) -> Claims:
    truth, claims = evidence["truth"], Claims()
    taken, patch = (
        truth["interventions"][name] for name in ("target taken away", "ground patch changed")
    )
    if patch["upper95"] is not None:
        claims["truth.patch"] = (
            "A patch of ground, which should not matter, changes the action probabilities by no "
            f"more than {patch['upper95']:.2f} of 1 on average (95%)."
        )
        if _is_above(taken["lower95"], patch["upper95"]):
            claims["truth.target"] = (
                f"Removing the next {terms_of(evidence).target} changes the action probabilities "
                f"by {taken['mean']:.2f} of 1 ({bounds(taken)}), reliably more than a patch of "
                "ground does."
            )
    if (error := truth["integration_error"]) is not None:
        claims["truth.integral"] = (
            "Integrated gradients differ from the change in probability that they must add up to "
            f"by {error['mean']:.4f} on average and {error['max']:.4f} at most, on "
            f"{plural(error['pictures'], 'frame')}."
        )
    return claims


def say_reasons(evidence: Evidence) -> Claims:
    """Say why methods are not trusted; the page shows it only on request."""
    truth = evidence["truth"]
    refused = [
        f"{_name(name)} ({'; '.join(_reason(result, test) for test in result['failed'])})"
        for name, result in truth["methods"].items()
        if not result["trusted"]
    ]
    is_said = truth["frames"] > 0 and refused
    return {"truth.refused": f"Not trusted: {listed(refused)}."} if is_said else {}


def _reason(result: Mapping[str, Any], test: str) -> str:
    if test != "placebos":
        return _FAILED.get(test, test)
    unbeaten = [n for n, b in result["placebos"].items() if not _is_above(b["lower"], 0)]
    more = f" and {plural(len(unbeaten) - 1, 'other')}" if len(unbeaten) > 1 else ""
    return f"not reliably better than the placebo {unbeaten[0]!r}{more}"


def _is_above(value: float | None, bar: float) -> bool:
    return value is not None and value > bar


def changes(explanation: Explanation) -> dict[str, Image.Image]:
    """Return one frame before and after each change to its scene, by caption."""
    truth = explanation.numbers["truth"]
    before = explanation.data["frames"][truth["shown_frame"]]
    tiles = {"as it was": images.titled(images.enlarge(before), "as it was")}
    after = explanation.arrays["interventions"]
    for (name, effect), frame in zip(truth["interventions"].items(), after, strict=True):
        size = "not tried"
        if effect["mean"] is not None:
            size = f"{effect['mean']:.2f} [{effect['lower95']:.2f}, {effect['upper95']:.2f}]"
        caption = f"{name}: {size}"
        tiles[caption] = images.titled(images.enlarge(frame), caption)
    return tiles


PART = Part(
    title="Tests of the heat maps",
    label="Tests of the heat maps",
    needs=("truth",),
    text={"truth": say_findings, "reasons": say_reasons},
    draw=lambda explanation: {
        "truth": truth_charts(explanation),
        "curves": curves_charts(explanation),
        "heat": heat_chart(explanation),
        "interventions": changes(explanation),
    },
)
