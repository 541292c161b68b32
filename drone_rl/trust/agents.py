"""The policy as an agent of evaluations; baselines are in `policies.baselines`."""

import torch
from torch import Tensor

from drone_rl.envs.observer import with_rows
from drone_rl.envs.rollout import Act, StepContext
from drone_rl.policies import ImageNetwork, RecurrentNetwork
from drone_rl.policies.recurrent import Memory
from drone_rl.policies.rounding import decider


class PolicyAgent:
    """A policy that takes the most probable action."""

    def __init__(self, network: ImageNetwork, *, examines_rounding: bool = False) -> None:
        """Take a policy's network; `examines_rounding` fills `is_fragile`, unless it remembers."""
        self._network = network
        is_examined = examines_rounding and not network.is_recurrent
        self._decide = decider(network)[0] if is_examined else None
        self.is_fragile = torch.empty(0, dtype=torch.bool)
        """Episodes with a frame in which rounding can change the action. Shape: (num_envs,)."""
        self._memory: Memory | None = None

    def act(self, context: StepContext) -> Act:
        """See `Agent`."""
        if not len(self.is_fragile):
            self.is_fragile = torch.zeros(context.worlds.num_envs, dtype=torch.bool)
        if self._decide is not None:
            is_fragile = self._decide(context.observe()).is_fragile.cpu()
            self.is_fragile[context.rows.cpu()] |= is_fragile
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
