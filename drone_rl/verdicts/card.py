"""The card of an exported policy: its verdict, its figures, and where they come from."""

from collections.abc import Mapping
from typing import Any

from drone_rl.evaluation.verdict_text import best_luck
from drone_rl.sim.vocabulary import terms_of
from drone_rl.utils.text import said
from drone_rl.verdicts.card_text import SENTENCES

Evidence = Mapping[str, Any]


def write_card(name: str, digest: str, about: Evidence) -> str:
    """The card as Markdown.

    Args:
        name: Of the policy.
        digest: SHA-256 of its file.
        about: What the file says of it: "command", "progress", "provenance", "verdict" (as in
            verdict.json), "worlds" (the stream of worlds that it rests on), "seed" (theirs),
            "chosen" (None, or "runs" and "episodes" of the sweep in which it was made), "task",
            "dynamics" (None in computer-vision mode), "shifts" (None, or as in shifts.json).
    """
    sentences = said(SENTENCES, about)
    verdict = sentences.pop("card.verdict")
    known = about["provenance"]["versions"]
    packages = {name: known.get(name, "unknown") for name in ("torch", "torchrl", "mujoco-warp")}
    revision = about["provenance"]["git_revision"] or "unknown"
    points = "\n".join(f"- {text}" for text in sentences.values())
    return f"""# {name}

{verdict}

{_flights(about["verdict"])}

{_failures(about["verdict"]["failures"])}

{points}
- Trained by `{about["command"]}` in {about["progress"]["frames"]:,} frames; its description is in \
the file's metadata.
- SHA-256 of `{name}.safetensors`: `{digest}`
- revision {revision}; torch {packages["torch"]}, torchrl {packages["torchrl"]}, mujoco-warp \
{packages["mujoco-warp"]}
"""


def _flights(verdict: Evidence) -> str:
    """Greedy and drawn actions, the best luck and the oracle side by side."""
    luck = best_luck(verdict)
    flown = {
        "most probable actions": verdict["greedy"],
        "drawn actions": verdict["sampled"],
        f"best luck ({luck})": verdict["baselines"][luck],
        "oracle": verdict["baselines"]["oracle"],
    }
    flown = {name: flights for name, flights in flown.items() if flights is not None}
    rows = [["", *flown], ["---"] * (1 + len(flown))]
    terms = terms_of(verdict)
    rows.append(
        [f"episodes with all {terms.goals}", *(_share(f["success"]) for f in flown.values())]
    )
    for side in verdict["greedy"]["shares"]:
        label = f"{terms.goals} {terms.reached}" if side == "all" else f"of those {side}"
        rows.append([label, *(_share(f["shares"][side]) for f in flown.values())])
    return _table(rows)


def _failures(failures: Evidence) -> str:
    """The rows of the failure table at which something failed, the largest first."""
    largest = failures["largest"]
    if largest is None:
        upper = f"{100 * failures['bound']['upper95']:.1f}% of episodes"
        return _table([["fails", "never"], ["---"] * 2, ["upper bound", upper]])
    failed = [row for row in failures["rows"] if row["failed"] and row != largest]
    rows = [
        [f"{row['by']}: {row['value']}", str(row["failed"]), str(row["episodes"]), _share(row)]
        for row in (largest, *failed)
    ]
    return _table([["fails first at", "episodes", "of", "share"], ["---"] * 4, *rows])


def _table(rows: list[list[str]]) -> str:
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _share(value: Evidence) -> str:
    """A share or a mean share with its interval."""
    middle = value["share"] if "share" in value else value["mean"]
    if middle is None:
        return "not offered"
    return f"{middle:.3f} ({value['lower95']:.3f} to {value['upper95']:.3f})"
