"""The one place where the order of the pixel pipeline is decided."""

from collections.abc import Sequence

from torchrl.envs import Compose, EnvBase, Transform, TransformedEnv


def with_transforms(env: EnvBase, transforms: Sequence[Transform] = ()) -> TransformedEnv:
    """Puts a pipeline of transforms behind an environment.

    Args:
        env: The environment.
        transforms: In the order in which they are applied, cheapest data first.
    """
    # TorchRL annotates the star of its arguments as a list
    return TransformedEnv(env, Compose(*transforms))  # pyright: ignore[reportArgumentType]
