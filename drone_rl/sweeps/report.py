"""`drone-rl sweep-report`: a CSV and a JSON file, an HTML page, and lines for a terminal.

It needs no torch unless the runs are judged again.
"""

import base64
import logging
import re
from pathlib import Path
from typing import TYPE_CHECKING

from markupsafe import Markup, escape

from drone_rl.sweeps import figures
from drone_rl.sweeps.manifest import Sweep, read_sweep
from drone_rl.sweeps.rows import read_rows
from drone_rl.sweeps.summary import (
    MIN_RUNS,
    RunMedian,
    Summary,
    make_groups,
    summarise_sweep,
    to_csv,
)
from drone_rl.trust.results import Verdict
from drone_rl.utils.display import content_security_policy, page_environment, static_text
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import folder_lock, last_of, newest, write_atomically
from drone_rl.utils.models import Seeded
from drone_rl.utils.run_result import read_result
from drone_rl.utils.text import FILTERS, render

if TYPE_CHECKING:
    from drone_rl.utils.seeding import RootSeed

STYLES = ("style.css", "sweep.css")
"""Style sheets of the page."""
_log = logging.getLogger(__name__)


def find_sweep(which: str | Path, outputs: str | Path = "outputs") -> Sweep:
    """Return the sweep in a folder, or with "latest" the newest one below `outputs`.

    Raises:
        InputError: There is none.
    """
    if which != "latest":
        return read_sweep(Path(which).absolute())
    last = newest(Path(outputs).glob("train/multiruns/*/sweep.json"))
    if last is None:
        raise InputError(
            f"folder=latest, but there is no sweep under {outputs}/train/multiruns; "
            "run drone-rl train -m first or give the folder of a sweep"
        )
    return read_sweep(last.parent.absolute())


def write_sweep_report(sweep: Sweep) -> tuple[Path, Summary]:
    """Write `summary.csv`, `summary.json` and `report.html` to the sweep's folder.

    Return the path of the page, and the summary.
    """
    rows = read_rows(sweep)
    summary = summarise_sweep(sweep, rows)
    write_atomically(sweep.folder / "summary.csv", to_csv(rows))
    summary.write_json(sweep.folder / "summary.json")
    page = sweep.folder / "report.html"
    write_atomically(page, render_page(sweep.folder.name, summary))
    return page, summary


def text_of(summary: Summary, part: str) -> str:
    """Return the sentences of one part of the report, such as "verdicts"."""
    return render("drone_rl.sweeps", "text.j2", s=summary, part=part, min_runs=MIN_RUNS)


def write_picture(sweep: Sweep, path: Path) -> None:
    """Write a plot of verdicts, sides and entropies as PNG.

    Raises:
        InputError: No run of the sweep is finished and judged.
    """
    rows = read_rows(sweep)
    if not any(row.kind for row in rows):
        raise InputError(
            f"picture={path}: no run of {sweep.folder} is finished and judged yet; "
            "sweep with evaluate_after=200, or give judge=true"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, figures.draw_outcome(figures.lay_out(make_groups(rows))))


def terminal_lines(summary: Summary) -> str:
    """Return the lines of a summary for a terminal."""
    lines = [text for part in ("runs", "verdicts") if (text := text_of(summary, part))]
    for group in summary.groups:
        choice = ", ".join(f"{k}={v}" for k, v in group.settings.items())
        lines.append(f"{choice or 'all':44} {render('drone_rl.sweeps', 'group.j2', g=group)}")
    lines += [f"run {row.run} {row.state}: {row.error}" for row in summary.runs if row.error]
    best = text_of(summary, "best")
    lines.append(f"best run: {best}" if summary.best else best)
    if summary.best:
        lines.append(f"to repeat it: {summary.best.command}")
    return "\n".join(lines)


def judge_sweep(sweep: Sweep, episodes: int, device: str) -> None:
    """Judge the last policies of all finished runs again; log those that can't be judged.

    Each verdict takes `episodes` episodes in selection environments.
    """
    from drone_rl.utils.seeding import root_seed  # imports torch

    seed = root_seed(None)
    _log.info("%s", Seeded(**seed.as_dict()).seed_line())
    finished = [run for run in sweep.runs if read_result(run.folder) is not None]
    for number, run in enumerate(finished, start=1):
        name = sweep.name_of(run)
        try:
            verdict = judge_run(run.folder, episodes, device, seed=seed)
            _log.info("[%d/%d] %s: %s", number, len(finished), name, verdict.kind.value)
        except InputError as error:
            _log.warning("[%d/%d] %s not judged: %s", number, len(finished), name, error)


def judge_run(
    folder: Path, episodes: int, device: str, *, seed: "RootSeed | None" = None
) -> Verdict:
    """Judge the last policy of a finished run and store the verdict in its result.json.

    All runs that are compared need the same root of the environments' streams; default: fresh.

    Raises:
        InputError: The run has no result, or its last checkpoint is unusable or of another frame.
    """
    from drone_rl.trust.verdict import judge_for_selection  # imports torch

    with folder_lock(folder):
        result = read_result(folder)
        if result is None:
            raise InputError(f"{folder} has no result.json; give the sweep's command to finish it")
        verdict, progress = judge_for_selection(last_of(folder), episodes, device, seed=seed)
        if progress.frames != result.frames:
            raise InputError(
                f"{folder}/checkpoints/last.pt is of frame {progress.frames}, result.json of "
                f"frame {result.frames}; resume with: drone-rl train resume={folder}"
            )
        result.with_verdict(verdict.as_dict()).write(folder)
    return verdict


def render_page(name: str, summary: Summary) -> str:
    """Return the HTML page of a sweep with this name."""
    environment = page_environment("drone_rl.sweeps", "drone_rl.explanations.report")  # for styles
    environment.filters |= {"median": _median, "number": _number, "code": _code, **FILTERS}
    style = static_text(environment, STYLES)
    parts = ("runs", "verdicts", "best", "curves", "outcome", "settings")
    return environment.get_template("report.html").render(
        name=name,
        summary=summary,
        plots=_plots(summary),
        texts={part: text_of(summary, part) for part in parts},
        policy=content_security_policy(style),
        style=style,
    )


def _plots(summary: Summary) -> dict[str, tuple[str, str]]:
    """Return title and data URI of each plot, by the part of the text below it."""
    layout, plots = figures.lay_out(summary.groups), {}
    if any(group.ended for group in summary.groups):
        plots["curves"] = "Learning curves", figures.draw_curves(layout)
    if summary.judged:
        plots["outcome"] = "Verdicts, sides and entropies", figures.draw_outcome(layout)
    note = f" (without {layout.left_out} further panels)" if layout.left_out else ""
    return {
        part: (title + note, f"data:image/png;base64,{base64.b64encode(png).decode()}")
        for part, (title, png) in plots.items()
    }


def _median(median: RunMedian) -> str:
    """Format a median or its lower bound, with the interval if there is one."""
    figure = median.median if median.more_than is None else median.more_than
    if figure is None:
        return ""
    text = ("" if median.more_than is None else ">") + _number(figure)
    if median.lower95 is None:
        return text
    upper = "more" if median.upper95 is None else _number(median.upper95)
    return f"{text} [{_number(median.lower95)}, {upper}]"


def _number(value: object) -> str:
    """Format a table cell; None is empty."""
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.4g}"
    return "" if value is None else str(value)


def _code(text: str) -> Markup:
    """Mark up `code` in a sentence and escape everything else."""
    return Markup(re.sub(r"`([^`]*)`", r"<code>\1</code>", str(escape(text))))
