"""Mutation score of the test suite, as measured by `make mutants`."""

import hashlib
import json
from collections import Counter
from pathlib import Path
from typing import Any

from drone_rl.utils.errors import InputError

ROOT = Path(__file__).resolve().parents[1]


def bench_mutants(root: Path = ROOT) -> dict[str, Any]:
    """Read docs/mutants.json, which `make mutants` writes, and count its outcomes.

    Survivors may have been tested again after tests were written for them; the score at first
    sight is the score before that. A mutant whose tests time out counts as killed. Equivalent
    mutants, listed with a reason, are not counted.

    Args:
        root: Folder of the checkout.

    Raises:
        InputError: The list is missing, or a module has changed since it was written.
    """
    path = root / "docs" / "mutants.json"
    if not path.exists():
        raise InputError(f"{path} does not exist; run `make mutants` in a checkout")
    kept = json.loads(path.read_text())
    stale = [name for name, digest in kept["modules"].items() if _digest(root / name) != digest]
    if stale:
        raise InputError(
            f"modules changed since the last `make mutants`: {', '.join(stale)}; run it again"
        )
    counts = Counter(mutant["outcome"] for mutant in kept["mutants"])
    killed = counts["killed"] + counts["timeout"]
    judged = killed + counts["survived"]
    return {
        "mutation_score": killed / judged if judged else None,
        "mutation_score_at_first_sight": kept.get("first_score", kept["score"]),
        "mutants_sampled": len(kept["mutants"]),
        "mutants_killed": killed,
        "mutants_equivalent": counts["equivalent"],
        "mutants_revision": kept["revision"],
    }


def _digest(path: Path) -> str | None:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.exists() else None
