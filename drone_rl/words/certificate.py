"""What a verdict quotes of a certificate. Evidence: `verdict.json`; old ones have no "proof"."""

from drone_rl.words.licence import Evidence, Sentence
from drone_rl.words.numbers import all_cubes, exact


def is_quoted(evidence: Evidence) -> bool:
    """Whether a verdict rests on a certificate, too."""
    proof = evidence.get("proof")
    return proof is not None and proof["refused"] is None


def is_proved(evidence: Evidence) -> bool:
    """Whether that certificate says that it succeeds from every placement."""
    return is_quoted(evidence) and evidence["proof"]["every"]


def _is_refused(evidence: Evidence) -> bool:
    return evidence.get("proof") is not None and not is_quoted(evidence)


def _is_share(evidence: Evidence) -> bool:
    return is_quoted(evidence) and not evidence["proof"]["every"]


def _every(evidence: Evidence) -> str:
    return (
        "Proved for every placement: with its most probable actions it collects "
        f"{all_cubes(evidence['num_cubes'])} from all places where they may stand."
    )


def _share(evidence: Evidence) -> str:
    proof, cubes = evidence["proof"], all_cubes(evidence["num_cubes"])
    share, lost, undecided = (proof[name] for name in ("share", "lost", "undecided"))
    so_far = "" if proof["finished"] else " so far, for the proof was stopped"
    text = (
        f"Proved{so_far}: with its most probable actions it collects {cubes} from a share of "
        f"{exact(share)} of all placements; from {exact(lost, is_all=share == undecided == 0)} it "
        "does not"
    )
    if undecided:
        text += f", and {exact(undecided, is_all=share == lost == 0)} is undecided"
    return f"{text}."


def _basis(evidence: Evidence) -> str:
    checked, agreeing = evidence["proof"]["checked"], evidence["proof"]["agreeing"]
    anew = (
        f"{checked:,} flights were made anew to try it and ended as it states"
        if checked
        else "its flights were not flown anew (drone-rl check does that)"
    )
    own = f" The {agreeing:,} greedy flights of this verdict that it tells of ended so."
    return (
        "The certificate is of this network and task, and its boxes are a partition of the "
        f"placements; {anew}.{own if agreeing else ''}"
    )


PROOF = (
    Sentence(
        "proof.every",
        "a certificate that holds together says so, and no flight speaks against it",
        is_proved,
        _every,
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
        "there is a certificate, and something speaks against it",
        _is_refused,
        lambda e: f"A certificate is not quoted: {e['proof']['refused']}.",
    ),
)
