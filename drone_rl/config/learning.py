"""How parameters are changed: the optimiser and the schedule of its rate."""

import dataclasses
from typing import Annotated, ClassVar

from drone_rl.config.variant import Variant
from drone_rl.utils.schema import Real, Whole

LearningRate = Annotated[float, Real(0.0, 1e30, is_above=True)]
"""Bounded so that a step is a number in float32, of which Adam's first takes ten times the rate;
above that torch fails with an error of its own. Which rates make sense is for training to find."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Optimiser(Variant):
    """Which optimiser, and with which values."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Adam(Optimiser):
    """Steps as long as the gradient is sure of itself."""

    target: ClassVar[str] = "torch.optim.Adam"
    lr: LearningRate = 1e-3
    """Learning rate."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Sgd(Optimiser):
    """Plain stochastic gradient ascent (Eq. 13)."""

    target: ClassVar[str] = "torch.optim.SGD"
    lr: LearningRate = 1e-4
    """Learning rate; the original study's."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scheduler(Variant):
    """Which schedule of the learning rate, and with which values."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Constant(Scheduler):
    """The learning rate stays as it is."""

    target: ClassVar[str] = "torch.optim.lr_scheduler.ConstantLR"
    factor: Annotated[float, Real(0.0, 1.0)] = 1.0
    """Factor on the learning rate."""
    total_iters: Annotated[int, Whole(0, unit="updates")] = 0
    """Updates for which the factor holds."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class StepDecay(Scheduler):
    """The original study's schedule: 0.99 times the rate every 5 updates."""

    target: ClassVar[str] = "torch.optim.lr_scheduler.StepLR"
    step_size: Annotated[int, Whole(1, unit="updates")] = 5
    """Updates from one decay to the next."""
    gamma: Annotated[float, Real(0.0, 1.0)] = 0.99
    """Factor of a decay."""
