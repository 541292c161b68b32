"""How episodes end when moves are drawn: exactly, by the Markov chain on the lattice.

The probability of being in each node is carried from step to step, to the step limit, in float64.
Nothing is drawn at random, and what is left out is reported as undecided.
"""

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torchrl.envs import CatFrames, Transform, TransformedEnv

from drone_rl.envs import CameraFault, worlds_of
from drone_rl.policies.rounding import RoundingBound
from drone_rl.sim.tasks.collect_cubes import EndReason, WorldState
from drone_rl.utils.batch import Batch
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.bounds import Part, Ranges
from drone_rl.verification.prover.boxes import Boxes
from drone_rl.verification.prover.cells import Cells
from drone_rl.verification.prover.lattice import AHEAD, LEFT, RIGHT, Graph, Place
from drone_rl.verification.prover.policy_spec import Subject

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
        graph: From `drone_rl.verification.prover.lattice.explore`.
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


MOST_ROUNDING = 0.1
"""Largest bound on the rounding error of a logit. Honest policies have about 0.01."""
_FEW = 256
BATCH = 1000
"""Pictures drawn at a time; bounds memory."""


class Sight:
    """Draws nodes of lattices as the policy's camera does, and asks its network."""

    def __init__(self, env: TransformedEnv, network: Callable[[Tensor], Tensor]) -> None:
        """Borrows worlds, transforms and a network.

        Args:
            env: Worlds of cube collection and the policy's transforms.
            network: Pictures (N, C, H, W) to logits (N, A).

        Raises:
            InputError: The policy remembers pictures or its camera goes wrong, so that a node
                doesn't decide what it does.
        """
        self.pictures = 0
        """Drawn so far."""
        self._worlds, self._network = worlds_of(env), network
        is_module = isinstance(network, nn.Module)
        self._rounding = RoundingBound.find(network) if is_module else None
        pipeline: Iterable[Transform] = env.transform  # type: ignore[assignment]
        self._transforms = [t for t in pipeline if "pixels" in (t.in_keys or [])]
        stacks = [t.N for t in self._transforms if isinstance(t, CatFrames)]
        if max(stacks, default=1) > 1:
            raise InputError(
                f"the policy stacks {max(stacks)} frames, so that its moves depend on the past; "
                "give a policy that sees one picture"
            )
        if faults := [t for t in self._transforms if isinstance(t, CameraFault)]:
            raise InputError(
                f"the policy's camera goes wrong ({faults[0]}), so that its moves depend on chance "
                "or the past; give a policy without"
            )

    def on(self, graph: Graph) -> Ask:
        """How to ask what the policy does in nodes of a graph; no picture is drawn twice."""
        node, picture = graph.pictures()
        every = graph.states()
        known = torch.full(
            (len(node), len(self._worlds.dynamics.actions.names)), torch.nan
        ).double()

        def ask(nodes: Tensor) -> Tensor:
            wanted = picture[nodes].unique()
            new = wanted[known[wanted, 0].isnan()]
            if len(new):
                known[new] = self._wishes(every[node[new]])
            return known[picture[nodes]]

        return ask

    @torch.no_grad()
    def _wishes(self, states: WorldState) -> Tensor:
        """Probabilities of the moves in worlds. Shape: (N, A), float64, on the CPU."""
        self.pictures += len(states)
        parts = states.to(self._worlds.device).split(BATCH)
        return torch.cat([self._logits(part) for part in parts]).double().softmax(-1).cpu()

    def _logits(self, state: WorldState) -> Tensor:
        pixels = self._worlds.render(state)
        for transform in self._transforms:
            pixels = transform._apply_transform(pixels)
        logits = self._network(pixels)  # refuses what is not finite
        self._require_known(pixels)
        return logits

    def _require_known(self, pixels: Tensor) -> None:
        """Refuse probabilities that depend on the order of summation.

        Raises:
            InputError: They may differ by more than `MOST_ROUNDING`.
        """
        if self._rounding is None:
            return
        _, error = self._rounding.together(pixels)
        if bool((error <= MOST_ROUNDING).all()):  # a probability changes by no more than its logit
            return
        for part in pixels.split(_FEW):
            most = float(self._rounding.errors(part).max())
            if not most <= MOST_ROUNDING:
                raise InputError(
                    f"rounding can change a logit of the policy by {most:.3g}, so that its "
                    f"chances depend on the order of sums; give a policy with at most "
                    f"{MOST_ROUNDING:g}"
                )


_LOST, _WON = 0, 1
_MOVES = (AHEAD, LEFT, RIGHT)
_BATCH = 512
ROUNDING = 1e-9
"""More than float64's errors of some hundred steps come to."""


@dataclasses.dataclass(frozen=True)
class Bounded:
    """Bounds on the probability that all cubes are collected, over a box of placements."""

    least: float
    """Nowhere in the box is it less."""
    most: float
    """Nowhere is it more."""
    mean_least: float
    """Nor is its mean over the box less than this,"""
    mean_most: float
    """or more than this."""


def bound_success(subject: Subject, box: Boxes, most: int = 1) -> Bounded:
    """How probable it is that all cubes are collected, wherever in a box they stand.

    Args:
        subject: Policy and task.
        box: Where the cubes may stand, metres to the left, the nearest first. Shape: (C, 2).
        most: Parts that the box is cut into, each where it helps the most: the smaller a part, the
            closer its bounds.

    Raises:
        InputError: See `Cells`.
    """
    looks = _Looks(subject, box)
    parts = [(box, *_bound(looks, box))]
    while len(parts) < most:
        gaps = [np.prod(np.diff(part)) * (high - low) for part, low, high in parts]
        part, low, high = parts[worst := int(np.argmax(gaps))]
        if high - low <= 2 * ROUNDING:
            break
        parts[worst : worst + 1] = [(half, *_bound(looks, half)) for half in _halves(part)]
    shares = [float(np.prod(np.diff(part)) / np.prod(np.diff(box))) for part, _, _ in parts]
    return Bounded(
        least=min(low for _, low, _ in parts),
        most=max(high for _, _, high in parts),
        mean_least=sum(share * low for share, (_, low, _) in zip(shares, parts, strict=True)),
        mean_most=sum(share * high for share, (_, _, high) in zip(shares, parts, strict=True)),
    )


def _halves(box: Boxes) -> tuple[Boxes, Boxes]:
    """Cut across the longest side."""
    cube = int(np.diff(box).argmax())
    first, second = box.copy(), box.copy()
    first[cube, 1] = second[cube, 0] = box[cube].mean()
    return first, second


def _bound(looks: "_Looks", box: Boxes) -> tuple[float, float]:
    places, targets = _reachable(looks.subject, box)
    lowest, highest = looks.probabilities(box, places)
    start = np.concatenate([[0.0, 1.0], np.zeros(len(places))])
    least, most = start, start
    for _ in range(looks.subject.lattice.task.step_limit):
        before = least, most
        least, most = start.copy(), start.copy()
        least[2:] = _extreme(before[0][targets].min(-1), lowest, highest)
        most[2:] = -_extreme(-before[1][targets].max(-1), lowest, highest)
        if all(map(np.array_equal, before, (least, most))):
            break
    return max(0.0, float(least[2]) - ROUNDING), min(1.0, float(most[2]) + ROUNDING)


def _reachable(subject: Subject, box: Boxes) -> tuple[list[Place], NDArray[np.int64]]:
    """All places, the start first, and where each move may lead.

    Returns:
        The places; and of each move the numbers of what may come of it, which are 0 for a loss, 1
        for a win, and two more than the place's own otherwise. Shape: (places, moves, ways).
    """
    lattice, number = subject.lattice, {Place(0, 0): 0}
    places, found = [Place(0, 0)], []
    for place in places:  # which grows
        for move in _MOVES:
            ways = []
            for moved, _ in lattice.move(place, move, box[None]):
                bare = dataclasses.replace(moved, steps=0, came=AHEAD)
                if (ending := lattice.ending(bare)) is not None:
                    ways.append(_WON if ending.reason == EndReason.ALL_CUBES else _LOST)
                    continue
                if bare not in number:
                    number[bare] = len(places)
                    places.append(bare)
                ways.append(2 + number[bare])
            found.append(ways)
    most = max(map(len, found))
    padded = [ways + ways[:1] * (most - len(ways)) for ways in found]
    return places, np.array(padded).reshape(len(places), len(_MOVES), most)


class _Looks:
    """What may be seen, and wished for, of cubes in a box and in its parts."""

    def __init__(self, subject: Subject, box: Boxes) -> None:
        self.subject, self._box = subject, box
        self._known: dict[tuple[int, int], tuple[Cells, Ranges]] = {}

    def probabilities(
        self, box: Boxes, places: list[Place]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """How probable each move is, at least and at most. Shapes: (places, moves)."""
        lattice, painter = self.subject.lattice, self.subject.painter
        lowest, highest = np.zeros((2, len(places), len(_MOVES)))
        alike: dict[tuple[int, ...], list[int]] = {}
        for i, place in enumerate(places):
            alike.setdefault((place.ahead, *lattice.standing(place)), []).append(i)
        for (ahead, *cubes), numbers in alike.items():
            y = np.array([lattice.y(places[i]) for i in numbers])
            for some in np.array_split(np.arange(len(y)), -(-len(y) // _BATCH)):
                cases = [self._case(cube, ahead, box[cube], y[some]) for cube in cubes]
                lower, upper = map(painter.see, painter.paint(cases, len(some)))
                at = np.array(numbers)[some]
                bounds = self.subject.bounds.probabilities(lower, upper)
                lowest[at], highest[at] = (bound.numpy() for bound in bounds)
        return lowest, highest

    def _case(
        self, cube: int, ahead: int, interval: NDArray, y: NDArray
    ) -> tuple[Part, Tensor, Tensor]:
        """What `Painter.paint` takes of one cube, for drones at y."""
        cells, ranges = self._look(cube, ahead)
        first, last = cells.span(interval[0] - y, interval[1] - y)
        return ranges.part, *ranges.of(np.stack([cells.first[first], cells.last[last]], -1))

    def _look(self, cube: int, ahead: int) -> tuple[Cells, Ranges]:
        if (cube, ahead) not in self._known:
            task, (low, high) = self.subject.lattice.task, self._box[cube]
            aside = task.side_bound + task.step_length
            cells = self.subject.cells(cube, ahead, low - aside, high + aside)
            self._known[cube, ahead] = cells, Ranges(torch.from_numpy(cells.pictures))
        return self._known[cube, ahead]


def _extreme(
    values: NDArray[np.float64], lowest: NDArray[np.float64], highest: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The least mean of values that probabilities between bounds allow. Shapes: (N, A) to (N,)."""
    order = values.argsort(-1)
    values, low, high = (np.take_along_axis(v, order, -1) for v in (values, lowest, highest))
    left = (1.0 - low.sum(-1)).clip(0.0)
    mean = (low * values).sum(-1)
    for k in range(values.shape[1]):
        more = np.minimum(high[:, k] - low[:, k], left)
        mean += more * values[:, k]
        left -= more
    return mean
