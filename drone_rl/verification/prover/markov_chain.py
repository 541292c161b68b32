"""Exact success probabilities of a policy that samples its actions."""

import dataclasses
from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torchrl.envs import EnvBase

from drone_rl.envs import base_env, worlds_of
from drone_rl.sim.tasks.collect_cubes import CubesEnd
from drone_rl.sim.tasks.objects import ObjectState
from drone_rl.utils.batch import Batch
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.lattice import Graph
from drone_rl.verification.prover.rounding import RoundingBound

MIN_PROBABILITY = 1e-18  # nodes less probable than this at every step are not evaluated
NEGLIGIBLE = 1e-15  # sum of the probabilities of running episodes at which propagation stops
MAX_ROUNDING = 0.1  # largest rounding error of a logit; typical policies have about 0.01
BATCH = 1000  # images rendered at a time; bounds memory
_ROUNDING_BATCH = 256  # images whose rounding errors are bounded at a time
Evaluate = Callable[[Tensor], Tensor]  # nodes (N,) to action probabilities (N, A), float64


@dataclasses.dataclass
class Outcomes(Batch):
    """How episodes end in `P` placements of `C` cubes."""

    ends: Tensor  # (P, len(CubesEnd), 2**C) float64
    """Probability of each end reason with exactly these cubes collected. Bit k of the last index is
    set if cube k is collected."""
    steps: Tensor  # (P,) float64; expected length of an episode
    undecided: Tensor  # (P,) float64
    """Probability of episodes that are not followed to their end. Every other probability is too
    low by at most this, and never too high, up to float64 rounding."""

    @property
    def success(self) -> Tensor:
        """Probability that all cubes are collected. Shape: (P,)."""
        return self.ends[:, CubesEnd.ALL_CUBES].sum(-1)

    @property
    def failure(self) -> Tensor:
        """Probability that not all cubes are collected, precise even if tiny. Shape: (P,)."""
        return self.reasons[:, [end for end in CubesEnd if end != CubesEnd.ALL_CUBES]].sum(-1)

    @property
    def reasons(self) -> Tensor:
        """Probability of each `CubesEnd`. Shape: (P, len(CubesEnd))."""
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


def propagate(graph: Graph, evaluate: Evaluate) -> Outcomes:
    """Return how episodes end, by propagating probabilities until the rest is `NEGLIGIBLE`."""
    count, sets = len(graph.cubes), 2 ** graph.cubes.shape[1]
    placement = graph.nodes.placement.numpy()
    probability, visits, last, dropped = _propagate(graph, evaluate)
    reason, collected = graph.reason.numpy(), graph.collected.numpy()
    flow = visits[:, None] * probability  # includes moves that continue: they "end" as RUNNING
    end = (placement[:, None] * len(CubesEnd) + reason) * sets + collected
    ends = np.bincount(end.ravel(), flow.ravel(), count * len(CubesEnd) * sets)
    ends = ends.reshape(count, len(CubesEnd), sets)
    ends[:, CubesEnd.RUNNING] = 0.0
    by_set = placement * sets + graph.nodes.collected.numpy()
    ends[:, CubesEnd.STEP_LIMIT] += np.bincount(by_set, last, count * sets).reshape(count, sets)
    steps = np.bincount(placement, visits, count)
    undecided = np.bincount(placement, dropped, count)
    return Outcomes(*map(torch.from_numpy, (ends.clip(max=1.0), steps, undecided)))


def _propagate(graph: Graph, evaluate: Evaluate) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Return action probabilities (K, A), 0 where not evaluated, and three values of each node.

    The three values, each (K,), are the expected number of visits, the probability at the step
    limit, and the probability that is not followed.
    """
    target = graph.target.numpy()
    goes_on = target >= 0
    nodes = len(target)
    probability, visits, dropped = np.zeros(target.shape), np.zeros(nodes), np.zeros(nodes)
    is_known = np.zeros(nodes, dtype=bool)
    now = (np.arange(nodes) < len(graph.cubes)).astype(float)
    for _ in range(graph.settings.step_limit):
        new = (now > MIN_PROBABILITY) & ~is_known
        if new.any():
            probability[new] = evaluate(torch.from_numpy(new.nonzero()[0])).numpy()
            is_known |= new
        dropped += np.where(is_known, 0.0, now)
        now = np.where(is_known, now, 0.0)
        visits += now
        here = now.nonzero()[0]
        flow, inner = now[here, None] * probability[here], goes_on[here]
        now = np.bincount(target[here][inner], flow[inner], nodes)
        if now.sum() < NEGLIGIBLE:
            return probability, visits, np.zeros(nodes), dropped + now
    return probability, visits, now, dropped


class NodeEvaluator:
    """Render graph nodes and evaluate the policy's action probabilities at them."""

    def __init__(self, env: EnvBase, network: nn.Module) -> None:
        self.num_images = 0  # images rendered so far
        self._worlds, self._network = worlds_of(env), network
        self._rounding = RoundingBound.find(network)
        self._transforms = base_env(env).observer.image.transforms

    def on(self, graph: Graph) -> Evaluate:
        """Return a function from nodes of a graph to action probabilities; it caches images."""
        node, image = graph.images()
        every = graph.states()
        shape = len(node), len(self._worlds.dynamics.actions.names)
        probabilities = torch.full(shape, torch.nan, dtype=torch.float64)

        def evaluate(nodes: Tensor) -> Tensor:
            wanted = image[nodes].unique()
            new = wanted[probabilities[wanted, 0].isnan()]
            if len(new):
                probabilities[new] = self._probabilities(every[node[new]])
            return probabilities[image[nodes]]

        return evaluate

    @torch.no_grad()
    def _probabilities(self, states: ObjectState) -> Tensor:
        """Return the action probabilities. Shape: (N, A), float64, on the CPU."""
        self.num_images += len(states)
        logits = []
        for part in states.to(self._worlds.device).split(BATCH):
            pixels = self._worlds.render(part)
            for transform in self._transforms:
                pixels = transform._apply_transform(pixels)
            with torch.backends.cudnn.flags(enabled=False):  # no TF32, for which no bound holds
                logits.append(self._network(pixels))  # raises for values that are not finite
            self._check_rounding(pixels)
        return torch.cat(logits).double().softmax(-1).cpu()

    def _check_rounding(self, pixels: Tensor) -> None:
        """Raise InputError if rounding may change a logit by more than `MAX_ROUNDING`."""
        if self._rounding is None:
            return
        _, error = self._rounding.together(pixels)
        if bool((error <= MAX_ROUNDING).all()):  # a probability changes by no more than its logit
            return
        for part in pixels.split(_ROUNDING_BATCH):
            most = float(self._rounding.errors(part).max())
            if not most <= MAX_ROUNDING:
                raise InputError(
                    f"rounding can change a logit of the policy by {most:.3g}, so its action "
                    f"probabilities depend on the order of summation; give a policy with at most "
                    f"{MAX_ROUNDING:g}"
                )
