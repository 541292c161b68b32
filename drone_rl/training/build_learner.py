"""What learns, out of a training's settings and what it collects with."""

from typing import Any

import torch
from torch import nn

from drone_rl.collectors.speedups import accelerated_gradients
from drone_rl.config.configuration import as_config, locate
from drone_rl.config.learning import WithCritic
from drone_rl.config.training import TrainSettings
from drone_rl.policies import ActorCritic, make_actor
from drone_rl.policies.zoo import describe
from drone_rl.training.build_collector import Collecting
from drone_rl.training.learners import ActorCriticLearner, Learner, ReinforceLearner
from drone_rl.utils.seeding import Stream, torch_generator


def build_learner(settings: TrainSettings, made: Collecting) -> Learner:
    """The learner that the settings ask for.

    Args:
        settings: The training's.
        made: What it collects with, whose network learns.

    Raises:
        InputError: A part does not exist, or does not take its settings.
    """
    return locate(settings.objective.learner)(settings, made)


def reinforce_learner(settings: TrainSettings, made: Collecting) -> ReinforceLearner:
    """One that needs no critic."""
    optimiser = settings.optimiser.make(made.network.parameters())
    return ReinforceLearner(
        network=made.network,
        estimator=settings.returns.make().to(settings.device),
        loss=settings.objective.make(_learning_actor(settings, made)).to(settings.device),
        optimiser=optimiser,
        scheduler=settings.scheduler.make(optimiser),
        max_grad_norm=settings.trainer.max_grad_norm,
        minibatch_frames=settings.trainer.minibatch_frames,
    )


def actor_critic_learner(settings: TrainSettings, made: Collecting) -> ActorCriticLearner:
    """One with a critic, on the policy's features or on a network of its own."""
    objective = settings.objective
    assert isinstance(objective, WithCritic)
    weights = torch_generator(settings.seed, Stream.CRITIC_INIT)
    own = None if objective.shares_trunk else describe(as_config(settings)).build_critic(weights)
    model = ActorCritic(made.network, own, weights).to(settings.device)
    optimiser = settings.optimiser.make(model.parameters())
    return ActorCriticLearner(
        network=made.network,
        model=model,
        estimator=settings.returns.make().to(settings.device),
        loss=objective.make(model.actor, model.critic).to(settings.device),
        optimiser=optimiser,
        generator=torch_generator(settings.seed, Stream.MINIBATCHES),
        scheduler=settings.scheduler.make(optimiser),
        max_grad_norm=settings.trainer.max_grad_norm,
        chunk_frames=settings.trainer.minibatch_frames,
        **objective.passes,
    )


def _learning_actor(settings: TrainSettings, made: Collecting) -> nn.Module:
    """The actor; with a fused network, if that is asked for and the kernel supports it."""
    actor, trainer = made.collector.actor, settings.trainer
    if not trainer.compiled:
        return actor
    network = accelerated_gradients(
        made.network, trainer.num_threads, cache=made.collector.cache_activations
    )
    if network is made.network:
        return actor
    torch.set_num_threads(1)  # what is left to torch is small, and its threads wait in loops
    spec: Any = actor.spec  # torch's modules are annotated to hold anything
    return make_actor(network, spec["action"])
