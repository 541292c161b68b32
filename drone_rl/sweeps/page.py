"""The report of a sweep: a CSV and a JSON for programs, one HTML page for people."""

import base64
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup, escape

from drone_rl.sweeps import figures
from drone_rl.sweeps.groups import Group, make_groups
from drone_rl.sweeps.manifest import Sweep
from drone_rl.sweeps.rows import read_rows
from drone_rl.sweeps.summary import summarise_sweep, to_csv
from drone_rl.utils.display import content_security_policy, page_environment, static_text
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import write_atomically

STYLES = ("style.css", "sweep.css")
"""Files of the page's one style element."""


def write_sweep_report(sweep: Sweep) -> Path:
    """Writes `summary.csv`, `summary.json` and `report.html` into the sweep's folder.

    Returns:
        The page.
    """
    rows = read_rows(sweep)
    summary = summarise_sweep(sweep, rows)
    write_atomically(sweep.folder / "summary.csv", to_csv(rows))
    write_atomically(sweep.folder / "summary.json", json.dumps(summary, indent=2))
    pictures = _pictures(make_groups(rows), summary["sentences"])
    page = sweep.folder / "report.html"
    write_atomically(page, render_page(sweep.folder.name, summary, pictures))
    return page


def write_picture(sweep: Sweep, path: Path) -> None:
    """Writes what policies came out, which sides they lost and whether they can still change.

    Args:
        sweep: With runs whose policies were judged.
        path: Of the PNG.

    Raises:
        InputError: No run of the sweep is finished and judged.
    """
    groups = make_groups(read_rows(sweep))
    if not any(row.kind for group in groups for row in group.finished):
        raise InputError(
            f"picture={path}: no run of {sweep.folder} is finished and judged yet; "
            "sweep with evaluate_after=200, or give judge=true"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, figures.draw_outcome(figures.lay_out(groups)))


def _pictures(groups: Sequence[Group], sentences: Mapping[str, str]) -> list[dict[str, str]]:
    ended = [row for group in groups for row in group.known]
    if not ended:
        return []
    layout = figures.lay_out(groups)
    drawn = [("Learning curves", "curves.", figures.draw_curves)]
    if any(row.kind for row in ended):
        drawn += [
            ("What policies came out", "shares.", figures.draw_verdicts),
            ("Which side is lost", "sides.", figures.draw_sides),
            ("Entropy at the end", "entropies.", figures.draw_entropies),
        ]
    drawn += [("Frames to solve", "costs.", figures.draw_costs)]
    return [_picture(title, _paragraph(sentences, of), draw(layout)) for title, of, draw in drawn]


def _picture(title: str, text: str, content: tuple[bytes, bytes]) -> dict[str, str]:
    light, dark = (f"data:image/png;base64,{base64.b64encode(c).decode()}" for c in content)
    return {"title": title, "text": text, "light": light, "dark": dark}


def _paragraph(sentences: Mapping[str, str], of: str) -> str:
    """The sentences of one part of the page, as a paragraph."""
    return " ".join(text for name, text in sentences.items() if name.startswith(of))


def render_page(name: str, summary: dict[str, Any], pictures: list[dict[str, str]]) -> str:
    """Return the page of a sweep, as HTML.

    Args:
        name: Of the sweep.
        summary: From `summarise_sweep`.
        pictures: Each with "title", "text", and data URIs for a "light" and for a "dark" page.
    """
    environment = page_environment(
        "drone_rl.sweeps", "drone_rl.explanations.report"
    )  # which share a style
    environment.filters |= {"figure": _figure, "code": _code}
    style = static_text(environment, STYLES)
    parts = ("runs", "verdicts", "best", "settings")
    texts = {part: _paragraph(summary["sentences"], f"{part}.") for part in parts}
    return environment.get_template("report.html").render(
        name=name,
        figures=summary,
        pictures=pictures,
        texts=texts,
        policy=content_security_policy(style),
        style=style,
    )


def _figure(value: object) -> str:
    """A cell of a table; what isn't known is left empty."""
    if isinstance(value, dict) and "more_than" in value:
        return _median(value)
    if isinstance(value, dict):
        if value["share"] is None:
            return ""
        return _share(value)
    if value is None:
        return ""
    return _number(value) if isinstance(value, float) else str(value)


def _share(value: Mapping[str, Any]) -> str:
    """A share of the runs of which it is known, with the interval that allows for the others."""
    unknown = value.get("unknown", 0)
    if unknown == value["trials"]:
        return "not known"
    certain = value.get("certain", value["successes"])
    few = "" if certain == value["successes"] else f", {certain} certain"
    more = f", {unknown} not known" if unknown else ""
    count = f"{value['successes']}/{value['trials'] - unknown}{few}{more}"
    return f"{count} [{value['lower95']:.2f}, {value['upper95']:.2f}]"


def _median(value: Mapping[str, Any]) -> str:
    """A median with its interval, or what it is more than; no interval of few runs."""
    middle, beyond = value["median"], value["more_than"]
    if beyond is not None:
        text = f">{_number(beyond)}"
    elif middle is not None:
        text = _number(middle)
    else:
        return ""
    if value["lower95"] is None:
        return text
    upper = "more" if value["upper95"] is None else _number(value["upper95"])
    return f"{text} [{_number(value['lower95'])}, {upper}]"


def _number(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.4g}"


def _code(text: str) -> Markup:
    """A sentence in which `commands` stand out, and nothing else is markup."""
    return Markup(re.sub(r"`([^`]*)`", r"<code>\1</code>", str(escape(text))))
