"""Tables of the figures in docs/results.json."""

import math
import statistics
import string
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from benchmarks.ledger import Ledger, Origin
from benchmarks.peers.settings import LABELS, OURS, THEIRS
from benchmarks.robust import ALL_KINDS, ARMS
from benchmarks.robust_comparison import PLAIN, mean
from drone_rl.trust.axes import GROUPS

Figures = Mapping[str, Any]
UNKNOWN = "not measured yet"
_STATISTICS = {"min": min, "max": max, "median": statistics.median}
_PEER_COLUMNS = {
    "seconds from process start": ("seconds", ".1f"),
    "without imports": ("seconds_without_imports", ".1f"),
    "frames": ("frames", ","),
    "success rate, lower end of 95% CI": ("success_lower95", "%"),
}


class Row(NamedTuple):
    """A row of a table."""

    bench: str
    """Name of the benchmark that measures the quantity."""
    label: str
    format: str | Callable[[Figures], str]
    """Template of the cell, see `fill`, or a function of the figures."""
    target: str = ""


class _Formatter(string.Formatter):
    def get_field(self, field_name: str, args: Any, kwargs: Any) -> tuple[Any, str]:
        key, _, statistic = field_name.partition(".")
        value = kwargs[key]
        return (_STATISTICS[statistic](value) if statistic else value), key

    def format_field(self, value: Any, format_spec: str) -> str:
        if isinstance(value, bool):
            return "yes" if value else "no"
        if isinstance(value, Mapping | list):
            values = value.values() if isinstance(value, Mapping) else value
            return ", ".join(self.format_field(one, format_spec) for one in values)
        match format_spec:
            case "%":
                return f"{100 * value:.1f}%" if value >= 0.01 else f"{_two_digits(100 * value)}%"
            case "two digits":
                return _two_digits(value)
            case "minutes":
                return f"{value / 60:.1f}"
        return format(value, format_spec)


def fill(template: str, figures: Figures) -> str:
    """Insert figures into a template.

    Args:
        template: As for `str.format`. Lists are formatted value by value; `{key.median}` is a
            statistic of one. Further formats: "%" (one decimal, or two digits below 1%), "two
            digits" without exponent, and "minutes" from seconds.
        figures: The figures by key.

    Raises:
        KeyError: A figure is missing.
    """
    return _Formatter().vformat(template, (), figures)


def make_table(rows: Iterable[Row], figures: Figures) -> str:
    """Return a Markdown table: quantity, measured value, target, benchmark."""
    lines = [[r.label, make_cell(r, figures), r.target, f"`{r.bench}`"] for r in rows]
    return _table(["quantity", "measured", "target", "`drone-rl bench`"], lines)


def make_headlines(rows: Iterable[Row], figures: Figures) -> str:
    """Return a Markdown table of figures with the commands that measure them."""
    lines = [[r.label, make_cell(r, figures), f"`drone-rl bench {r.bench}`"] for r in rows]
    return _table(["measured", "result", "command"], lines)


def make_cell(row: Row, figures: Figures) -> str:
    """Return a row's figure, or UNKNOWN."""
    try:
        return row.format(figures) if callable(row.format) else fill(row.format, figures)
    except KeyError:
        return UNKNOWN


def list_origins(ledger: Ledger, names: Iterable[str]) -> str:
    """Return a table of date, revision and machine of each benchmark run.

    Args:
        ledger: The measurements.
        names: Names of all benchmarks; those that were never run are marked.
    """
    lines = []
    for name in sorted(names):
        origin = ledger.origins.get(name)
        cells = [origin.date, _revision(origin), origin.machine] if origin else [UNKNOWN, "", ""]
        lines.append([f"`{name}`", *cells])
    return _table(["`drone-rl bench`", "date", "revision", "machine"], lines)


def make_peers(figures: Figures) -> str:
    """Return a table with one row for each learner and one value for each seed."""
    lines = []
    for name, label in LABELS.items():
        settings = ", ".join(f"{key} {value:g}" for key, value in THEIRS.get(name, {}).items())
        ours = f"`{' '.join(['drone-rl train', *OURS.get(name, ())])}`"
        measured = figures.get("peers", {}).get(name)
        cells = [
            fill(f"{{{key}:{spec}}}", measured) if measured else UNKNOWN
            for key, spec in _PEER_COLUMNS.values()
        ]
        if unsolved := (measured or {}).get("is_solved", []).count(False):
            cells[2] += f" ({unsolved} not solved)"
        lines.append([label, settings or ours, *cells])
    return _table(["learner", "settings", *_PEER_COLUMNS], lines)


def make_robust(figures: Figures) -> str:
    """Return success rates of randomized training: a row for each group, a column for each arm."""
    arms, untouched = figures.get("robust_arms", {}), figures.get("robust_untouched", ())
    titles = {
        PLAIN: "training conditions",
        **{name: f"**{name}**" if name in untouched else name for name in GROUPS},
        "untouched": "**mean of the groups without randomization**",
        ALL_KINDS: "mean of all groups",
    }
    lines = [
        [title, *(_range(arms.get(arm, {}).get(name)) for arm in ARMS)]
        for name, title in titles.items()
    ]
    return _table(["success rate, %", *ARMS], lines)


def _range(rates: Sequence[float] | None) -> str:
    """Format the mean, minimum and maximum over seeds."""
    if not rates:
        return UNKNOWN
    return f"{100 * mean(rates):.0f} ({100 * min(rates):.0f} to {100 * max(rates):.0f})"


def _revision(origin: Origin) -> str:
    """Return the abbreviated revision of the measured checkout, with "-dirty" if it had changes."""
    if not origin.revision:
        return "unknown"
    commit, *suffix = origin.revision.split("-")
    return f"`{'-'.join([commit[:12], *suffix])}`"


def _table(head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *lines))


def _two_digits(value: float) -> str:
    rounded = float(f"{value:.2g}")
    decimals = 0 if rounded == 0 else max(0, 1 - math.floor(math.log10(abs(rounded))))
    return f"{rounded:,.{decimals}f}"
