"""From explanations to one HTML file that needs nothing else."""

import base64
import csv
import io
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import imageio.v3 as iio
import jinja2
import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from PIL import Image

from drone_rl.report import figures
from drone_rl.report.explanation import ACTIONS, Explanation
from drone_rl.utils.errors import InputError
from drone_rl.words import advice, report, truth
from drone_rl.words.licence import percent, say

WORDS = {**advice.SECTIONS, **report.SECTIONS, "truth": truth.FINDINGS, "reasons": truth.REASONS}
"""Sentences by the part of the page in which they stand."""


def write_report(folders: Sequence[Path], target: Path) -> Path:
    """Writes report.html and, under figures/, each figure as PNG with its numbers beside it.

    Args:
        folders: Each with one explanation; several stand side by side.
        target: Folder of the report.

    Returns:
        Path of report.html.

    Raises:
        InputError: An explanation can't be read or the report can't be written.
    """
    explanations = [Explanation.load(folder) for folder in folders]
    try:
        (target / "figures").mkdir(parents=True, exist_ok=True)
        sections = [
            _section(explanation, target / "figures", f"{i}_{_slug(explanation.name)}")
            for i, explanation in enumerate(explanations)
        ]
        shared = _save(figures.class_model_grid(explanations), target / "figures" / "class_models")
        path = target / "report.html"
        path.write_text(_render(explanations, sections, shared), encoding="utf-8")
    except OSError as error:
        raise InputError(
            f"report in {target} can't be written ({error.strerror}); choose another folder"
        ) from error
    return path


def _section(explanation: Explanation, folder: Path, prefix: str) -> dict[str, Any]:
    """One policy's figures, saved and as data URIs, its numbers and its sentences."""
    drawn = figures.draw_all(explanation)
    pictures = {
        name: _save(picture, folder / f"{prefix}_{name}") for name, picture in drawn.items()
    }
    for name, rows in figures.tables(explanation).items():
        with open(folder / f"{prefix}_{name}.csv", "w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(rows)
    for name, numbers in figures.numbers(explanation).items():
        (folder / f"{prefix}_{name}.json").write_text(json.dumps(numbers, indent=1))
    video = folder / f"{prefix}_episode.mp4"
    iio.imwrite(video, figures.episode_video(explanation), fps=8, codec="libx264")
    return {
        "name": explanation.name,
        "numbers": explanation.numbers,
        "pictures": pictures,
        "video": _uri(video.read_bytes(), "video/mp4"),
        "sprite": _save(figures.sprite(explanation), None),
        "points": figures.points(explanation),
        "words": {name: say(may, explanation.numbers) for name, may in WORDS.items()},
        "provenance": json.dumps(explanation.numbers["provenance"], indent=1),
    }


def _render(explanations: list[Explanation], sections: list[dict], class_models: str) -> str:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("drone_rl.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters["percent"] = _short
    # "<" is the one character by which a name could leave a script
    environment.filters["script"] = lambda x: jinja2.utils.markupsafe.Markup(
        json.dumps(x).replace("<", "\\u003c")
    )
    return environment.get_template("report.html").render(
        title="Can these policies be trusted?"
        if len(sections) > 1
        else "Can this policy be trusted?",
        sections=sections,
        class_models=class_models,
        actions=ACTIONS,
        names=truth.NAMES,
        rule=explanations[0].numbers["verdict"]["rule"],
    )


def _short(share: float) -> str:
    """A share for a table."""
    return percent(share).replace("less than ", "<").replace("more than ", ">")


def _save(picture: Image.Image | Figure, path: Path | None) -> str:
    """Saves a PNG (unless `path` is None) and returns it as a data URI."""
    buffer = io.BytesIO()
    if isinstance(picture, Figure):
        picture.savefig(buffer, format="png", dpi=90, metadata={"Software": None})
        plt.close(picture)
    else:
        picture.save(buffer, "png", optimize=True)
    if path is not None:
        path.with_name(path.name + ".png").write_bytes(buffer.getvalue())
    return _uri(buffer.getvalue(), "image/png")


def _uri(content: bytes, kind: str) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def _slug(name: str) -> str:
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_")[-60:] or "policy"
