"""All ways in which episodes can go on where rounding leaves the action open."""

import dataclasses
from typing import Any

import torch
from torch import Tensor

from drone_rl.envs.direct_renderer import DirectRenderer
from drone_rl.evaluation.metrics import Episodes
from drone_rl.policies.rounding import Decide
from drone_rl.sim.tasks import State

MOST = 64
"""Branches of an episode that are followed; one that has more is left open."""


@dataclasses.dataclass(frozen=True)
class Outcomes:
    """How episodes can end."""

    episodes: Episodes | None
    """One for each end that was found; None if no episode was followed."""
    owner: Tensor
    """The episode that each is an end of. Shape: (number of ends,), int64."""
    is_open: Tensor
    """Episodes of which not all ends are known. Shape: (number of episodes,), bool."""


@torch.no_grad()
def follow(renderer: DirectRenderer, decide: Decide, worlds: Tensor) -> Outcomes:
    """Fly episodes from their starts, with every possible action wherever there are several.

    Args:
        renderer: Of an environment whose worlds are as they were at the start.
        decide: The policy, of counted actions and without memory.
        worlds: Indices of the environment's. Shape: (k,).

    Returns:
        The k episodes' ends.
    """
    simulated, count = renderer.worlds, len(worlds)
    state: Any = simulated.state[worlds]
    owner = torch.arange(count, device=worlds.device)
    is_open = torch.zeros_like(owner, dtype=torch.bool)
    ends, owners = [], []
    while len(owner):
        possible = decide(renderer.look(state, worlds[owner]).get("pixels")).possible
        row, action = possible.nonzero().unbind(-1)
        state, owner = state[row], owner[row]
        state, _ = simulated.advance(state, action)
        is_over = state.end_reason != 0
        ends.append(state[is_over])
        owners.append(owner[is_over])
        kept = _distinct(state, owner, ~is_over)
        state, owner = state[kept], owner[kept]
        is_open |= (owner.bincount(minlength=count) + _counts(owners, count)) > MOST
        going = (~is_open[owner]).nonzero()[:, 0]
        state, owner = state[going], owner[going]
    episodes = [
        Episodes.ended(simulated.task, simulated.info(end), end.steps) for end in ends if len(end)
    ]
    return Outcomes(
        Episodes.joined(episodes) if episodes else None, torch.cat(owners).cpu(), is_open.cpu()
    )


def _distinct(state: State, owner: Tensor, is_kept: Tensor) -> Tensor:
    """Rows that go on, one of those that are the same state of the same episode."""
    rows = is_kept.nonzero()[:, 0]
    if len(rows) < 2:
        return rows
    columns = [owner[rows, None].double(), *_columns(state[rows].tensors(), len(rows))]
    _, number = torch.cat(columns, -1).unique(dim=0, return_inverse=True)
    first = torch.full((int(number.max()) + 1,), len(rows), device=rows.device)
    index = torch.arange(len(rows), device=rows.device)
    return rows[first.scatter_reduce(0, number, index, "amin").sort().values]


def _columns(tensors: dict[str, Any], count: int) -> list[Tensor]:
    """All numbers of a state, a row a world."""
    found = []
    for value in tensors.values():
        if isinstance(value, dict):
            found += _columns(value, count)
        else:
            found.append(value.reshape(count, -1).double())
    return found


def _counts(owners: list[Tensor], count: int) -> Tensor:
    return torch.cat(owners).bincount(minlength=count)
