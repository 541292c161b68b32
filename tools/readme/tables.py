"""Tables of figures out of docs/results.json: what was measured, what was asked for, by what."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from benchmarks.ledger import Ledger, Origin

Figures = Mapping[str, Any]
UNKNOWN = "not measured yet"


class Row(NamedTuple):
    """A line of a table."""

    bench: str
    """The benchmark that measures it."""
    what: str
    measured: Callable[[Figures], str]
    """Takes what it needs by key; a key that is missing leaves the cell unmeasured."""
    asked: str = ""


def make_table(rows: Iterable[Row], figures: Figures) -> str:
    """A table in Markdown."""
    lines = [f"| {r.what} | {make_cell(r, figures)} | {r.asked} | `{r.bench}` |" for r in rows]
    head = ["| what | measured | asked for | `drone-rl bench` |", "| --- | --- | --- | --- |"]
    return "\n".join([*head, *lines])


def list_figures(ledger: Ledger) -> str:
    """A table in Markdown: every figure by its key, its benchmark, and when that was run."""
    lines = [
        "| figure | value | `drone-rl bench` | revision | day |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, origin in sorted(ledger.origins.items()):
        of = f"`{name}` | {_revision(origin)} | {origin.date}"
        lines += [f"| `{k}` | {_short(ledger.figures[k])} | {of} |" for k in origin.keys]
    return "\n".join(lines)


def list_origins(ledger: Ledger, names: Iterable[str] = ()) -> str:
    """A table in Markdown: when, where and at which revision each benchmark was run.

    Args:
        ledger: What was measured.
        names: Of all benchmarks; one that was never run is listed as such.
    """
    lines = ["| `drone-rl bench` | run | revision | on |", "| --- | --- | --- | --- |"]
    for name in sorted({*ledger.origins, *names}):
        origin = ledger.origins.get(name)
        if origin is None:
            lines.append(f"| `{name}` | {UNKNOWN} |  |  |")
        else:
            line = f"| `{name}` | {origin.date} | {_revision(origin)} | {origin.machine} |"
            lines.append(line)
    return "\n".join(lines)


def _revision(origin: Origin) -> str:
    """Of the measured checkout, abbreviated; with "-dirty" if it had changes."""
    if not origin.revision:
        return "unknown"
    commit, *changed = origin.revision.split("-")
    return f"`{'-'.join([commit[:12], *changed])}`"


def _short(value: Any) -> str:
    """A number, a text, or a list of them; of what is longer only its size."""
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list) and len(value) <= 8 and not any(isinstance(v, dict) for v in value):
        return ", ".join(map(_short, value)) or "none"
    if isinstance(value, dict | list):
        return f"{len(value)} entries" if value else "none"
    return str(value)


def make_cell(row: Row, figures: Figures) -> str:
    """Return a row's figure, or that it was not measured."""
    try:
        return row.measured(figures)
    except KeyError:
        return UNKNOWN
