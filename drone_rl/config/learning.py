"""Settings of return estimators, objectives, optimizers, learning-rate schedules and collectors."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from drone_rl.config.parts import Part
from drone_rl.config.values import Fraction, NumEnvs, Steps
from drone_rl.utils.schema import Real, Whole


class Returns(Part):
    """Settings of a return estimator."""

    scale: bool = False
    """Whether to divide a batch's returns by their root mean square."""


class _Discounted(Returns):
    gamma: Fraction = 0.99
    """Discount rate, 0 to 1."""


class TotalReward(Returns, target="total_reward"):
    """The whole episode's reward at every step (Eq. 12)."""


class LinearRamp(Returns, target="linear_ramp"):
    """The episode's reward times a ramp over the episode (variant 1)."""


class RewardToGo(_Discounted, target="reward_to_go"):
    """Discounted return (Eq. 14; the original's variant 2)."""


class Standardized(_Discounted, target="standardized"):
    """Discounted return, standardized over each episode (Algorithm 4; variant 0)."""


class SuccessScaled(_Discounted, target="success_scaled"):
    """Discounted return scaled by exp(reward - max_reward) (variant 3)."""

    max_reward: Annotated[float, Real(0.0, 1e6)] = 3.0
    """Reward of a perfect episode; give the task's `largest_reward`."""


class TimeBaseline(_Discounted, target="time_baseline"):
    """Discounted return minus a running mean for each time step (variant 4)."""

    scale: bool = True
    decay: Annotated[float, Real(0.0, 1.0, is_below=True)] = 0.9
    """Weight of the old mean at each batch, 0 to below 1."""
    max_steps: Steps = 300
    """Time steps that have a mean of their own; later ones have 0. Give the task's step limit."""


class LeaveOneOut(_Discounted, target="leave_one_out"):
    """Discounted return minus the other episodes' mean at the same time step."""

    scale: bool = True
    gamma: Fraction = 0.95


class BatchNormalized(_Discounted, target="batch_normalized"):
    """Discounted return, normalized over the batch."""


class Gae(_Discounted, target="gae"):
    """Generalized advantage estimates, for objectives with a critic."""

    scale: bool = True
    """Whether to standardize a batch's advantages."""
    gamma: Fraction = 0.95
    lmbda: Fraction = 0.95
    """GAE's lambda, 0 to 1; 0 looks one step ahead."""


class Collector(Part):
    """Settings of a collector."""

    num_envs: NumEnvs = 16
    """Environments. A batch is one complete episode of each; with collector=rollouts it is a fixed
    number of steps of each."""
    num_threads: Annotated[int, Whole(1, unit="threads")] = 1
    """Groups of environments that are collected in parallel, each by its own thread or worker. Each
    samples actions from its own stream, so results for a seed depend on their number."""

    def arguments(self) -> dict[str, Any]:
        """Return nothing: the factory takes the settings of the whole training."""
        return {}


class Compiled(Collector):
    """Settings of collectors that have the fused kernel."""

    compiled: bool = True
    """Run whole episodes in one fused kernel if it supports task, camera and network, which is much
    faster on a CPU. It samples actions in a different order, so results for a seed depend on it."""


class Episodes(Compiled, target="episodes"):
    """Batches of complete episodes from threads of this process."""


class Ray(Episodes, target="ray"):
    """Batches of complete episodes from workers on a Ray cluster."""

    num_threads: Annotated[int, Whole(1, unit="workers")] = 2
    """Workers with own environments and action streams; results depend on their number."""
    address: str | None = None
    """Address of the cluster, such as auto or ray://host:10001; local starts one on
    this machine; null joins that of RAY_ADDRESS or ray start, else starts one."""
    num_cpus: Annotated[float, Real(0.0, is_above=True, unit="cores")] = 1.0
    """Cores that a worker takes of the cluster."""
    max_lost_workers: Annotated[int, Whole(0, unit="workers")] = 10
    """Workers that may be lost, and replaced, before training stops."""


class Rollouts(Compiled, target="rollouts"):
    """Batches of a fixed number of steps of each environment, from threads.

    The objective sets the number of steps. Episodes continue in the next batch.
    """

    num_envs: NumEnvs = 64
    """Environments."""


LearningRate = Annotated[float, Real(0.0, 1e30, is_above=True)]
"""Bounded because larger rates overflow float32 in Adam's first step."""


class Optimizer(Part):
    """Settings of an optimizer."""


class Adam(Optimizer, target="torch.optim.Adam"):
    """Adam."""

    lr: LearningRate = 1e-3
    """Learning rate."""


class Sgd(Optimizer, target="torch.optim.SGD"):
    """Plain SGD (Eq. 13 as descent on the negative objective)."""

    lr: LearningRate = 1e-4
    """Learning rate; the original study's."""


class Scheduler(Part):
    """Settings of a learning-rate schedule."""


class Constant(Scheduler, target="torch.optim.lr_scheduler.ConstantLR"):
    """Constant learning rate."""

    factor: Fraction = 1.0
    """Factor on the learning rate."""
    total_iters: Annotated[int, Whole(0, unit="updates")] = 0
    """Updates for which the factor holds."""


class StepDecay(Scheduler, target="torch.optim.lr_scheduler.StepLR"):
    """The original study's schedule: 0.99 times the rate every 5 updates."""

    step_size: Annotated[int, Whole(1, unit="updates")] = 5
    """Updates from one decay to the next."""
    gamma: Fraction = 0.99
    """Factor of a decay."""


Weight = Annotated[float, Real(0.0)]


class Objective(Part):
    """Settings of a loss and its learner."""

    needs: ClassVar[Mapping[str, Part]] = {}
    """Other parts that the objective requires, and selects unless they are given."""


class Reinforce(Objective, target="reinforce"):
    """REINFORCE without a critic."""

    entropy_coeff: Weight = 0.01
    """Weight of the entropy bonus, which keeps a policy exploring; 0 for none."""
    reduction: Literal["mean", "sum", "episode_mean"] = "mean"
    """Reduction over a batch's steps: mean; sum as in Algorithm 4; or episode_mean, the sum divided
    by the number of episodes (Eq. 12)."""


class WithCritic(Objective):
    """Objective with a critic."""

    needs: ClassVar[Mapping[str, Part]] = {"returns": Gae(), "collector": Rollouts()}
    num_steps: Annotated[int, Whole(2, 4096)] = 32
    """Steps of each environment in a batch."""
    shares_trunk: bool = True
    """Whether the critic shares the policy's features; otherwise it has its own network."""
    critic_coeff: Annotated[float, Real(0.0, is_above=True)] = 1.0
    """Weight of the critic's loss."""
    entropy_coeff: Weight = 0.0
    """Weight of the entropy bonus; 0 for none."""

    @property
    def passes(self) -> dict[str, int]:
        """Passes over a batch and size of minibatches; empty for one pass over the whole batch."""
        return {}

    def arguments(self) -> dict[str, Any]:
        """Return the settings of the loss."""
        others = {"num_steps", "shares_trunk", *self.passes}
        return {name: value for name, value in self.values().items() if name not in others}


class A2c(WithCritic, target="torchrl.objectives.A2CLoss"):
    """Advantage actor-critic: one step of the optimizer from each batch."""

    num_steps: Annotated[int, Whole(2, 4096)] = 16


class Ppo(WithCritic, target="torchrl.objectives.ClipPPOLoss"):
    """Proximal policy optimization with clipped ratios: several passes over each batch."""

    clip_epsilon: Annotated[float, Real(0.0, 1.0, is_above=True)] = 0.2
    """Clipping range of the probability ratio."""
    epochs: Annotated[int, Whole(1)] = 2
    """Passes over a batch."""
    minibatch_size: Annotated[int, Whole(1)] = 512
    """Approximate number of steps in a minibatch."""

    @property
    def passes(self) -> dict[str, int]:
        """See `WithCritic`."""
        return {"epochs": self.epochs, "minibatch_size": self.minibatch_size}
