"""Enumerate all outcomes of episodes in which rounding leaves an action open."""

import dataclasses
from typing import Any

import torch
from torch import Tensor

from drone_rl.collectors.complete_episodes import Episodes
from drone_rl.envs.direct_renderer import DirectRenderer
from drone_rl.policies.rounding import Decide
from drone_rl.sim.tasks import State

MAX_FRAGILE = 0.02
"""Largest fraction of fragile frames for a certain verdict; honest policies have at most 0.003."""
MAX_FRAGILE_EPISODES = 0.25
"""Largest fraction of episodes with a fragile frame. Honest policies have at most 0.15."""
MAX_UNEXPLAINED = 0.04
"""Largest fraction of episodes that may end differently in another implementation if there is no
bound on rounding, actions are continuous, or drones have flight dynamics. Otherwise an episode may
take other actions only in or after a fragile frame."""
MAX_BRANCHES = 64
"""Largest number of branches of an episode; with more, its outcome is left open."""


@dataclasses.dataclass(frozen=True)
class OutcomeSet:
    """Possible outcomes of episodes."""

    episodes: Episodes | None
    """One for each outcome that was found; None if no episode was followed."""
    owner: Tensor
    """The episode that each is an outcome of. Shape: (number of outcomes,), int64."""
    is_open: Tensor
    """Episodes of which not all outcomes are known. Shape: (number of episodes,), bool."""


@dataclasses.dataclass(frozen=True)
class Rounding:
    """How rounding can change some episodes."""

    arithmetic: str
    """Arithmetic that computed the episodes, such as "float32 on cpu, fused kernel"."""
    is_bound: bool
    """Whether the rounding error is bounded, not estimated."""
    frames: int
    fragile: int
    """Frames in which rounding can change the action."""
    is_fragile: Tensor
    """Episodes with such a frame. Shape: (n,), bool."""
    outcomes: OutcomeSet
    """Possible outcomes of these; `owner` and `is_open` index all n episodes."""
    compared: str
    """Implementation that ran the episodes again."""
    compared_episodes: int
    differing: int
    """Episodes in which it took other actions; with continuous actions or flight dynamics, episodes
    that ended differently."""
    unexplained: int
    """Differing episodes without a fragile frame up to the first other action, or at all if
    outcomes were compared."""

    @property
    def is_excessive(self) -> bool:
        """Whether too much is fragile or unexplained for any verdict to be certain."""
        if not self.frames:
            return False
        allowed = 0.0 if self.is_bound else MAX_UNEXPLAINED
        return (
            self.fragile > MAX_FRAGILE * self.frames
            or int(self.is_fragile.sum()) > MAX_FRAGILE_EPISODES * len(self.is_fragile)
            or self.unexplained > allowed * self.compared_episodes
        )

    def as_dict(self) -> dict[str, Any]:
        """Return plain values, as in `verdict.json`."""
        fragile = int(self.is_fragile.sum())
        return {
            "arithmetic": self.arithmetic,
            "bound": self.is_bound,
            "frames": self.frames,
            "fragile": self.fragile,
            "fragile_rate": self.fragile / max(1, self.frames),
            "threshold": MAX_FRAGILE,
            "episodes": len(self.is_fragile),
            "fragile_episodes": fragile,
            "fragile_episodes_rate": fragile / max(1, len(self.is_fragile)),
            "threshold_episodes": MAX_FRAGILE_EPISODES,
            "open_episodes": int(self.outcomes.is_open.sum()),
            "compared": self.compared,
            "compared_episodes": self.compared_episodes,
            "differing": self.differing,
            "unexplained": self.unexplained,
            "excessive": self.is_excessive,
        }


@torch.no_grad()
def enumerate_outcomes(renderer: DirectRenderer, decide: Decide, env_ids: Tensor) -> OutcomeSet:
    """Run episodes from their initial states and follow every action that rounding permits.

    The renderer is in the state at the start of the episodes. The policy has discrete actions and
    no memory. `env_ids` are the indices of the episodes, shape (k,).
    """
    simulated, count = renderer.worlds, len(env_ids)
    state: Any = simulated.state[env_ids]
    owner = torch.arange(count, device=env_ids.device)
    is_open = torch.zeros_like(owner, dtype=torch.bool)
    ends, owners = [], []
    while len(owner):
        possible = decide(renderer.observe(state, env_ids[owner]).get("pixels")).possible
        row, action = possible.nonzero().unbind(-1)
        state, owner = state[row], owner[row]
        state, _ = simulated.advance(state, action)
        is_over = state.end_reason != 0
        ends.append(state[is_over])
        owners.append(owner[is_over])
        kept = _distinct(state, owner, ~is_over)
        state, owner = state[kept], owner[kept]
        ended = torch.cat(owners).bincount(minlength=count)
        is_open |= (owner.bincount(minlength=count) + ended) > MAX_BRANCHES
        going = (~is_open[owner]).nonzero()[:, 0]
        state, owner = state[going], owner[going]
    episodes = [
        Episodes.ended(simulated.task, simulated.info(end), end.steps) for end in ends if len(end)
    ]
    return OutcomeSet(
        Episodes.joined(episodes) if episodes else None, torch.cat(owners).cpu(), is_open.cpu()
    )


def _distinct(state: State, owner: Tensor, is_kept: Tensor) -> Tensor:
    """Rows to keep, without duplicate states of the same episode."""
    rows = is_kept.nonzero()[:, 0]
    if len(rows) < 2:
        return rows
    columns = [owner[rows, None].double(), *_columns(state[rows].tensors(), len(rows))]
    _, number = torch.cat(columns, -1).unique(dim=0, return_inverse=True)
    first = torch.full((int(number.max()) + 1,), len(rows), device=rows.device)
    index = torch.arange(len(rows), device=rows.device)
    return rows[first.scatter_reduce(0, number, index, "amin").sort().values]


def _columns(tensors: dict[str, Any], count: int) -> list[Tensor]:
    """All numbers of a state, one row per environment."""
    found = []
    for value in tensors.values():
        if isinstance(value, dict):
            found += _columns(value, count)
        else:
            numbers = value.reshape(count, -1).double()
            found.append(numbers.nan_to_num(nan=torch.inf))  # `unique` never merges rows with NaN
    return found
