"""Normal numbers, squashed by tanh into [-1, 1]: how continuous actions are drawn."""

import math
from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor
from torch.distributions import Distribution
from torch.distributions.constraints import Constraint
from torch.nn import functional

from drone_rl.sim.continuous_actions import normal_of


class RandomSource:
    """A torch generator that copies of a module share, so that no draw is made twice."""

    def __init__(self, generator: torch.Generator) -> None:
        self.generator = generator

    def __deepcopy__(self, memo: dict) -> "RandomSource":
        """Returns itself: the stream is one, however many copies draw from it."""
        return self


MOST = 1 - 1e-6
"""Size of an action; float32 hardly tells those above from 1, whose density is unknown."""
_NODES = 32


class SquashedNormal(Distribution):
    """tanh of independent normal numbers, drawn from a generator of its own, not the global one."""

    has_rsample = False

    def __init__(self, logits: Tensor, source: RandomSource | None = None) -> None:
        """Takes outputs of a network, n means and n deviations, see `normal_of`: (*batch, 2 n)."""
        self.loc, self.scale = normal_of(logits)
        self._source = source
        shape = self.loc.shape
        super().__init__(shape[:-1], shape[-1:], validate_args=False)

    @property
    def arg_constraints(self) -> dict[str, Constraint]:
        """Return none: outputs may be any numbers."""
        return {}

    @property
    def deterministic_sample(self) -> Tensor:
        """The normal's mean, squashed, which is also the median. Shape: (*batch, n)."""
        return self.loc.tanh()

    @property
    def mode(self) -> Tensor:
        """Return `deterministic_sample`."""
        return self.deterministic_sample

    @torch.no_grad()
    def sample(self, sample_shape: Sequence[int] = ()) -> Tensor:
        """Sample. Shape: (*sample_shape, *batch, n)."""
        generator = None if self._source is None else self._source.generator
        shape = (*sample_shape, *self.loc.shape)
        draw = torch.randn(shape, generator=generator, device=self.loc.device)
        return (self.loc + self.scale * draw).tanh().clamp(-MOST, MOST)

    def log_prob(self, value: Tensor) -> Tensor:
        """Return the log-density of actions (*, n), which are clamped to `MOST`."""
        number = torch.atanh(value.clamp(-MOST, MOST))
        square = ((number - self.loc) / self.scale) ** 2
        normal = -0.5 * square - self.scale.log() - 0.5 * math.log(2 * math.pi)
        return (normal - _log_slope(number)).sum(-1)

    def entropy(self) -> Tensor:
        """Return the entropy of the squashed numbers: at most n log 2, where these are uniform.

        That of the normal numbers, whose bonus would increase deviations for ever, plus the mean
        of log(1 - tanh^2), by Gauss-Hermite quadrature, without sampling. Shape: batch.
        """
        places, weights = (self.loc.new_tensor(part) for part in _quadrature())
        numbers = self.loc[..., None] + self.scale[..., None] * places
        bend = (_log_slope(numbers) * weights).sum(-1)
        return (0.5 + 0.5 * math.log(2 * math.pi) + self.scale.log() + bend).sum(-1)


def _log_slope(number: Tensor) -> Tensor:
    """Return log(1 - tanh^2), without cancellation."""
    return 2 * (math.log(2) - number - functional.softplus(-2 * number))


def _quadrature() -> tuple[list[float], list[float]]:
    places, weights = np.polynomial.hermite_e.hermegauss(_NODES)
    return places.tolist(), (weights / weights.sum()).tolist()
