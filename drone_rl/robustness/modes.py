"""When a condition holds, and how worlds differ in it: numbers from -1 to 1, step by step."""

import enum
from collections.abc import Iterator, Sequence

import torch
from torch import Tensor

DRIFT = 0.1
"""Standard deviation of a step of what drifts, where 1 is the whole strength."""
ONSET_STEP = 20
"""The step at which a condition sets in during the flight: between the first cubes."""


class Mode(enum.StrEnum):
    """When it holds."""

    CONSTANT = "constant"
    """From start to end, in each world in one of the extreme ways, drawn at the start."""
    DRIFTING = "drifting"
    """In each world a random walk that begins with no difference and stays within the strength."""
    ONSET = "onset"
    """As constant, but only from `ONSET_STEP` on."""


def sways(
    mode: Mode, dimensions: Sequence[int], num_worlds: int, generator: torch.Generator
) -> Iterator[list[Tensor]]:
    """What each step's ways are, without end.

    Args:
        mode: Which.
        dimensions: Of each part of a condition.
        num_worlds: In all, whether they still fly or not.
        generator: Where they are drawn from.

    Yields:
        One tensor a part. Shapes: (num_worlds, dimensions), float64.
    """
    shape = (num_worlds, sum(dimensions))
    way = torch.rand(shape, generator=generator, dtype=torch.float64).round() * 2 - 1
    if mode is not Mode.DRIFTING:
        while True:
            yield [*way.split(list(dimensions), -1)]
    way = torch.zeros_like(way)
    while True:
        yield [*way.split(list(dimensions), -1)]
        step = DRIFT * torch.randn(shape, generator=generator, dtype=torch.float64)
        way = reflect(way + step)


def reflect(way: Tensor) -> Tensor:
    """Numbers put back between -1 and 1 as by mirrors that stand there. Shape kept."""
    return ((way - 1.0) % 4.0 - 2.0).abs() - 1.0
