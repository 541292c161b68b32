"""Report section "truth": tests of heat maps, and the effects of changes to a scene."""

from collections.abc import Mapping
from typing import Any

from PIL import Image

from drone_rl.evaluation.plots import images
from drone_rl.explanations.report.explanation import Explanation, Part
from drone_rl.explanations.report.truth_charts import curves_chart, heat_chart, truth_chart
from drone_rl.explanations.report.validation import METHOD_NAMES
from drone_rl.sim.vocabulary import terms_of
from drone_rl.utils.text import Evidence, Sentence, bounds, listed, percent, plural

_FAILED = {
    "pointing": "its hottest patch does not reliably affect the policy more often than chance",
    "likeness": "it does not reliably change when the weights are shuffled",
    "random weights": "it scores as well on shuffled weights",
}


def _truth(evidence: Evidence) -> Mapping[str, Any]:
    return evidence["truth"]


def best_placebo(truth: Mapping[str, Any]) -> str:
    """Return the name of the placebo map with the highest score."""
    return max(truth["placebos"], key=lambda name: truth["placebos"][name]["mean"])


def _is_trusted(evidence: Evidence) -> bool:
    return _truth(evidence)["trusted"] is not None


def _refused(evidence: Evidence) -> list[str]:
    """Return each method that is not trusted, with the tests that it failed."""
    return [
        f"{METHOD_NAMES.get(name, name)} "
        f"({'; '.join(_reason(result, test) for test in result['failed'])})"
        for name, result in _truth(evidence)["methods"].items()
        if not result["trusted"]
    ]


def _reason(result: Mapping[str, Any], test: str) -> str:
    if test != "placebos":
        return _FAILED.get(test, test)
    unbeaten = [n for n, b in result["placebos"].items() if not _is_above(b["lower"], 0)]
    more = f" and {plural(len(unbeaten) - 1, 'other')}" if len(unbeaten) > 1 else ""
    return f"not reliably better than the placebo {unbeaten[0]!r}{more}"


def _is_above(value: float | None, bar: float) -> bool:
    return value is not None and value > bar


def _has_outcomes(evidence: Evidence) -> bool:
    return _truth(evidence).get("outcomes") is not None


def _can_follow(evidence: Evidence) -> bool:
    """Return whether the task's targets are approached, so that a policy can follow them."""
    return _has_outcomes(evidence) and terms_of(evidence).follows


def _outcome(evidence: Evidence, name: str) -> Mapping[str, Any]:
    return _truth(evidence)["outcomes"][name]


def _follows(evidence: Evidence) -> bool:
    return _can_follow(evidence) and _is_above(_outcome(evidence, "follows")["lower95"], 0)


def _next(evidence: Evidence) -> str:
    return f"the next {terms_of(evidence).target}"


def _trusted(evidence: Evidence) -> str:
    truth = _truth(evidence)
    name, rival = truth["trusted"], best_placebo(truth)
    score = truth["methods"][name]["score"]
    return (
        f"The heat map to trust is {METHOD_NAMES.get(name, name)}: it shows which patches of a "
        f"frame affect the policy (score {score['mean']:.2f}, {bounds(score)}) reliably better "
        f"than every map that does not use the policy (the best, {rival!r}: "
        f"{truth['placebos'][rival]['mean']:.2f}), and it depends on the weights."
    )


def _pointing(evidence: Evidence) -> Mapping[str, Any]:
    return _truth(evidence)["methods"][_truth(evidence)["trusted"]]["pointing"]


def _effect(evidence: Evidence, change: str) -> Mapping[str, Any]:
    return _truth(evidence)["interventions"][change]


def _target_counts(evidence: Evidence) -> bool:
    taken = _effect(evidence, "target taken away")["lower95"]
    patch = _effect(evidence, "ground patch changed")["upper95"]
    return taken is not None and patch is not None and taken > patch


def _has_any(evidence: Evidence) -> bool:
    return _truth(evidence)["frames"] > 0


FINDINGS = (
    Sentence("truth.trusted", "a method passed every test", _is_trusted, _trusted),
    Sentence(
        "truth.hits",
        "a method passed every test",
        _is_trusted,
        lambda e: (
            "Its hottest patch is one of those that affect the policy most in "
            f"{percent(_pointing(e)['hit'])} of these frames "
            f"(chance: {percent(_pointing(e)['chance'])})."
        ),
    ),
    Sentence(
        "truth.none",
        "some patch affects the policy, and no method passed every test",
        lambda e: _has_any(e) and not _is_trusted(e),
        lambda e: "No heat map of this policy can be trusted.",
    ),
    Sentence(
        "truth.untested",
        "some patch affects the policy, and no method was tested",
        lambda e: _has_any(e) and not _truth(e)["methods"],
        lambda e: (
            "No method could be tested: whether a map depends on the weights can't be measured "
            "where they are unknown. Give the policy as a torch module."
        ),
    ),
    Sentence(
        "truth.unmoved",
        "no patch of any frame affects the policy",
        lambda e: not _has_any(e),
        lambda e: (
            "No change of a part of these frames affects this policy, so no heat map of it could "
            "be verified: trust none."
        ),
    ),
    Sentence(
        "truth.left_out",
        "some frames were left out of the tests",
        lambda e: _has_any(e) and _truth(e)["frames_unmoved"] > 0,
        lambda e: (
            f"Of {_truth(e)['frames'] + _truth(e)['frames_unmoved']} frames "
            f"{_truth(e)['frames_unmoved']} are left out, since no part of them affects the policy."
        ),
    ),
    Sentence(
        "truth.follows",
        "the task's targets are approached, and rollouts reliably follow a moved target",
        _follows,
        lambda e: (
            f"When {_next(e)} is moved sideways, "
            f"{plural(_truth(e)['outcomes']['flights'], 'rollout')} from these frames follow it by "
            f"{_outcome(e, 'follows')['mean']:.2f} m per metre ({bounds(_outcome(e, 'follows'))})."
        ),
    ),
    Sentence(
        "truth.follows_not",
        "the task's targets are approached, and rollouts do not reliably follow a moved target",
        lambda e: _can_follow(e) and not _follows(e),
        lambda e: (
            f"When {_next(e)} is moved sideways, rollouts from these frames do not reliably follow "
            f"it ({_outcome(e, 'follows')['mean']:.2f} m per metre, "
            f"{bounds(_outcome(e, 'follows'))})."
        ),
    ),
    Sentence(
        "truth.ground",
        "rollouts with another ground were run",
        _has_outcomes,
        lambda e: (
            "Another ground colour, which should not matter, changes the outcome of "
            f"{percent(_outcome(e, 'ground_changed')['mean'])} of these rollouts, and of no more "
            f"than {percent(_outcome(e, 'ground_changed')['upper95'])} (95%)."
        ),
    ),
    Sentence(
        "truth.patch",
        "a patch of ground was changed",
        lambda e: _effect(e, "ground patch changed")["upper95"] is not None,
        lambda e: (
            "A patch of ground, which should not matter, changes the action probabilities by no "
            f"more than {_effect(e, 'ground patch changed')['upper95']:.2f} of 1 on average (95%)."
        ),
    ),
    Sentence(
        "truth.target",
        "the effect of removing the target is above that of a patch of ground (95% bounds)",
        _target_counts,
        lambda e: (
            f"Removing {_next(e)} changes the action probabilities by "
            f"{_effect(e, 'target taken away')['mean']:.2f} of 1 "
            f"({bounds(_effect(e, 'target taken away'))}), reliably more than a patch of ground "
            "does."
        ),
    ),
    Sentence(
        "truth.integral",
        "the error of integrated gradients was measured",
        lambda e: _truth(e)["integration_error"] is not None,
        lambda e: (
            "Integrated gradients differ from the change in probability that they must add up to "
            f"by {_truth(e)['integration_error']['mean']:.4f} on average and "
            f"{_truth(e)['integration_error']['max']:.4f} at most, "
            f"on {plural(_truth(e)['integration_error']['pictures'], 'frame')}."
        ),
    ),
)
REASONS = (
    Sentence(
        "truth.refused",
        "some patch affects the policy, and a method failed a test",
        lambda e: _has_any(e) and bool(_refused(e)),
        lambda e: f"Not trusted: {listed(_refused(e))}.",
    ),
)
"""Shown only on request: why methods are not trusted."""


def changes(explanation: Explanation) -> Image.Image:
    """Return one frame before and after each change to its scene."""
    truth = explanation.numbers["truth"]
    before = explanation.data["frames"][truth["shown_frame"]]
    tiles = [images.titled(images.enlarge(before), "as it was")]
    after = explanation.arrays["interventions"]
    for (name, effect), frame in zip(truth["interventions"].items(), after, strict=True):
        size = "not tried"
        if effect["mean"] is not None:
            size = f"{effect['mean']:.2f} [{effect['lower95']:.2f}, {effect['upper95']:.2f}]"
        tiles.append(images.titled(images.enlarge(frame), f"{name}: {size}"))
    return images.gridded(tiles, 3)


PART = Part(
    title="Tests of the heat maps",
    label="Tests of the heat maps",
    needs=("truth",),
    text={"truth": FINDINGS, "reasons": REASONS},
    draw=lambda explanation: {
        "truth": truth_chart(explanation),
        "curves": curves_chart(explanation),
        "heat": heat_chart(explanation),
        "interventions": changes(explanation),
    },
)
