"""An attempt to be called good without being so."""

import dataclasses
from collections.abc import Callable


@dataclasses.dataclass(frozen=True)
class GamedCase:
    """An adversarial policy or file."""

    name: str
    called_good: Callable[[], bool]
    """Run the judgement; whether it says good and certain, or proved, with a successful status."""
