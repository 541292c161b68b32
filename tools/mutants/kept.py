"""What is kept of a run: every mutant of the sample, and what became of it."""

import hashlib
import json
import tomllib
from collections import Counter
from importlib import metadata
from pathlib import Path
from typing import Any

from tools.mutants.worklist import Mutant

HERE = Path(__file__).parent


def row(
    mutant: Mutant,
    root: Path,
    result: dict[str, Any],
    reasons: dict[str, str],
    harms: dict[str, str],
) -> dict[str, Any]:
    """One line of the list.

    Args:
        mutant: Which one.
        root: The tree it was made of.
        result: Its "outcome" ("killed", "timeout" or "survived"), and "by" which test.
        reasons: Why some mutants change nothing, by id; a survivor among them is "equivalent".
        harms: What the others would do if they were in the program, by id.
    """
    before, after = _change((root / mutant.module).read_text(), mutant.source(root) or "")
    found = {
        "id": mutant.id,
        "module": mutant.module,
        "line": mutant.spec.start_pos[0],
        "operator": mutant.spec.operator_name.split("/")[1],
        "before": before,
        "after": after,
        **result,
    }
    if result["outcome"] == "survived" and mutant.id in reasons:
        found |= {"outcome": "equivalent", "reason": reasons[mutant.id]}
    elif result["outcome"] == "survived":
        found["harm"] = harms.get(mutant.id)
    return found


def listed(name: str) -> dict[str, str]:
    """What is listed of mutants by id, from equivalents.toml or harms.toml.

    Args:
        name: "equivalents", why they change nothing, or "harms", what they would do.
    """
    found = tomllib.loads((HERE / f"{name}.toml").read_text())
    return {id_: entry["reason"] for entry in found.get("mutants", []) for id_ in entry["ids"]}


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


def digest(root: Path, paths: list[str]) -> str:
    """One hash of files and folders together."""
    return hashlib.sha256(json.dumps(hashes(root, paths)).encode()).hexdigest()


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
    old, new = source.splitlines(), mutated.splitlines()
    same = [a == b for a, b in zip(old, new, strict=False)]
    first = same.index(False) if False in same else len(same)
    rest = list(zip(reversed(old[first:]), reversed(new[first:]), strict=False))
    last = next((count for count, (a, b) in enumerate(rest) if a != b), len(rest))
    parts = (lines[first : len(lines) - last] for lines in (old, new))
    before, after = (" ".join(line.strip() for line in part) for part in parts)
    return before, after
