"""The dm_control task as a TorchRL environment: one scene, rendered by OpenGL."""

import torch
from dm_control import composer
from dm_env.specs import DiscreteArray
from torchrl.data import Categorical
from torchrl.envs import DMControlWrapper


class ComposerEnv(DMControlWrapper):
    """Wrapper of a `composer.Environment` with discrete actions, which TorchRL's wrapper rejects.

    Actions are indices, as in `DroneEnv`.
    """

    def _check_kwargs(self, kwargs: dict) -> None:
        if not isinstance(kwargs["env"], composer.Environment):
            raise TypeError(f"env={kwargs['env']!r} is not a composer.Environment")

    def _make_specs(self, env: composer.Environment) -> None:
        super()._make_specs(env)
        spec = env.action_spec()
        if isinstance(spec, DiscreteArray):
            self.action_spec = Categorical(spec.num_values, dtype=torch.int64, device=self.device)

    def _set_seed(self, _seed: int | None) -> None:
        self._env.random_state.seed(_seed)
        self.reset()
