"""Learning with a critic: passes over the steps of a rollout with TorchRL's losses."""

import copy
from collections.abc import Iterator, Mapping
from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from torch import Tensor, nn
from torchrl.objectives import A2CLoss, ClipPPOLoss

from drone_rl.collectors import take_rows
from drone_rl.objectives import Advantages
from drone_rl.policies import ActorCritic
from drone_rl.policies.critic import LOG_PROB, PIXELS, VALUE
from drone_rl.training.learners.learner import (
    GradientLearner,
    NotANumberError,
    accumulate,
    check_entries,
    descend,
)

ADVANTAGE, TARGET, ENTROPY = "advantage", "value_target", "entropy"
_METRICS = ("loss_objective", "loss_critic", "loss_entropy", "clip_fraction", "kl_approx")
"""Logged outputs of a loss, as far as it has them."""


class ActorCriticLearner(GradientLearner):
    """Values, advantages, then passes over minibatches, each a step of the optimizer.

    Values and log-probabilities are those of the policy and critic that an update begins with,
    and are computed once. What follows a step is taken to be the next one of its row, unless the
    row is cut there.
    """

    def __init__(
        self,
        *,
        network: nn.Module,
        model: ActorCritic,
        estimator: Advantages,
        loss: A2CLoss | ClipPPOLoss,
        optimiser: torch.optim.Optimizer,
        generator: torch.Generator,
        scheduler: torch.optim.lr_scheduler.LRScheduler | None = None,
        epochs: int = 1,
        minibatch_size: int | None = None,
        max_grad_norm: float | None = None,
        chunk_frames: int = 512,
    ) -> None:
        """Connects the parts.

        Args:
            network: The policy's.
            model: The same, with its critic.
            estimator: Makes advantages of values.
            loss: Of the model's actor and critic; a mean over steps.
            optimiser: Over the model's parameters.
            generator: Shuffles the steps, on the CPU.
            scheduler: Stepped after each update.
            epochs: Passes over a batch.
            minibatch_size: About how many steps make one step of the optimizer; None for all.
            max_grad_norm: Clip the gradient of each to this norm; None for no clipping.
            chunk_frames: Steps in one forward and backward pass; changes nothing but memory.
        """
        self.network = network
        self.model = model
        self.estimator = estimator
        self.loss = loss
        self.optimiser = optimiser
        self.generator = generator
        self.scheduler = scheduler
        self.epochs = epochs
        self.minibatch_size = minibatch_size
        self.max_grad_norm = max_grad_norm
        self.chunk_frames = chunk_frames
        following = (PIXELS, "reward", "done", "terminated")
        self._read = [PIXELS, "action", *(("next", key) for key in following)]
        self.in_keys = [PIXELS, "action", LOG_PROB, VALUE, ADVANTAGE, TARGET, ENTROPY]

    def update(self, batch: TensorDictBase) -> dict[str, float]:
        """Learn from a rollout of shape (num_envs, T), as returned by `estimate`.

        Returns:
            Means over the minibatches of the terms of the loss, the divergence from the policy that
            collected, and the gradient's norm; that policy's entropy, and the next learning rate.

        Raises:
            NotANumberError: A loss or gradient is NaN or infinite.
        """
        before = copy.deepcopy(self.state_dict())
        try:
            steps = batch.select(*self.in_keys).reshape(-1)
            entropy = float(steps.pop(ENTROPY).mean())
            metrics = list(self._descend(steps))
        except NotANumberError:
            self.load_state_dict(before)
            self.optimiser.zero_grad()
            raise
        means = {f"loss/{k}": sum(m[k] for m in metrics) / len(metrics) for k in metrics[0]}
        return {**means, "loss/entropy": entropy, "train/learning_rate": self._next_rate()}

    @torch.no_grad()
    def estimate(self, batch: TensorDictBase) -> TensorDictBase:
        """Add the entries that the loss reads; the collector's `postproc`.

        They are log-probability, entropy and value of the policy that collected, "advantage" and
        "value_target".

        Raises:
            InputError: An entry of the batch, of shape (num_envs, T), is missing.
        """
        check_entries(batch, self._read, type(self).__name__)
        seen = self._look(batch.get(PIXELS).flatten(0, batch.ndim - 1))
        policy = self.model.actor.get_dist(seen)
        value = seen.get(VALUE).reshape(*batch.shape, 1)
        after = batch.get("next").select("reward", "done", "terminated")
        after.set(VALUE, self._after(batch, value))
        estimated = self.estimator(TensorDict({VALUE: value, "next": after}, batch.shape))
        for key in (VALUE, ADVANTAGE, TARGET):
            batch.set(key, estimated.get(key))
        log_prob = policy.log_prob(batch.get("action").flatten(0, batch.ndim - 1))
        batch.set(LOG_PROB, log_prob.reshape(batch.shape))
        return batch.set(ENTROPY, policy.entropy().reshape(batch.shape))

    def _after(self, batch: TensorDictBase, value: Tensor) -> Tensor:
        """Return the value after each step; arbitrary after a terminal one. Shape: as `value`."""
        after = torch.cat([value[..., 1:, :], value[..., -1:, :]], -2)
        cut = batch.get(("next", "done")).clone()
        cut[..., -1, :] = True
        cut = (cut & ~batch.get(("next", "terminated")))[..., 0]
        after[cut] = self._look(batch.get(("next", PIXELS))[cut]).get(VALUE)
        return after

    def _look(self, pixels: Tensor) -> TensorDictBase:
        """Return features and values of frames, without the frames. Shape: (num_frames,)."""
        chunks = (TensorDict({PIXELS: c}, [len(c)]) for c in pixels.split(self.chunk_frames))
        seen = [self.model.critic(self.model.trunk(chunk)).exclude(PIXELS) for chunk in chunks]
        # it takes TensorDicts, too, which its annotation lacks
        return torch.cat(seen)  # pyright: ignore[reportReturnType]

    def _descend(self, steps: TensorDictBase) -> Iterator[dict[str, float]]:
        """Take the steps of the optimizer. Yields the metrics of each."""
        pieces = max(1, round(len(steps) / (self.minibatch_size or len(steps))))
        for _ in range(self.epochs):
            order = torch.randperm(len(steps), generator=self.generator).to(steps.device)
            for rows in order.chunk(pieces):
                self.optimiser.zero_grad()
                minibatch = take_rows(steps, rows)
                terms = accumulate(minibatch, self._losses, self.chunk_frames)
                norm = descend(self.optimiser, self.model.named_parameters(), self.max_grad_norm)
                yield {**{k: terms[k] for k in _METRICS if k in terms}, "grad_norm": norm}

    def _losses(self, chunk: TensorDictBase) -> TensorDictBase:
        return self.loss(self.model.trunk(chunk))

    def state_dict(self) -> dict[str, Any]:
        """Return the weights of both and the states of optimizer, scheduler and shuffling."""
        state = {**super().state_dict(), "critic": self.model.critic.state_dict()}
        return {**state, "minibatches": self.generator.get_state()}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Resume from a state."""
        super().load_state_dict(state)
        self.model.critic.load_state_dict(state["critic"])
        self.generator.set_state(state["minibatches"])
