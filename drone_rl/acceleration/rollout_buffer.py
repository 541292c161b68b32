"""What is written down of flights, and read when all have ended."""

import sys
from collections.abc import Iterable, Mapping

import torch
from torch import Tensor


class RolloutBuffer:
    """A row a step, part after part, as long as any flight goes on.

    Its memory is used again, and so is that of what was read once nobody holds any of it: new
    memory for as many frames takes longer to get than to fill.
    """

    def __init__(self, part: Mapping[str, Tensor]) -> None:
        """Takes over room for one part, by name. Shapes: (num_rows, *), of all the same rows."""
        self._room = dict(part)
        self._num_rows = len(next(iter(self._room.values())))
        self._read: dict[str, Tensor] = {}

    def open(self, part: int, kept: Iterable[str]) -> dict[str, Tensor]:
        """Room for a part, to be written. Shapes: (num_rows, *).

        Args:
            part: Its number, from 0.
            kept: Names of what shall be behind that of the parts before, which stays; the rest of
                each part is written over the first.
        """
        first, last = part * self._num_rows, (part + 1) * self._num_rows
        opened = {name: room[: self._num_rows] for name, room in self._room.items()}
        for name in kept:
            room = self._room[name]
            if len(room) < last:
                wider = self._room[name] = room.new_empty(2 * last, *room.shape[1:])
                wider[:first] = room[:first]
            opened[name] = self._room[name][first:last]
        return opened

    def read(self, rows: Tensor, names: Iterable[str]) -> dict[str, Tensor]:
        """A copy of rows of all parts, by name. Shapes: (k, *).

        Args:
            rows: Which, the first part's first. Shape: (k,).
            names: What of them; of several parts only what was kept.
        """
        read = {name: self._to_read(name, len(rows)) for name in names}
        for name, values in read.items():
            torch.index_select(self._room[name], 0, rows, out=values)
        return read

    def _to_read(self, name: str, count: int) -> Tensor:
        """Memory for so many rows: that of the last copy, if it is wide enough and free again."""
        last = self._read.get(name)
        if last is None or len(last) < count or not is_free(last):
            room = self._room[name]
            last = self._read[name] = room.new_empty(count + count // 4, *room.shape[1:])
        return last[:count]


def is_free(tensor: Tensor) -> bool:
    """Whether nobody else holds the memory of a tensor: no view, and no array over it."""
    return _holders(tensor) == _holders(torch.empty(1))


def _holders(tensor: Tensor) -> tuple[int, int]:
    """Tensors over the memory of one, and who holds that by itself; who asks among them."""
    storage = tensor.untyped_storage()
    return torch._C._storage_Use_Count(storage._cdata), sys.getrefcount(storage)
