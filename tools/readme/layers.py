"""The house: what each package holds, and which may import which, from the import contracts."""

import ast
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any


def read_contracts(root: Path) -> list[dict[str, Any]]:
    """The import contracts of a checkout."""
    with open(root / "pyproject.toml", "rb") as file:
        return tomllib.load(file)["tool"]["importlinter"]["contracts"]


def list_packages(contracts: Iterable[dict[str, Any]], package: Path) -> str:
    """A table in Markdown: each package and those within it, by their docstrings' first lines.

    Args:
        contracts: The import contracts, whose layers give the order.
        package: The folder drone_rl.
    """
    paths = []
    for name in (name for row in _layers(contracts) for name in row):
        inner = sorted(file.parent for file in (package / name).glob("*/__init__.py"))
        paths += [package / name, *inner]
    rows = [f"| `{_name(path, package)}` | {_first_line(path)} |" for path in paths]
    return "\n".join(["| package | holds |", "| --- | --- |", *rows])


def draw_layers(contracts: Iterable[dict[str, Any]]) -> str:
    """The contract of layers as a list from the top, and under it what the others forbid.

    A list needs no program that draws it, on the site or on any page that shows Markdown; the site
    makes boxes of its items.
    """
    boxes = [" ".join(f"<code>{name}</code>" for name in names) for names in _layers(contracts)]
    lines = ['<ol class="layers">', *(f"<li>{box}</li>" for box in boxes), "</ol>", ""]
    forbidden = [c for c in contracts if c["type"] == "forbidden"]
    return "\n".join([*lines, *(_sentence(c) for c in forbidden)])


def _layers(contracts: Iterable[dict[str, Any]]) -> list[list[str]]:
    """Names of packages, from the top; those of one row side by side."""
    layers = next(c["layers"] for c in contracts if c["type"] == "layers")
    return [[name.strip() for name in layer.split("|")] for layer in layers]


def _name(path: Path, package: Path) -> str:
    return f"{path.relative_to(package)}{'/' if path.is_dir() else '.py'}"


def _first_line(path: Path) -> str:
    """What a package, or a module in place of one, says of itself."""
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    text = ast.get_docstring(ast.parse(file.read_text())) or ""
    return text.partition("\n")[0].rstrip(".")


def _sentence(contract: dict[str, Any]) -> str:
    who = ", ".join(name.removeprefix("drone_rl.") for name in contract["source_modules"])
    name = contract["name"][0].upper() + contract["name"][1:]
    what = ", ".join(contract["forbidden_modules"])
    return f"- {name}: in {who}, no {what}."
