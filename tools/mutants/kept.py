"""What is kept of a run: every mutant of the sample, and what became of it."""

import difflib
import hashlib
import json
import tomllib
from collections import Counter
from importlib import metadata
from pathlib import Path
from typing import Any

from tools.mutants.worklist import Mutant

HERE = Path(__file__).parent


def row(mutant: Mutant, root: Path, outcome: str, reasons: dict[str, str]) -> dict[str, Any]:
    """One line of the list.

    Args:
        mutant: Which one.
        root: The tree it was made of.
        outcome: "killed", "timeout" or "survived".
        reasons: Why some mutants change nothing, by id; a survivor among them is "equivalent".
    """
    before, after = _change((root / mutant.module).read_text(), mutant.source(root) or "")
    found = {
        "id": mutant.id,
        "module": mutant.module,
        "line": mutant.spec.start_pos[0],
        "operator": mutant.spec.operator_name.split("/")[1],
        "before": before,
        "after": after,
        "outcome": outcome,
    }
    if outcome == "survived" and mutant.id in reasons:
        found |= {"outcome": "equivalent", "reason": reasons[mutant.id]}
    return found


def equivalents() -> dict[str, str]:
    """Reasons why a mutant changes nothing, by its id, from equivalents.toml."""
    listed = tomllib.loads((HERE / "equivalents.toml").read_text())
    return {id_: entry["reason"] for entry in listed.get("equivalent", []) for id_ in entry["ids"]}


def score(rows: list[dict[str, Any]]) -> float:
    """Killed, timeouts included, out of those that change anything."""
    counts = Counter(row["outcome"] for row in rows)
    killed = counts["killed"] + counts["timeout"]
    return killed / max(1, killed + counts["survived"])


def merge(
    path: Path, modules: dict[str, str], rows: list[dict[str, Any]]
) -> tuple[list[dict[str, Any]], float]:
    """A kept list after its survivors were run again, with tests that were added since.

    What was killed stays so: it is for the reviewer of the tests to see that none was taken away.

    Args:
        path: The kept list.
        modules: Hashes of the modules as they are.
        rows: Of the survivors' second run.

    Returns:
        All rows, and the score at first sight of the sample, before a test was written for it:
        what a sample drawn anew would get, about.

    Raises:
        ValueError: A module has changed since, so that its mutants are others.
    """
    old = json.loads(path.read_text())
    if old["modules"] != modules:
        raise ValueError(f"modules have changed since {path} was made; run all mutants")
    again = {row["id"]: row for row in rows}
    merged = [again.get(row["id"], row) for row in old["mutants"]]
    return merged, old.get("first_score", old["score"])


def hashes(root: Path, paths: list[str]) -> dict[str, str]:
    """SHA-256 of files; a folder counts by its Python files."""
    files = {
        file.relative_to(root).as_posix(): file
        for path in paths
        for file in ([root / path] if (root / path).is_file() else (root / path).rglob("*.py"))
    }
    return {name: hashlib.sha256(files[name].read_bytes()).hexdigest() for name in sorted(files)}


def write(path: Path, head: dict[str, Any], rows: list[dict[str, Any]]) -> None:
    """Writes the list as JSON, a mutant a line."""
    head = {"tool": f"cosmic-ray {metadata.version('cosmic-ray')}", **head}
    head |= {"score": score(rows), "counts": dict(Counter(row["outcome"] for row in rows))}
    text = json.dumps({**head, "mutants": []}, indent=1)
    ordered = sorted(rows, key=lambda row: (row["module"], row["line"], row["id"]))
    lines = ",\n  ".join(json.dumps(row, ensure_ascii=False) for row in ordered)
    path.write_text(text.replace('"mutants": []', f'"mutants": [\n  {lines}\n ]') + "\n")


def _change(source: str, mutated: str) -> tuple[str, str]:
    """The lines that differ, before and after."""
    lines = list(difflib.ndiff(source.splitlines(), mutated.splitlines()))
    parts = ([line[2:].strip() for line in lines if line.startswith(sign)] for sign in "-+")
    before, after = (" ".join(part) for part in parts)
    return before, after
