"""Return estimators as TorchRL transforms, applied by the collector to each batch.

Each `ReturnEstimator` applies one function of `objectives.returns` and writes "return_to_go"; those
with a discount rate `gamma` raise `InputError` unless it is in [0, 1]. `Advantages` is TorchRL's
GAE, for learners with a critic.
"""

import abc
from typing import Any, ClassVar, TypedDict, Unpack

import torch
from tensordict import TensorDictBase
from tensordict.utils import NestedKey
from torch import Tensor
from torchrl.envs import EnvBase, Transform
from torchrl.objectives.value import GAE

from drone_rl.config import learning as settings
from drone_rl.config.learning import Gae, Returns
from drone_rl.config.registry import implements
from drone_rl.objectives import returns
from drone_rl.utils.errors import InputError
from drone_rl.utils.plugins import described, place_of

_MASK = ("collector", "mask")


class ReturnKeys(TypedDict, total=False):
    """Keyword arguments of `ReturnEstimator`."""

    scale: bool | None
    reward_key: NestedKey
    done_key: NestedKey
    out_key: NestedKey


class ReturnEstimator(Transform, abc.ABC):
    """Read rewards and end flags of shape (*batch, T, 1), write returns of the same shape.

    A return is known once its episode has ended, so this is no transform of an environment. Like
    TorchRL's `Reward2GoTransform` it is for complete episodes: the `postproc` of a collector (of a
    chain, its `inv`), or the transform of a replay buffer, which estimates when a batch is added.

    If a batch ends within an episode, the returns of its steps are unknown: they are 0, and
    ("collector", "mask"), which TorchRL's losses and ours use, is False. An episode that began in
    an earlier batch is taken to begin with this one; TorchRL's collectors start each batch again
    with `reset_at_each_iter=True`.

    Examples:
        >>> Collector(env, actor, reset_at_each_iter=True, postproc=RewardToGo(), ...)
        >>> ReplayBuffer(storage=LazyTensorStorage(10_000), transform=RewardToGo())
        >>> RewardToGo(0.95)(batch)["return_to_go"]
    """

    Settings: ClassVar[type[Returns]] = Returns
    """Where the defaults of the parameters are defined."""

    def __init__(
        self,
        *,
        scale: bool | None = None,
        reward_key: NestedKey = ("next", "reward"),
        done_key: NestedKey = ("next", "done"),
        out_key: NestedKey = "return_to_go",
    ) -> None:
        """Name the entries.

        Args:
            scale: Whether to divide the batch's returns by their root mean square; biased, see
                `returns.scale_to_unit`. By default as in the settings of this estimator.
            reward_key: Entry with the rewards.
            done_key: Entry with the end flags.
            out_key: Entry that is written, under one name for all estimators. With a baseline, as
                in the default `LeaveOneOut`, it holds advantages, scaled if `scale` is set.
        """
        read, written = [reward_key, done_key], [out_key]
        super().__init__(in_keys=read, out_keys=written, in_keys_inv=read, out_keys_inv=written)
        self.scale = self.Settings().scale if scale is None else scale
        self._is_contained = False

    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Write the returns; in the chain of a replay buffer, return samples unchanged.

        Raises:
            InputError: No episode ends in the batch.
        """
        return tensordict if self._is_contained else self._inv_call(tensordict)

    @torch.no_grad()
    def _inv_call(self, tensordict: TensorDictBase) -> TensorDictBase:
        reward, done = (tensordict.get(key) for key in self.in_keys)
        ends = _ends_later(done)
        if bool(ends.all()) and not (self._is_contained or _MASK in tensordict.keys(True)):
            return tensordict.set(self.out_keys[0], self._estimate(reward, done))
        values = self._estimate(reward[ends][:, None], done[ends][:, None])
        filled = torch.zeros_like(reward, dtype=values.dtype)
        filled[ends] = values[:, 0]
        return tensordict.set(self.out_keys[0], filled).set(_MASK, ends[..., 0])

    def _estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        values: Any = self.estimate(reward, done)
        is_tensor = isinstance(values, Tensor) and values.shape == reward.shape
        fault = "" if is_tensor else described(values)
        if is_tensor and not type(self).__module__.startswith("drone_rl."):
            fault = "" if values.isfinite().all() else "NaN or infinity"
        if fault:
            raise InputError(
                f"{place_of(type(self))} returns {fault} for rewards of shape "
                f"{tuple(reward.shape)}; return a tensor of finite numbers of that shape"
            )
        return returns.scale_to_unit(values) if self.scale else values

    def set_container(self, container: Transform | EnvBase) -> None:
        """Join a chain of transforms; raise an `InputError` if it belongs to an environment."""
        if isinstance(container, EnvBase) or container.parent is not None:
            raise InputError(
                f"{type(self).__name__} needs whole episodes, an environment has one step at a "
                "time; give it as postproc to a collector or as transform to a replay buffer"
            )
        super().set_container(container)
        self._is_contained = True

    @abc.abstractmethod
    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """Return the returns. Shape: that of `reward`."""


def _ends_later(done: Tensor) -> Tensor:
    """Return whether the episode of each step ends within its row. Shape: (*batch, T, 1)."""
    ends = done.flip(-2).cumsum(-2).flip(-2) > 0
    if not bool(ends.any()):
        raise InputError(
            f"no episode ends in a batch of shape {tuple(done.shape[:-1])}, so no return is known; "
            "collect more steps a batch"
        )
    return ends


class _Discounted(ReturnEstimator):
    def __init__(self, gamma: float | None = None, **keys: Unpack[ReturnKeys]) -> None:
        super().__init__(**keys)
        defaults: Any = self.Settings()
        self.gamma: float = defaults.gamma if gamma is None else gamma
        if not 0.0 <= self.gamma <= 1.0:
            raise InputError(f"gamma={gamma} is out of range; give a rate from 0 to 1")


@implements(settings.TotalReward)
class TotalReward(ReturnEstimator):
    """The whole episode's reward at every step (Eq. 12)."""

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `returns.total_reward`."""
        return returns.total_reward(reward, done)


@implements(settings.RewardToGo)
class RewardToGo(_Discounted):
    """Discounted return (Eq. 14)."""

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `returns.reward_to_go`."""
        return returns.reward_to_go(reward, done, self.gamma)


@implements(settings.Standardized)
class Standardized(_Discounted):
    """Discounted return, standardized over each episode (Algorithm 4)."""

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `returns.standardized`."""
        return returns.standardized(reward, done, self.gamma)


@implements(settings.LinearRamp)
class LinearRamp(ReturnEstimator):
    """The episode's reward times a ramp over the episode."""

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `returns.linear_ramp`."""
        return returns.linear_ramp(reward, done)


@implements(settings.SuccessScaled)
class SuccessScaled(_Discounted):
    """Discounted return scaled by exp(reward - max_reward)."""

    def __init__(
        self,
        gamma: float | None = None,
        max_reward: float = settings.SuccessScaled().max_reward,
        **keys: Unpack[ReturnKeys],
    ) -> None:
        super().__init__(gamma, **keys)
        self.max_reward = max_reward

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `returns.success_scaled`."""
        return returns.success_scaled(reward, done, self.gamma, self.max_reward)


@implements(settings.TimeBaseline)
class TimeBaseline(_Discounted):
    """Discounted return minus a running mean, over earlier episodes, for each time step."""

    baseline: Tensor
    """Means by time step. Shape: (max_steps,)."""
    seen: Tensor
    """Which steps have one. Shape: (max_steps,)."""

    def __init__(
        self,
        gamma: float | None = None,
        decay: float = settings.TimeBaseline().decay,
        max_steps: int = settings.TimeBaseline().max_steps,
        **keys: Unpack[ReturnKeys],
    ) -> None:
        """Allocate the means of `max_steps` time steps.

        `decay`, 0 or more and below 1, is the weight of the old mean at each batch.
        """
        super().__init__(gamma, **keys)
        if not 0.0 <= decay < 1.0:
            raise InputError(f"decay={decay} is out of range; give 0 or more, below 1")
        self.decay = decay
        self.register_buffer("baseline", torch.zeros(max_steps))
        self.register_buffer("seen", torch.zeros(max_steps, dtype=torch.bool))

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `returns.time_baseline`; the running mean takes in this batch only afterwards."""
        values = returns.time_baseline(reward, done, self.gamma, self.baseline)
        mean, _ = returns.mean_by_time(returns.reward_to_go(reward, done, self.gamma), done)
        steps = min(len(mean), len(self.baseline))
        old, mean, seen = self.baseline[:steps], mean[:steps], self.seen[:steps]
        blend = self.decay * old + (1 - self.decay) * mean
        self.baseline[:steps] = torch.where(seen, blend, mean)
        self.seen[:steps] = True
        return values


@implements(settings.LeaveOneOut)
class LeaveOneOut(_Discounted):
    """Discounted return minus the other episodes' mean at the same time step."""

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `returns.leave_one_out`."""
        return returns.leave_one_out(reward, done, self.gamma)


@implements(settings.BatchNormalized)
class BatchNormalized(_Discounted):
    """Discounted return, normalized over the batch."""

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `returns.batch_normalized`."""
        return returns.batch_normalized(reward, done, self.gamma)


@implements(Gae)
class Advantages(GAE):
    """Generalized advantage estimates (TorchRL's `GAE`) from values that the batch contains.

    Reads "state_value", ("next", "state_value") and ("next", ...) "reward", "done", "terminated";
    writes "advantage" and "value_target". Shapes: (*batch, T, 1). A step that is not
    `terminated` is bootstrapped with the value of the next state, also at the end of a row.
    """

    def __init__(
        self, gamma: float = Gae().gamma, lmbda: float = Gae().lmbda, scale: bool = Gae().scale
    ) -> None:
        """Set discount rate, weight of later estimates, and whether to standardize a batch."""
        super().__init__(gamma=gamma, lmbda=lmbda, value_network=None, average_gae=scale)
