"""Records of tensors whose first dimension counts worlds, cut and written all together."""

from collections.abc import Mapping, Sequence
from typing import Any, Self

import torch
from torch import Tensor


class Batch:
    """Makes a dataclass of tensors, or of other batches, behave like one tensor of worlds."""

    def __len__(self) -> int:
        """Returns the number of worlds."""
        return len(next(iter(vars(self).values())))

    def __getitem__(self, worlds: Tensor | slice) -> Self:
        """Returns some worlds: a copy where they are given by index, a view where by a slice."""
        return type(self)(**{k: v[worlds] for k, v in vars(self).items()})

    def __setitem__(self, worlds: Tensor, other: Self) -> None:
        """Overwrites some worlds."""
        for name, value in vars(self).items():
            value[worlds] = getattr(other, name)

    def to(self, device: torch.device | str) -> Self:
        """Returns the same on another device."""
        return type(self)(**{k: v.to(device) for k, v in vars(self).items()})

    def split(self, size: int) -> list[Self]:
        """Cuts the batch into parts of at most so many worlds."""
        parts = {k: v.split(size) for k, v in vars(self).items()}
        count = len(next(iter(parts.values())))
        return [type(self)(**{k: v[i] for k, v in parts.items()}) for i in range(count)]

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Concatenate parts; their fields must be tensors."""
        return cls(**{k: torch.cat([vars(part)[k] for part in parts]) for k in vars(parts[0])})

    def tensors(self) -> dict[str, Any]:
        """The fields by name, those of batches in it as mappings: what a file may hold."""
        return {k: v.tensors() if isinstance(v, Batch) else v for k, v in vars(self).items()}

    def with_tensors(self, tensors: Mapping[str, Any]) -> Self:
        """One of the same kind made of what `tensors` gave, with tensors of its own."""
        own = {k: (v, tensors[k]) for k, v in vars(self).items()}
        return type(self)(
            **{
                k: v.with_tensors(new) if isinstance(v, Batch) else new.to(v, copy=True)
                for k, (v, new) in own.items()
            }
        )
