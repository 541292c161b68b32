"""Continuous actions: speeds forward and sideways, and a yaw rate.

An action is three numbers in [-1, 1]. Forward: 1 is full speed, -1 is none; sideways and yaw: 1 is
the greatest speed or rate to the left, -1 to the right. Samples of normal distributions, see
`normal_of`, are squashed by tanh.

The parts are forward, left, right, and, where drones can turn, turn left and turn right.
An action belongs to "left" if its speed to the left exceeds a third of the greatest, and to "turn
left" if its yaw rate does. If it does both, `probabilities` counts half to each and `part` returns
the larger one. If it does neither, it belongs to "forward". Probabilities have a closed form.
"""

import dataclasses
import math
from collections.abc import Mapping
from typing import Self

import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.config.dynamics import ActionSettings
from drone_rl.sim.actions import MOVES, Actions, Entry, listed
from drone_rl.sim.vocabulary import ShownActions
from drone_rl.utils import palette
from drone_rl.utils.errors import InputError

FORWARD, SIDEWAYS, YAW = range(3)
"""Indices of an action's numbers."""
ASIDE = 1 / 3
"""Fraction of the greatest speed or rate above which an action goes, or turns, to that side."""
_EDGE = math.atanh(ASIDE)
MOST_MEAN = 3.0
"""Largest mean before squashing; tanh(3) = 0.995."""
LEAST_LOG, MOST_LOG = -3.0, 0.0
"""Bounds of the deviation's logarithm; at 0 the squashed distribution is about uniform."""
_FIRST_LOG = -0.5
"""The logarithm for an output of 0."""
SHIFT = math.log((_FIRST_LOG - LEAST_LOG) / (MOST_LOG - _FIRST_LOG))
_SLANTED = math.sqrt(0.5)
"""Components of a diagonal arrow."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ContinuousActions(Actions):
    """Speeds forward and sideways, and a yaw rate; see the module and `Actions`."""

    speeds: tuple[float, float, float]
    """Greatest speeds forward and sideways, m/s, and greatest yaw rate, rad/s."""

    @classmethod
    def of(cls, settings: ActionSettings) -> Self:
        """Return the actions for some settings; raise an `InputError` if they are discrete."""
        if settings.kind != "velocity":
            raise InputError(
                f"actions={settings.kind} are discrete; give settings with kind=velocity"
            )
        count, yaw_rate = 5 if settings.yaw_rate else 3, math.radians(settings.yaw_rate)
        return cls(
            names=("forward", "left", "right", "turn left", "turn right")[:count],
            mirrored=(0, 2, 1, 4, 3)[:count],
            opposite=(0, 2, 1, 4, 3)[:count],
            left=1,
            order=(3, 1, 0, 2, 4) if settings.yaw_rate else (1, 0, 2),
            arrows=(*MOVES.arrows, (-_SLANTED, _SLANTED), (_SLANTED, _SLANTED))[:count],
            colors=(*MOVES.colors, palette.TURN_LEFT, palette.TURN_RIGHT)[:count],
            speeds=(settings.forward_speed, settings.sideways_speed, yaw_rate),
        )

    @property
    def lefts(self) -> tuple[int, ...]:
        """Going left, and turning left."""
        return (self.left, 3) if self.can_turn else (self.left,)

    @property
    def can_turn(self) -> bool:
        """Whether drones can turn."""
        return self.speeds[YAW] > 0

    @property
    def entry(self) -> Entry:
        """Three numbers."""
        return Entry((3,), torch.float32, -1.0, 1.0)

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the means, then of the deviations."""
        numbers = ("forward", "left", "turn left")
        return (*(f"{n} mean" for n in numbers), *(f"{n} deviation" for n in numbers))

    def to_rates(self, action: Tensor | NDArray) -> Tensor:
        """Return m/s forward, m/s to the left and rad/s to the left, in the drone's frame.

        Actions are clipped to [-1, 1]. Shapes: (*, 3), the result's type is float64.
        """
        action = torch.as_tensor(action)
        forward, *aside = action.double().clamp(-1, 1).unbind(-1)
        return torch.stack([(forward + 1) / 2, *aside], -1) * action.new_tensor(
            self.speeds, dtype=torch.float64
        )

    def probabilities(self, outputs: Tensor) -> Tensor:
        """Return the probability of each part."""
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
        """Return the means' outputs, signed to each part; that of forward is its mean's output."""
        forward, left, turn_left = outputs[..., :3].unbind(-1)
        every = (forward, left, -left, turn_left, -turn_left)
        return torch.stack(every[: len(self)], -1)

    def greedy(self, outputs: Tensor) -> Tensor:
        """Return the squashed means."""
        return normal_of(outputs)[0].tanh()

    def part(self, action: Tensor) -> Tensor:
        """Return the side that an action goes or turns to, whichever is more; else forward."""
        aside, turned = action[..., SIDEWAYS], action[..., YAW] * self.can_turn
        is_turn = turned.abs() > aside.abs()
        stronger = torch.where(is_turn, turned, aside)
        part = torch.where(is_turn, 3, 1) + (stronger < 0).long()
        return part.masked_fill(stronger.abs() <= ASIDE, 0)

    def always(self, name: str) -> Tensor:
        """Return the full-speed action of a part; those to a side do not go forward."""
        actions = ((1, 0, 0), (-1, 1, 0), (-1, -1, 0), (-1, 0, 1), (-1, 0, -1))
        return torch.tensor(actions[self.names.index(name)], dtype=torch.float32)

    def speeds_of(self, action: Tensor) -> Tensor:
        """See `Actions`."""
        forward, left, turn = action.float().clamp(-1, 1).unbind(-1)
        return torch.stack([(forward + 1) / 2, left, torch.zeros_like(left), turn], -1)

    def sample(self, shape: tuple[int, ...], generator: torch.Generator) -> Tensor:
        """See `Actions.sample`."""
        actions = torch.rand(*shape, 3, generator=generator, device=generator.device)
        return 2 * actions - 1

    def fields(self) -> dict[str, str]:
        """Return the entries of part and rates."""
        return {
            "actions": "part to which the action taken belongs: " + listed(self.names),
            "rates": "the action: m/s forward, m/s to the left, rad/s to the left (T, 3)",
        }

    def kept(self, action: Tensor) -> dict[str, Tensor]:
        """Return the part, and the action in m/s and rad/s."""
        return {"actions": self.part(action), "rates": self.to_rates(action)}

    @property
    def shown(self) -> ShownActions:
        """What reports need, with the speeds."""
        forward, aside, turning = self.speeds
        return super().shown.replace(speeds=(forward, aside, math.degrees(turning)))

    def is_reversible(self, kept: Mapping[str, Tensor]) -> Tensor:
        """Return whether actions go or turn to a side, forward at most at a third of full speed."""
        is_slow = kept["rates"][..., FORWARD] <= ASIDE * self.speeds[FORWARD]
        return self.can_be_undone(kept["actions"]) & is_slow


def normal_of(outputs: Tensor) -> tuple[Tensor, Tensor]:
    """Return means and deviations before squashing, each (*, n), of a network's outputs, (*, 2 n).

    Both are bounded smoothly, so that float32 can distinguish the actions of any policy: means from
    -3 to 3, deviations from 0.05 to 1.
    """
    mean, log = outputs.chunk(2, -1)
    share = (log + SHIFT).sigmoid()
    deviation = (LEAST_LOG + (MOST_LOG - LEAST_LOG) * share).exp()
    return MOST_MEAN * (mean / MOST_MEAN).tanh(), deviation


def _above(distance: Tensor) -> Tensor:
    """Return the standard normal distribution function."""
    return 0.5 * (1 + torch.erf(distance / math.sqrt(2.0)))
