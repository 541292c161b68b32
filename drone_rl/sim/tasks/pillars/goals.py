"""Finished flights through pillars: their rows, and the classes into which these fall."""

import dataclasses
from collections.abc import Iterator

import torch
from torch import Tensor

from drone_rl.config import PillarsSettings
from drone_rl.sim.tasks.judgeable import Goals
from drone_rl.sim.tasks.pillars.rules import Side
from drone_rl.utils.text import ordinal


@dataclasses.dataclass
class RowGoals(Goals):
    """Rows that were to be passed; their strata are sides on which the way through lay."""

    gap: Tensor  # (n, R) float64
    """Metres between the pillars beside the nearest way through; NaN if the row never came up."""


def classes(settings: PillarsSettings, rows: RowGoals) -> Iterator[tuple[str, str, Tensor]]:
    """By number of the row, side and width of the gap; see `Judgeable.classes`."""
    for number in range(rows.reached.shape[-1]):
        of = torch.zeros_like(rows.reached)
        of[:, number] = True
        yield "row", ordinal(number), of
    for side in Side:
        yield "side", side.name.lower(), rows.stratum == side
    edges = gap_edges(settings)
    for low, high in zip(edges, [*edges[1:], torch.inf], strict=True):
        label = f"{low:g} to {high:g} m" if high < torch.inf else f"more than {low:g} m"
        yield "gap", label, (rows.gap > low) & (rows.gap <= high)


def gap_edges(settings: PillarsSettings) -> list[float]:
    """Bounds of the classes of gaps, metres: from as wide as the drone, by steps, upwards."""
    narrow, step = settings.drone_size, settings.step_length
    return [narrow, narrow + step, narrow + 3 * step]
