"""The policy as an agent of evaluations; baselines are in `policies.baselines`."""

import torch
from torch import Tensor

from drone_rl.envs.observer import with_rows
from drone_rl.envs.rollout import Act, StepContext
from drone_rl.policies import ImageNetwork, RecurrentNetwork
from drone_rl.policies.recurrent import Memory


class PolicyAgent:
    """A policy that takes the most probable action."""

    def __init__(self, network: ImageNetwork) -> None:
        """Take a policy's network."""
        self._network = network
        self._memory: Memory | None = None

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        outputs = self._outputs(context)
        return Act(context.actions.greedy(outputs), outputs)

    def _outputs(self, context: StepContext) -> Tensor:
        """Evaluate the network, and keep a recurrent one's state of each environment."""
        network, rows = self._network, context.rows
        if not isinstance(network, RecurrentNetwork):
            return network(context.observe())
        fresh, before = network.start(len(rows)), self._memory
        memory, starts = fresh, context.starts[:, None, None]
        if before is not None and not bool(starts.all()):
            pairs = zip(fresh, before, strict=True)
            memory = Memory(*(torch.where(starts, new, old[rows]) for new, old in pairs))
        outputs, after = network.step(context.observe(), memory)
        pairs = zip(before or (None, None), after, strict=True)
        self._memory = Memory(*(with_rows(old, rows, new) for old, new in pairs))
        return outputs
