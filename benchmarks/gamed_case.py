"""One adversarial policy and the judgement that it tries to deceive."""

import dataclasses
from collections.abc import Callable


@dataclasses.dataclass(frozen=True)
class GamedCase:
    """One adversarial policy, and whether the program was deceived by it."""

    name: str
    """Of the case, unique in its module."""
    called_good: Callable[[], bool]
    """Run the judgement; return whether the program called the policy good and certain, or proved,
    with a status of success."""
