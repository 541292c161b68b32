"""Continuous actions: speeds forward and sideways, a yaw rate, and a climb rate if there is one.

An action is three or four numbers in [-1, 1]. Forward: 1 is full speed, -1 is none, or full speed
back if there is one; sideways, yaw and climb: 1 is the greatest speed or rate to the left or up, -1
to the right or down. Samples of normal distributions, see `normal_of`, are squashed by tanh.

The parts are forward, left, right, and, where drones can do so, turn left, turn right, up, down and
back. An action belongs to "left" if its speed to the left exceeds a third of the greatest, and
likewise to the others, where left and right, both turns, and up and down are one kind each. If it
belongs to several kinds, `probabilities` counts it in equal shares and `part` returns the largest
one. If it belongs to none, it belongs to "forward". Probabilities have a closed form.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Self

import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.config.dynamics import ActionSettings
from drone_rl.sim.actions import PARTS, Actions, Entry, fields_of, listed
from drone_rl.sim.vocabulary import ShownActions
from drone_rl.utils.errors import InputError

FORWARD, SIDEWAYS, YAW, CLIMB = range(4)
"""Indices of an action's numbers."""
_KINDS = {
    ("left", "right"): SIDEWAYS,
    ("turn left", "turn right"): YAW,
    ("up", "down"): CLIMB,
    ("back",): FORWARD,
}
"""Kinds of parts besides forward, and the indices of their numbers."""
ASIDE = 1 / 3
"""Fraction of the greatest speed or rate above which an action goes, or turns, to that side."""
MOST_MEAN = 3.0
"""Largest mean before squashing; tanh(3) = 0.995."""
LEAST_LOG, MOST_LOG = -3.0, 0.0
"""Bounds of the deviation's logarithm; at 0 the squashed distribution is about uniform."""
_FIRST_LOG = -0.5
"""The logarithm for an output of 0."""
SHIFT = math.log((_FIRST_LOG - LEAST_LOG) / (MOST_LOG - _FIRST_LOG))


class _Signed(NamedTuple):
    """A part to which actions belong that exceed a bound."""

    axis: int
    """Index of the action's number."""
    sign: int
    edge: float
    """Bound of the signed number before it is squashed."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class ContinuousActions(Actions):
    """Speeds forward and sideways, a yaw and a climb rate; see the module and `Actions`."""

    speeds: tuple[float, float, float, float]
    """Greatest speeds forward and sideways, m/s, yaw rate, rad/s, and climb rate, m/s."""
    backward: float = 0.0
    """Greatest speed backward, as a fraction of that forward."""

    @classmethod
    def of(cls, settings: ActionSettings) -> Self:
        """Return the actions for some settings; raise an `InputError` if they are discrete."""
        if settings.kind != "velocity":
            raise InputError(
                f"actions={settings.kind} are discrete; give settings with kind=velocity"
            )
        s, yaw_rate = settings, math.radians(settings.yaw_rate)
        is_there = {SIDEWAYS: 1.0, YAW: s.yaw_rate, CLIMB: s.climb_speed, FORWARD: s.backward_speed}
        names = (name for kind, axis in _KINDS.items() if is_there[axis] for name in kind)
        return cls(
            **fields_of(("forward", *names)),
            speeds=(s.forward_speed, s.sideways_speed, yaw_rate, s.climb_speed),
            backward=s.backward_speed / s.forward_speed,
        )

    @property
    def _kinds(self) -> list[list[_Signed]]:
        """Parts besides forward, by kind and in order."""
        edge = math.atanh(ASIDE)
        kinds = [
            [_Signed(axis, sign, edge) for sign in (1, -1)]
            for kind, axis in _KINDS.items()
            if kind[0] in self.names and axis != FORWARD
        ]
        if self.backward:
            back = (1 - ASIDE) * 2 * self.backward / (1 + self.backward) - 1
            kinds.append([_Signed(FORWARD, -1, -math.atanh(back))])
        return kinds

    @property
    def _count(self) -> int:
        """How many numbers an action has."""
        return 4 if self.speeds[CLIMB] else 3

    @property
    def entry(self) -> Entry:
        """Three numbers, or four."""
        return Entry((self._count,), torch.float32, -1.0, 1.0)

    @property
    def output_names(self) -> tuple[str, ...]:
        """Names of the means, then of the deviations."""
        numbers = ("forward", "left", "turn left", "up")[: self._count]
        return (*(f"{n} mean" for n in numbers), *(f"{n} deviation" for n in numbers))

    def fractions(self, action: Tensor) -> Tensor:
        """Return the fraction of the greatest speed or rate of each number, forward's of that.

        Actions are clipped to [-1, 1]. Shape kept: (*, n).
        """
        forward, *others = action.clamp(-1, 1).unbind(-1)
        forward = (forward + 1) / 2 * (1 + self.backward) - self.backward
        return torch.stack([forward, *others], -1)

    def to_rates(self, action: Tensor | NDArray) -> Tensor:
        """Return m/s forward, m/s and rad/s to the left, and m/s up, in the drone's frame.

        Actions are clipped to [-1, 1]. Shapes: (*, n), the result's type is float64.
        """
        action = torch.as_tensor(action).double()
        return self.fractions(action) * action.new_tensor(self.speeds[: self._count])

    def commanded(self, forward: float, left: float, up: float, turn: float) -> Tensor:
        """Return the action of deflections from -1 to 1, as of sticks. Shape: (n,), float32."""
        ahead = forward if forward > 0 else forward * self.backward
        numbers = (2 * (ahead + self.backward) / (1 + self.backward) - 1, left, turn, up)
        return torch.tensor(numbers[: self._count])

    def probabilities(self, outputs: Tensor) -> Tensor:
        """Return the probability of each part."""
        mean, deviation = normal_of(outputs)
        kinds = [
            [_above((p.sign * mean[..., p.axis] - p.edge) / deviation[..., p.axis]) for p in kind]
            for kind in self._kinds
        ]
        chances = [sum(kind, torch.zeros(())).clamp(max=1) for kind in kinds]
        parts: list[Any] = [math.prod(1 - chance for chance in chances)]
        for number, kind in enumerate(kinds):
            share = _mean_share([*chances[:number], *chances[number + 1 :]])
            parts += [part * share for part in kind]
        return torch.stack(parts, -1)

    def scores(self, outputs: Tensor) -> Tensor:
        """Return the means' outputs, signed to each part; that of forward is its mean's output."""
        return torch.cat([outputs[..., [FORWARD]], self._signed(outputs)], -1)

    def greedy(self, outputs: Tensor) -> Tensor:
        """Return the squashed means."""
        return normal_of(outputs)[0].tanh()

    def part(self, action: Tensor) -> Tensor:
        """Return the part of which an action is most, if that is above a third; else forward."""
        fractions = self.fractions(action)
        if self.backward:
            fractions[..., FORWARD] /= self.backward
        most, part = self._signed(fractions).max(-1)
        return (part + 1).masked_fill(most <= ASIDE, 0)

    def _signed(self, numbers: Tensor) -> Tensor:
        """Return the numbers of all parts but forward, in their order and signed to them."""
        parts = [part for kind in self._kinds for part in kind]
        return torch.stack([part.sign * numbers[..., part.axis] for part in parts], -1)

    def always(self, name: str) -> Tensor:
        """Return the full-speed action of a part; those to a side do not go forward."""
        forward, left, up, turn = PARTS[name].speeds
        return self.commanded(forward, left, up, turn)

    def speeds_of(self, action: Tensor) -> Tensor:
        """See `Actions`."""
        forward, left, turn, *up = self.fractions(action.float()).unbind(-1)
        return torch.stack([forward, left, *(up or [torch.zeros_like(left)]), turn], -1)

    def sample(self, shape: tuple[int, ...], generator: torch.Generator) -> Tensor:
        """See `Actions.sample`."""
        actions = torch.rand(*shape, self._count, generator=generator, device=generator.device)
        return 2 * actions - 1

    def fields(self) -> dict[str, str]:
        """Return the entries of part and rates."""
        return {
            "actions": "part to which the action taken belongs: " + listed(self.names),
            "rates": "the action: m/s forward, m/s to the left, rad/s to the left, m/s up if the "
            "drone climbs (T, 3 or 4)",
        }

    def kept(self, action: Tensor) -> dict[str, Tensor]:
        """Return the part, and the action in m/s and rad/s."""
        return {"actions": self.part(action), "rates": self.to_rates(action)}

    @property
    def shown(self) -> ShownActions:
        """What reports need, with the speeds."""
        forward, aside, turning, climb = self.speeds
        back = forward * self.backward
        return super().shown.replace(speeds=(forward, aside, math.degrees(turning), climb, back))

    def is_reversible(self, kept: Mapping[str, Tensor]) -> Tensor:
        """Return whether actions go or turn to a side, forward at most at a third of full speed."""
        is_slow = kept["rates"][..., FORWARD].abs() <= ASIDE * self.speeds[FORWARD]
        part = kept["actions"]
        return self.can_be_undone(part) & ~self.goes_forward(part) & is_slow


def normal_of(outputs: Tensor) -> tuple[Tensor, Tensor]:
    """Return means and deviations before squashing, each (*, n), of a network's outputs, (*, 2 n).

    Both are bounded smoothly, so that float32 can distinguish the actions of any policy: means from
    -3 to 3, deviations from 0.05 to 1.
    """
    mean, log = outputs.chunk(2, -1)
    share = (log + SHIFT).sigmoid()
    deviation = (LEAST_LOG + (MOST_LOG - LEAST_LOG) * share).exp()
    return MOST_MEAN * (mean / MOST_MEAN).tanh(), deviation


def _mean_share(others: Sequence[Tensor]) -> Tensor | float:
    """Return the mean of 1 / (1 + the number of independent events), given their probabilities.

    It is the integral of the product of all 1 - p u, u from 0 to 1.
    """
    coefficients: list[Tensor | float] = [1.0]
    for chance in others:
        shifted = [0.0, *(-chance * one for one in coefficients)]
        coefficients = [a + b for a, b in zip([*coefficients, 0.0], shifted, strict=True)]
    return sum(one / (power + 1) for power, one in enumerate(coefficients))


def _above(distance: Tensor) -> Tensor:
    """Return the standard normal distribution function."""
    return 0.5 * (1 + torch.erf(distance / math.sqrt(2.0)))
