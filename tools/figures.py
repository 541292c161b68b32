"""Figures of the documentation that no command writes.

`python -m tools.figures placebos FOLDER` plots the tests of the heat maps in a folder of `drone-rl
explain`; `python -m tools.figures house` renders the indoor scene.
"""

import dataclasses
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


INSIDE = ((1.0, 3.4, 1.3, -25.0), (3.4, 5.4, 1.3, 140.0), (5.2, 5.4, 1.2, 25.0))
"""Where the drone is in each room of the indoor scene: x, y, z in metres, heading in degrees."""


def render_house(path: Path) -> None:
    """Render the indoor scene from above and from inside of its rooms."""
    import numpy as np
    import torch
    from PIL import Image

    from drone_rl.config import BaseTaskSettings
    from drone_rl.sim.worlds import Worlds

    worlds = Worlds(1, BaseTaskSettings.read({"name": "reach", "scene": ["indoor"]}, "task"))

    worlds.reset(torch.arange(1), [np.random.RandomState(0)])

    def render(camera: str, pose: tuple[float, ...], size: tuple[int, int], fov: float) -> Any:
        *place, heading = pose
        half = torch.deg2rad(torch.tensor(heading)) / 2
        worlds.state.body.position[:] = torch.tensor(place)
        worlds.state.body.attitude[:] = torch.tensor([half.cos(), 0.0, 0.0, half.sin()])
        view = worlds.view(camera, width=2 * size[0], height=2 * size[1])
        view = dataclasses.replace(view, horizontal_fov=fov)
        image = Image.fromarray(worlds.render(worlds.state, view)[0].numpy())
        return image.resize(size, Image.Resampling.LANCZOS)

    whole = Image.new("RGB", (1000, 564), "white")
    whole.paste(render("bottom_center", (5.0, 4.0, 11.0, 90.0), (694, 564), 58.0))
    for row, pose in enumerate(INSIDE):
        whole.paste(render("front_center", pose, (300, 184), 100.0), (700, 190 * row))
    whole.quantize(192).save(path, optimize=True)


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
        case ["house"]:
            render_house(docs / "house.png")
        case _:
            print("error: give house, or placebos and a folder of drone-rl explain")
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
