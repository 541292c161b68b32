"""Confirm by greedy episodes that a policy has solved its task."""

import functools
from collections.abc import Mapping
from typing import Any

from torch import nn
from torchrl.envs import EnvBase

from drone_rl.collectors.complete_episodes import end_reasons
from drone_rl.config.training import TrainSettings
from drone_rl.envs import base_env
from drone_rl.policies import make_actor
from drone_rl.policies.zoo import describe
from drone_rl.utils.seeding import Stream

_NUM_ENVS = 250


class Confirmation:
    """Evaluate a policy in training greedily, in environments that it never learns from.

    A policy with sampled actions may leave loops that its most probable actions never leave. So it
    may solve its task in training and fail most episodes afterwards.
    """

    def __init__(self, settings: TrainSettings, network: nn.Module) -> None:
        self._settings, self._network = settings, network
        self._description = describe(settings)
        self.attempts = 0
        """Confirmations since the run began or was last resumed."""
        self.succeeded = 0
        """Successes in the last confirmation."""

    def __call__(self, update: int) -> bool:
        """Return whether enough episodes succeed; each update has its own environments."""
        settings, episodes = self._settings, self._settings.trainer.confirm_episodes
        env = self._env
        base_env(env).first_world = update * _NUM_ENVS
        env.set_seed(settings.seed)
        actor = make_actor(self._network, env.action_spec)
        self._network.eval()  # as the policy acts once it is loaded
        try:
            ends = end_reasons(actor, env, episodes)
        finally:
            self._network.train()
        self.attempts += 1
        self.succeeded = int((ends == base_env(env).worlds.task.success_end).sum())
        return self.succeeded >= settings.trainer.confirm_share * episodes - 1e-9

    @functools.cached_property
    def _env(self) -> EnvBase:
        settings = self._settings
        return self._description.build_env(
            min(_NUM_ENVS, settings.trainer.confirm_episodes),
            seed=settings.seed,
            stream=Stream.CONFIRMATION,
            device=settings.device,
            renderer=settings.renderer,
        )

    def close(self) -> None:
        """Close the environments, if there are any."""
        if "_env" in vars(self):
            self._env.close()

    @property
    def result(self) -> Mapping[str, Any]:
        """Entries of `result.json`: attempts, and episodes and successes of the last one."""
        return {
            "confirming_attempts": self.attempts,
            "confirming_flights": self._settings.trainer.confirm_episodes if self.attempts else 0,
            "confirming_flights_succeeded": self.succeeded,
        }
