"""Tables of the figures in docs/results.json: quantity, measured value, target, benchmark."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

from benchmarks.ledger import Ledger, Origin

Figures = Mapping[str, Any]
UNKNOWN = "not measured yet"


class Row(NamedTuple):
    """A row of a table."""

    bench: str
    """Name of the benchmark that measures the quantity."""
    label: str
    format: Callable[[Figures], str]
    """Formats the figures; if it raises a KeyError, the cell says that they are not measured."""
    target: str = ""


def percent(share: float) -> str:
    """Format a fraction in percent with one decimal, or with two digits if it is smaller."""
    value = 100 * share
    return f"{value:.1f}%" if value >= 1 else f"{_plain(value)}%"


def seconds(value: float) -> str:
    """Format seconds with two significant digits."""
    return f"{_plain(value)} s"


def _plain(value: float) -> str:
    """Format a number with two significant digits and no exponent."""
    rounded = float(f"{value:.2g}")
    decimals = 0 if rounded == 0 else max(0, 1 - math.floor(math.log10(abs(rounded))))
    return f"{rounded:,.{decimals}f}"


def make_table(rows: Iterable[Row], figures: Figures) -> str:
    """Return a Markdown table."""
    lines = [f"| {r.label} | {make_cell(r, figures)} | {r.target} | `{r.bench}` |" for r in rows]
    head = ["| quantity | measured | target | `drone-rl bench` |", "| --- | --- | --- | --- |"]
    return "\n".join([*head, *lines])


def list_figures(ledger: Ledger) -> str:
    """Return a Markdown table of every figure with its key, benchmark, revision and date."""
    lines = [
        "| figure | value | `drone-rl bench` | revision | date |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, origin in sorted(ledger.origins.items()):
        source = f"`{name}` | {_revision(origin)} | {origin.date}"
        lines += [f"| `{k}` | {_short(ledger.figures[k])} | {source} |" for k in origin.keys]
    return "\n".join(lines)


def list_origins(ledger: Ledger, names: Iterable[str] = ()) -> str:
    """Return a Markdown table of date, revision and machine of each benchmark run.

    Args:
        ledger: The measurements.
        names: Names of all benchmarks; those that were never run are marked.
    """
    lines = ["| `drone-rl bench` | date | revision | machine |", "| --- | --- | --- | --- |"]
    for name in sorted({*ledger.origins, *names}):
        origin = ledger.origins.get(name)
        if origin is None:
            lines.append(f"| `{name}` | {UNKNOWN} |  |  |")
        else:
            lines.append(f"| `{name}` | {origin.date} | {_revision(origin)} | {origin.machine} |")
    return "\n".join(lines)


def _revision(origin: Origin) -> str:
    """Return the abbreviated revision of the measured checkout, with "-dirty" if it had changes."""
    if not origin.revision:
        return "unknown"
    commit, *suffix = origin.revision.split("-")
    return f"`{'-'.join([commit[:12], *suffix])}`"


def _short(value: Any) -> str:
    """Format a number, a short string or list of them, or the size of what is longer."""
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= 1e4 else f"{value:.4g}"
    if isinstance(value, list) and len(value) <= 8 and not any(isinstance(v, dict) for v in value):
        return ", ".join(map(_short, value)) or "none"
    if isinstance(value, dict | list):
        return f"{len(value)} entries" if value else "none"
    text = str(value)
    return text if len(text) <= 100 else f"{len(text)} characters"


def make_cell(row: Row, figures: Figures) -> str:
    """Return a row's figure, or UNKNOWN."""
    try:
        return row.format(figures)
    except KeyError:
        return UNKNOWN
