"""How many small changes of the program its tests notice, as `make mutants` found."""

import hashlib
import json
from collections import Counter
from pathlib import Path
from typing import Any

from drone_rl.utils.errors import InputError

ROOT = Path(__file__).resolve().parents[1]


def bench_mutants(root: Path = ROOT) -> dict[str, Any]:
    """Reads docs/mutants.json, the list that `make mutants` keeps, and counts it again.

    Its survivors may have been run again, with tests written for them; the score at first sight is
    the one from before. A mutant whose tests ran into the time limit counts as killed. Equivalent
    ones, each listed with its reason, count neither way.

    Args:
        root: The checkout.

    Raises:
        InputError: There is no list, or one of its modules has changed since, so that the figure
            would be of another program.
    """
    path = root / "docs" / "mutants.json"
    if not path.exists():
        raise InputError(f"{path} is not there; run `make mutants` in a checkout")
    kept = json.loads(path.read_text())
    stale = [name for name, digest in kept["modules"].items() if _digest(root / name) != digest]
    if stale:
        raise InputError(f"changed since the last `make mutants`: {', '.join(stale)}; run it again")
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
