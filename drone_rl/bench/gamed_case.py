"""One attempt to get a good verdict, or a proof, for a policy that does not deserve it."""

import dataclasses
from collections.abc import Callable


@dataclasses.dataclass(frozen=True)
class GamedCase:
    """A policy made to deceive, and the judgement that it must not pass."""

    name: str
    called_good: Callable[[], bool]
    """Runs the judgement. Returns whether the program called the policy good and certain, or
    proved, with a successful exit status."""
