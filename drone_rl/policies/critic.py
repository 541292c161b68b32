"""A critic next to a policy network: it estimates the value of a state."""

from collections.abc import Callable
from typing import Any

import torch
from tensordict.nn import (
    ProbabilisticTensorDictModule,
    ProbabilisticTensorDictSequential,
    TensorDictModule,
)
from torch import nn

from drone_rl.policies.actor import KeepsModes, distribution_of
from drone_rl.policies.networks import (
    ImageNetwork,
    InputsNetwork,
    InputsTrunk,
    PolicyNetwork,
    Trunk,
    orthogonal,
)
from drone_rl.utils.errors import InputError

FEATURES = "features"
LOG_PROB = "action_log_prob"
VALUE = "state_value"


class _Actor(KeepsModes, ProbabilisticTensorDictSequential):
    pass


class _Outputs(nn.Module):
    """A linear layer whose outputs another network has computed, among its own."""

    def __init__(self, layer: nn.Module, columns: slice) -> None:
        super().__init__()
        self.weight, self.bias = layer.get_parameter("weight"), layer.get_parameter("bias")
        self._columns = columns

    def forward(self, outputs: torch.Tensor) -> torch.Tensor:
        """Return the outputs of the layer. Shapes: (*, all) to (*, those of the layer)."""
        return outputs[..., self._columns]


class ActorCritic(nn.Module):
    """A policy network, split before its last layer, and a critic.

    Policy and critic share the features unless the critic has a network of its own. The policy's
    parameters are the network's.
    """

    def __init__(
        self,
        network: ImageNetwork,
        own: ImageNetwork | None = None,
        generator: torch.Generator | None = None,
        fuse: Callable[[nn.Module | None], nn.Module | None] = lambda critic: None,
    ) -> None:
        """Add a critic to a policy.

        Args:
            network: The policy's; an `InputError` unless it is a `PolicyNetwork` of layers in turn.
            own: Of the critic, with one output; None for a linear layer on the policy's features.
            generator: Source of that layer's initial weights.
            fuse: From that layer, or None, to a faster module for the policy's outputs, followed
                by the layer's; None for none.
        """
        super().__init__()
        if isinstance(network, InputsNetwork):
            trunk: nn.Module = InputsTrunk(network)
        elif isinstance(network, PolicyNetwork) and network.is_sequential:
            trunk = Trunk(network)
        else:
            raise InputError(
                f"a critic needs a policy of layers, which {type(network).__name__} is not; give "
                "objective=reinforce, or derive it from drone_rl.policies.PolicyNetwork and "
                "keep its forward"
            )
        *_, last = network.layers
        self.inputs = network.in_keys
        """Names of the inputs."""
        critic = own or _one_number(last, generator)
        head: nn.Module = last
        fused = fuse(None if own else critic)
        if fused is not None:
            count = len(last.get_parameter("weight"))
            trunk, head = fused, _Outputs(last, slice(0, count))
            critic = own or _Outputs(critic, slice(count, None))
        self.trunk = TensorDictModule(trunk, in_keys=[*self.inputs], out_keys=[FEATURES])
        """Inputs to "features"; with `fuse` to the outputs of policy and critic."""
        policy = ProbabilisticTensorDictModule(
            in_keys=["logits"],
            out_keys=["action"],
            distribution_class=distribution_of(network.actions.entry.dtype),
            return_log_prob=True,
            log_prob_key=LOG_PROB,
        )
        modules: Any = (TensorDictModule(head, in_keys=[FEATURES], out_keys=["logits"]), policy)
        self.actor = _Actor(*modules)
        """"features" to "logits" and the distribution of "action"."""
        self.critic = TensorDictModule(
            critic,
            in_keys=[FEATURES] if own is None else [*own.in_keys],
            out_keys=[VALUE],
        )
        """"features" or inputs to "state_value"."""


def _one_number(logits: nn.Module, generator: torch.Generator | None) -> nn.Linear:
    weight = logits.get_parameter("weight")
    layer = nn.Linear(weight.shape[1], 1)
    orthogonal(generator)(layer, True)
    return layer.to(weight.device)
