"""Readers of YAML and CSV files that accept plain data of bounded size only."""

import csv
import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from drone_rl.utils.errors import InputError
from drone_rl.utils.files import parse_json, read_bytes
from drone_rl.utils.limits import (
    METRICS_BYTES,
    METRICS_CELLS,
    METRICS_ROWS,
    RESULT_BYTES,
    SWEEP_METRICS_BYTES,
    SWEEP_METRICS_CELLS,
    SWEEP_METRICS_ROWS,
    YAML_BYTES,
    YAML_DEPTH,
    YAML_VALUES,
    Allowance,
)
from drone_rl.utils.schema import Text, as_mapping

_DAMAGE = (
    *(yaml.YAMLError, RecursionError, ValueError, ArithmeticError),
    *(LookupError, TypeError, AttributeError),
)
"""What PyYAML raises for damaged content; not all of it is a `YAMLError`."""
NAMES_OF_0_1 = {
    "running_cubes": "running_reward",
    "train/running_cubes": "train/running_reward",
    "train/cubes": "train/reward",
    "num_cubes": "largest_reward",
}
"""Names of figures in results, metrics and checkpoints of version 0.1, and the current names."""


def with_current_names(figures: Mapping[str, Any]) -> dict[str, Any]:
    """Return figures under their current names, whichever version wrote them."""
    return {NAMES_OF_0_1.get(name, name): value for name, value in figures.items()}


def read_yaml(path: Path, most: int = YAML_BYTES) -> Any:
    """Return plain data from a YAML file; see `read_bytes` and `parse_yaml` for errors."""
    return parse_yaml(read_bytes(path, most), str(path))


def parse_yaml(content: bytes | str, where: str) -> Any:
    """Return plain data from YAML; `where` is its name for messages.

    Raises:
        InputError: It is damaged, too large, or holds anchors, aliases, tags or a name twice.
    """
    try:
        return yaml.load(content, _PlainLoader)  # a safe loader
    except InputError as error:
        raise InputError(f"{where} is damaged: no plain YAML ({error})") from None
    except yaml.MarkedYAMLError as error:
        raise InputError(yaml_mistake(error, where)) from None
    except _DAMAGE as error:
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise InputError(f"{where} is damaged: no plain YAML ({reason})") from None


def yaml_mistake(error: yaml.MarkedYAMLError, where: str) -> str:
    """Return the message about a line that is no YAML; `where` is the file's name."""
    remedy = "indent with spaces, not tabs" if "\\t" in f"{error.problem}" else "correct it"
    line = f"line {error.problem_mark.line + 1} of " if error.problem_mark else ""
    context = f"{error.context}: " if error.context else ""
    return f"{line}{where} is no YAML ({context}{error.problem}); {remedy}"


class _PlainLoader(yaml.SafeLoader):
    """Loads texts, numbers, dates, true, false, none, lists and mappings."""

    def __init__(self, stream: Any) -> None:
        super().__init__(stream)
        self._depth = self._values = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Compose a node, unless it refers to another one or names a type."""
        event = self.peek_event()
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None) is not None:
            raise InputError("anchors and aliases are not accepted; write values out")
        if getattr(event, "tag", None) is not None:
            raise InputError("tags are not accepted; write plain values")
        self._depth, self._values = self._depth + 1, self._values + 1
        if self._depth > YAML_DEPTH:
            raise InputError(f"it is nested more than {YAML_DEPTH} times")
        if self._values > YAML_VALUES:
            raise InputError(f"it holds more than {YAML_VALUES} values")
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        """Merge nothing: a quoted "<<" is a name like any other, and PyYAML refuses a plain one."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Construct a mapping with each name once."""
        made = super().construct_mapping(node, deep)
        if len(made) < len(node.value):
            names = [self.construct_object(key, deep) for key, _ in node.value]
            at = next(i for i, name in enumerate(names) if name in names[:i])
            mark = node.value[at][0].start_mark
            raise yaml.MarkedYAMLError(None, None, f"{names[at]} occurs twice", mark)
        return made


class TablesAllowance:
    """Limits on all tables of one command together."""

    def __init__(
        self,
        size: int = SWEEP_METRICS_BYTES,
        rows: int = SWEEP_METRICS_ROWS,
        cells: int = SWEEP_METRICS_CELLS,
    ) -> None:
        self.size = Allowance(size)
        self.rows = Allowance(rows, "rows")
        self.cells = Allowance(cells, "cells")


def read_table(path: Path, allowance: TablesAllowance | None = None) -> Iterator[list[str]]:
    """Yield the rows of a CSV file, its header first, without empty rows.

    `allowance` limits this file and others together.

    Raises:
        InputError: The file can't be read, is too large, or is no CSV.
    """
    if allowance is not None:
        allowance.size.take(_size(path), str(path))  # before it is read: there may be many
    content = read_bytes(path, METRICS_BYTES)
    rows = max(content.count(b"\n"), content.count(b"\r"))
    cells = content.count(b",")
    if rows > 1 + METRICS_ROWS:
        raise InputError(
            f"{path} has more than {METRICS_ROWS:,} rows; files of its kind have fewer"
        )
    if cells > METRICS_CELLS:
        raise InputError(
            f"{path} has more than {METRICS_CELLS:,} cells; files of its kind have fewer"
        )
    if allowance is not None:
        allowance.rows.take(rows, str(path))
        allowance.cells.take(cells, str(path))
    try:
        for row in csv.reader(io.StringIO(content.decode(), newline="")):
            if row:
                yield row
    except (csv.Error, UnicodeDecodeError) as error:
        raise InputError(f"{path} is damaged: no CSV ({error})") from None


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except (OSError, ValueError):
        return 0  # the reader reports the error


def read_result(folder: Path) -> dict[str, Any] | None:
    """Return `result.json` of a finished run, or None for an unfinished one."""
    try:
        content = read_bytes(folder / "result.json", RESULT_BYTES)
        result = as_mapping(parse_json(content, "result", allow_nan=True), "result")
        reason = Text(100).read(result.get("reason"), "reason")
    except InputError:
        return None
    return None if reason.startswith("SIG") else with_current_names(result)
