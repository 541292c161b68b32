"""Variants of the pipeline in `train.py`: a critic (PPO, A2C), rollouts, a Ray cluster."""

import functools
import importlib
import logging
from typing import Any

import torch
from torchrl.envs.utils import exploration_type

from drone_rl.collectors import EpisodeCollector, RolloutCollector, ThreadedCollector
from drone_rl.config.learning import A2c, Ppo, Ray, Rollouts, WithCritic
from drone_rl.config.parts import locate
from drone_rl.config.registry import implements, modules_of
from drone_rl.config.training import TrainSettings
from drone_rl.policies import ActorCritic, ImageNetwork
from drone_rl.policies.zoo import describe
from drone_rl.sim.tasks import FailureReplayTask
from drone_rl.training.components import Components, episode_options, group_sizes, joined
from drone_rl.training.learners import ActorCriticLearner
from drone_rl.training.train import make_groups
from drone_rl.utils.plugins import IMPORTED
from drone_rl.utils.seeding import Stream, torch_generator

_log = logging.getLogger(__name__)


@implements(Rollouts)
def rollout_collector(
    settings: TrainSettings, replay: FailureReplayTask | None = None
) -> Components:
    """Make `collector=rollouts`: a fixed number of steps of each environment, in threads.

    The learner's `estimate` is the collector's `postproc`, see `_actor_critic_learner`.
    """
    objective = settings.objective
    assert isinstance(objective, WithCritic)
    groups = make_groups(settings, group_sizes(settings), replay)
    collectors = [RolloutCollector(g.env, g.actor, objective.num_steps) for g in groups]
    _log.info("%s", collectors[0].name)
    return joined(ThreadedCollector(collectors), groups)


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
    model = ActorCritic(components.network, critic, weights).to(settings.device)
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
        max_grad_norm=settings.trainer.max_grad_norm,
        chunk_frames=settings.trainer.chunk_frames,
        **objective.passes,
    )
    components.collector.postproc = learner.estimate
    return learner


@implements(Ray)
def ray_collector(settings: TrainSettings, replay: FailureReplayTask | None = None) -> Components:
    """Make `collector=ray`: complete episodes, with returns, from workers on a Ray cluster."""
    from drone_rl.collectors.ray import RayEpisodeCollector  # slow to import, seldom needed

    chosen = settings.collector
    assert isinstance(chosen, Ray)
    sizes = group_sizes(settings)
    (local,) = make_groups(settings, [1])  # only its actor and network are needed
    local.env.close()
    sent = (settings.config(), sorted(modules_of(settings) | {*IMPORTED}), sizes)
    makers = [functools.partial(_remote_collector, *sent, i, replay) for i in range(len(sizes))]
    collector = RayEpisodeCollector(
        makers,
        local.actor,
        local.network,
        address=chosen.address,
        num_cpus=chosen.num_cpus,
        max_lost_workers=chosen.max_lost_workers,
        device=settings.device,
        postproc=settings.returns.make().to(settings.device),
    )
    return Components(collector, local.network, {})


def _remote_collector(
    config: dict[str, Any],
    modules: list[str],
    sizes: list[int],
    number: int,
    replay: FailureReplayTask | None,
) -> tuple[EpisodeCollector, ImageNetwork, torch.Generator]:
    """Make a worker's collector, with its network and generator, from arguments that can be sent.

    `modules` register its parts.
    """
    for module in modules:
        importlib.import_module(module)
    settings = TrainSettings.read(config)
    assert isinstance(settings.collector, Ray)
    (group,) = make_groups(settings, sizes, replay, [number])
    options = episode_options(settings, max(1, int(settings.collector.num_cpus)))
    collector = EpisodeCollector(group.env, group.actor, **options)
    return collector, group.network, group.generator
