"""Learning with a critic (PPO, A2C) from rollouts of fixed length: collector and learner."""

import copy
import dataclasses
import logging
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import torch
from tensordict import TensorDict, TensorDictBase
from tensordict.utils import NestedKey
from torch import Tensor, nn
from torchrl.envs.utils import exploration_type
from torchrl.objectives import A2CLoss, ClipPPOLoss

from drone_rl.acceleration import FusedNetwork, with_fused_passes
from drone_rl.collectors import RolloutCollector, ThreadedCollector
from drone_rl.config.learning import A2c, Ppo, Rollouts, WithCritic
from drone_rl.config.parts import locate
from drone_rl.config.registry import implements
from drone_rl.config.training import TrainerSettings, TrainSettings
from drone_rl.objectives import Advantages
from drone_rl.policies import ActorCritic
from drone_rl.policies.critic import LOG_PROB, VALUE
from drone_rl.policies.zoo import describe
from drone_rl.sim.tasks import FailureReplayTask
from drone_rl.training.learners import (
    GradientLearner,
    NotANumberError,
    add_gradients,
    check_batch,
    descend,
)
from drone_rl.training.train import Components, local_groups
from drone_rl.utils.seeding import Stream, torch_generator

ADVANTAGE, TARGET, ENTROPY = "advantage", "value_target", "entropy"

_log = logging.getLogger(__name__)


@implements(Rollouts)
def rollout_collector(
    settings: TrainSettings, replay: FailureReplayTask | None = None
) -> Components:
    """Make `collector=rollouts`: a fixed number of steps of each environment, in threads.

    The learner's `estimate` is the collector's `postproc`, see `_actor_critic_learner`.
    """
    objective = settings.objective
    chosen = settings.collector
    assert isinstance(objective, WithCritic) and isinstance(chosen, Rollouts)
    groups, cores = local_groups(settings, replay)
    steps, compiled = objective.num_steps, chosen.compiled
    collectors = [
        RolloutCollector(env, actor, steps, compiled=compiled, num_threads=cores)
        for env, actor in groups
    ]
    _log.info("%s", collectors[0].name)
    threads = settings.trainer.num_threads
    return Components.of(ThreadedCollector(collectors, num_threads=threads), groups)


@dataclasses.dataclass(kw_only=True, eq=False, repr=False)
class ActorCriticLearner(GradientLearner):
    """Values, advantages, then passes over minibatches, each a step of the optimizer.

    Values and log-probabilities are those of the policy and critic that an update begins with,
    and are computed once. The next state of a step is that of the next step in its row, except
    where an episode or the row ends.
    """

    model: ActorCritic
    """The network with its critic."""
    estimator: Advantages
    """Computes advantages from values."""
    loss: A2CLoss | ClipPPOLoss
    """Loss of `model.actor` and `model.critic`, a mean over steps."""
    generator: torch.Generator
    """Shuffles the steps, on the CPU."""
    epochs: int = 1
    """Passes over a batch."""
    minibatch_size: int | None = None
    """Approximate number of steps for one step of the optimizer; None for all."""
    chunk_frames: int = TrainerSettings().chunk_frames
    """See `ReinforceLearner`."""

    @property
    def in_keys(self) -> Sequence[NestedKey]:
        """Entries of a batch that are read: the inputs, and what `estimate` adds."""
        return (*self.model.inputs, "action", LOG_PROB, VALUE, ADVANTAGE, TARGET, ENTROPY)

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
            self.optimizer.zero_grad()
            raise
        means = {f"loss/{k}": sum(m[k] for m in metrics) / len(metrics) for k in metrics[0]}
        return {**means, "loss/entropy": entropy, "train/learning_rate": self._step_scheduler()}

    @torch.no_grad()
    def estimate(self, batch: TensorDictBase) -> TensorDictBase:
        """Add the entries that the loss reads; the collector's `postproc`.

        They are log-probability, entropy and value of the policy that collected, "advantage" and
        "value_target". See `check_batch` for errors.
        """
        inputs = self.model.inputs
        following = [("next", key) for key in (*inputs, "reward", "done", "terminated")]
        check_batch(batch, [*inputs, "action", *following], type(self).__name__)
        seen = self._evaluate(batch.select(*inputs).reshape(-1))
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
        after[cut] = self._evaluate(batch.get("next").select(*self.model.inputs)[cut]).get(VALUE)
        return after

    def _evaluate(self, inputs: TensorDictBase) -> TensorDictBase:
        """Return features and values of inputs, without these. Shape: (num_frames,)."""
        model, names, size = self.model, self.model.inputs, self.chunk_frames
        chunks = (inputs[i : i + size] for i in range(0, max(1, len(inputs)), size))
        seen = [model.critic(model.trunk(chunk)).exclude(*names) for chunk in chunks]
        # it takes TensorDicts, too, which its annotation lacks
        return torch.cat(seen)  # pyright: ignore[reportReturnType]

    def _descend(self, steps: TensorDictBase) -> Iterator[dict[str, float]]:
        """Take the steps of the optimizer; yield the metrics of each."""
        # as far as the loss has them
        logged = ("loss_objective", "loss_critic", "loss_entropy", "clip_fraction", "kl_approx")
        pieces = max(1, round(len(steps) / (self.minibatch_size or len(steps))))
        for _ in range(self.epochs):
            order = torch.randperm(len(steps), generator=self.generator).to(steps.device)
            for rows in order.chunk(pieces):
                self.optimizer.zero_grad()
                minibatch = take_rows(steps, rows)
                terms = add_gradients(minibatch, self._losses, self.chunk_frames)
                norm = descend(self.optimizer, self.model.named_parameters(), self.max_grad_norm)
                yield {**{k: terms[k] for k in logged if k in terms}, "grad_norm": norm}

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


@implements(A2c, Ppo)
def _actor_critic_learner(
    settings: TrainSettings, components: Components, **options: Any
) -> ActorCriticLearner:
    """Make the learner with a critic, on the policy's features or with its own network.

    `options` are the settings of TorchRL's loss, whose dotted name is the objective's target.
    """
    objective = settings.objective
    assert isinstance(objective, WithCritic)
    weights = torch_generator(settings.seed, Stream.CRITIC_INIT)
    critic = None if objective.shares_trunk else describe(settings).build_critic(weights)
    limits = settings.trainer

    def fuse(layer: Any) -> nn.Module | None:
        network, threads = components.network, limits.num_threads
        made = FusedNetwork.try_create(network, threads, critic=layer) if limits.compiled else ()
        return made if isinstance(made, nn.Module) else None

    if limits.compiled and critic is not None:
        critic = with_fused_passes(critic, limits.num_threads)
    model = ActorCritic(components.network, critic, weights, fuse).to(settings.device)
    loss = locate(objective.target)(model.actor, model.critic, functional=False, **options)
    loss.deterministic_sampling_mode = exploration_type()  # see `ReinforceLoss`
    optimizer = settings.optimizer.make(model.parameters())
    learner = ActorCriticLearner(
        network=components.network,
        model=model,
        estimator=settings.returns.make().to(settings.device),
        loss=loss.to(settings.device),
        optimizer=optimizer,
        generator=torch_generator(settings.seed, Stream.MINIBATCHES),
        scheduler=settings.scheduler.make(optimizer),
        max_grad_norm=limits.max_grad_norm,
        chunk_frames=limits.chunk_frames,
        # the fused kernel has threads of its own
        num_threads=1 if isinstance(model.trunk.module, FusedNetwork) else None,
        **objective.passes,
    )
    components.collector.postproc = learner.estimate
    return learner


def take_rows(tensordict: TensorDictBase, rows: Tensor) -> TensorDictBase:
    """Index the first dimension by rows (k,), faster than tensordict's own indexing."""
    taken = {key: tensordict.get(key).index_select(0, rows) for key in tensordict.keys(True, True)}
    return TensorDict(taken, [len(rows)], device=tensordict.device)
