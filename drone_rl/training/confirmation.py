"""Is a policy that seems to have solved its task as good by its most probable actions?"""

import functools
from collections.abc import Mapping
from typing import Any

from torch import nn
from torchrl.envs import TransformedEnv

from drone_rl.config.training import TrainSettings
from drone_rl.evaluation.rollouts import run_episodes
from drone_rl.policies import make_actor
from drone_rl.policies.zoo import describe
from drone_rl.utils.seeding import Stream

_WORLDS = 250
"""That are flown at the same time."""


class Confirmation:
    """Flies a policy as it will be judged, in worlds that it never learns from.

    What a training sees are drawn actions. They lead out of loops in which the most probable
    actions are caught for ever, so that a policy which collects everything while it learns may fail
    most flights afterwards.
    """

    def __init__(self, settings: TrainSettings, network: nn.Module) -> None:
        """Takes a training's policy.

        Args:
            settings: The training's; `trainer.confirm_episodes` are flown.
            network: The policy's, as it learns.
        """
        self._settings, self._network = settings, network
        self._description = describe(settings)
        self.flights = 0
        """So far."""
        self.succeeded = 0
        """Of the last `trainer.confirm_episodes`."""

    def __call__(self, update: int) -> bool:
        """Whether enough flights reach every goal.

        Args:
            update: Number of the update after which this is asked; each is asked in other worlds.
        """
        settings, episodes = self._settings, self._settings.trainer.confirm_episodes
        env = self._env
        worlds: Any = env.base_env
        worlds.first_world = update * _WORLDS
        env.set_seed(settings.seed)
        actor = make_actor(self._network, env.action_spec)
        flown = run_episodes(env, actor, episodes, is_compiled=True)
        self.flights += episodes
        self.succeeded = int(flown.success.sum())
        return self.succeeded >= settings.trainer.confirm_share * episodes

    @functools.cached_property
    def _env(self) -> TransformedEnv:
        settings = self._settings
        return self._description.build_env(
            min(_WORLDS, settings.trainer.confirm_episodes),
            seed=settings.seed,
            stream=Stream.CONFIRMATION,
            device=settings.device,
            renderer=settings.renderer,
        )

    def close(self) -> None:
        """Ends the worlds, if any were flown in."""
        if "_env" in vars(self):
            self._env.close()

    @property
    def told(self) -> Mapping[str, Any]:
        """For `result.json`."""
        return {"confirming_flights": self.flights, "confirming_flights_succeeded": self.succeeded}
