"""What is made smaller, and with which values."""

import dataclasses
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from drone_rl.config.collecting import Rollouts
from drone_rl.config.returns import Gae
from drone_rl.config.variant import Variant, locate
from drone_rl.utils.schema import OneOf, Real, Whole

Weight = Annotated[float, Real(0.0)]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Objective(Variant):
    """Which loss, and with which values."""

    learner: ClassVar[str] = "drone_rl.training.build_learner.reinforce_learner"
    """Where that which makes the learner is to be imported from."""
    needs: ClassVar[Mapping[str, Variant]] = {}
    """Other parts of a training that it can't do without, and brings unless they are given."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Reinforce(Objective):
    """REINFORCE without a critic."""

    target: ClassVar[str] = "drone_rl.objectives.ReinforceLoss"
    entropy_coeff: Weight = 0.01
    """Weight of the entropy bonus, which keeps a policy from giving up a side early; 0 for none."""
    reduction: Annotated[str, OneOf(("mean", "sum"))] = "mean"
    """Over a batch's steps: mean, or sum as in Algorithm 4."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class WithCritic(Objective):
    """One that learns, besides, what a state is worth."""

    learner: ClassVar[str] = "drone_rl.training.build_learner.actor_critic_learner"
    needs: ClassVar[Mapping[str, Variant]] = {"returns": Gae(), "collector": Rollouts()}
    num_steps: Annotated[int, Whole(2, 4096)] = 32
    """Steps of each world in a batch."""
    shares_trunk: bool = True
    """Whether the critic sees the features that the policy makes; else it has its own network."""
    critic_coeff: Annotated[float, Real(0.0, is_above=True)] = 1.0
    """Weight of the critic's loss."""
    entropy_coeff: Weight = 0.0
    """Weight of the entropy bonus; 0 for none."""

    @property
    def passes(self) -> dict[str, int]:
        """How often and in which pieces a batch is gone through, by name; once, as a whole."""
        return {}

    def make(self, *args: Any, **kwargs: Any) -> Any:
        """See `Variant`; the loss is told what is the loss's."""
        others = {"num_steps", "shares_trunk", *self.passes}
        values = {name: value for name, value in self.values().items() if name not in others}
        return locate(self.target)(*args, functional=False, **values, **kwargs)


@dataclasses.dataclass(frozen=True, kw_only=True)
class A2c(WithCritic):
    """Advantage actor-critic: one step of the optimiser from each batch."""

    target: ClassVar[str] = "torchrl.objectives.A2CLoss"
    num_steps: Annotated[int, Whole(2, 4096)] = 16
    """Steps of each world in a batch."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Ppo(WithCritic):
    """Proximal policy optimisation with clipped ratios: several passes over each batch."""

    target: ClassVar[str] = "torchrl.objectives.ClipPPOLoss"
    clip_epsilon: Annotated[float, Real(0.0, 1.0, is_above=True)] = 0.2
    """How far the probability of an action may change, as a share, before it counts no more."""
    epochs: Annotated[int, Whole(1)] = 2
    """Passes over a batch."""
    minibatch_size: Annotated[int, Whole(1)] = 512
    """About how many steps of a batch make one step of the optimiser."""

    @property
    def passes(self) -> dict[str, int]:
        """See `WithCritic`."""
        return {"epochs": self.epochs, "minibatch_size": self.minibatch_size}
