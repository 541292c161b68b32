"""An adversarial policy and the analysis that it attacks."""

import dataclasses
from collections.abc import Callable


@dataclasses.dataclass(frozen=True)
class GamedCase:
    """An adversarial policy and a function that runs the attacked analysis."""

    name: str
    """Unique in its module."""
    is_judged_good: Callable[[], bool]
    """Run the analysis; return whether it ends with a status of success, which means that the
    policy is judged good and certain, or proved."""
