"""`drone-rl report`: build one self-contained HTML file from explanations, and its figures."""

import dataclasses
import functools
import json
from collections.abc import Collection, Mapping, Sequence
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
from drone_rl.trust.plots.saving import save_drawn, save_numbers, save_rows
from drone_rl.utils.display import content_security_policy, page_environment, static_text
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import newest, to_file_name
from drone_rl.utils.limits import ARRAYS_BYTES, Allowance
from drone_rl.utils.text import percent, said, say

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
SCRIPTS = ("map.js", "zoom.js", "save.js")
"""Files of the page's one script element; their data are in elements of type JSON."""
_INCOMPLETE = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError)
"""Errors while rendering that a missing number or one of another type causes."""


def report(folders: Sequence[Path], target: Path) -> Path:
    """Build a report, see `write_report`.

    Raises:
        InputError: An explanation can't be read or is incomplete, or the report can't be written.
    """
    try:
        return write_report(folders, target)
    except (*_INCOMPLETE, jinja2.TemplateError) as error:
        if isinstance(error, InputError):
            raise
        names = ", ".join(map(str, folders))
        raise InputError(
            f"explanations={names} lack entries that a report needs "
            f"({type(error).__name__}: {str(error)[:200]}); run drone-rl explain again"
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
    found: list[Path] = []
    for folder in folders:
        is_one = (folder / "explanation.json").is_file()
        inside = [folder] if is_one else sorted(p.parent for p in folder.glob("*/explanation.json"))
        if not inside:
            raise InputError(
                f"explanations={folder} holds no explanation.json; give a folder that drone-rl "
                "explain wrote"
            )
        found += inside
    return found


def write_report(folders: Sequence[Path], target: Path) -> Path:
    """Write report.html, and figures with their numbers in figures/; return the page's path.

    The folders hold one explanation each; one page shows all.

    Raises:
        InputError: An explanation can't be read or the report can't be written.
    """
    allowance = Allowance(ARRAYS_BYTES)
    loaded = [Explanation.load(folder, allowance) for folder in folders]
    figures = target / "figures"
    policies = [Policy(e, figures, f"{i}_{to_file_name(e.name)}") for i, e in enumerate(loaded)]
    for policy in policies:
        policy.check()
    try:
        figures.mkdir(parents=True, exist_ok=True)
        path = target / "report.html"
        path.write_text(render_page(policies), encoding="utf-8")
    except jinja2.TemplateNotFound:
        raise  # also an OSError, but not caused by the folder
    except OSError as error:
        raise InputError(
            f"report in {target} can't be written ({error.strerror}); choose another folder"
        ) from error
    return path


@dataclasses.dataclass(frozen=True)
class Policy:
    """One explanation and where its figures are saved."""

    explanation: Explanation
    folder: Path  # folder of the figures
    prefix: str  # start of their file names

    def check(self) -> None:
        """Make all sentences and tables once, so that a wrong number is found before rendering."""
        for part in PARTS.values():
            if part.fits(self.explanation):
                part.tables(self.explanation)
                for paragraph in part.text.values():
                    said(paragraph, self.explanation.numbers)

    def show(self, part: Part) -> dict[str, Any]:
        """Save the figures and numbers of a part; return what its template needs."""
        explanation, numbers = self.explanation, self.explanation.numbers
        found = {
            name: [*said(paragraph, numbers).values()] for name, paragraph in part.text.items()
        }
        for name, rows in part.tables(explanation).items():
            save_rows(rows, self.folder / f"{self.prefix}_{name}")
        for name in part.needs:
            save_numbers(numbers[name], self.folder / f"{self.prefix}_{name}")
        return {
            "name": explanation.name,
            "numbers": numbers,
            "actions": explanation.actions,
            "pictures": _save(part.draw(explanation), self.folder, f"{self.prefix}_"),
            "text": {name: " ".join(claims) for name, claims in found.items()},
            "found": found,
            "terms": explanation.terms,
            "extras": part.extras(explanation),
        }


def render_page(policies: Sequence[Policy]) -> str:
    """Return the page of some policies, as HTML."""
    environment = _environment()
    explanations = [policy.explanation for policy in policies]
    fitting = {name for name, part in PARTS.items() if any(map(part.fits, explanations))}
    style, script = static_text(environment, STYLES), static_text(environment, SCRIPTS)
    return environment.get_template("report.html").render(
        title="Can these policies be trusted?" if policies[1:] else "Can this policy be trusted?",
        parts=_parts(environment, policies),
        policies=explanations,
        summaries=[(e.name, summary_lines(e, fitting)) for e in explanations],
        sources=[say(behavior.say_source, {**e.numbers, "source": e.source}) for e in explanations],
        policy=content_security_policy(style, script),
        style=style,
        script=script,
    )


def summary_lines(explanation: Explanation, parts: Collection[str]) -> list[tuple[str, ...]]:
    """Return label, section (empty if it is not among the parts) and text of each line."""
    lines: list[tuple[str, ...]] = []
    for name, text in said(summary.say_summary, explanation.numbers).items():
        label, section = summary.LINES[name.removeprefix("summary.").partition("_")[0]]
        lines.append((label, section if section in parts else "", text))
    return lines


@functools.cache
def _environment() -> jinja2.Environment:
    """Return the templates of this page, compiled once."""
    environment = page_environment("drone_rl.explanations.report")
    environment.filters |= {
        "percent": lambda of: percent(of).replace("less than ", "<").replace("more than ", ">"),
        "json": functools.partial(json.dumps, indent=1),
    }
    return environment


def _parts(environment: jinja2.Environment, policies: Sequence[Policy]) -> list[dict[str, Any]]:
    """Return the parts that some explanation fits, in the order of the page."""
    htmls = {
        name: _render(environment.get_template(f"sections/{name}.html"), part, policies)
        for name, part in sorted(PARTS.items(), key=lambda item: item[1].is_slow)
    }
    parts = [
        {"id": name, "title": part.title, "label": part.label, "html": htmls[name]}
        for name, part in PARTS.items()
        if htmls[name]
    ]
    others = []
    for explanation in (policy.explanation for policy in policies):
        shown = HEADER.union(*(part.needs for part in PARTS.values() if part.fits(explanation)))
        others.append((explanation, sorted(explanation.numbers.keys() - shown)))
    if any(keys for _, keys in others):
        html = Markup(environment.get_template("others.html").render(others=others))
        parts.append({"id": "others", "title": "Other numbers", "label": "Others", "html": html})
    return parts


def _render(template: jinja2.Template, part: Part, policies: Sequence[Policy]) -> Markup | None:
    """Return one part with all policies that it fits; None if there is none."""
    if not (fitting := [policy for policy in policies if part.fits(policy.explanation)]):
        return None
    _save(part.compare([policy.explanation for policy in fitting]), fitting[0].folder, "")
    return Markup(template.render(policies=[policy.show(part) for policy in fitting]))


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
