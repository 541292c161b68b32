"""Figures of the documentation that no command writes.

`python -m tools.figures placebos FOLDER` plots the tests of the heat maps in a folder of `drone-rl
explain`.
"""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_rl.utils.palette import INK, MUTED, css

DOCS = Path(__file__).resolve().parents[1] / "docs"
MAPS, PLACEBOS = css(INK), css(MUTED)


def plot_placebos(truth: Mapping[str, Any], path: Path, policy: str) -> None:
    """Plot how well each heat map and each placebo ranks the patches by their effect.

    Args:
        truth: "truth" of explanation.json.
        path: Path of the image.
        policy: Name of the policy, for the title.
    """
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    methods = {_title(name): found for name, found in truth["methods"].items()}
    placebos = {_title(name): {"score": score} for name, score in truth["placebos"].items()}
    figure = Figure(figsize=(8.5, 4.2), layout="constrained")
    axes = figure.subplots()
    for row, (name, found) in enumerate({**methods, **placebos}.items()):
        score, color = found["score"], MAPS if name in methods else PLACEBOS
        ends = [score["mean"] - score["lower95"]], [score["upper95"] - score["mean"]]
        axes.barh(row, score["mean"], color=color, xerr=ends, ecolor="0.55", capsize=2)
        if found.get("trusted"):
            axes.text(score["upper95"], row, "  passed all tests", va="center")
    axes.set_yticks(range(len(methods) + len(placebos)), [*methods, *placebos])
    axes.invert_yaxis()
    axes.axvline(0, color="0.3", linewidth=0.8)
    axes.set(
        xlabel="rank correlation with the change of the output\n"
        "when a patch is re-rendered (95% CI)",
        xlim=(None, 1.2),  # right of 1, the largest correlation, is space for text
        xticks=[-0.2, 0.0, 0.2, 0.4, 0.6, 0.8, 1.0],
    )
    figure.suptitle(f"Do heat maps of policy {policy} show what it responds to?")
    handles = [
        Patch(color=MAPS, label="heat maps of the policy"),
        Patch(color=PLACEBOS, label="placebos: maps that ignore the policy"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False)
    figure.savefig(path, dpi=120)


def _title(name: str) -> str:
    """Return a name as a label."""
    text = name.replace("_", " ").replace("grad cam", "Grad-CAM")
    return text[0].upper() + text[1:]


def main(arguments: list[str], docs: Path = DOCS) -> int:
    """Write a figure to docs/ and return the exit status."""
    match arguments:
        case ["placebos", folder]:
            (file,) = Path(folder).rglob("explanation.json")
            found = json.loads(file.read_text())
            plot_placebos(found["truth"], docs / "placebos.png", found["name"])
        case _:
            print("error: give placebos and a folder of drone-rl explain")
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
