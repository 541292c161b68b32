"""Package list and layer diagram, from docstrings and import contracts."""

import ast
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any


def read_contracts(root: Path) -> list[dict[str, Any]]:
    """Return the import contracts of a checkout."""
    with open(root / "pyproject.toml", "rb") as file:
        return tomllib.load(file)["tool"]["importlinter"]["contracts"]


def list_packages(contracts: Iterable[dict[str, Any]], package: Path) -> str:
    """Return a Markdown table of packages and subpackages with their docstrings' first lines.

    Args:
        contracts: The import contracts, whose layers define the order.
        package: The folder drone_rl.
    """
    paths = []
    for name in (name for row in _layers(contracts) for name in row):
        inner = sorted(file.parent for file in (package / name).glob("*/__init__.py"))
        paths += [package / name, *inner]
    rows = [f"| `{_name(path, package)}` | {_first_line(path)} |" for path in paths]
    return "\n".join(["| package | holds |", "| --- | --- |", *rows])


def draw_layers(contracts: Iterable[dict[str, Any]]) -> str:
    """Return the layers as an HTML list from the top, and below it the forbidden imports.

    Any Markdown viewer shows the list without a diagram renderer; the site styles items as boxes.
    """
    boxes = [" ".join(f"<code>{name}</code>" for name in names) for names in _layers(contracts)]
    lines = ['<ol class="layers">', *(f"<li>{box}</li>" for box in boxes), "</ol>", ""]
    forbidden = [c for c in contracts if c["type"] == "forbidden"]
    return "\n".join([*lines, *(_sentence(c) for c in forbidden)])


def _layers(contracts: Iterable[dict[str, Any]]) -> list[list[str]]:
    """Return the names of packages by layer, from the top."""
    layers = next(c["layers"] for c in contracts if c["type"] == "layers")
    return [[name.strip() for name in layer.split("|")] for layer in layers]


def _name(path: Path, package: Path) -> str:
    return f"{path.relative_to(package)}{'/' if path.is_dir() else '.py'}"


def _first_line(path: Path) -> str:
    """Return the first line of the docstring of a package or module."""
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    text = ast.get_docstring(ast.parse(file.read_text())) or ""
    return text.partition("\n")[0].rstrip(".")


def _sentence(contract: dict[str, Any]) -> str:
    sources = ", ".join(name.removeprefix("drone_rl.") for name in contract["source_modules"])
    name = contract["name"][0].upper() + contract["name"][1:]
    forbidden = ", ".join(contract["forbidden_modules"])
    return f"- {name}: {sources} may not import {forbidden}."
