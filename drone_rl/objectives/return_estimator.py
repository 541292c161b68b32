"""Base class of return estimators: TorchRL transforms of batches of complete episodes."""

import abc
from typing import ClassVar

import torch
from tensordict import TensorDictBase
from tensordict.utils import NestedKey
from torch import Tensor
from torchrl.envs import EnvBase, Transform

from drone_rl.config.learning import Returns
from drone_rl.objectives import returns
from drone_rl.utils.errors import InputError

_MASK = ("collector", "mask")


class ReturnEstimator(Transform, abc.ABC):
    """Reads rewards and end flags of shape (*batch, T, 1), writes returns of the same shape.

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
        """Names the entries.

        Args:
            scale: Whether to divide the batch's returns by their root mean square; biased, see
                `returns.scale_to_unit`. By default as in the settings of this estimator.
            reward_key: Entry with the rewards.
            done_key: Entry with the end flags.
            out_key: Entry that is written.
        """
        read, written = [reward_key, done_key], [out_key]
        super().__init__(in_keys=read, out_keys=written, in_keys_inv=read, out_keys_inv=written)
        self.scale = self.Settings.scale if scale is None else scale
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
        known = _ends_later(done)
        if bool(known.all()) and not (self._is_contained or _MASK in tensordict.keys(True)):
            return tensordict.set(self.out_keys[0], self._estimate(reward, done))
        values = self._estimate(reward[known][:, None], done[known][:, None])
        filled = torch.zeros_like(reward, dtype=values.dtype)
        filled[known] = values[:, 0]
        return tensordict.set(self.out_keys[0], filled).set(_MASK, known[..., 0])

    def _estimate(self, reward: Tensor, done: Tensor) -> Tensor:
        values = self.estimate(reward, done)
        return returns.scale_to_unit(values) if self.scale else values

    def set_container(self, container: Transform | EnvBase) -> None:
        """Join a chain of transforms.

        Raises:
            InputError: It is an environment's.
        """
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
    known = done.flip(-2).cumsum(-2).flip(-2) > 0
    if not bool(known.any()):
        raise InputError(
            f"no episode ends in a batch of shape {tuple(done.shape[:-1])}, so no return is known; "
            "collect more steps a batch"
        )
    return known
