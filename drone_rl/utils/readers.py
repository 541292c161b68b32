"""Readers of YAML and CSV files that accept plain data of bounded size only."""

import csv
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import yaml

from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_bytes
from drone_rl.utils.limits import METRICS_BYTES, YAML_BYTES


def read_yaml(path: Path, most: int = YAML_BYTES) -> Any:
    """Return plain data from a YAML file; see `read_bytes` and `parse_yaml` for errors."""
    return parse_yaml(read_bytes(path, most), str(path))


def parse_yaml(content: bytes | str, where: str) -> Any:
    """Return plain data from YAML; `where` is its name for messages.

    Raises:
        InputError: It is damaged, or holds aliases, objects or a name twice.
    """
    try:
        return yaml.load(content, _PlainLoader)  # a safe loader
    except yaml.MarkedYAMLError as error:
        raise InputError(yaml_mistake(error, where)) from None
    except Exception as error:  # PyYAML raises more than `YAMLError` for damaged content
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise InputError(f"{where} is damaged: no plain YAML ({reason})") from None


def yaml_mistake(error: yaml.MarkedYAMLError, where: str) -> str:
    """Return the message about a line that is no YAML; `where` is the file's name."""
    remedy = "indent with spaces, not tabs" if "\\t" in f"{error.problem}" else "correct it"
    line = f"line {error.problem_mark.line + 1} of " if error.problem_mark else ""
    context = f"{error.context}: " if error.context else ""
    return f"{line}{where} is no YAML ({context}{error.problem}); {remedy}"


class _PlainLoader(yaml.SafeLoader):
    """Loads plain values, lists and mappings."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        """Compose a node that is no alias: a few aliases of aliases expand to gigabytes."""
        if self.check_event(yaml.AliasEvent):
            raise InputError("aliases are not accepted; write values out")
        return super().compose_node(parent, index)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        """Construct a mapping with each name once."""
        made = super().construct_mapping(node, deep)
        if len(made) < len(node.value):
            names = [self.construct_object(key, deep) for key, _ in node.value]
            at = next(i for i, name in enumerate(names) if name in names[:i])
            mark = node.value[at][0].start_mark
            raise yaml.MarkedYAMLError(None, None, f"{names[at]} occurs twice", mark)
        return made


def read_table(path: Path) -> Iterator[list[str]]:
    """Yield the rows of a CSV file, its header first, without empty rows.

    Raises:
        InputError: The file can't be read, is too large, or is no CSV.
    """
    content = read_bytes(path, METRICS_BYTES)
    try:
        yield from filter(None, csv.reader(io.StringIO(content.decode(), newline="")))
    except (csv.Error, UnicodeDecodeError) as error:
        raise InputError(f"{path} is damaged: no CSV ({error})") from None


def read_metrics(folder: Path) -> dict[str, list[float]]:
    """Return the columns of a run's `metrics.csv`, one value for each update; see `read_table`."""
    head, *rows = read_table(folder / "metrics.csv")
    return {name: [float(row[i]) for row in rows] for i, name in enumerate(head)}
