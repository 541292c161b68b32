"""Training with a critic (PPO, A2C): its collector and its learner."""

import logging

from drone_rl.collectors import RolloutCollector, ThreadedCollector
from drone_rl.config.learning import A2c, Ppo, Rollouts, WithCritic
from drone_rl.config.registry import implements, learns
from drone_rl.config.training import TrainSettings
from drone_rl.policies import ActorCritic
from drone_rl.policies.zoo import describe
from drone_rl.sim.tasks import FailureReplayTask
from drone_rl.training.components import Components, group_sizes, joined
from drone_rl.training.learners import ActorCriticLearner
from drone_rl.training.train import make_groups
from drone_rl.utils.seeding import Stream, torch_generator

_log = logging.getLogger(__name__)


@implements(Rollouts)
def rollout_collector(
    settings: TrainSettings, replay: FailureReplayTask | None = None
) -> Components:
    """Make `collector=rollouts`: the next steps of each environment, from threads.

    Its batches get advantages by the learner's `estimate`, which `actor_critic_learner` makes the
    collector's `postproc`.
    """
    objective = settings.objective
    assert isinstance(objective, WithCritic)
    groups = make_groups(settings, group_sizes(settings), replay)
    collectors = [RolloutCollector(g.env, g.actor, objective.num_steps) for g in groups]
    _log.info("%s", collectors[0].name)
    return joined(ThreadedCollector(collectors), groups)


@learns(A2c, Ppo)
def actor_critic_learner(settings: TrainSettings, parts: Components) -> ActorCriticLearner:
    """Make the learner with a critic, on the policy's features or with its own network."""
    objective = settings.objective
    assert isinstance(objective, WithCritic)
    weights = torch_generator(settings.seed, Stream.CRITIC_INIT)
    own = None if objective.shares_trunk else describe(settings).build_critic(weights)
    model = ActorCritic(parts.network, own, weights).to(settings.device)
    optimizer = settings.optimiser.make(model.parameters())
    learner = ActorCriticLearner(
        network=parts.network,
        model=model,
        estimator=settings.returns.make().to(settings.device),
        loss=objective.make(model.actor, model.critic).to(settings.device),
        optimiser=optimizer,
        generator=torch_generator(settings.seed, Stream.MINIBATCHES),
        scheduler=settings.scheduler.make(optimizer),
        max_grad_norm=settings.trainer.max_grad_norm,
        chunk_frames=settings.trainer.minibatch_frames,
        **objective.passes,
    )
    parts.collector.postproc = learner.estimate
    return learner
