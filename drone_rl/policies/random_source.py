"""A stream of random numbers that belongs to a policy and to all its copies."""

import torch


class RandomSource:
    """A torch generator that copies of a module share, so that no draw is made twice."""

    def __init__(self, generator: torch.Generator) -> None:
        self.generator = generator

    def __deepcopy__(self, memo: dict) -> "RandomSource":
        """Returns itself: the stream is one, however many copies draw from it."""
        return self
