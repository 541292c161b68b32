"""What a report says of heat maps: which to trust, or none. Evidence: `explanation.json`."""

from collections.abc import Mapping
from typing import Any

from drone_rl.sim.vocabulary import terms_of
from drone_rl.utils.text import Evidence, Sentence, bounds, listed, percent, plural

NAMES = {
    "grad_cam": "Grad-CAM",
    "grad_cam_logit": "Grad-CAM (logit)",
    "saliency": "saliency",
    "integrated_gradients": "integrated gradients",
    "occlusion": "occlusion",
}
"""Methods as people call them."""
_FAILED = {
    "pointing": "its hottest patch does not surely move the policy more often than chance",
    "likeness": "it does not surely change when the weights are shuffled",
    "random weights": "it does as well on shuffled weights",
}


def _truth(evidence: Evidence) -> Mapping[str, Any]:
    return evidence["truth"]


def best_placebo(truth: Mapping[str, Any]) -> str:
    """The map that knows nothing of the policy and scores highest all the same."""
    return max(truth["placebos"], key=lambda name: truth["placebos"][name]["mean"])


def _trusted(evidence: Evidence) -> str:
    truth = _truth(evidence)
    name, rival = truth["trusted"], best_placebo(truth)
    score = truth["methods"][name]["score"]
    return (
        f"The map to trust is {NAMES.get(name, name)}: which patches of a picture move the policy "
        f"it tells (score {score['mean']:.2f}, {bounds(score)}) surely better than every map that "
        f"knows nothing of the policy (the best, {rival!r}: "
        f"{truth['placebos'][rival]['mean']:.2f}), and it depends on the weights."
    )


def _hits(evidence: Evidence) -> str:
    pointing = _truth(evidence)["methods"][_truth(evidence)["trusted"]]["pointing"]
    return (
        "Its hottest patch is one of those that move the policy most in "
        f"{percent(pointing['hit'])} of these pictures (chance: {percent(pointing['chance'])})."
    )


def _refused(evidence: Evidence) -> list[str]:
    """Why each method that may not be trusted is not, by the tests that it failed."""
    return [
        f"{NAMES.get(name, name)} ({'; '.join(_reason(result, test) for test in result['failed'])})"
        for name, result in _truth(evidence)["methods"].items()
        if not result["trusted"]
    ]


def _reason(result: Mapping[str, Any], test: str) -> str:
    if test != "placebos":
        return _FAILED.get(test, test)
    unbeaten = [n for n, b in result["placebos"].items() if not _is_above(b["lower"], 0)]
    more = f" and {plural(len(unbeaten) - 1, 'other')}" if len(unbeaten) > 1 else ""
    return f"not surely better than the placebo {unbeaten[0]!r}{more}"


def _is_above(value: float | None, bar: float) -> bool:
    return value is not None and value > bar


def _was_flown(evidence: Evidence) -> bool:
    return _truth(evidence).get("outcomes") is not None


def _is_followed(evidence: Evidence) -> bool:
    """Whether there is something to fly to, and to follow where it moves."""
    return _was_flown(evidence) and terms_of(evidence).follows


def _outcome(evidence: Evidence, name: str) -> Mapping[str, Any]:
    return _truth(evidence)["outcomes"][name]


def _follows(evidence: Evidence) -> bool:
    return _is_followed(evidence) and _is_above(_outcome(evidence, "follows")["lower95"], 0)


def _next(evidence: Evidence) -> str:
    return f"the next {terms_of(evidence).target}"


def _moved_along(evidence: Evidence) -> str:
    follows, flights = _outcome(evidence, "follows"), _truth(evidence)["outcomes"]["flights"]
    return (
        f"When {_next(evidence)} is moved sideways, {plural(flights, 'flight')} gone on from these "
        f"pictures move with it by {follows['mean']:.2f} m a metre ({bounds(follows)})."
    )


def _not_along(evidence: Evidence) -> str:
    follows = _outcome(evidence, "follows")
    return (
        f"When {_next(evidence)} is moved sideways, flights gone on do not surely move with it "
        f"({follows['mean']:.2f} m a metre, {bounds(follows)})."
    )


def _ground(evidence: Evidence) -> str:
    changed = _outcome(evidence, "ground_changed")
    return (
        "Painting the ground otherwise, which should not matter, changes what comes of "
        f"{percent(changed['mean'])} of flights gone on, and of no more than "
        f"{percent(changed['upper95'])} (95%)."
    )


def _patch(evidence: Evidence) -> Mapping[str, Any]:
    return _truth(evidence)["interventions"]["ground patch changed"]


def _taken(evidence: Evidence) -> Mapping[str, Any]:
    return _truth(evidence)["interventions"]["target taken away"]


def _target_counts(evidence: Evidence) -> bool:
    taken, patch = _taken(evidence)["lower95"], _patch(evidence)["upper95"]
    return taken is not None and patch is not None and taken > patch


def _target(evidence: Evidence) -> str:
    change = _taken(evidence)
    return (
        f"Taking {_next(evidence)} away changes the probabilities by {change['mean']:.2f} of 1 "
        f"({bounds(change)}), surely more than a patch of ground does."
    )


def _integral(evidence: Evidence) -> str:
    error = _truth(evidence)["integration_error"]
    return (
        "Integrated gradients miss the change in probability that they must add up to by "
        f"{error['mean']:.4f} on average and {error['max']:.4f} at most, "
        f"on {plural(error['pictures'], 'picture')}."
    )


def _has_any(evidence: Evidence) -> bool:
    return _truth(evidence)["frames"] > 0


SENTENCES = (
    Sentence(
        "truth.trusted",
        "a method passed every test",
        lambda e: _truth(e)["trusted"] is not None,
        _trusted,
    ),
    Sentence(
        "truth.hits",
        "a method passed every test",
        lambda e: _truth(e)["trusted"] is not None,
        _hits,
    ),
    Sentence(
        "truth.none",
        "something moves the policy, and no method passed every test",
        lambda e: _has_any(e) and _truth(e)["trusted"] is None,
        lambda e: "No map is to be trusted on this policy.",
    ),
    Sentence(
        "truth.untested",
        "something moves the policy, and no method was tested",
        lambda e: _has_any(e) and not _truth(e)["methods"],
        lambda e: (
            "None could be tested: whether a map depends on the weights is not to be found out "
            "where these are not known. Give the policy as a torch module."
        ),
    ),
    Sentence(
        "truth.refused",
        "something moves the policy, and a method failed a test",
        lambda e: _has_any(e) and bool(_refused(e)),
        lambda e: f"Not to be trusted: {listed(_refused(e))}.",
    ),
    Sentence(
        "truth.unmoved",
        "no patch of any picture moves the policy",
        lambda e: not _has_any(e),
        lambda e: (
            "Nothing that was drawn otherwise in a part of these pictures moves this policy, so "
            "that no map of it could be shown to be true: trust none."
        ),
    ),
    Sentence(
        "truth.left_out",
        "some pictures were left out of the tests",
        lambda e: _has_any(e) and _truth(e)["frames_unmoved"] > 0,
        lambda e: (
            f"Of {_truth(e)['frames'] + _truth(e)['frames_unmoved']} pictures "
            f"{_truth(e)['frames_unmoved']} are left out, since no part of them moves it."
        ),
    ),
    Sentence(
        "truth.follows",
        "flights with the next target, to which one flies, moved surely end up sideways with it",
        _follows,
        _moved_along,
    ),
    Sentence(
        "truth.follows_not",
        "they do not surely",
        lambda e: _is_followed(e) and not _follows(e),
        _not_along,
    ),
    Sentence("truth.ground", "the ground was repainted in flights", _was_flown, _ground),
    Sentence(
        "truth.patch",
        "a patch of ground was changed",
        lambda e: _patch(e)["upper95"] is not None,
        lambda e: (
            "A patch of ground, which should not matter, changes the probabilities of the actions "
            f"by no more than {_patch(e)['upper95']:.2f} of 1 on average (95%)."
        ),
    ),
    Sentence(
        "truth.target",
        "the target taken away changes at least more than the patch of ground does at most",
        _target_counts,
        _target,
    ),
    Sentence(
        "truth.integral",
        "integrated gradients were summed up",
        lambda e: _truth(e)["integration_error"] is not None,
        _integral,
    ),
)
FINDINGS = tuple(sentence for sentence in SENTENCES if sentence.name != "truth.refused")
REASONS = tuple(sentence for sentence in SENTENCES if sentence.name == "truth.refused")
"""Why maps are not trusted, which is more than one wants to read at once."""
