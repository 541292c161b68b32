"""What a certificate comes to, in one sentence."""

from collections.abc import Mapping
from typing import Any

from drone_rl.utils.text import all_cubes, exact


def sentence(certificate: Mapping[str, Any]) -> str:
    """Says no more than the certificate does.

    Args:
        certificate: See `drone_rl.verification.prover.certificate`.
    """
    task = certificate["policy"]["description"]["task"]
    cubes = all_cubes(task["num_cubes"])
    outcomes, undecided = certificate["outcomes"], certificate["undecided"]
    success = sum(o["share"] for o in outcomes if o["end"] == "all_cubes")
    if not undecided["boxes"] and all(o["end"] == "all_cubes" for o in outcomes):
        return f"Proved: greedy, it collects {cubes} from every placement."
    lost = sum(o["share"] for o in outcomes if o["end"] != "all_cubes")
    lost = exact(lost, is_all=not success and not undecided["boxes"])
    text = f"Proved: greedy, it collects {cubes} from a share of {exact(success)} of all placements"
    text += f" and does not from a share of {lost}"
    if undecided["boxes"]:
        text += f"; a share of {exact(undecided['share'], is_all=not outcomes)} are undecided"
    if not certificate["finished"]:
        text += f" so far ({why_stopped(certificate['found'].get('stopped_by'))})"
    return text + "."


def why_stopped(setting: str | None) -> str:
    """Why a proof has not come to its end, and what helps.

    Args:
        setting: The one that stopped it, if it is known.
    """
    if setting != "most_boxes":
        return "the proof was stopped"
    return (
        "the proof was stopped, for more than most_boxes boxes were under way; begin anew with a "
        "smaller most_combinations, which makes parts of fewer boxes"
    )


def found(search: Mapping[str, Any]) -> str:
    """What a training found in one of its searches for failures.

    Args:
        search: A row of "rounds" in `result.json`, see `drone_rl.verification.journal.Round`.
    """
    text = f"at frame {search['frames']:,}: {search['failures']} of {search['flights']:,} flights"
    if search["losing"] is None:
        return f"{text} failed"
    losing, undecided = exact(search["losing"]), exact(search["undecided"])
    text += f" failed; proof in {search['proof_s']:.0f} s: fails from a share of {losing}"
    return f"{text}, undecided a share of {undecided}"
