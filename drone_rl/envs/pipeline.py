"""The one place where the order of the pixel pipeline is decided."""

from collections.abc import Callable, Iterable, Sequence

import torch
from torch import Tensor
from torchrl.envs import CatFrames, Compose, EnvBase, Transform, TransformedEnv


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


def memory_of(transforms: Iterable[Transform]) -> int:
    """Pictures before the present one that are seen with it: more than 0 of stacks of frames."""
    return max((t.N for t in transforms if isinstance(t, CatFrames)), default=1) - 1


def see_film(transforms: Iterable[Transform], film: Sequence[Tensor]) -> Tensor:
    """What transforms make of the last of some pictures; stacks of frames hold earlier ones.

    Args:
        transforms: Of pixels, in order.
        film: Pictures of one time after the other; the first repeats what is missing before it.
    """
    for transform in transforms:
        if isinstance(transform, CatFrames):
            shown = film[-transform.N :]
            shown = [*shown[:1]] * (transform.N - len(shown)) + [*shown]
            film = [torch.cat(shown, dim=transform.dim)]
        else:
            film = [transform._apply_transform(pixels) for pixels in film]
    return film[-1]
