"""`drone-rl report`: build one self-contained HTML file from explanations, and its figures."""

import functools
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import jinja2
from markupsafe import Markup

from drone_rl.explanations.report import (
    attribution,
    behavior,
    class_models,
    embedding,
    importance,
    places,
    response,
    scene_map,
    truth,
)
from drone_rl.explanations.report.part import METHOD_NAMES, Figures, Part
from drone_rl.explanations.results import Explanation
from drone_rl.trust.axes_table import NAMES
from drone_rl.trust.plots.saving import save_drawn
from drone_rl.utils.display import content_security_policy, page_environment, static_text
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import newest, to_file_name
from drone_rl.utils.text import FILTERS

PARTS: dict[str, Part] = {
    "verdict": behavior.VERDICT_PART,
    "scene_map": scene_map.PART,
    "shifts": behavior.SHIFTS_PART,
    "dataset": behavior.DATASET_PART,
    "tsne": embedding.PART,
    "flaws": behavior.FLAWS_PART,
    "importance": importance.PART,
    "class_model": class_models.PART,
    "attribution": attribution.PART,
    "truth": truth.PART,
    "response": response.RESPONSE_PART,
    "places": places.PART,
    "asymmetry": response.ASYMMETRY_PART,
    "left_out": behavior.LEFT_OUT_PART,
}
"""All parts in the order of the page, by the names of results in `Explanation`."""
STYLES = ("style.css", "report.css")  # files of the page's one style element
SCRIPTS = ("map.js",)
"""Files of the page's one script element; their data are in elements of type JSON."""


def find_explanations(which: Sequence[str], outputs: str | Path = "outputs") -> list[Path]:
    """Return folders of explanations, or raise InputError if there is none.

    `which` has such folders, folders that contain some, or only "latest": the newest run of
    `outputs`.
    """
    folders = [Path(path) for path in which]
    if tuple(which) == ("latest",):
        made = Path(outputs).glob("explain/runs/*/*/explanation.json")
        run = newest({path.parents[1] for path in made})
        if run is None:
            raise InputError(
                f"explanations=latest, but there is none under {outputs}/explain/runs; "
                "run drone-rl explain first or give folders"
            )
        folders = [run]
    explained: list[Path] = []
    for folder in folders:
        is_one = (folder / "explanation.json").is_file()
        inside = [folder] if is_one else sorted(p.parent for p in folder.glob("*/explanation.json"))
        if not inside:
            raise InputError(
                f"explanations={folder} holds no explanation.json; give a folder that drone-rl "
                "explain wrote"
            )
        explained += inside
    return explained


def write_report(folders: Sequence[Path], target: Path) -> Path:
    """Write report.html, and its figures in figures/; return the page's path.

    The folders hold one explanation each; one page shows all.

    Raises:
        InputError: An explanation can't be read or the report can't be written.
    """
    explanations = [Explanation.load(folder) for folder in folders]
    figures = target / "figures"
    try:
        figures.mkdir(parents=True, exist_ok=True)
        path = target / "report.html"
        path.write_text(render_page(explanations, figures), encoding="utf-8")
    except OSError as error:
        raise InputError(
            f"report in {target} can't be written ({error}); choose another folder"
        ) from error
    return path


def render_page(explanations: Sequence[Explanation], folder: Path) -> str:
    """Save the figures of some policies in a folder; return their page, as HTML."""
    parts = []
    for name, part in PARTS.items():
        if any(getattr(e, name, None) for e in explanations):
            html = render_section(name, explanations, folder)
            parts.append({"id": name, "title": part.title, "label": part.label, "html": html})
    environment = _environment()
    several = len({str(e.provenance.get("policy", e.name)) for e in explanations}) > 1
    style, script = static_text(environment, STYLES), static_text(environment, SCRIPTS)
    return environment.get_template("report.html").render(
        title="Can these policies be trusted?" if several else "Can this policy be trusted?",
        parts=[{**part, "html": Markup(part["html"])} for part in parts],
        summary=Markup(render_summary(explanations, [part["id"] for part in parts])),
        policies=explanations,
        policy=content_security_policy(style, script),
        style=style,
        script=script,
    )


def render_summary(explanations: Sequence[Explanation], sections: Sequence[str] = ()) -> str:
    """Return the summaries of some policies, with links to sections, as HTML."""
    return _environment().get_template("summary.html").render(policies=explanations, ids=sections)


def render_section(name: str, explanations: Sequence[Explanation], folder: Path) -> str:
    """Save a section's figures in a folder; return the section of the page, as HTML."""
    part = PARTS[name]
    results = ((getattr(e, name, None), e) for e in explanations)
    shown = {i: (of, e) for i, (of, e) in enumerate(results) if of}
    policies = [
        {
            "name": e.name,
            "e": e,
            "figures": _save(part.draw(of, e), folder, f"{i}_{to_file_name(e.name)}_"),
            **part.values(of, e),
        }
        for i, (of, e) in shown.items()
    ]
    return _environment().get_template(f"sections/{name}.html").render(policies=policies)


@functools.cache
def _environment() -> jinja2.Environment:
    """Return the templates of this page, compiled once."""
    environment = page_environment("drone_rl.explanations.report")
    environment.filters |= {
        **FILTERS,
        "axis": NAMES.__getitem__,
        "json": functools.partial(json.dumps, indent=1),
        "method": METHOD_NAMES.__getitem__,
    }
    return environment


def _save(drawn: Figures, folder: Path, prefix: str) -> dict[str, str | dict[str, str]]:
    """Save figures; return their data URIs by name, and by caption where a name has several."""
    saved: dict[str, str | dict[str, str]] = {}
    for name, one in drawn.items():
        path = folder / f"{prefix}{name}"
        if isinstance(one, Mapping):
            saved[name] = {
                caption: save_drawn(media, path.with_name(f"{path.name}_{i}"))
                for i, (caption, media) in enumerate(one.items(), start=1)
            }
        else:
            saved[name] = save_drawn(one, path)
    return saved
