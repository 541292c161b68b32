"""Returns of the steps of an episode: pure functions of rewards, and transforms that apply them.

Every function takes `reward` and `done` of shape (*batch, T, 1), time in dimension -2, of complete
episodes: no return crosses a `done`, and the last step of every row must be one. A flat batch
(T, 1) of episodes one after the other and a batch (N, T, 1) are equivalent.

The original study's other variants are in `original_returns`.

Unbiased means: with the loss summed over steps and divided by the number of episodes, the expected
gradient is that of the expected reward (undiscounted), or that of Eq. 15 (discounted). Biases are
measured by enumerating all outcomes of small batches on the process of Fig. 3
(`drone_rl.envs.three_state`), two steps long, both actions equally likely, gamma 0.95; angles are
those between the expected update and the exact gradient. Discounting alone turns it by 1.4 degrees.
"""

import abc
from collections.abc import Callable
from typing import Any, ClassVar, TypedDict, Unpack

import torch
from tensordict import TensorDictBase
from tensordict.utils import NestedKey
from torch import Tensor
from torch.nn.utils.rnn import pad_sequence
from torchrl.envs import EnvBase, Transform

from drone_rl.config import learning as settings
from drone_rl.config.registry import implements
from drone_rl.utils.errors import InputError
from drone_rl.utils.plugins import described, place_of

ROUNDING = 1e-6
"""Deviation of returns, in rewards, up to which they differ by rounding errors alone."""


def episode_lengths(done: Tensor) -> list[int]:
    """Return the lengths of the episodes, row after row, from end flags (*batch, T, 1).

    Raises:
        InputError: A row does not end with its last episode.
    """
    if not bool(done[..., -1, :].all()):
        raise InputError(
            "a return needs complete episodes, but a row's last step is not done; "
            "collect with EpisodeCollector, or cut the unfinished tail"
        )
    ends = done.flatten().nonzero()[:, 0]
    return torch.diff(ends, prepend=ends.new_tensor([-1])).tolist()


def total_reward(reward: Tensor, done: Tensor) -> Tensor:
    """Return the whole episode's reward at every step, r(tau) of Eq. 12; unbiased."""
    padded, lengths = pad(reward, done)
    return unpad(padded.sum(0).expand_as(padded), lengths, reward)


def reward_to_go(reward: Tensor, done: Tensor, gamma: float) -> Tensor:
    """Discounted return, Eq. 14: g_t = r_{t+1} + gamma g_{t+1}; unbiased. Shape: (*batch, T, 1)."""
    padded, lengths = pad(reward, done)
    return unpad(discount(padded, gamma), lengths, reward)


def leave_one_out(reward: Tensor, done: Tensor, gamma: float) -> Tensor:
    """Discounted return minus the mean, at the same time step, of the other episodes still going.

    The baseline does not depend on the episode's own actions, so this is unbiased, as long as it is
    neither scaled (`scale_to_unit`) nor averaged over steps (`ReinforceLoss`); an episode that goes
    on alone has baseline 0.
    """
    padded, lengths = pad(reward, done)
    returns = discount(padded, gamma)
    others = alive(lengths, returns).sum(1, keepdim=True) - 1
    baseline = (returns.sum(1, keepdim=True) - returns) / others.clamp(min=1)
    return unpad(returns - baseline, lengths, reward)


def batch_normalized(reward: Tensor, done: Tensor, gamma: float) -> Tensor:
    """Discounted return, (g - mean) / std over the whole batch; zeros if it is constant.

    Mean and deviation contain the episode itself, so this is biased, less the larger the batch: by
    10.9 degrees with 2 episodes, 1.9 with 8; with a single one it is `standardized`.
    """
    returns = reward_to_go(reward, done, gamma)
    centred = returns - returns.mean()
    deviation = centred.square().mean().sqrt()
    return centred / deviation if deviation > ROUNDING else torch.zeros_like(centred)


def scale_to_unit(returns: Tensor) -> Tensor:
    """Divide by the root mean square of the batch, which keeps zero where it is.

    The batch's own returns are in the divisor, so what was unbiased becomes biased, though less the
    larger the batch. `leave_one_out`: by 8.7 degrees with 3 episodes, 2.6 with 8, 0.1 with 64.
    Returns that differ from 0 by rounding errors alone become 0 and are not scaled up.
    """
    rms = returns.square().mean().sqrt()
    return returns / rms if rms > ROUNDING else torch.zeros_like(returns)


def pad(values: Tensor, done: Tensor) -> tuple[Tensor, list[int]]:
    """Return episodes side by side, (longest, episodes), zero after their ends, and lengths."""
    if values.shape != done.shape or values.shape[-1] != 1:
        raise ValueError(
            f"values {tuple(values.shape)} and done {tuple(done.shape)} must both be (*batch, T, 1)"
        )
    lengths = episode_lengths(done)
    return pad_sequence(list(values.flatten().float().split(lengths))), lengths


def unpad(padded: Tensor, lengths: list[int], like: Tensor) -> Tensor:
    """Return padded values as the steps of `like`, episode after episode."""
    episodes = zip(padded.T, lengths, strict=True)
    return torch.cat([episode[:length] for episode, length in episodes]).reshape(like.shape)


def discount(padded: Tensor, gamma: float) -> Tensor:
    """Return the discounted rewards-to-go of padded episodes."""
    returns = padded.cpu().numpy().copy()  # numpy: ten times faster than torch for short rows
    for t in range(len(returns) - 2, -1, -1):
        returns[t] += gamma * returns[t + 1]
    return torch.from_numpy(returns).to(padded.device)


def alive(lengths: list[int], padded: Tensor) -> Tensor:
    """Return which steps of padded episodes belong to them. Shape: that of `padded`."""
    step = torch.arange(len(padded), device=padded.device)[:, None]
    return step < torch.tensor(lengths, device=padded.device)


_MASK = ("collector", "mask")


class ReturnKeys(TypedDict, total=False):
    """Keyword arguments of `ReturnEstimator`."""

    scale: bool | None
    reward_key: NestedKey
    done_key: NestedKey
    out_key: NestedKey


class ReturnEstimator(Transform, abc.ABC):
    """Apply one of the functions above to a batch: a transform, called by the collector.

    Read rewards and end flags of shape (*batch, T, 1), write returns of the same shape.

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

    Settings: ClassVar[type[settings.Returns]] = settings.Returns
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
                `scale_to_unit`. By default as in the settings of this estimator.
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
        return scale_to_unit(values) if self.scale else values

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


class Discounted(ReturnEstimator):
    """A return estimator with a discount rate."""

    function: ClassVar[Callable[[Tensor, Tensor, float], Tensor]]
    """Maps rewards, end flags and discount rate to returns."""

    def __init__(self, gamma: float | None = None, **keys: Unpack[ReturnKeys]) -> None:
        super().__init__(**keys)
        defaults: Any = self.Settings()
        self.gamma: float = defaults.gamma if gamma is None else gamma
        if not 0.0 <= self.gamma <= 1.0:
            raise InputError(f"gamma={gamma} is out of range; give a rate from 0 to 1")

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `ReturnEstimator.estimate`."""
        return type(self).function(reward, done, self.gamma)


@implements(settings.TotalReward)
class TotalReward(ReturnEstimator):
    """The whole episode's reward at every step (Eq. 12)."""

    def estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        """See `total_reward`."""
        return total_reward(reward, done)


@implements(settings.RewardToGo)
class RewardToGo(Discounted):
    """Discounted return (Eq. 14)."""

    function = staticmethod(reward_to_go)


@implements(settings.LeaveOneOut)
class LeaveOneOut(Discounted):
    """Discounted return minus the other episodes' mean at the same time step."""

    function = staticmethod(leave_one_out)


@implements(settings.BatchNormalized)
class BatchNormalized(Discounted):
    """Discounted return, normalized over the batch."""

    function = staticmethod(batch_normalized)
