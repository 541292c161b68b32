"""Several judgements at once, as an object that shows itself."""

import dataclasses
from collections.abc import Sequence
from typing import Protocol, TypeVar, overload

from drone_rl.evaluation.judge import Verdict
from drone_rl.utils.display import aligned, interval, table


class _Judged(Protocol):
    """A judgement, as far as the table shows it."""

    @property
    def name(self) -> str: ...

    @property
    def verdict(self) -> Verdict: ...


T = TypeVar("T", bound=_Judged)


@dataclasses.dataclass(frozen=True)
class Judgements(Sequence[T]):
    """Several judgements, in the order in which they were asked for."""

    each: tuple[T, ...]

    @overload
    def __getitem__(self, index: int) -> T: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[T]: ...

    def __getitem__(self, index: int | slice) -> T | Sequence[T]:
        """One of them, or some."""
        return self.each[index]

    def __len__(self) -> int:
        """How many."""
        return len(self.each)

    def rows(self) -> list[list[str]]:
        """Names of columns, then a row for each policy."""
        rows = [["policy", "verdict", "certain", "success rate (95% interval)"]]
        for one in self.each:
            verdict = one.verdict
            success = interval(verdict.evidence["greedy"]["success"], "share")
            certain = "yes" if verdict.certain else "no"
            rows.append([one.name, verdict.kind.value, certain, success])
        return rows

    def __str__(self) -> str:
        """The table for a terminal."""
        return aligned(self.rows())

    def _repr_html_(self) -> str:
        head, *rows = self.rows()
        return table(head, rows)
