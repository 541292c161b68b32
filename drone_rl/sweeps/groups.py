"""Runs that differ in their seed alone, as one; every run that ended counts, failed ones too."""

import dataclasses
from collections.abc import Sequence
from typing import Any

from drone_rl.evaluation.rule import KINDS
from drone_rl.sweeps.rows import Row
from drone_rl.sweeps.statistics import median_of_runs, share_of_runs

SEED = "seed"
FAILED = "failed"
"""What a run that came to no policy is, beside `KINDS`."""
NEVER = float("inf")


@dataclasses.dataclass
class Group:
    """Runs that differ in their seed alone."""

    choice: dict[str, str]
    """Their common values of the swept settings."""
    rows: list[Row]
    """All of them."""

    @property
    def finished(self) -> list[Row]:
        """Those with a result."""
        return self.of_state("finished")

    @property
    def ended(self) -> list[Row]:
        """All but the unfinished ones; shares are of these."""
        return [row for row in self.rows if row.state != "unfinished"]

    @property
    def known(self) -> list[Row]:
        """Those of which it is known how far they came: finished or failed."""
        return [row for row in self.ended if row.state != "damaged"]

    def of_state(self, state: str) -> list[Row]:
        """Those in one state."""
        return [row for row in self.rows if row.state == state]

    @property
    def solved(self) -> dict[str, Any]:
        """Share of the ended runs that reached their target; a failed one did not."""
        hits = sum(row.is_solved for row in self.finished)
        return share_of_runs(hits, len(self.ended) - len(self.known), len(self.ended))

    @property
    def verdicts(self) -> dict[str, dict[str, Any]]:
        """Share of each of `KINDS`, and of failures, among the ended runs.

        One that was not judged may be of any kind, a damaged one may be anything. "certain" counts
        those whose verdict is.
        """
        judged = [row for row in self.finished if row.kind is not None]
        failed = self.of_state("failed")
        unknown = len(self.ended) - len(judged) - len(failed)
        shares = {}
        for kind in KINDS:
            rows = [row for row in judged if row.kind == kind]
            shares[kind] = share_of_runs(len(rows), unknown, len(self.ended))
            shares[kind]["certain"] = sum(row.is_certain for row in rows)
        damaged = len(self.of_state("damaged"))
        failures = share_of_runs(len(failed), damaged, len(self.ended))
        return {**shares, FAILED: {**failures, "certain": len(failed)}}

    def plain(self) -> dict[str, Any]:
        """Its figures, shares and medians with exact intervals."""
        known, states = self.known, [row.state for row in self.rows]
        return {
            **self.choice,
            "runs": len(self.rows),
            "ended": len(self.ended),
            **{name: states.count(name) for name in ("failed", "damaged", "unfinished")},
            "judged": sum(row.kind is not None for row in self.finished),
            "solved": self.solved,
            "frames_to_solve": _to_solve(known, [row.frames for row in known]),
            "seconds_to_solve": _to_solve(known, [row.seconds for row in known]),
            "final_share": median_of_runs([row.final_share for row in known]),
            "entropy": median_of_runs([r.entropy for r in self.finished if r.entropy is not None]),
            "verdicts": self.verdicts,
        }


def make_groups(rows: Sequence[Row]) -> list[Group]:
    """The groups, in the order of their first run."""
    groups: dict[tuple, Group] = {}
    for row in rows:
        choice = {key: value for key, value in row.choice.items() if key != SEED}
        groups.setdefault(tuple(choice.items()), Group(choice, [])).rows.append(row)
    return list(groups.values())


def _to_solve(rows: Sequence[Row], had: Sequence[float]) -> dict[str, Any]:
    """The median of what it takes; a run that ended without needs more than it had."""
    pairs = zip(rows, had, strict=True)
    return median_of_runs([value if row.is_solved else NEVER for row, value in pairs], had)
