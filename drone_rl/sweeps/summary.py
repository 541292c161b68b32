"""All figures of a sweep as plain values; its page, its tables and its words are made of them."""

import csv
import io
import os
import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from drone_rl.sweeps import text as words
from drone_rl.sweeps.groups import Group, make_groups
from drone_rl.sweeps.manifest import Sweep
from drone_rl.sweeps.rows import Row
from drone_rl.sweeps.runs import quoted
from drone_rl.utils.text import said

STATES = ("finished", "failed", "damaged", "unfinished")


def summarise_sweep(sweep: Sweep, rows: Sequence[Row]) -> dict[str, Any]:
    """All figures as plain values, and the sentences that they allow."""
    states = [row.state for row in rows]
    judged = [row.verdict for row in rows if row.verdict is not None]
    older = sum(row.has_older_verdict for row in rows)
    groups = make_groups(rows)
    summary = {
        "command": sweep.command,
        "judge_command": _command("sweep-report", f"folder={_literal(sweep.folder)}", "judge=true"),
        **{name: states.count(name) for name in STATES},
        "copies": count_copies(rows),
        "judged": len(judged),
        "certain": sum(verdict["certain"] for verdict in judged),
        "judged_by_older_rule": older,
        "never_judged": states.count("finished") - len(judged) - older,
        "error_rates": sorted({verdict["error_rate"] for verdict in judged}),
        "episodes": sorted({verdict["greedy"]["episodes"] for verdict in judged}),
        "sides_not_offered": sum(row.lean is None for row in rows if row.verdict is not None),
        "best": _best(rows),
        "groups": [_group(group) for group in groups],
        "runs": [row.plain() for row in rows],
    }
    return {**summary, "sentences": said(words.SENTENCES, summary)}


def best_rows(rows: Sequence[Row]) -> list[Row]:
    """The runs that were judged, those first that collect the greatest share of their cubes.

    Of equals the ones that were trained with the fewest frames come first. Cubes are no measure:
    a task with more of them would win.
    """
    judged = [row for row in rows if row.verdict is not None]
    return sorted(judged, key=lambda row: (-(row.share("all") or 0.0), row.frames))


def count_copies(rows: Sequence[Row]) -> int:
    """Count finished runs whose figures are those of an earlier run.

    Seconds are measured to a nanosecond, so that no two trainings have the same.
    """
    keys = ("reason", "frames", "episodes", "seconds", "running_reward")
    figures = [tuple(row.result[key] for key in keys) for row in rows if row.state == "finished"]
    return len(figures) - len(set(figures))


def to_csv(rows: Sequence[Row]) -> str:
    """The table of runs."""
    text = io.StringIO()
    plain = [row.plain() for row in rows]
    writer = csv.DictWriter(text, fieldnames=list(plain[0]) if plain else [])
    writer.writeheader()
    writer.writerows(plain)
    return text.getvalue()


def _group(group: Group) -> dict[str, Any]:
    figures = group.plain()
    return {**figures, "sentences": said(words.GROUP_SENTENCES, figures)}


def _best(rows: Sequence[Row]) -> dict[str, Any] | None:
    ranked = best_rows(rows)
    if not ranked:
        return None
    best, verdict = ranked[0], ranked[0].verdict or {}
    return {
        **best.plain(),
        "episodes": verdict["greedy"]["episodes"],
        "equals": sum(row.share("all") == best.share("all") for row in ranked) - 1,
        "command": best.run.repeat_command(),
        "report_command": _command("verdict", f"policy={_literal(best.run.folder)}"),
    }


def _command(*words: str) -> str:
    return shlex.join(["drone-rl", *words])


def _literal(path: Path) -> str:
    """A path as Hydra's command line takes it, from here if it lies below."""
    text = str(path.relative_to(Path.cwd())) if path.is_relative_to(Path.cwd()) else str(path)
    plain = re.fullmatch(rf"[\w.+:{re.escape(os.sep)}-]+", text)
    return text if plain else quoted(text)
