"""`drone-rl report`: build one self-contained HTML file from explanations, and its figures."""

import dataclasses
import functools
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from drone_rl.explanations.report import (
    attribution,
    behavior,
    class_models,
    embedding,
    places,
    response,
    summary,
    truth,
)
from drone_rl.explanations.report.explanation import HEADER, Explanation, Figures, Part
from drone_rl.trust.plots.saving import save_drawn
from drone_rl.utils.display import content_security_policy, page_environment, static_text
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import newest, to_file_name
from drone_rl.utils.text import rate, said, say

PARTS: dict[str, Part] = {
    "evaluation": behavior.EVALUATION_PART,
    "shifts": behavior.SHIFTS_PART,
    "dataset": behavior.DATASET_PART,
    "embedding": embedding.PART,
    "flaws": behavior.FLAWS_PART,
    "class_models": class_models.PART,
    "attribution": attribution.PART,
    "truth": truth.PART,
    "response": response.RESPONSE_PART,
    "places": places.PART,
    "asymmetry": response.ASYMMETRY_PART,
    "left_out": behavior.LEFT_OUT_PART,
}
"""All parts in the order of the page, by the names of `explanations.explain.SECTIONS`; entries of
an explanation that no part shows are printed as JSON."""
STYLES = ("style.css", "report.css")  # files of the page's one style element
SCRIPTS = ("map.js",)
"""Files of the page's one script element; their data are in elements of type JSON."""


def report(folders: Sequence[Path], target: Path) -> Path:
    """Build a report, see `write_report`.

    Raises:
        InputError: An explanation can't be read or is incomplete, or the report can't be written.
    """
    try:
        return write_report(folders, target)
    except InputError:
        raise
    except (LookupError, TypeError, ValueError, AttributeError, jinja2.UndefinedError) as error:
        raise InputError(
            f"explanations={', '.join(map(str, folders))} lack entries that a report needs "
            f"({type(error).__name__}: {error}); run drone-rl explain again"
        ) from error


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
    loaded = [Explanation.load(folder) for folder in folders]
    figures = target / "figures"
    policies = [PolicyPage(e, figures, f"{i}_{to_file_name(e.name)}") for i, e in enumerate(loaded)]
    try:
        figures.mkdir(parents=True, exist_ok=True)
        path = target / "report.html"
        path.write_text(render_page(policies), encoding="utf-8")
    except OSError as error:
        raise InputError(
            f"report in {target} can't be written ({error}); choose another folder"
        ) from error
    return path


@dataclasses.dataclass(frozen=True)
class PolicyPage:
    """One explanation and where its figures are saved."""

    explanation: Explanation
    folder: Path  # folder of the figures
    prefix: str  # start of their file names

    def show(self, part: Part) -> dict[str, Any]:
        """Save the figures of a part; return what its template needs."""
        explanation, numbers = self.explanation, self.explanation.numbers
        claims = {name: [*said(text, numbers).values()] for name, text in part.text.items()}
        return {
            "name": explanation.name,
            "numbers": numbers,
            "actions": explanation.actions,
            "pictures": _save(part.draw(explanation), self.folder, f"{self.prefix}_"),
            "text": {name: " ".join(sentences) for name, sentences in claims.items()},
            "claims": claims,
            "terms": explanation.terms,
            "extras": part.extras(explanation),
        }


def render_page(policies: Sequence[PolicyPage]) -> str:
    """Return the page of some policies, as HTML."""
    environment = _environment()
    explanations = [policy.explanation for policy in policies]
    style, script = static_text(environment, STYLES), static_text(environment, SCRIPTS)
    return environment.get_template("report.html").render(
        title="Can these policies be trusted?" if policies[1:] else "Can this policy be trusted?",
        parts=_parts(environment, policies),
        policies=explanations,
        summaries=[(e.name, said(summary.say_summary, e.numbers)) for e in explanations],
        lines=summary.LINES,
        sources=[say(behavior.say_source, {**e.numbers, "source": e.source}) for e in explanations],
        policy=content_security_policy(style, script),
        style=style,
        script=script,
    )


@functools.cache
def _environment() -> jinja2.Environment:
    """Return the templates of this page, compiled once."""
    environment = page_environment("drone_rl.explanations.report")
    environment.filters |= {"rate": rate, "json": functools.partial(json.dumps, indent=1)}
    return environment


def _parts(environment: jinja2.Environment, policies: Sequence[PolicyPage]) -> list[dict[str, Any]]:
    """Return the parts that some explanation fits, in the order of the page."""
    parts = []
    for name, part in PARTS.items():
        if fitting := [policy for policy in policies if part.fits(policy.explanation)]:
            _save(part.compare([policy.explanation for policy in fitting]), fitting[0].folder, "")
            template = environment.get_template(f"sections/{name}.html")
            html = Markup(template.render(policies=[policy.show(part) for policy in fitting]))
            parts.append({"id": name, "title": part.title, "label": part.label, "html": html})
    displayed = HEADER.union(*(part.needs for part in PARTS.values()))
    others = [(p.explanation, sorted(p.explanation.numbers.keys() - displayed)) for p in policies]
    if any(keys for _, keys in others):
        html = Markup(environment.get_template("others.html").render(others=others))
        parts.append({"id": "others", "title": "Other numbers", "label": "Others", "html": html})
    return parts


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
