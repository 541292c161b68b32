"""Whether numbers of steps are as frequent among random flights as stated."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from drone_rl.utils.intervals import proportion
from drone_rl.verification.checker.certificate import Outcome
from drone_rl.verification.checker.claims import missing_steps

DOUBT = 1e-9
"""Probability at which luck may refuse what is true, for each number of steps, and all others."""


def find_wrong_tallies(
    outcomes: Sequence[Outcome], owner: NDArray[np.int64], steps: NDArray[np.int64]
) -> Iterator[str]:
    """Shares of numbers of steps that random flights refute, one line each.

    Args:
        outcomes: As stated.
        owner: Outcome of each flight's placement, uniform over all placements; as many as there
            are outcomes where nothing is stated. Shape: (flights,).
        steps: How many each flight had. Shape: (flights,).
    """
    for i, outcome in enumerate(outcomes):
        here, missing = steps[owner == i], missing_steps(outcome)
        for number, stated in sorted(outcome.steps.items()):
            found = proportion(int((here == number).sum()), len(steps), 1 - DOUBT)
            if found["upper95"] < stated or found["lower95"] > stated + missing:
                yield (
                    f"outcome {i} ({outcome}) is said to take {number} steps from a share of "
                    f"{stated:.6g}, which {found['successes']} of {found['trials']} random flights "
                    "refute"
                )
        is_other = ~np.isin(here, list(outcome.steps))
        found = proportion(int(is_other.sum()), len(steps), 1 - DOUBT)
        if found["lower95"] > missing:
            yield (
                f"outcome {i} ({outcome}) is said to take other numbers of steps than those stated "
                f"from a share of {missing:.6g}, which {found['successes']} of {found['trials']} "
                "random flights refute"
            )
