"""Report section "truth": tests of heat maps, and the effects of changes to a scene."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from drone_rl.explanations.report.explanation import METHOD_NAMES, Explanation, Part
from drone_rl.sim.vocabulary import terms_of
from drone_rl.trust.plots import images
from drone_rl.trust.plots.saving import new_chart
from drone_rl.utils.palette import FAINT, GOOD, INK, MUTED, css
from drone_rl.utils.text import Claims, Evidence, bounds, listed, percent, plural

_NO_EFFECT = "no patch of any frame\naffects this policy"
_TESTS = {
    "placebos": (0.0, "score above its strongest placebo\n(must be above 0)"),
    "pointing": (0.0, "hits above chance\n(must be above 0)"),
    "likeness": (0.5, "similarity on shuffled weights\n(must be below 0.5)"),
}
"""Limit and title of the chart of each test."""


class _Row(NamedTuple):
    """A value with an interval, which is not known with too few episodes."""

    label: str
    color: str
    value: float | None
    lower: float | None
    upper: float | None


def truth_charts(explanation: Explanation) -> dict[str, Figure]:
    """Plot the scores of methods and placebos, and the tests that a method must pass."""
    truth = explanation.numbers["truth"]
    methods, placebos = truth["methods"], truth["placebos"]
    colors = {name: css(GOOD if of["trusted"] else FAINT) for name, of in methods.items()}
    ordered = sorted(placebos, key=lambda name: -(placebos[name]["mean"] or 0.0))
    scores = [_score_row(METHOD_NAMES[n], colors[n], of["score"]) for n, of in methods.items()]
    scores += [_score_row(f"placebo: {n}", css(MUTED), placebos[n]) for n in ordered]
    title = "agreement with the patches that affect\nthe policy (score; chance: 0; line: 95%)"
    charts = [_interval_chart(scores, 0.0, title)]
    for test, (limit, title) in _TESTS.items():
        rows = []
        for name, method in methods.items():
            result = method.get(test)
            if test == "placebos" and result:  # the one that the method beats least reliably
                result = min(result.values(), key=lambda b: (b["lower"] is not None, b["lower"]))
            ends = [result[key] for key in ("median", "lower", "upper")] if result else [None] * 3
            rows.append(_Row(METHOD_NAMES[name], colors[name], *ends))
        charts.append(_interval_chart(rows, limit, title))
    return {chart.axes[0].get_title().replace("\n", " "): chart for chart in charts}


def _score_row(label: str, color: str, score: Mapping[str, float | None]) -> _Row:
    return _Row(label, color, score["mean"], score["lower95"], score["upper95"])


def _interval_chart(rows: Sequence[_Row], limit: float, title: str) -> Figure:
    """Plot values with their intervals, the first on top, and a limit."""
    figure, axis = new_chart(height=1.6 + 0.3 * len(rows))
    for y, row in enumerate(reversed(rows)):
        if row.value is None:
            continue
        if row.lower is None or row.upper is None:
            axis.text(limit, y, " too few episodes", va="center", fontsize=9)
            continue
        axis.plot([row.lower, row.upper], [y, y], color="black", lw=1.5)
        axis.plot(row.value, y, "o", color=row.color)
    if all(row.value is None for row in rows):
        _write(axis, _NO_EFFECT if rows else "no method was tested")
    else:
        axis.axvline(limit, color=css(INK), ls="--", lw=1.2)
    labels = [textwrap.fill(row.label, 26) for row in reversed(rows)]
    axis.set_yticks(range(len(rows)), labels, fontsize=8)
    axis.set_ylim(-0.6, max(len(rows), 1) - 0.4)
    axis.set_title(title, fontsize=11)
    return figure


def _write(axis: Axes, text: str, color: str = "black") -> None:
    """Write a text in the middle of a chart."""
    place = {"transform": axis.transAxes, "ha": "center", "va": "center"}
    axis.text(0.5, 0.5, text, color=color, **place)


def effects_chart(explanation: Explanation) -> Figure:
    """Plot the mean effect of each patch."""
    effects = explanation.arrays["patch_effects"]
    figure, axis = new_chart()
    image = axis.imshow(effects, cmap="magma", vmin=0, vmax=max(float(effects.max()), 1e-6))
    axis.set(xticks=[], yticks=[])
    axis.set_title("mean effect of each patch on the policy", fontsize=11)
    if not effects.any():
        _write(axis, _NO_EFFECT, "white")
    figure.colorbar(image, ax=axis, shrink=0.8, location="bottom")
    return figure


_FAILED = {
    "pointing": "its hottest patch does not reliably affect the policy more often than chance",
    "likeness": "it does not reliably change when the weights are shuffled",
    "random weights": "it scores as well on shuffled weights",
    "placebos": "it is not reliably better than every placebo",
}


def say_findings(evidence: Evidence) -> Claims:
    """Say what the tests of heat maps, the rollouts and the changes of scenes show."""
    return {**_say_tests(evidence), **_say_effects(evidence)}


def _say_tests(evidence: Evidence) -> Claims:
    truth, claims = evidence["truth"], Claims()
    if truth["frames"] == 0:
        return {
            "truth.unmoved": (
                "No change of a part of these frames affects this policy, so no heat map of it "
                "could be verified: trust none."
            )
        }
    if (name := truth["trusted"]) is not None:
        method, placebos = truth["methods"][name], truth["placebos"]
        rival = max(placebos, key=lambda placebo: placebos[placebo]["mean"])
        score, pointing = method["score"], method["pointing"]
        claims["truth.trusted"] = (
            f"The heat map to trust is {METHOD_NAMES[name]}: it shows which patches of a frame "
            f"affect the policy (score {score['mean']:.2f}, {bounds(score)}) reliably better than "
            f"every map that does not use the policy (the best on the same frames, {rival!r}: "
            f"{placebos[rival]['mean']:.2f}), and it depends on the weights. Its hottest patch is "
            f"one of those that affect the policy most in {percent(pointing['hit'])} of these "
            f"frames (chance: {percent(pointing['chance'])})."
        )
    elif truth["methods"]:
        claims["truth.none"] = "No heat map of this policy can be trusted."
    else:
        claims["truth.untested"] = (
            "No method could be tested: whether a map depends on the weights can't be measured "
            "where they are unknown. Give the policy as a torch module."
        )
    if (unmoved := truth["frames_unmoved"]) > 0:
        claims["truth.left_out"] = (
            f"Of {truth['frames'] + unmoved} frames {unmoved} are left out, since no part of them "
            "affects the policy."
        )
    return claims


def _say_effects(evidence: Evidence) -> Claims:
    truth, terms, claims = evidence["truth"], terms_of(evidence), Claims()
    if outcomes := truth["outcomes"]:
        follows, ground = outcomes["follows"], outcomes["ground_changed"]
        if terms.follows:
            claims["truth.follows"] = (
                f"When the next {terms.target} is moved sideways, "
                f"{plural(outcomes['flights'], 'rollout')} from these frames follow it by "
                f"{follows['mean']:.2f} m per metre ({bounds(follows)})."
            )
        claims["truth.ground"] = (
            "Another ground color, which should not matter, changes the outcome of "
            f"{percent(ground['mean'])} of the rollouts from these frames "
            f"({bounds(ground, percent)})."
        )
    changed = {n: of for n, of in truth["interventions"].items() if of["mean"] is not None}
    if changed:
        effects = [f"{n} {of['mean']:.2f} ({bounds(of)})" for n, of in changed.items()]
        claims["truth.effects"] = (
            "Mean changes of the action probabilities (0: none, 1: another action with certainty): "
            f"{listed(effects)}. A patch of ground should not matter."
        )
    return claims


def say_reasons(evidence: Evidence) -> Claims:
    """Say why methods are not trusted; the page shows it only on request."""
    truth = evidence["truth"]
    failed = {name: of["failed"] for name, of in truth["methods"].items() if not of["trusted"]}
    if truth["frames"] == 0 or not failed:
        return {}
    reasons = [
        f"{METHOD_NAMES[name]} ({'; '.join(_FAILED[test] for test in tests)})"
        for name, tests in failed.items()
    ]
    return {"truth.refused": f"Not trusted: {listed(reasons)}."}


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
        "effects": effects_chart(explanation),
        "interventions": changes(explanation),
    },
)
