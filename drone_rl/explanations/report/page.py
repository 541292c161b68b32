"""From explanations to one HTML file that needs nothing else."""

import dataclasses
import functools
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from drone_rl.evaluation.plots.saving import save_drawn, save_numbers, save_rows
from drone_rl.explanations.report.explanation import FRAME, Explanation
from drone_rl.explanations.report.part import Drawn, Part
from drone_rl.explanations.report.sections import find_parts
from drone_rl.explanations.report.source_text import SENTENCES as SOURCE
from drone_rl.utils.display import content_security_policy, page_environment, static_text
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import to_file_name
from drone_rl.utils.limits import ARRAYS_BYTES, Allowance
from drone_rl.utils.text import percent, say

STYLES = ("style.css", "report.css")
"""Files of the page's one style element."""
SCRIPTS = ("map.js", "zoom.js")
"""Files of the page's one script element; parts give them data in elements of type JSON."""


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
    allowance = Allowance(ARRAYS_BYTES)
    loaded = [Explanation.load(folder, allowance) for folder in folders]
    policies = [
        Policy(explanation, target / "figures", f"{number}_{to_file_name(explanation.name)}")
        for number, explanation in enumerate(loaded)
    ]
    for policy in policies:
        policy.check()
    try:
        (target / "figures").mkdir(parents=True, exist_ok=True)
        path = target / "report.html"
        path.write_text(render_page(policies), encoding="utf-8")
    except jinja2.TemplateNotFound:
        raise  # an OSError too, of which the folder is not the cause
    except OSError as error:
        raise InputError(
            f"report in {target} can't be written ({error.strerror}); choose another folder"
        ) from error
    return path


@dataclasses.dataclass(frozen=True)
class Policy:
    """One explanation on its way to the page."""

    explanation: Explanation
    folder: Path
    """Of the figures."""
    prefix: str
    """Of the names of its files."""

    def check(self) -> None:
        """Make all sentences and tables once, so that a wrong number is found before rendering."""
        for part in find_parts().values():
            if part.fits(self.explanation):
                part.tables(self.explanation)
                for may in part.words.values():
                    say(may, self.explanation.numbers)

    def show(self, part: Part) -> dict[str, Any]:
        """Saves what a part makes of this policy; returns what the part's template needs."""
        for name, rows in part.tables(self.explanation).items():
            save_rows(rows, self.folder / f"{self.prefix}_{name}")
        for name in part.needs:
            save_numbers(self.explanation.numbers[name], self.folder / f"{self.prefix}_{name}")
        return {
            "name": self.explanation.name,
            "numbers": self.explanation.numbers,
            "actions": self.explanation.actions,
            "pictures": _save(part.draw(self.explanation), self.folder, f"{self.prefix}_"),
            "words": {n: say(may, self.explanation.numbers) for n, may in part.words.items()},
            "terms": self.explanation.terms,
            "extras": part.extras(self.explanation),
        }


def render_page(policies: Sequence[Policy]) -> str:
    """Return the page of some policies, as HTML."""
    environment = _environment()
    several = len(policies) > 1
    style, script = static_text(environment, STYLES), static_text(environment, SCRIPTS)
    return environment.get_template("report.html").render(
        title="Can these policies be trusted?" if several else "Can this policy be trusted?",
        parts=_parts(environment, policies),
        policies=[policy.explanation for policy in policies],
        sources=[_source(policy.explanation) for policy in policies],
        policy=content_security_policy(style, script),
        style=style,
        script=script,
    )


@functools.cache
def _environment() -> jinja2.Environment:
    """The templates of this page, compiled once."""
    environment = page_environment("drone_rl.explanations.report")
    environment.filters |= {"percent": _short, "json": _json}
    return environment


def _source(explanation: Explanation) -> str:
    """Which file the figures of a policy were read from."""
    return say(SOURCE, {**explanation.numbers, "source": explanation.source})


def _parts(environment: jinja2.Environment, policies: Sequence[Policy]) -> list[dict[str, Any]]:
    """Everything that is in the explanations, in the order of the page."""
    known = find_parts()
    htmls = {
        name: _part(environment.get_template(f"sections/{name}.html"), part, policies)
        for name, part in sorted(known.items(), key=lambda item: item[1].is_slow)
    }
    parts = [
        {"id": name, "title": part.title, "label": part.label, "html": htmls[name]}
        for name, part in known.items()
        if htmls[name]
    ]
    others = [(p.explanation, _others(p.explanation, known.values())) for p in policies]
    if any(keys for _, keys in others):
        html = Markup(environment.get_template("others.html").render(others=others))
        parts.append({"id": "others", "title": "Other numbers", "label": "Others", "html": html})
    return parts


def _others(explanation: Explanation, parts: Iterable[Part]) -> list[str]:
    """Entries that no part shows, such as those of a newer version."""
    shown = FRAME.union(*(part.needs for part in parts if part.fits(explanation)))
    return sorted(explanation.numbers.keys() - shown)


def _part(template: jinja2.Template, part: Part, policies: Sequence[Policy]) -> Markup | None:
    """One part with all policies that have it; None where none has."""
    fitting = [policy for policy in policies if part.fits(policy.explanation)]
    if not fitting:
        return None
    together = part.compare([policy.explanation for policy in fitting])
    shared = _save(together, fitting[0].folder, "")
    return Markup(template.render(policies=[p.show(part) for p in fitting], shared=shared))


def _save(drawn: Drawn, folder: Path, prefix: str) -> Mapping[str, str]:
    return {name: save_drawn(one, folder / f"{prefix}{name}") for name, one in drawn.items()}


def _short(share: float) -> str:
    """A share for a table."""
    return percent(share).replace("less than ", "<").replace("more than ", ">")


def _json(value: Any) -> str:
    return json.dumps(value, indent=1)
