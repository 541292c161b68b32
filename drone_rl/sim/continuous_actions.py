"""Actions of which there are infinitely many: how fast forward, to a side, and around.

An action is three numbers in [-1, 1]: 1 is full speed forward and -1 none (there is no way back), 1
is full speed to the left and -1 to the right, 1 is the greatest rate of turning to the left.

A policy draws each from a normal distribution of its own and squashes it by tanh, see
`drone_rl.policies.distributions`. A network's outputs are three numbers for the means, then three
for the deviations; `normal_of` says which.

A wish has parts that reports can name: forward, left, right, turn left, turn right (the last two
only where drones can turn). An action *is* left where it goes there at more than a third of full
speed, turns left where it turns so at more than a third of the greatest rate, counts half to each
where it does both, and is forward where it does neither. A part's share is its probability under
the policy's distribution, in closed form. So shares are probabilities that add up to 1, as they are
of discrete actions, and all that reports say of these holds: of speeds to the side drawn uniformly
a third is left and a third neither. Gentle corrections count as flying forward, but they move the
shares, which are smooth in the outputs.
"""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any, Self

import torch
from torch import Tensor

from drone_rl.config.dynamics import ActionSettings
from drone_rl.sim.actions import Entry, Parts, listed

FORWARD, SIDEWAYS, YAW = range(3)
"""Numbers of an action."""
ASIDE = 1 / 3
"""Share of the greatest speed, or rate, from which on an action goes, or turns, to that side."""
_EDGE = math.atanh(ASIDE)
MOST_MEAN = 3.0
"""Of a normal distribution before it is squashed; tanh(3) = 0.995."""
LEAST_LOG, MOST_LOG = -3.0, 0.0
"""Of its deviation's logarithm. At the most the squashed distribution is about uniform."""
_FIRST_LOG = -0.5
"""What an output of 0 means."""
_SHIFT = math.log((_FIRST_LOG - LEAST_LOG) / (MOST_LOG - _FIRST_LOG))
_SLANTED = math.sqrt(0.5)


@dataclasses.dataclass(frozen=True, kw_only=True)
class ContinuousActions(Parts):
    """Speeds forward and to a side and a rate of turning; see the module."""

    speeds: tuple[float, float, float]
    """The greatest: forward and to a side, metres a second; of turning, radians a second."""

    @classmethod
    def of(cls, settings: ActionSettings) -> Self:
        """Those that settings ask for."""
        count = 5 if settings.yaw_rate else 3
        return cls(
            names=("forward", "left", "right", "turn left", "turn right")[:count],
            mirrored=(0, 2, 1, 4, 3)[:count],
            opposite=(0, 2, 1, 4, 3)[:count],
            left=1,
            order=(3, 1, 0, 2, 4) if settings.yaw_rate else (1, 0, 2),
            arrows=(
                (0.0, 1.0),
                (-1.0, 0.0),
                (1.0, 0.0),
                (-_SLANTED, _SLANTED),
                (_SLANTED, _SLANTED),
            )[:count],
            colors=(
                (214, 39, 40),
                (44, 160, 44),
                (31, 96, 200),
                (152, 223, 138),
                (174, 199, 232),
            )[:count],
            speeds=(
                settings.forward_speed,
                settings.sideways_speed,
                math.radians(settings.yaw_rate),
            ),
        )

    @property
    def lefts(self) -> tuple[int, ...]:
        """Going there, and turning there."""
        return (self.left, 3) if self.can_turn else (self.left,)

    @property
    def can_turn(self) -> bool:
        """Whether the rate of turning means anything."""
        return self.speeds[YAW] > 0

    @property
    def entry(self) -> Entry:
        """One world's action: three numbers."""
        return Entry((3,), torch.float32, -1.0, 1.0)

    @property
    def num_outputs(self) -> int:
        """A mean and a deviation for each of three numbers."""
        return 6

    @property
    def output_names(self) -> tuple[str, ...]:
        """First those for the means."""
        numbers = ("forward", "left", "turn left")
        return (*(f"{n} mean" for n in numbers), *(f"{n} deviation" for n in numbers))

    def to_rates(self, action: Tensor) -> Tensor:
        """Actions in units: m/s forward, m/s to the left, rad/s to the left; the drone's own frame.

        Args:
            action: What lies outside [-1, 1] counts as its bound. Shape: (*, 3).

        Returns:
            Shape: (*, 3), float64.
        """
        forward, *aside = action.double().clamp(-1, 1).unbind(-1)
        return torch.stack([(forward + 1) / 2, *aside], -1) * action.new_tensor(
            self.speeds, dtype=torch.float64
        )

    def wish(self, outputs: Tensor) -> Tensor:
        """The probability of each part."""
        mean, deviation = normal_of(outputs)
        left, turn_left = _above((mean - _EDGE) / deviation)[..., SIDEWAYS:].unbind(-1)
        right, turn_right = _above((-mean - _EDGE) / deviation)[..., SIDEWAYS:].unbind(-1)
        aside = (left + right).clamp(max=1)
        if not self.can_turn:
            return torch.stack([1 - aside, left, right], -1)
        turned = (turn_left + turn_right).clamp(max=1)
        alone, unmoved = 1 - 0.5 * turned, 1 - 0.5 * aside
        shares = (left * alone, right * alone, turn_left * unmoved, turn_right * unmoved)
        return torch.stack([(1 - aside) * (1 - turned), *shares], -1)

    def scores(self, outputs: Tensor) -> Tensor:
        """Outputs for the means, with the sign with which they lead to each part."""
        forward, left, turn_left = outputs[..., :3].unbind(-1)
        every = (forward, left, -left, turn_left, -turn_left)
        return torch.stack(every[: len(self)], -1)

    def greedy(self, outputs: Tensor) -> Tensor:
        """The means, squashed."""
        return normal_of(outputs)[0].tanh()

    def part(self, action: Tensor) -> Tensor:
        """To where it goes or turns, whichever it does more; forward where it does neither."""
        aside, turned = action[..., SIDEWAYS], action[..., YAW] * self.can_turn
        is_turn = turned.abs() > aside.abs()
        way = torch.where(is_turn, turned, aside)
        part = torch.where(is_turn, 3, 1) + (way < 0).long()
        return part.masked_fill(way.abs() <= ASIDE, 0)

    def always(self, name: str) -> Tensor:
        """At full speed; whatever goes or turns aside does not go forward."""
        given = ((1, 0, 0), (-1, 1, 0), (-1, -1, 0), (-1, 0, 1), (-1, 0, -1))
        return torch.tensor(given[self.names.index(name)], dtype=torch.float32)

    def draw(self, shape: tuple[int, ...], generator: torch.Generator) -> Tensor:
        """Uniformly."""
        given = torch.rand(*shape, 3, generator=generator, device=generator.device)
        return 2 * given - 1

    def fields(self) -> dict[str, str]:
        """The part it is, and what it is in units."""
        return {
            "actions": "what the action taken is, for the most part: " + listed(self.names),
            "rates": "the action: m/s forward, m/s to the left, rad/s to the left (T, 3)",
        }

    def kept(self, action: Tensor) -> dict[str, Tensor]:
        """The part it is, and what it is in units."""
        return {"actions": self.part(action), "rates": self.to_rates(action)}

    def as_dict(self) -> dict[str, Any]:
        """As in `explanation.json`; "speeds" are the greatest, turning in degrees a second."""
        forward, aside, turning = self.speeds
        return {**super().as_dict(), "speeds": [forward, aside, math.degrees(turning)]}

    def sways(self, kept: Mapping[str, Tensor]) -> Tensor:
        """Whether they go or turn aside, and forward at no more than a third of full speed."""
        is_slow = kept["rates"][..., FORWARD] <= ASIDE * self.speeds[FORWARD]
        return self.can_be_undone(kept["actions"]) & is_slow


def normal_of(outputs: Tensor) -> tuple[Tensor, Tensor]:
    """The normal distributions that a network's outputs mean, before they are squashed.

    Both are bounded, smoothly, so that neither a sure nor an unsure policy leaves the numbers
    within which float32 tells actions apart.

    Args:
        outputs: For n means, then for n deviations. Shape: (*, 2 n).

    Returns:
        Means, of at most 3 to either side, and deviations, from 0.05 to 1. Shapes: (*, n).
    """
    mean, log = outputs.chunk(2, -1)
    share = (log + _SHIFT).sigmoid()
    deviation = (LEAST_LOG + (MOST_LOG - LEAST_LOG) * share).exp()
    return MOST_MEAN * (mean / MOST_MEAN).tanh(), deviation


def _above(distance: Tensor) -> Tensor:
    """How probable a normal number is below so many deviations."""
    return 0.5 * (1 + torch.erf(distance * _SLANTED))
