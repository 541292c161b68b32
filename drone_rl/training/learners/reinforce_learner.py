"""REINFORCE: one optimizer step from a batch of complete episodes with returns."""

import torch
from tensordict import TensorDictBase
from torch import nn

from drone_rl.objectives import ReinforceLoss
from drone_rl.training.learners.learner import (
    GradientLearner,
    NotANumberError,
    accumulate,
    descend,
)


class ReinforceLearner(GradientLearner):
    """Loss, gradient, optimizer step (Algorithm 4): one step for each batch."""

    def __init__(
        self,
        *,
        network: nn.Module,
        loss: ReinforceLoss,
        optimiser: torch.optim.Optimizer,
        scheduler: torch.optim.lr_scheduler.LRScheduler | None = None,
        max_grad_norm: float | None = None,
        minibatch_frames: int = 512,
    ) -> None:
        """Connects the parts.

        Args:
            network: The policy's, whose parameters the optimizer holds.
            loss: Gives the `loss_*` terms of a batch, as a mean over its steps or a sum.
            optimiser: Over the network's parameters.
            scheduler: Stepped after each update.
            max_grad_norm: Clip the gradient to this norm; None for no clipping.
            minibatch_frames: Gradients are accumulated over chunks of this size, which bounds
                memory; sums are rounded by it in their last places.
        """
        self.network = network
        self.loss = loss
        self.optimiser = optimiser
        self.scheduler = scheduler
        self.max_grad_norm = max_grad_norm
        self.minibatch_frames = minibatch_frames
        self.in_keys = loss.in_keys

    def update(self, batch: TensorDictBase) -> dict[str, float]:
        """Take one optimizer step.

        Args:
            batch: With returns, see `ReturnEstimator`. Shape: (T_total,) or (num_envs, T); steps
                outside ("collector", "mask") are left out.

        Returns:
            The terms of the loss, the gradient's norm and the learning rate of the next step.

        Raises:
            NotANumberError: A loss or gradient is NaN or infinite.
        """
        self.optimiser.zero_grad()
        try:
            terms = accumulate(
                _known_steps(batch),
                self.loss,
                self.minibatch_frames,
                is_sum=self.loss.reduction == "sum",
            )
            norm = descend(self.optimiser, self.network.named_parameters(), self.max_grad_norm)
        except NotANumberError:
            self.optimiser.zero_grad()
            raise
        losses = {f"loss/{name}": value for name, value in {**terms, "grad_norm": norm}.items()}
        return {**losses, "train/learning_rate": self._next_rate()}


def _known_steps(batch: TensorDictBase) -> TensorDictBase:
    """Return the steps whose return is known. Shape: (num_steps,)."""
    mask = batch.get(("collector", "mask"), None)
    return batch.reshape(-1) if mask is None else batch[mask]
