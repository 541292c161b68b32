"""List of packages and of import rules, from docstrings and import contracts."""

import ast
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any


def read_contracts(root: Path) -> list[dict[str, Any]]:
    """Return the import contracts of a checkout."""
    with open(root / "pyproject.toml", "rb") as file:
        return tomllib.load(file)["tool"]["importlinter"]["contracts"]


def list_packages(package: Path) -> str:
    """Return a Markdown table of packages and subpackages with their docstrings' first lines.

    Args:
        package: The folder drone_rl.
    """
    found = [*package.glob("*/__init__.py"), *package.glob("*/*/__init__.py")]
    paths = sorted([file.parent for file in found])
    rows = [f"| `{_name(path, package)}` | {_first_line(path)} |" for path in paths]
    return "\n".join(["| package | holds |", "| --- | --- |", *rows])


def list_contracts(contracts: Iterable[dict[str, Any]]) -> str:
    """Return the forbidden imports as a Markdown list."""
    return "\n".join(_sentence(c) for c in contracts if c["type"] == "forbidden")


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
