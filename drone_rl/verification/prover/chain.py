"""How episodes end when moves are drawn: exactly, by the Markov chain on the lattice.

The probability of being in each node is carried from step to step, to the step limit, in float64.
Nothing is drawn at random, and what is left out is reported as undecided.
"""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.sim.tasks.collect_cubes import EndReason
from drone_rl.utils.batch import Batch
from drone_rl.verification.prover.graph import Graph

FAINT = 1e-18
"""Probability of being in a node at a step up to which the policy isn't asked what it does there;
most nodes are all but out of reach. Once it has been asked, all that comes there is followed."""
NEGLIGIBLE = 1e-15
"""Probability that any episode still goes on, of all placements together, below which none is
followed farther."""
Ask = Callable[[Tensor], Tensor]
"""Nodes by number (N,) to the probabilities of the moves there (N, A), float64."""


@dataclasses.dataclass
class Outcomes(Batch):
    """How episodes end in `P` placements of `C` cubes."""

    ends: Tensor  # (P, len(EndReason), 2**C) float64
    """Probability that the episode ends for this reason with just these cubes collected; bit k of
    the last index says whether cube k is one of them."""
    steps: Tensor  # (P,) float64
    """Expected length of an episode."""
    undecided: Tensor  # (P,) float64
    """Probability of what was not followed to its end. Every other probability is at most so much
    too low and never too high, but for float64's rounding."""

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Those of all the parts' placements."""
        columns = zip(*((p.ends, p.steps, p.undecided) for p in parts), strict=True)
        return cls(*(torch.cat(column) for column in columns))

    @property
    def success(self) -> Tensor:
        """Probability that all cubes are collected. Shape: (P,)."""
        return self.ends[:, EndReason.ALL_CUBES].sum(-1)

    @property
    def failure(self) -> Tensor:
        """Probability that not all are, with all its digits however small it is. Shape: (P,)."""
        missed = [reason for reason in EndReason if reason != EndReason.ALL_CUBES]
        return self.reasons[:, missed].sum(-1)

    @property
    def reasons(self) -> Tensor:
        """Probability of each `EndReason`. Shape: (P, len(EndReason))."""
        return self.ends.sum(-1)

    @property
    def collected(self) -> Tensor:
        """Probability that each cube is collected. Shape: (P, C)."""
        sets = torch.arange(self.ends.shape[-1])
        cubes = torch.arange(self.ends.shape[-1].bit_length() - 1)
        return self.ends.sum(1) @ (sets[:, None] >> cubes & 1).double()

    @property
    def cubes(self) -> Tensor:
        """Expected number of cubes collected. Shape: (P,)."""
        return self.collected.sum(-1)


def follow_chances(graph: Graph, ask: Ask) -> Outcomes:
    """Carries the probability of every node on, step by step, until all episodes have ended.

    Args:
        graph: From `drone_rl.verification.prover.graph.explore`.
        ask: What the policy wishes for, asked once of each node that matters.
    """
    count, sets = len(graph.cubes), 2 ** graph.cubes.shape[1]
    placement = graph.nodes.placement.numpy()
    wish, visits, last, dropped = _carry(graph, ask)
    reason, collected = graph.reason.numpy(), graph.collected.numpy()
    flow = visits[:, None] * wish  # of the moves that go on, too: those "end" as RUNNING
    end = (placement[:, None] * len(EndReason) + reason) * sets + collected
    ends = np.bincount(end.ravel(), flow.ravel(), count * len(EndReason) * sets)
    ends = ends.reshape(count, len(EndReason), sets)
    ends[:, EndReason.RUNNING] = 0.0
    by_set = placement * sets + graph.nodes.collected.numpy()
    ends[:, EndReason.STEP_LIMIT] += np.bincount(by_set, last, count * sets).reshape(count, sets)
    steps = np.bincount(placement, visits, count)
    undecided = np.bincount(placement, dropped, count)
    return Outcomes(*map(torch.from_numpy, (ends.clip(max=1.0), steps, undecided)))


def _carry(graph: Graph, ask: Ask) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Steps as long as anything goes on.

    Returns:
        Of each node the wish, which is 0 where none was asked for (K, A); how often it is expected
        to be left; the probability of being there at the step limit; and that which was not
        followed from there. Shapes: (K,).
    """
    target = graph.target.numpy()
    goes_on = target >= 0
    nodes = len(target)
    wish, visits, dropped = np.zeros(target.shape), np.zeros(nodes), np.zeros(nodes)
    is_known = np.zeros(nodes, dtype=bool)
    now = (np.arange(nodes) < len(graph.cubes)).astype(float)
    for _ in range(graph.settings.step_limit):
        new = (now > FAINT) & ~is_known
        if new.any():
            wish[new] = ask(torch.from_numpy(new.nonzero()[0])).numpy()
            is_known |= new
        dropped += np.where(is_known, 0.0, now)
        now = np.where(is_known, now, 0.0)
        visits += now
        here = now.nonzero()[0]
        flow, inner = now[here, None] * wish[here], goes_on[here]
        now = np.bincount(target[here][inner], flow[inner], nodes)
        if now.sum() < NEGLIGIBLE:
            return wish, visits, np.zeros(nodes), dropped + now
    return wish, visits, now, dropped
