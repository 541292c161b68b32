"""The report of a sweep: a CSV and a JSON for programs, one HTML page for people."""

import base64
import json
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import jinja2

from drone_rl.sweeps import figures
from drone_rl.sweeps.manifest import Sweep
from drone_rl.sweeps.summary import Group, Row, best_row, make_groups, read_rows, to_csv
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import write_atomically
from drone_rl.verdicts.kinds import KINDS


def write_report(sweep: Sweep) -> Path:
    """Writes `summary.csv`, `summary.json` and `report.html` into the sweep's folder.

    Returns:
        The page.
    """
    rows = read_rows(sweep)
    groups = make_groups(rows)
    found = summarise_sweep(sweep, rows, groups)
    write_atomically(sweep.folder / "summary.csv", to_csv(rows))
    write_atomically(sweep.folder / "summary.json", json.dumps(found, indent=2))
    page = sweep.folder / "report.html"
    write_atomically(page, _render(sweep.folder.name, found, _pictures(groups)))
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
    if not any(row.verdict for group in groups for row in group.finished):
        raise InputError(
            f"picture={path}: no run of {sweep.folder} is finished and judged yet; "
            "sweep with evaluate_after=200"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, figures.draw_outcome(figures.lay_out(groups)))


def summarise_sweep(sweep: Sweep, rows: Sequence[Row], groups: Sequence[Group]) -> dict[str, Any]:
    """All figures as plain values."""
    states = [row.state for row in rows]
    best = best_row(rows)
    return {
        "command": sweep.command,
        **{name: states.count(name) for name in ("finished", "failed", "damaged", "unfinished")},
        "best": None if best is None else {**best.plain(), "command": best.run.repeat_command()},
        "groups": [group.plain() for group in groups],
        "runs": [row.plain() for row in rows],
    }


def _pictures(groups: Sequence[Group]) -> list[dict[str, str]]:
    finished = [row for group in groups for row in group.finished]
    if not finished:
        return []
    layout = figures.lay_out(groups)
    pictures = [
        _picture(
            "Learning curves",
            "Interquartile mean over seeds; band: 95% bootstrap over runs. A run that has stopped "
            "counts as staying where it was.",
            figures.draw_curves(layout),
        ),
        _picture(
            "Frames to solve",
            "Each dot a run that reached its target; above: how many did.",
            figures.draw_costs(layout),
        ),
    ]
    if any(row.verdict for row in finished):
        verdicts = _picture(
            "What policies came out",
            "Share of runs by the verdict on their held-out episodes; bars: exact 95% "
            "(Clopper-Pearson) intervals.",
            figures.draw_verdicts(layout),
        )
        sides = _picture(
            "Which side is lost",
            "Each dot a run: the share of cubes that it collects of those on its right, less the "
            "share of those on its left. At 1 it has lost the left, at -1 the right.",
            figures.draw_sides(layout),
        )
        entropies = _picture(
            "What can still change",
            "Each dot a run: the mean entropy of its policy over the last updates; the line is "
            "that of a policy which doesn't care. At 0 it never tries another action again, so "
            "nothing can teach it one.",
            figures.draw_entropies(layout),
        )
        pictures[1:1] = [verdicts, sides, entropies]
    return pictures


def _picture(title: str, text: str, content: tuple[bytes, bytes]) -> dict[str, str]:
    light, dark = (f"data:image/png;base64,{base64.b64encode(c).decode()}" for c in content)
    return {"title": title, "text": text, "light": light, "dark": dark}


def _render(name: str, found: dict[str, Any], pictures: list[dict[str, str]]) -> str:
    source = resources.files("drone_rl.sweeps").joinpath("templates/report.html").read_text()
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("drone_rl.report"),  # the style that all reports share
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    environment.filters["figure"] = _figure
    return environment.from_string(source).render(
        name=name, figures=found, pictures=pictures, kinds=KINDS
    )


def _figure(value: object) -> str:
    """A cell of a table; what isn't known is left empty."""
    if isinstance(value, dict):
        middle = value.get("share", value.get("iqm"))
        if middle is None:
            return ""
        return f"{middle:.2f} [{value['lower95']:.2f}, {value['upper95']:.2f}]"
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
