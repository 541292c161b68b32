"""What a verdict quotes of a certificate. Evidence: `verdict.json`; old ones have no "proof"."""

from drone_rl.words.licence import Evidence, Sentence


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


def _cubes(evidence: Evidence) -> str:
    count = evidence["num_cubes"]
    return "the cube" if count == 1 else f"all {count} cubes"


def _every(evidence: Evidence) -> str:
    return (
        "Proved for every placement: with its most probable actions it collects "
        f"{_cubes(evidence)} from all places where they may stand."
    )


def _share(evidence: Evidence) -> str:
    proof = evidence["proof"]
    so_far = "" if proof["finished"] else " so far, for the proof was stopped"
    open_part = f", and {_exact(proof['undecided'])} is undecided" if proof["undecided"] else ""
    return (
        f"Proved{so_far}: with its most probable actions it collects {_cubes(evidence)} from a "
        f"share of {_exact(proof['share'])} of all placements; from {_exact(proof['lost'])} it "
        f"does not{open_part}."
    )


def _exact(share: float) -> str:
    """A share in nine digits; never 1 of what is only nearly all."""
    text = f"{share:.9g}"
    return "more than 0.999999999" if text == "1" else text


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
