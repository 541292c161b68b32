"""Dataclasses of tensors whose first dimension counts environments."""

from collections.abc import Mapping, Sequence
from typing import Any, Self

import torch
from torch import Tensor


class Batch:
    """Base class of dataclasses of tensors or batches that are indexed like one tensor."""

    def __len__(self) -> int:
        """Return the number of environments."""
        return len(next(iter(vars(self).values())))

    def __getitem__(self, env_ids: Tensor | slice) -> Self:
        """Return some environments: a copy for an index, a view for a slice."""
        return type(self)(**{k: v[env_ids] for k, v in vars(self).items()})

    def __setitem__(self, env_ids: Tensor, other: Self) -> None:
        """Overwrite some environments."""
        for name, value in vars(self).items():
            value[env_ids] = getattr(other, name)

    def to(self, device: torch.device | str) -> Self:
        """Return the batch on another device."""
        return type(self)(**{k: v.to(device) for k, v in vars(self).items()})

    def split(self, size: int) -> list[Self]:
        """Split the batch into parts of at most `size` environments."""
        parts = {k: v.split(size) for k, v in vars(self).items()}
        count = len(next(iter(parts.values())))
        return [type(self)(**{k: v[i] for k, v in parts.items()}) for i in range(count)]

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Concatenate parts; their fields must be tensors."""
        return cls(**{k: torch.cat([vars(part)[k] for part in parts]) for k in vars(parts[0])})

    def tensors(self) -> dict[str, Any]:
        """Return the fields by name, batches as mappings, for a file."""
        return {k: v.tensors() if isinstance(v, Batch) else v for k, v in vars(self).items()}

    def with_tensors(self, tensors: Mapping[str, Any]) -> Self:
        """Return a batch with copies of the tensors that `tensors` returned."""
        pairs = {k: (v, tensors[k]) for k, v in vars(self).items()}
        return type(self)(
            **{
                k: v.with_tensors(new) if isinstance(v, Batch) else new.to(v, copy=True)
                for k, (v, new) in pairs.items()
            }
        )
