"""What was written down of episodes that were flown in parts."""

from collections.abc import Mapping

import torch
from torch import Tensor


class Logbook:
    """Takes part after part, and gives episode after episode.

    Its memory is used again: new memory for as many pictures takes longer to get than to fill.
    """

    def __init__(self) -> None:
        """Nothing is taken down yet."""
        self._room: dict[str, Tensor] = {}
        self._worlds: list[Tensor] = []
        self._names: tuple[str, ...] = ()

    def begin(self) -> None:
        """Forgets what was taken down, if anything was."""
        self._worlds = []

    def __len__(self) -> int:
        """Steps that were taken down."""
        return sum(map(len, self._worlds))

    def add(self, worlds: Tensor, rows: Tensor, log: Mapping[str, Tensor]) -> None:
        """Takes steps down.

        Args:
            worlds: Whose they are, each world's in the order in which they were taken. Shape: (k,).
            rows: Of the log, where they stand. Shape: (k,).
            log: By name, the same names as in the parts before. Shapes: (num_rows, *).
        """
        self._names = tuple(log)
        first, last = len(self), len(self) + len(rows)
        for name, values in log.items():
            room = self._room_of(name, values, last)
            torch.index_select(values, 0, rows, out=room[first:last])
        self._worlds.append(worlds)

    def take(self) -> tuple[Tensor, dict[str, Tensor]]:
        """Worlds of steps, episode after episode, and what was taken down of these, a copy."""
        worlds = torch.cat(self._worlds)
        order = worlds.argsort(stable=True)
        return worlds[order], {n: self._room[n].index_select(0, order) for n in self._names}

    def _room_of(self, name: str, values: Tensor, count: int) -> Tensor:
        """Where so many rows fit, with what is there already."""
        room = self._room.get(name)
        if room is None or len(room) < count:
            wider = values.new_empty(2 * count, *values.shape[1:])
            if room is not None:
                wider[: len(self)] = room[: len(self)]
            room = self._room[name] = wider
        return room
