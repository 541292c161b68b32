"""REINFORCE as a TorchRL loss module, without a critic."""

import dataclasses

import torch
from tensordict import TensorDict, TensorDictBase, TensorDictParams
from tensordict.nn import ProbabilisticTensorDictSequential, dispatch
from tensordict.utils import NestedKey
from torch import Tensor
from torchrl.envs.utils import ExplorationType, exploration_type
from torchrl.objectives import LossModule

from drone_rl.config.learning import Reinforce
from drone_rl.policies.recurrent import WHOLE_EPISODES
from drone_rl.utils.errors import InputError
from drone_rl.utils.threads import set_in_thread

_DONE: NestedKey = ("next", "done")


class ReinforceLoss(LossModule):
    """-sum_t g_t log pi(a_t | s_t), reduced over the batch (chapter, Eq. 15).

    The returns g_t come from a return estimator, the actions a_t from the batch.

    With `reduction="episode_mean"`, the sum over steps divided by the number of episodes (Eq. 12),
    the gradient is unbiased if the returns are. With "mean" it is biased, because the number of
    steps depends on the actions. On the three-state process of Fig. 3 the expected gradient differs
    in direction from the exact one by 3.8 degrees with 2 episodes, 0.1 with 64 (`leave_one_out`
    without `scale`, measured as in `objectives.returns`). With `scale` too, the default of
    training, it differs by 10.7 degrees with 3 episodes, 3.9 with 8, 0.5 with 32.

    The output's `loss_*` entries add up to what is to be back-propagated; the others are detached.

    Examples:
        >>> loss = ReinforceLoss(actor)
        >>> losses = loss(estimator(batch))
        >>> (losses["loss_actor"] + losses["loss_entropy"]).backward()
    """

    @dataclasses.dataclass
    class _AcceptedKeys:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Names of the entries that the loss reads, changed by `set_keys`."""

        action: NestedKey = "action"
        """The stored action."""
        return_to_go: NestedKey = "return_to_go"
        """Written by a return estimator; often an advantage, see there. Shape: (*batch, 1)."""

    tensor_keys: _AcceptedKeys  # pyright: ignore[reportIncompatibleMethodOverride]
    default_keys = _AcceptedKeys
    out_keys = ("loss_actor", "loss_entropy", "entropy")  # pyright: ignore
    entropy_coeff: torch.Tensor
    actor_network: ProbabilisticTensorDictSequential
    actor_network_params: TensorDictParams
    target_actor_network_params: TensorDictParams

    def __init__(
        self,
        actor_network: ProbabilisticTensorDictSequential,
        *,
        entropy_coeff: float = Reinforce().entropy_coeff,
        reduction: str = Reinforce().reduction,
    ) -> None:
        """Wrap the policy that collected the batch.

        `entropy_coeff` is the weight of the entropy bonus, `reduction` "mean" over steps, "sum"
        (Algorithm 4), "episode_mean" (Eq. 12) or "none".

        Raises:
            InputError: The reduction is unknown or the weight negative.
        """
        super().__init__()
        if reduction not in ("mean", "sum", "episode_mean", "none"):
            options = "mean, sum, episode_mean or none"
            raise InputError(f"reduction={reduction} is unknown; give {options}")
        if entropy_coeff < 0:
            raise InputError(f"entropy_coeff={entropy_coeff} is negative; give 0 or more")
        self.reduction = reduction
        self.convert_to_functional(actor_network, "actor_network", create_target_params=False)
        self.register_buffer("entropy_coeff", torch.tensor(float(entropy_coeff)))

    @property
    def deterministic_sampling_mode(self) -> ExplorationType | None:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The current type, which TorchRL therefore leaves to other threads; nothing is sampled."""
        return exploration_type()

    @property
    def in_keys(self) -> list[NestedKey]:
        """What `forward` reads."""
        keys = self.tensor_keys
        ends: list[NestedKey] = [_DONE] if self.reduction == "episode_mean" else []
        return [keys.action, keys.return_to_go, *ends, *self.actor_network.in_keys]

    @in_keys.setter
    def in_keys(self, values: list[NestedKey]) -> None:  # pyright: ignore[reportIncompatibleMethodOverride]
        raise RuntimeError("in_keys follows from set_keys(...) and the actor; change those")

    def divisor(self, tensordict: TensorDictBase) -> int:
        """Return what sums over the steps of a batch are divided by; it ignores masks.

        That is 1 for "sum", the number of steps for "mean" and, for "episode_mean", the number of
        steps that end an episode, at least 1.
        """
        if self.reduction == "episode_mean":
            return max(1, int(tensordict.get(_DONE).sum()))
        return 1 if self.reduction == "sum" else tensordict.numel()

    def _reduced(self, terms: Tensor, tensordict: TensorDictBase) -> Tensor:
        if self.reduction != "episode_mean":
            return self._reduce_loss(terms, tensordict)
        return self._reduce_loss(terms, tensordict, reduction="sum") / self.divisor(tensordict)

    def _forward_value_estimator_keys(self, **kwargs: NestedKey) -> None:
        """Do nothing: there is no value estimator."""

    @dispatch  # pyright: ignore[reportArgumentType]
    def forward(self, tensordict: TensorDictBase) -> TensorDictBase:
        """Compute "loss_actor", "loss_entropy" and the detached "entropy" of a batch.

        It has observations, actions and returns; raise an `InputError` without returns. A recurrent
        policy needs whole episodes, one after the other, each beginning where "is_init" is set.
        """
        returns = tensordict.get(self.tensor_keys.return_to_go, None)
        if returns is None:
            raise InputError(
                f"the batch has no entry {self.tensor_keys.return_to_go!r}; "
                "pass it through a return estimator first"
            )
        whole = set_in_thread(WHOLE_EPISODES, True)
        with self.actor_network_params.to_module(self.actor_network), whole:
            distribution = self.actor_network.get_dist(
                tensordict.select(*self.actor_network.in_keys)
            )
        log_prob = distribution.log_prob(tensordict.get(self.tensor_keys.action))
        entropy = distribution.entropy()
        loss = -log_prob * returns.detach().reshape(log_prob.shape)
        bonus = -self.entropy_coeff * entropy
        return TensorDict(
            {
                "loss_actor": self._reduced(loss, tensordict),
                "loss_entropy": self._reduced(bonus, tensordict),
                "entropy": entropy.detach().mean(),
            }
        )
