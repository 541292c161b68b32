"""Flights with a firmware on board, beside the verdicts of `drone-rl bodies`.

Evidence: `bodies.json`, which has them by policy where there are any.
"""

from drone_rl.utils.text import Evidence

LOOPED = "software in the loop"
"""Their column, and their key in the evidence."""


def with_loops(table: list[list[str]], numbers: Evidence) -> list[list[str]]:
    """A table with their column, if there are any.

    Args:
        table: Names, then a row for each policy.
        numbers: The evidence.
    """
    if LOOPED not in numbers:
        return table
    cells = [LOOPED, *(looped(numbers[LOOPED][name]) for name in numbers["policies"])]
    return [[*row, text] for row, text in zip(table, cells, strict=True)]


def looped(flights: Evidence) -> str:
    """What became of a policy's flights: no verdict, for which they are too few."""
    if "left_out" in flights:
        return "left out"
    success = flights["success"]
    ends = " to ".join(f"{100 * success[bound]:.0f}" for bound in ("lower95", "upper95"))
    return f"no verdict: {success['successes']} of {success['trials']} ({ends})"


def reasons(numbers: Evidence) -> list[str]:
    """Why flights were left out, a line each."""
    flown = numbers.get(LOOPED, {}).items()
    return [f"{name}, {LOOPED}: {f['left_out']}" for name, f in flown if "left_out" in f]
