"""The dm_control task as a TorchRL environment: one world, drawn by OpenGL."""

from dm_control import composer
from torchrl.envs import DMControlWrapper


class ComposerEnv(DMControlWrapper):
    """Wraps a `composer.Environment`, which TorchRL's own wrapper refuses.

    It differs from `dm_control.rl.control.Environment` in the two methods below only.
    """

    def _check_kwargs(self, kwargs: dict) -> None:
        if not isinstance(kwargs["env"], composer.Environment):
            raise TypeError(f"env={kwargs['env']!r} is not a composer.Environment")

    def _set_seed(self, _seed: int | None) -> None:
        self._env.random_state.seed(_seed)
        self.reset()
