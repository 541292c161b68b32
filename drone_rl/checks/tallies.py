"""Whether numbers of steps are as frequent among random flights as stated."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from drone_rl.checks.certificate import Outcome
from drone_rl.checks.claims import missing_steps
from drone_rl.utils.intervals import proportion

DOUBT = 1e-9
"""Probability at which luck may refuse a true statement, for each number of steps."""


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
        for number in sorted({*outcome.steps, *here.tolist()}):
            stated = outcome.steps.get(number, 0.0)
            found = proportion(int((here == number).sum()), len(steps), 1 - DOUBT)
            low, high = found["lower95"], found["upper95"]
            if high < stated or low > stated + missing:
                yield (
                    f"outcome {i} ({outcome}) is said to take {number} steps from a share of "
                    f"{stated:.6g}, which {found['successes']} of {found['trials']} random flights "
                    "refute"
                )
