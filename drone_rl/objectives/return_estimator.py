"""What all return estimators are: a TorchRL transform for whatever holds whole episodes."""

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

    A return is known once its episode has ended, so this is no transform of an environment, which
    sees one step at a time. Like TorchRL's `Reward2GoTransform` it is for what holds whole
    episodes: a collector's `postproc` (of a chain, its `inv`), or a replay buffer, which estimates
    when a batch comes in and hands samples of it out as they are.

    Where a batch ends within an episode, the return of that episode's steps is not known: they
    get 0, and ("collector", "mask"), which TorchRL's losses and ours honour, tells them from the
    others. An episode that began in an earlier batch is taken to begin with this one; TorchRL's
    collectors start each batch again with `reset_at_each_iter=True`.

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
        """Writes the returns; in a chain, as a replay buffer has one, it hands samples on.

        Raises:
            InputError: No episode ends in the batch.
        """
        return tensordict if self._is_contained else self._inv_call(tensordict)

    @torch.no_grad()
    def _inv_call(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Writes the returns, in a chain too: what a replay buffer does with what comes in."""
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
        """Takes its place in a chain of transforms.

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
        """The returns. Shape: that of `reward`."""


def _ends_later(done: Tensor) -> Tensor:
    """Whether a step's episode ends within its row.

    Args:
        done: Shape: (*batch, T, 1).

    Raises:
        InputError: No episode ends.
    """
    known = done.flip(-2).cumsum(-2).flip(-2) > 0
    if not bool(known.any()):
        raise InputError(
            f"no episode ends in a batch of shape {tuple(done.shape[:-1])}, so no return is known; "
            "collect more steps a batch"
        )
    return known
