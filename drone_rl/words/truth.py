"""What a report says of heat maps: which to trust, or none. Evidence: `explanation.json`."""

from drone_rl.words.licence import Evidence, Sentence

NAMES = {
    "grad_cam": "Grad-CAM",
    "grad_cam_logit": "Grad-CAM (logit)",
    "saliency": "saliency",
    "integrated_gradients": "integrated gradients",
    "occlusion": "occlusion",
}
"""Methods as people call them."""


def _trusted(evidence: Evidence) -> str:
    name = evidence["truth"]["trusted"]
    causal = evidence["truth"]["methods"][name]["causal"]
    return (
        f"The map to trust is {NAMES.get(name, name)}: what it claims agrees best with what "
        f"changing the scene does (rank correlation {causal['correlation']:.2f})."
    )


SENTENCES = (
    Sentence(
        "truth.trusted",
        "a method passed every test",
        lambda e: e["truth"]["trusted"] is not None,
        _trusted,
    ),
    Sentence(
        "truth.none",
        "no method did",
        lambda e: e["truth"]["trusted"] is None,
        lambda e: "No method's maps may be trusted on this policy.",
    ),
)
