"""Results of a run: every mutant of the sample with its outcome."""

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
    """Return the entry of one mutant in the list.

    Args:
        mutant: The mutant.
        root: The tree that contains the original module.
        result: "outcome" ("killed", "timeout" or "survived") and "by", the test that failed.
        reasons: Reasons why mutants are equivalent, by id; such a survivor is "equivalent".
        harms: The harm that other survivors would do in the program, by id.
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


def read_reasons(name: str) -> dict[str, str]:
    """Return the reasons in equivalents.toml or harms.toml by mutant id.

    Args:
        name: "equivalents" (why the mutants change nothing) or "harms" (what they would break).
    """
    found = tomllib.loads((HERE / f"{name}.toml").read_text())
    return {id_: entry["reason"] for entry in found.get("mutants", []) for id_ in entry["ids"]}


def score(rows: list[dict[str, Any]]) -> float:
    """Return the fraction of non-equivalent mutants that were killed, timeouts included."""
    counts = Counter(row["outcome"] for row in rows)
    killed = counts["killed"] + counts["timeout"]
    return killed / max(1, killed + counts["survived"])


def read_killers(*paths: Path) -> dict[str, str]:
    """Return the test that killed each mutant, by id, from lists or a plain mapping."""
    found: dict[str, str] = {}
    for path in filter(Path.exists, paths):
        content = json.loads(path.read_text())
        rows = {row["id"]: row.get("by") for row in content.get("mutants", [])}
        found |= {name: by for name, by in (rows or content).items() if isinstance(by, str)}
    return found


def merge(
    path: Path, modules: dict[str, str], rows: list[dict[str, Any]]
) -> tuple[list[dict[str, Any]], float]:
    """Merge a list with the results of a second run of its survivors against newer tests.

    Killed mutants are not run again; reviewers must check that no test was removed.

    Args:
        path: The list.
        modules: Current hashes of the modules.
        rows: Entries of the survivors after the second run.

    Returns:
        All entries, and the score of the first run, before tests for this sample were written. That
        score estimates the one of a new sample.

    Raises:
        ValueError: A module has changed since, so its mutants are different.
    """
    old = json.loads(path.read_text())
    if old["modules"] != modules:
        raise ValueError(f"modules have changed since {path} was made; run all mutants")
    again = {row["id"]: row for row in rows}
    merged = [again.get(row["id"], row) for row in old["mutants"]]
    return merged, old.get("first_score", old["score"])


def hashes(root: Path, paths: list[str]) -> dict[str, str]:
    """Return the SHA-256 of files and of all Python files in folders, by path."""
    files = {
        file.relative_to(root).as_posix(): file
        for path in paths
        for file in ([root / path] if (root / path).is_file() else (root / path).rglob("*.py"))
    }
    return {name: hashlib.sha256(files[name].read_bytes()).hexdigest() for name in sorted(files)}


def digest(root: Path, paths: list[str]) -> str:
    """Return one hash of files and folders together."""
    return hashlib.sha256(json.dumps(hashes(root, paths)).encode()).hexdigest()


def write(path: Path, head: dict[str, Any], rows: list[dict[str, Any]]) -> None:
    """Write the list as JSON, with one mutant per line."""
    head = {"tool": f"cosmic-ray {metadata.version('cosmic-ray')}", **head}
    head |= {"score": score(rows), "counts": dict(Counter(row["outcome"] for row in rows))}
    text = json.dumps({**head, "mutants": []}, indent=1)
    ordered = sorted(rows, key=lambda row: (row["module"], row["line"], row["id"]))
    lines = ",\n  ".join(json.dumps(row, ensure_ascii=False) for row in ordered)
    path.write_text(text.replace('"mutants": []', f'"mutants": [\n  {lines}\n ]') + "\n")


def _change(source: str, mutated: str) -> tuple[str, str]:
    """Return the lines that differ, before and after the mutation."""
    old, new = source.splitlines(), mutated.splitlines()
    same = [a == b for a, b in zip(old, new, strict=False)]
    first = same.index(False) if False in same else len(same)
    rest = list(zip(reversed(old[first:]), reversed(new[first:]), strict=False))
    last = next((count for count, (a, b) in enumerate(rest) if a != b), len(rest))
    parts = (lines[first : len(lines) - last] for lines in (old, new))
    before, after = (" ".join(line.strip() for line in part) for part in parts)
    return before, after
