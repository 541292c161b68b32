"""REINFORCE: one step of the optimiser from a batch of complete episodes, each used once."""

from collections.abc import Mapping
from typing import Any

import torch
from tensordict import TensorDictBase
from torch import nn

from drone_rl.objectives import ReinforceLoss, ReturnEstimator
from drone_rl.training.learners.learner import NotANumberError, accumulate, descend
from drone_rl.training.restore import check_fits, check_optimiser


class ReinforceLearner:
    """Returns, loss, gradient, step (Algorithm 4).

    Whatever the size of a batch, one update is one step of the optimiser.
    """

    def __init__(
        self,
        *,
        network: nn.Module,
        estimator: ReturnEstimator,
        loss: ReinforceLoss,
        optimiser: torch.optim.Optimizer,
        scheduler: torch.optim.lr_scheduler.LRScheduler | None = None,
        max_grad_norm: float | None = None,
        minibatch_frames: int = 512,
    ) -> None:
        """Connects the parts.

        Args:
            network: The policy's, whose parameters the optimiser holds.
            estimator: Writes the returns into a batch.
            loss: Gives the `loss_*` terms of a batch, as a mean over its steps or a sum.
            optimiser: Over the network's parameters.
            scheduler: Stepped after each update.
            max_grad_norm: Clip the gradient to this norm; None for no clipping.
            minibatch_frames: Gradients are accumulated over chunks of this size, which bounds
                memory; sums are rounded by it in their last places.
        """
        self.network = network
        self.estimator = estimator
        self.loss = loss
        self.optimiser = optimiser
        self.scheduler = scheduler
        self.max_grad_norm = max_grad_norm
        self.minibatch_frames = minibatch_frames
        needed = [*estimator.in_keys, *loss.in_keys]
        self.in_keys = [key for key in needed if key not in estimator.out_keys]

    def update(self, batch: TensorDictBase) -> dict[str, float]:
        """One step of the optimiser.

        Args:
            batch: Complete episodes one after the other, shape (T_total,), or pieces of episodes,
                shape (num_envs, T), whose steps of unknown return are left out.

        Returns:
            The terms of the loss, the gradient's norm and the learning rate of the next step.

        Raises:
            NotANumberError: A loss or gradient is NaN or infinite.
            InputError: No episode ends in the batch.
        """
        self.optimiser.zero_grad()
        try:
            terms = accumulate(
                _known_steps(self.estimator(batch)),
                self.loss,
                self.minibatch_frames,
                is_sum=self.loss.reduction == "sum",
            )
            norm = descend(self.optimiser, self.network.named_parameters(), self.max_grad_norm)
        except NotANumberError:
            self.optimiser.zero_grad()
            raise
        if self.scheduler is not None:
            self.scheduler.step()
        rate = self.optimiser.param_groups[0]["lr"]
        told = {f"loss/{name}": value for name, value in {**terms, "grad_norm": norm}.items()}
        return {**told, "train/learning_rate": rate}

    def state_dict(self) -> dict[str, Any]:
        """Weights, and what the estimator, optimiser and scheduler remember."""
        return {
            "policy": self.network.state_dict(),
            "estimator": self.estimator.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "scheduler": None if self.scheduler is None else self.scheduler.state_dict(),
        }

    def check_state(self, state: Mapping[str, Any]) -> None:
        """See `Learner.check_state`.

        Raises:
            InputError: It is not a state of such a learner.
        """
        own = self.state_dict()
        for key in ("policy", "estimator", "scheduler"):
            check_fits(state[key], own[key], key)
        check_optimiser(state["optimiser"], self.optimiser)

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Goes on from a state."""
        self.network.load_state_dict(state["policy"])
        self.estimator.load_state_dict(state["estimator"])
        self.optimiser.load_state_dict(state["optimiser"])
        if self.scheduler is not None:
            self.scheduler.load_state_dict(state["scheduler"])


def _known_steps(batch: TensorDictBase) -> TensorDictBase:
    """Those whose return is known. Shape: (num_steps,)."""
    mask = batch.get(("collector", "mask"), None)
    return batch.reshape(-1) if mask is None else batch[mask]
