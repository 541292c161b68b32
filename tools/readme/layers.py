"""The house as a diagram: which package may import which, from the import contracts."""

import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any


def read_contracts(root: Path) -> list[dict[str, Any]]:
    """The import contracts of a checkout."""
    with open(root / "pyproject.toml", "rb") as file:
        return tomllib.load(file)["tool"]["importlinter"]["contracts"]


def draw_layers(contracts: Iterable[dict[str, Any]]) -> str:
    """The contract of layers as a Mermaid diagram, and under it what the others forbid."""
    layers = next(c["layers"] for c in contracts if c["type"] == "layers")
    rows = [[name.strip() for name in layer.split("|")] for layer in layers]
    boxes = [f"  {names[0]}[{', '.join(names)}]" for names in rows]
    chain = " --> ".join(names[0] for names in rows)
    lines = ["```mermaid", "flowchart TD", *boxes, f"  {chain}", "```", ""]
    forbidden = [c for c in contracts if c["type"] == "forbidden"]
    return "\n".join([*lines, *(_sentence(c) for c in forbidden)])


def _sentence(contract: dict[str, Any]) -> str:
    who = ", ".join(name.removeprefix("drone_rl.") for name in contract["source_modules"])
    name = contract["name"][0].upper() + contract["name"][1:]
    what = ", ".join(contract["forbidden_modules"])
    return f"- {name}: in {who}, no {what}."
