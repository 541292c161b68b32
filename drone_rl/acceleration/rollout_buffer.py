"""Memory for the steps of episodes, written by kernels and read when all episodes have ended."""

import sys
from collections.abc import Iterable, Mapping

import torch
from torch import Tensor


class RolloutBuffer:
    """Rows of steps, part after part, as many parts as the longest episode needs.

    Its memory is reused, and so is that of earlier results once nothing refers to them: allocating
    memory for as many frames takes longer than filling it.
    """

    def __init__(self, part: Mapping[str, Tensor]) -> None:
        self._arrays = dict(part)
        self._num_rows = len(next(iter(self._arrays.values())))
        self._results: dict[str, Tensor] = {}

    def open(self, part: int, kept: Iterable[str]) -> dict[str, Tensor]:
        """Return memory of a part, to be written. Shapes: (num_rows, *).

        Entries in `kept` follow those of earlier parts; others overwrite those of the first.
        """
        first, last = part * self._num_rows, (part + 1) * self._num_rows
        opened = {name: array[: self._num_rows] for name, array in self._arrays.items()}
        for name in kept:
            array = self._arrays[name]
            if len(array) < last:
                wider = self._arrays[name] = array.new_empty(2 * last, *array.shape[1:])
                wider[:first] = array[:first]
            opened[name] = self._arrays[name][first:last]
        return opened

    def read(self, rows: Tensor, names: Iterable[str]) -> dict[str, Tensor]:
        """Return copies of rows (k,), counted from the first part's, of the named entries."""
        read = {name: self._to_read(name, len(rows)) for name in names}
        for name, values in read.items():
            torch.index_select(self._arrays[name], 0, rows, out=values)
        return read

    def _to_read(self, name: str, count: int) -> Tensor:
        """Return memory for rows: that of the last result if it is large enough and free again."""
        last = self._results.get(name)
        if last is None or len(last) < count or not is_free(last):
            array = self._arrays[name]
            last = self._results[name] = array.new_empty(count + count // 4, *array.shape[1:])
        return last[:count]


def is_free(tensor: Tensor) -> bool:
    """Return whether nothing else refers to the memory of a tensor: no view and no array."""
    return _holders(tensor) == _holders(torch.empty(1))


def _holders(tensor: Tensor) -> tuple[int, int]:
    storage = tensor.untyped_storage()
    return torch._C._storage_Use_Count(storage._cdata), sys.getrefcount(storage)
