"""What a report says of each section but the verdict and the maps. Evidence: `explanation.json`."""

from collections.abc import Sequence

from drone_rl.explanations.report.response_text import ASYMMETRY, RESPONSE
from drone_rl.explanations.report.truth_text import NAMES
from drone_rl.sim.vocabulary import shown_actions, terms_of
from drone_rl.utils.text import Evidence, Sentence, among, bounds, listed, percent, plural
from drone_rl.verification.text import PLACES


def _size(evidence: Evidence) -> str:
    data = evidence["dataset"]
    return (
        f"{data['frames']} frames, spread evenly over {data['episodes']} whole flights of "
        f"{data['steps']:,} steps with sampled actions."
    )


def _actions(evidence: Evidence) -> str:
    shares, names = evidence["dataset"]["action_shares"], shown_actions(evidence).names
    parts = listed([f"{percent(s)} {a}" for s, a in zip(shares, names, strict=True)])
    return f"Of these steps {parts}."


def _one_action(evidence: Evidence) -> str:
    shares, names = evidence["dataset"]["action_shares"], shown_actions(evidence).names
    return f"In every one of these steps it went {names[shares.index(max(shares))]}."


def _entropy(evidence: Evidence) -> str:
    entropy = evidence["dataset"]["entropy"]
    return (
        f"Its mean entropy is {entropy['mean']:.2f} of 1, where 1 is a coin toss "
        f"({bounds(entropy)})."
    )


DATASET = (
    Sentence("dataset.size", "frames were recorded", lambda e: e["dataset"]["frames"] > 0, _size),
    Sentence(
        "dataset.actions",
        "more than one action was taken",
        lambda e: max(e["dataset"]["action_shares"]) < 1,
        _actions,
    ),
    Sentence(
        "dataset.one_action",
        "every step flown took the same action",
        lambda e: max(e["dataset"]["action_shares"]) == 1,
        _one_action,
    ),
    Sentence(
        "dataset.entropy",
        "the policy's probabilities were recorded",
        lambda e: e["dataset"]["entropy"]["mean"] is not None,
        _entropy,
    ),
    Sentence(
        "dataset.none_reached",
        "no goal was reached in any step flown",
        lambda e: e["dataset"]["goals_reached"] == 0,
        lambda e: f"No {terms_of(e).goal} was {terms_of(e).reached} in these flights.",
    ),
)


def _faithful(evidence: Evidence) -> str:
    one, two = evidence["tsne"]["features"], evidence["tsne"]["pixels"]
    return (
        f"How faithful the maps are: of the {one['neighbours']} nearest here, "
        f"{percent(one['neighbours_kept'])} (features of layer {one['layer']}) and "
        f"{percent(two['neighbours_kept'])} (pixels) are among as many nearest in truth "
        f"(chance: {percent(one['neighbours_chance'])} and "
        f"{percent(two['neighbours_chance'])}); trustworthiness "
        f"{one['trustworthiness']:.3f} and {two['trustworthiness']:.3f} of 1."
    )


def _unfaithful(evidence: Evidence) -> list[str]:
    """Maps on which most neighbours are strangers."""
    return [n for n in ("features", "pixels") if evidence["tsne"][n]["neighbours_kept"] < 0.5]


TSNE = (
    Sentence("tsne.faithful", "always: it is the measure itself", lambda e: True, _faithful),
    Sentence(
        "tsne.unfaithful",
        "less than half of the neighbours on a map are neighbours in truth",
        lambda e: bool(_unfaithful(e)),
        lambda e: f"Most neighbours on the map of {listed(_unfaithful(e))} are none in truth.",
    ),
)


def _no_pair(evidence: Evidence) -> str:
    found = evidence["contradictions"]
    return (
        f"Among these {found['frames']} frames no two that look alike are answered in opposite "
        "ways."
    )


def _pairs(evidence: Evidence) -> str:
    found, target = evidence["contradictions"], terms_of(evidence).target
    text = (
        f"Among these {found['frames']} frames {plural(found['pairs'], 'pair')} of alike ones, "
        f"each frame in one pair at most, {'is' if found['pairs'] == 1 else 'are'} answered in "
        f"opposite ways: {plural(found['contradictions'], 'contradiction')} (the next {target} "
        f"stands alike in both), {found['justified']} justified (it stands elsewhere)"
    )
    unknown = found["unknown"]
    return text + (f", {unknown} unknown (a frame has no next {target})." if unknown else ".")


def _worst(evidence: Evidence) -> str:
    worst = evidence["contradictions"]["worst_opposition"]
    return f"In the worst contradiction the wish to turn swings by {worst:.2f} of 1."


CONTRADICTIONS = (
    Sentence(
        "contradictions.none",
        "no pair was found among the frames analysed",
        lambda e: e["contradictions"]["pairs"] == 0,
        _no_pair,
    ),
    Sentence(
        "contradictions.pairs",
        "pairs were found; all are counted",
        lambda e: e["contradictions"]["pairs"] > 0,
        _pairs,
    ),
    Sentence(
        "contradictions.worst",
        "one of them is a contradiction",
        lambda e: e["contradictions"]["contradictions"] > 0,
        _worst,
    ),
)


def _no_loop(evidence: Evidence) -> str:
    share = evidence["loops"]["episodes"]
    return (
        f"In none of these {share['trials']} sampled flights the drone moves back and forth in a "
        f"loop; up to {percent(share['upper95'])} of such flights may have one (95%)."
    )


def _loops(evidence: Evidence) -> str:
    found = evidence["loops"]
    share = found["episodes"]
    return (
        f"In {among(share)} of these sampled flights the drone moves back and forth in a loop "
        f"({bounds(share, percent)}); the longest takes {found['longest']} steps, all together "
        f"{percent(found['frames_share'])} of the steps flown."
    )


LOOPS = (
    Sentence("loops.none", "no flight has a loop", lambda e: not e["loops"]["loops"], _no_loop),
    Sentence("loops.some", "flights have loops", lambda e: e["loops"]["loops"] > 0, _loops),
)


def _reached(evidence: Evidence) -> str:
    reached = evidence["class_model"]["logit"]["probabilities"]
    names = shown_actions(evidence).names
    parts = listed([f"{a} {p:.3f}" for a, p in zip(names, reached, strict=True)])
    return f"The pictures sought by logit reach a probability of {parts}."


def _unreached(evidence: Evidence) -> list[str]:
    """Actions that no attempt of either objective made more probable than not."""
    found, names = evidence["class_model"], shown_actions(evidence).names
    highest = [max(p) for p in zip(*(found[o]["highest"] for o in _OBJECTIVES), strict=True)]
    return [action for action, p in zip(names, highest, strict=True) if p <= 0.5]


_OBJECTIVES = ("probability", "logit")


def _not_reached(evidence: Evidence) -> str:
    found = evidence["class_model"]
    attempts = sum(found[o]["starts"] * found[o]["num_settings"] for o in _OBJECTIVES)
    return (
        f"None of the {attempts} attempts made {listed(_unreached(evidence), 'or')} more probable "
        "than not; that no picture does is not shown by that."
    )


CLASS_MODEL = (
    Sentence("class_model.reached", "always: it is what was measured", lambda e: True, _reached),
    Sentence(
        "class_model.not_reached",
        "no start under any setting got an action above one half",
        lambda e: bool(_unreached(e)),
        _not_reached,
    ),
)


def _heat_by(evidence: Evidence) -> Sequence[str | None]:
    return evidence["attribution"]["film"]["heat_by"]


def _stand_in(evidence: Evidence) -> str:
    by = _heat_by(evidence)
    return (
        f"On {list(by).count('grad_cam_logit')} of the {len(by)} steps shown Grad-CAM of the "
        "probability has no heat; that of the logit stands there."
    )


def _no_heat(evidence: Evidence) -> str:
    by = _heat_by(evidence)
    return f"On {list(by).count(None)} of the {len(by)} steps shown there is no heat at all."


ATTRIBUTION = (
    Sentence(
        "attribution.layer",
        "the policy has a convolution",
        lambda e: e["attribution"]["layer"] is not None,
        lambda e: f"Grad-CAM of layer {e['attribution']['layer']}, on the first flight recorded.",
    ),
    Sentence(
        "attribution.no_convolution",
        "none is known",
        lambda e: e["attribution"]["layer"] is None,
        lambda e: (
            "No convolution is known of this policy that gradients go through, and thus no "
            f"Grad-CAM; {NAMES[e['attribution'].get('shown', 'saliency')]} is shown."
        ),
    ),
    Sentence(
        "attribution.stand_in",
        "another map is shown on some steps",
        lambda e: "grad_cam_logit" in _heat_by(e),
        _stand_in,
    ),
    Sentence(
        "attribution.no_heat", "some steps have none", lambda e: None in _heat_by(e), _no_heat
    ),
)


LEFT_OUT = (
    Sentence(
        "left_out.why",
        "sections could not be made of this policy",
        lambda e: bool(e.get("left_out")),
        lambda e: " ".join(e["left_out"].values()),
    ),
)

SECTIONS = {
    "left_out": LEFT_OUT,
    "dataset": DATASET,
    "tsne": TSNE,
    "contradictions": CONTRADICTIONS,
    "loops": LOOPS,
    "class_model": CLASS_MODEL,
    "attribution": ATTRIBUTION,
    "response": RESPONSE,
    "places": PLACES,
    "asymmetry": ASYMMETRY,
}
"""Sentences by the section of the page in which they stand."""
SENTENCES = tuple(sentence for section in SECTIONS.values() for sentence in section)
