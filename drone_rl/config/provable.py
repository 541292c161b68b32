"""How a training goes on until nothing is left that its policy fails at."""

import dataclasses
from typing import Annotated

from drone_rl.utils.schema import Real, Whole
from drone_rl.utils.settings import Settings


@dataclasses.dataclass(frozen=True, kw_only=True)
class ProvableSettings(Settings):
    """How a policy is trained until it is proved."""

    rounds: Annotated[int, Whole(0, unit="rounds")] = 0
    """Rounds of practice at most, each between two searches for failures; 0 proves nothing."""
    frames: Annotated[int, Whole(1, unit="frames")] = 50_000
    """That are collected in a round."""
    share: Annotated[float, Real(0.0, 1.0)] = 0.5
    """Of a round's episodes that begin where the policy failed; the others begin anywhere."""
    margin: Annotated[float, Real(0.0, 1_000.0, unit="m")] = 0.2
    """Metres by which practice reaches beyond the places of a failure, to either side."""
    flights: Annotated[int, Whole(0, unit="flights")] = 5_000
    """Greedy flights in which failures are looked for first; if there are any, no proof is made."""
    enough: Annotated[int, Whole(1, unit="failures")] = 50
    """Failures after which the search by flights ends."""
    most_boxes: Annotated[int, Whole(1, unit="boxes")] = 20_000
    """Places of failures that a round practises at most: of a proof the largest boxes."""
    limit_s: Annotated[float, Real(0.0, unit="s")] | None = None
    """Seconds after which a proof stops and its failures so far are practised; none for never."""
