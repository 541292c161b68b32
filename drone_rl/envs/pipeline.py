"""The one place where the order of the pixel pipeline is decided."""

from collections.abc import Callable, Iterable, Sequence

from torch import Tensor
from torchrl.envs import Compose, EnvBase, Transform, TransformedEnv


def with_transforms(env: EnvBase, transforms: Sequence[Transform] = ()) -> TransformedEnv:
    """Puts a pipeline of transforms behind an environment.

    Args:
        env: The environment.
        transforms: In the order in which they are applied, cheapest data first.
    """
    # TorchRL annotates the star of its arguments as a list
    return TransformedEnv(env, Compose(*transforms))  # pyright: ignore[reportArgumentType]


def on_pixels(transforms: Iterable[Transform]) -> Callable[[Tensor], Tensor]:
    """What transforms make of pictures, with no environment around them.

    Args:
        transforms: In order; those that don't look at "pixels" are left out.
    """
    looking = [transform for transform in transforms if "pixels" in (transform.in_keys or [])]

    def apply(pictures: Tensor) -> Tensor:
        for transform in looking:
            pictures = transform._apply_transform(pictures)
        return pictures

    return apply
