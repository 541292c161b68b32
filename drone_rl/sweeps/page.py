"""The report of a sweep: a CSV and a JSON for programs, one HTML page for people."""

import base64
import html
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from drone_rl.sweeps.manifest import Sweep
from drone_rl.sweeps.summary import Group, Row, best_row, make_groups, read_rows, to_csv
from drone_rl.utils.files import write_atomically

_STYLE = """\
:root { color-scheme: light dark; --line: #8884; }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 72rem; margin: 2rem auto; padding: 0 1rem; }
table { border-collapse: collapse; font-size: 13px; display: block; overflow-x: auto; }
th, td { padding: .2rem .6rem; border-bottom: 1px solid var(--line); text-align: left; }
code { font-size: 13px; overflow-wrap: anywhere; } img { max-width: 100%; }
.failed, .damaged { color: #d33; }
"""


def write_report(sweep: Sweep) -> Path:
    """Writes `summary.csv`, `summary.json` and `report.html` into the sweep's folder.

    Returns:
        The page.
    """
    rows = read_rows(sweep)
    groups = make_groups(rows)
    write_atomically(sweep.folder / "summary.csv", to_csv(rows))
    content = json.dumps(summary(sweep, rows, groups), indent=2)
    write_atomically(sweep.folder / "summary.json", content)
    page = sweep.folder / "report.html"
    write_atomically(page, _page(sweep, rows, groups))
    return page


def summary(sweep: Sweep, rows: Sequence[Row], groups: Sequence[Group]) -> dict[str, Any]:
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


def _page(sweep: Sweep, rows: Sequence[Row], groups: Sequence[Group]) -> str:
    figures = summary(sweep, rows, groups)
    counts = ", ".join(
        f"{figures[name]} {name}"
        for name in ("finished", "failed", "damaged", "unfinished")
        if figures[name]
    )
    name = html.escape(sweep.folder.name)
    parts = [
        f"<h1>Sweep {name}</h1>",
        f"<p>{len(rows)} runs: {counts}.</p><p><code>{html.escape(sweep.command)}</code></p>",
        _best(figures["best"]),
        _pictures(groups),
        f"<h2>Settings</h2>{_table([_group_cells(g) for g in figures['groups']])}",
        f"<h2>Runs</h2>{_table([_run_cells(row) for row in rows])}",
    ]
    body = "\n".join(parts)
    return (
        f"<!doctype html>\n<html lang='en'><head><meta charset='utf-8'><title>{name}</title>"
        f"<meta name='viewport' content='width=device-width'><style>{_STYLE}</style></head>"
        f"<body>\n{body}\n</body></html>\n"
    )


def _best(best: dict[str, Any] | None) -> str:
    if best is None:
        return "<p>No run has finished yet.</p>"
    return (
        f"<h2>Best run</h2><p>Run {best['run']}, {_link(best['folder'])}; the same again:</p>"
        f"<p><code>{html.escape(best['command'])}</code></p>"
    )


def _pictures(groups: Sequence[Group]) -> str:
    if not any(group.finished for group in groups):
        return ""
    from drone_rl.sweeps import figures  # matplotlib is slow to import

    layout = figures.lay_out(groups)
    parts = [
        _picture(
            "Learning curves",
            "Interquartile mean over seeds; band: 95% bootstrap over runs.",
            figures.draw_curves(layout),
        )
    ]
    if any(row.verdict for group in groups for row in group.finished):
        parts.append(
            _picture(
                "What policies came out",
                "Share of runs by the verdict on their held-out episodes; bars: exact 95% "
                "(Clopper-Pearson) intervals.",
                figures.draw_verdicts(layout),
            )
        )
    parts.append(
        _picture(
            "Frames to solve",
            "Each dot a run that reached its target; above: how many did.",
            figures.draw_costs(layout),
        )
    )
    return "\n".join(parts)


def _picture(title: str, text: str, pictures: tuple[bytes, bytes]) -> str:
    light, dark = (base64.b64encode(p).decode() for p in pictures)
    data = "data:image/png;base64,"
    return (
        f"<h2>{title}</h2><p>{text}</p><picture>"
        f"<source media='(prefers-color-scheme: dark)' srcset='{data}{dark}'>"
        f"<img alt='{title}' src='{data}{light}'></picture>"
    )


def _table(rows: Sequence[dict[str, str]]) -> str:
    """Cells are HTML already; headings are not."""
    if not rows:
        return ""
    head = "".join(f"<th>{html.escape(name)}</th>" for name in rows[0])
    lines = ("".join(f"<td>{cell}</td>" for cell in row.values()) for row in rows)
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f"<table><tr>{head}</tr>{body}</table>"


def _group_cells(group: dict[str, Any]) -> dict[str, str]:
    cells = {}
    for name, value in group.items():
        if name == "verdicts":
            cells |= {kind: _share(share) for kind, share in value.items()}
        elif isinstance(value, dict):
            cells[name] = _share(value)
        else:
            cells[name] = _text(value)
    return cells


def _run_cells(row: Row) -> dict[str, str]:
    cells = {name: _text(value) for name, value in row.plain().items()}
    cells["state"] = f"<span class='{row.state}'>{row.state}</span>"
    cells["folder"] = _link(row.run.folder.name)
    return cells


def _share(value: dict[str, Any]) -> str:
    middle = value.get("share", value.get("iqm"))
    if middle is None:
        return ""
    return f"{middle:.2f} [{value['lower95']:.2f}, {value['upper95']:.2f}]"


def _text(value: object) -> str:
    if value is None:
        return ""
    return f"{value:.3g}" if isinstance(value, float) else html.escape(str(value))


def _link(folder: str) -> str:
    from urllib.parse import quote

    return f"<a href='{quote(folder)}/'>{html.escape(folder)}</a>"
