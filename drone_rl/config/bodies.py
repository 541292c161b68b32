"""What the same policies flown in several bodies can be told."""

import dataclasses
from typing import Annotated

from drone_rl.config.judging import JudgeSettings
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Listed, OneOf, Colors, Whole

BODIES = (
    "computer vision",
    "simple flight",
    "wind 2 m/s",
    "wind 5 m/s",
    "wind 8 m/s",
    "motors twice as slow",
    "camera on the body",
)
"""In what policies are flown, in this order."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class BodiesSettings(JudgeSettings):
    """Whose verdicts are compared, and in which bodies and airs.

    Raises:
        InputError: A value is out of range, or a policy or body is named twice.
    """

    policies: Annotated[tuple[str, ...], Listed("policy", most=64)] = ("good", "proved")
    """Whom to fly: files, folders of runs, latest, or policies that travel with the package."""
    bodies: Annotated[tuple[str, ...], Several(OneOf(BODIES), 1, len(BODIES))] = BODIES
    """In what."""
    episodes: Annotated[int, Whole(1, unit="episodes")] = 400
    """Held-out episodes of each policy in each body, flown greedily; the same worlds for all."""
    num_envs: Annotated[int, Whole(1, unit="worlds")] = 400
    """Worlds in one batch; bounds memory."""
    sampled: bool = False
    """Whether to fly with drawn actions, too."""
    certificate_flights: Annotated[int, Whole(0, 10_000_000, "flights")] = 0
    """Rollouts that re-check a certificate; with 0 the table's verdicts prove nothing."""
    domain_flights: Annotated[int, Whole(0, 100_000, "episodes")] = 0
    """New episodes that check a required operating domain; the table requires none."""
    loop_flights: Annotated[int, Whole(0, 1000, "flights")] = 0
    """Of each policy with the firmware Betaflight on board, in real time; 0 for none."""

    def check(self) -> None:
        """Refuses bodies twice."""
        super().check()
        if len({*self.bodies}) < len(self.bodies):
            raise InputError(f"bodies={[*self.bodies]} has one twice; give each once")
