"""What a certificate comes to, in one sentence."""

from collections.abc import Mapping
from typing import Any


def sentence(certificate: Mapping[str, Any]) -> str:
    """Says no more than the certificate does.

    Args:
        certificate: See `drone_rl.proofs.certificate`.
    """
    task = certificate["policy"]["description"]["task"]
    cubes = "the cube" if task["num_cubes"] == 1 else f"all {task['num_cubes']} cubes"
    outcomes, undecided = certificate["outcomes"], certificate["undecided"]
    success = sum(o["share"] for o in outcomes if o["end"] == "all_cubes")
    if not undecided["boxes"] and all(o["end"] == "all_cubes" for o in outcomes):
        return f"Proved: greedy, it collects {cubes} from every placement."
    lost = sum(o["share"] for o in outcomes if o["end"] != "all_cubes")
    text = f"Proved: greedy, it collects {cubes} from {_share(success)} of all placements"
    text += f" and does not from {_share(lost)}"
    if undecided["boxes"]:
        text += f"; {_share(undecided['share'])} are undecided"
    if not certificate["finished"]:
        text += " so far (the proof was stopped)"
    return text + "."


def found(search: Mapping[str, Any]) -> str:
    """What a training found in one of its searches for failures.

    Args:
        search: A row of "rounds" in `result.json`, see `drone_rl.api.journal.Round`.
    """
    text = f"at frame {search['frames']:,}: {search['failures']} of {search['flights']:,} flights"
    if search["losing"] is None:
        return f"{text} failed"
    text += f" failed; proof in {search['proof_s']:.0f} s: fails from {_share(search['losing'])}"
    return f"{text}, undecided {_share(search['undecided'])}"


def _share(value: float) -> str:
    return f"a share of {value:.9g}"
