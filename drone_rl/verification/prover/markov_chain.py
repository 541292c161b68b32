"""Exact success probabilities of a policy that samples its actions, and bounds on them."""

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
from drone_rl.verification.prover.bounds import Crop, ImageRanges
from drone_rl.verification.prover.boxes import Boxes
from drone_rl.verification.prover.cells import Cells
from drone_rl.verification.prover.lattice import AHEAD, LEFT, RIGHT, Graph, LatticeState
from drone_rl.verification.prover.policy_spec import PolicySpec
from drone_rl.verification.prover.rounding import RoundingBound

MIN_PROBABILITY = 1e-18  # nodes less probable than this at every step are not evaluated
NEGLIGIBLE = 1e-15  # sum of the probabilities of running episodes at which propagation stops
MAX_ROUNDING = 0.1  # largest rounding error of a logit; typical policies have about 0.01
ROUNDING = 1e-9  # bound on the float64 error of several hundred steps
BATCH = 1000  # images rendered at a time; bounds memory
_ROUNDING_BATCH = 256  # images whose rounding errors are bounded at a time
_BOUNDS_BATCH = 512  # image ranges whose logits are bounded at a time
_LOST, _WON = 0, 1
_MOVES = (AHEAD, LEFT, RIGHT)
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


@dataclasses.dataclass(frozen=True)
class SuccessBounds:
    """Bounds on the success probability over a box of placements."""

    least: float  # lower bound everywhere in the box
    most: float  # upper bound everywhere in the box
    mean_least: float  # lower bound of the mean over the box
    mean_most: float  # upper bound of the mean over the box


def bound_success(spec: PolicySpec, box: Boxes, max_parts: int = 1) -> SuccessBounds:
    """Bound the probability that all cubes are collected, over a box of placements (C, 2).

    Network bounds over all images in the box give an interval Markov chain (Givan, Leach and Dean,
    2000), solved backwards for its best and worst case. The box is cut into up to
    `max_parts`; smaller parts give tighter bounds.

    Raises:
        InputError: See `Cells`.
    """
    actions = _ActionBounds(spec, box)
    parts = [(box, *_bound(actions, box))]
    while len(parts) < max_parts:
        gaps = [np.prod(np.diff(part)) * (high - low) for part, low, high in parts]
        part, low, high = parts[worst := int(np.argmax(gaps))]
        if high - low <= 2 * ROUNDING:
            break
        parts[worst : worst + 1] = [(half, *_bound(actions, half)) for half in _halves(part)]
    sizes = np.array([np.prod(np.diff(part)) for part, _, _ in parts])
    shares = (sizes / sizes.sum() if sizes.any() else np.full(len(sizes), 1 / len(sizes))).tolist()
    return SuccessBounds(
        least=min(low for _, low, _ in parts),
        most=max(high for _, _, high in parts),
        mean_least=sum(share * low for share, (_, low, _) in zip(shares, parts, strict=True)),
        mean_most=sum(share * high for share, (_, _, high) in zip(shares, parts, strict=True)),
    )


def _halves(box: Boxes) -> tuple[Boxes, Boxes]:
    cube = int(np.diff(box).argmax())
    first, second = box.copy(), box.copy()
    first[cube, 1] = second[cube, 0] = box[cube].mean()
    return first, second


def _bound(actions: "_ActionBounds", box: Boxes) -> tuple[float, float]:
    """Return bounds on the success probability by backward iteration."""
    states, targets = _reachable(actions.spec, box)
    lowest, highest = actions.probabilities(box, states)
    start = np.concatenate([[0.0, 1.0], np.zeros(len(states))])
    least, most = start, start
    for _ in range(actions.spec.lattice.task.step_limit):
        before = least, most
        least, most = start.copy(), start.copy()
        least[2:] = _least_mean(before[0][targets].min(-1), lowest, highest)
        most[2:] = -_least_mean(-before[1][targets].max(-1), lowest, highest)
        if all(map(np.array_equal, before, (least, most))):
            break
    return max(0.0, float(least[2]) - ROUNDING), min(1.0, float(most[2]) + ROUNDING)


def _reachable(spec: PolicySpec, box: Boxes) -> tuple[list[LatticeState], NDArray[np.int64]]:
    """Return all reachable states, and targets of moves (states, moves, possible targets).

    A target is 0 for failure, 1 for success, else 2 plus the index of the state.
    """
    lattice, index_of = spec.lattice, {LatticeState(0, 0): 0}
    # moves cut half-open boxes, but the upper ends belong to this one
    box = np.stack([box[:, 0], np.nextafter(box[:, 1], np.inf)], -1)
    states, all_targets = [LatticeState(0, 0)], []
    for state in states:  # the loop appends to `states`
        for move in _MOVES:
            targets = []
            for moved, _ in lattice.move(state, move, box[None]):
                untimed = dataclasses.replace(moved, steps=0, came=AHEAD)
                if (ending := lattice.ending(untimed)) is not None:
                    targets.append(_WON if ending.reason == CubesEnd.ALL_CUBES else _LOST)
                    continue
                if untimed not in index_of:
                    index_of[untimed] = len(states)
                    states.append(untimed)
                targets.append(2 + index_of[untimed])
            all_targets.append(targets)
    most = max(map(len, all_targets))
    padded = [targets + targets[:1] * (most - len(targets)) for targets in all_targets]
    return states, np.array(padded).reshape(len(states), len(_MOVES), most)


class _ActionBounds:
    """Bounds on action probabilities for cubes in a box and its parts."""

    def __init__(self, spec: PolicySpec, box: Boxes) -> None:
        self.spec, self._box = spec, box
        self._known: dict[tuple[int, int], tuple[Cells, ImageRanges]] = {}

    def probabilities(
        self, box: Boxes, states: list[LatticeState]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return lower and upper bounds of each action's probability. Shapes: (states, moves)."""
        lattice, compositor = self.spec.lattice, self.spec.compositor
        lowest, highest = np.zeros((2, len(states), len(_MOVES)))
        groups: dict[tuple[int, ...], list[int]] = {}
        for i, state in enumerate(states):
            groups.setdefault((state.ahead, *lattice.standing(state)), []).append(i)
        for (ahead, *cubes), numbers in groups.items():
            y = np.array([lattice.y(states[i]) for i in numbers])
            for some in np.array_split(np.arange(len(y)), -(-len(y) // _BOUNDS_BATCH)):
                cases = [self._case(cube, ahead, box[cube], y[some]) for cube in cubes]
                lower, upper = map(compositor.see, compositor.paint(cases, len(some)))
                at = np.array(numbers)[some]
                bounds = self.spec.bounds.probabilities(lower, upper)
                lowest[at], highest[at] = (bound.numpy() for bound in bounds)
        return lowest, highest

    def _case(
        self, cube: int, ahead: int, interval: NDArray, y: NDArray
    ) -> tuple[Crop, Tensor, Tensor]:
        """Return one cube's entry for `Compositor.paint`, for drones at y."""
        if (cube, ahead) not in self._known:
            task, (low, high) = self.spec.lattice.task, self._box[cube]
            aside = task.side_bound + task.step_length
            cells = self.spec.cells(cube, ahead, low - aside, high + aside)
            self._known[cube, ahead] = cells, ImageRanges(torch.from_numpy(cells.images))
        cells, ranges = self._known[cube, ahead]
        first, last = cells.span(interval[0] - y, interval[1] - y)
        return ranges.part, *ranges.of(np.stack([cells.first[first], cells.last[last]], -1))


def _least_mean(
    values: NDArray[np.float64], lowest: NDArray[np.float64], highest: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the smallest mean over all probabilities within bounds. (N, A) to (N,)."""
    order = values.argsort(-1)
    values, low, high = (np.take_along_axis(v, order, -1) for v in (values, lowest, highest))
    left = (1.0 - low.sum(-1)).clip(0.0)
    mean = (low * values).sum(-1)
    for k in range(values.shape[1]):
        more = np.minimum(high[:, k] - low[:, k], left)
        mean += more * values[:, k]
        left -= more
    return mean
