"""Report text about proofs; imports nothing heavy."""

from collections.abc import Mapping
from typing import Any

from drone_rl.utils.text import all_cubes, exact


def describe_proof(certificate: Mapping[str, Any]) -> str:
    """Summarize a certificate, see `proof_files`, in a sentence that claims only what it proves."""
    task = certificate["policy"]["description"]["task"]
    cubes = all_cubes(task["num_cubes"])
    outcomes, undecided = certificate["outcomes"], certificate["undecided"]
    success = sum(o["share"] for o in outcomes if o["end"] == "all_cubes")
    text = f"Proved: with its most probable actions it collects {cubes} from"
    if not undecided["boxes"] and {o["end"] for o in outcomes} == {"all_cubes"}:
        return f"{text} every placement."
    lost = sum(o["share"] for o in outcomes if o["end"] != "all_cubes")
    lost = exact(lost, is_all=not success and not undecided["boxes"])
    text += f" {exact(success)} of all placements; from {lost} it does not"
    if undecided["boxes"]:
        text += f", and {exact(undecided['share'], is_all=not outcomes)} are undecided"
    if not certificate["finished"]:
        text += f" so far (stopped by {certificate['found'].get('stopped_by')})"
    return text + "."


def describe_round(search: Mapping[str, Any]) -> str:
    """Describe the search for failures of one round, see `drone_rl.verification.provable.Round`."""
    text = f"at frame {search['frames']:,}: {search['failures']} of {search['flights']:,} episodes"
    if search["losing"] is None:
        return f"{text} failed"
    losing, undecided = exact(search["losing"]), exact(search["undecided"])
    text += f" failed; proof in {search['proof_s']:.0f} s: fails from {losing} of all placements"
    return f"{text}, {undecided} undecided"
