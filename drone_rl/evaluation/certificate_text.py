"""Sentences of a verdict about a certificate. Evidence: `verdict.json`."""

from drone_rl.utils.text import Evidence, Sentence, all_cubes, exact

MOST_WRONG = 0.01
"""Largest fraction of placements with a wrong statement, with 95% confidence."""


def is_quoted(evidence: Evidence) -> bool:
    """Return whether a certificate is quoted."""
    proof = evidence.get("proof")
    return proof is not None and proof["refused"] is None


def is_stated(evidence: Evidence) -> bool:
    """Return whether it states success from every placement."""
    return is_quoted(evidence) and evidence["proof"]["every"]


def is_proved(evidence: Evidence) -> bool:
    """Return whether it does, and enough rollouts from fresh placements re-checked it."""
    return is_stated(evidence) and _is_checked(evidence)


def _is_checked(evidence: Evidence) -> bool:
    bound = evidence["proof"].get("wrong_at_most")
    return bound is not None and bound <= MOST_WRONG


def _is_refused(evidence: Evidence) -> bool:
    return evidence.get("proof") is not None and not is_quoted(evidence)


def _is_share(evidence: Evidence) -> bool:
    return is_quoted(evidence) and not evidence["proof"]["every"]


def _every_placement(evidence: Evidence) -> str:
    return (
        "A certificate states for every placement: with its most probable actions it collects "
        f"{all_cubes(evidence['num_cubes'])} from all places where they may stand."
    )


def _share(evidence: Evidence) -> str:
    proof, cubes = evidence["proof"], all_cubes(evidence["num_cubes"])
    share, lost, undecided = (proof[name] for name in ("share", "lost", "undecided"))
    so_far = "" if proof["finished"] else " so far, for the proof was stopped"
    text = (
        f"A certificate states{so_far}: with its most probable actions it collects {cubes} from a "
        f"share of {exact(share)} of all placements; from "
        f"{exact(lost, is_all=share == undecided == 0)} it does not"
    )
    if undecided:
        text += f", and {exact(undecided, is_all=share == lost == 0)} is undecided"
    return f"{text}."


def _basis(evidence: Evidence) -> str:
    agreeing = evidence["proof"]["agreeing"]
    own = f" All {agreeing:,} greedy episodes of this verdict whose end it states ended so."
    return (
        "The certificate is of this network and task, and its boxes are a partition of the "
        f"placements. {_checked(evidence['proof'])}{own if agreeing else ''}"
    )


def _checked(proof: Evidence) -> str:
    """The number of rollouts that re-checked it, and what they rule out."""
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
    if bound > MOST_WRONG:
        return f"{text}, which is too much for a proof."
    return f"{text} (to prove it again, run drone-rl prove)."


PROOF = (
    Sentence(
        "proof.every",
        "a valid certificate states so, and no episode contradicts it",
        is_stated,
        _every_placement,
    ),
    Sentence(
        "proof.share",
        "the same, but some placements are lost or undecided",
        _is_share,
        _share,
    ),
    Sentence("proof.basis", "a certificate is quoted", is_quoted, _basis),
    Sentence(
        "proof.refused",
        "a certificate is refused",
        _is_refused,
        lambda e: f"A certificate is not quoted: {e['proof']['refused']}.",
    ),
)
