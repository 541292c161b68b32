"""The task's rules on the lattice of drone positions, a whole number of steps from the start.

`Lattice` moves boxes of placements; `explore` builds the graph of everything reachable past cubes
at given positions, by the simulator's own rules.
"""

import dataclasses
import functools
import math
from collections.abc import Iterator

import numpy as np
import torch
from torch import Tensor

from drone_rl.config import TaskSettings
from drone_rl.sim.actions import MOVES
from drone_rl.sim.dynamics import BodyState
from drone_rl.sim.tasks.collect_cubes import CollectCubes, CubesEnd
from drone_rl.sim.tasks.objects import ObjectState
from drone_rl.utils.batch import Batch
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.boxes import Boxes, cut

AHEAD, LEFT, RIGHT = range(3)  # the actions


@dataclasses.dataclass(frozen=True)
class LatticeState:
    """The drone's position, the cubes it has, and how it arrived."""

    ahead: int  # steps
    left: int  # steps
    collected: int = 0  # bit k is set for cube k
    steps: int = 0  # steps taken so far
    came: int = AHEAD  # the last action if it was sideways and collected nothing; else `AHEAD`
    is_fork: bool = False  # whether some earlier action was not certain

    @functools.cached_property
    def turn(self) -> tuple:
        """Sort key: no state precedes one that leads to it."""
        order = (0, self.left, -self.left)[self.came]
        return (self.ahead, self.collected.bit_count(), self.came, order, self.steps)


@dataclasses.dataclass(frozen=True, order=True)
class Ending:
    """How an episode ends."""

    reason: CubesEnd
    collected: int  # bit k is set for cube k
    loops: bool = False  # whether the drone oscillates until the step limit


class Lattice:
    """A task's rules on the lattice."""

    def __init__(self, task: TaskSettings) -> None:
        """Raise InputError if the simulator or the renderer, in float32, rounds positions."""
        self.task = task
        step, count = task.step_length, task.step_limit + 1
        multiples = np.arange(-count, count + 1) * step
        aside = multiples[np.abs(multiples) <= task.side_bound]  # see `CameraModel.rounding`
        is_exact = np.array_equal(multiples[1:], multiples[:-1] + step)
        if not is_exact or not np.array_equal(aside, aside.astype(np.float32)):
            raise InputError(
                f"multiples of task.step_length={step} are rounded, so positions depend on the "
                "path, or differ between simulator (float64) and renderer (float32); give a sum of "
                "few powers of two, such as 0.5 or 1.25"
            )
        self.cubes = task.first_distance + task.spacing * np.arange(task.num_cubes)  # x, metres
        self.everything = (1 << task.num_cubes) - 1

    @property
    def last(self) -> int:
        """Steps ahead after which every episode has ended."""
        return int(self.task.front_bound / self.task.step_length) + 1

    def x(self, state: LatticeState) -> float:
        """Return the metres ahead of the start."""
        return state.ahead * self.task.step_length

    def y(self, state: LatticeState) -> float:
        """Return the metres to the left of the start."""
        return state.left * self.task.step_length

    def standing(self, state: LatticeState) -> list[int]:
        """Return the cubes neither collected nor passed, nearest first."""
        x = self.x(state)
        cubes = range(len(self.cubes))
        return [k for k in cubes if not state.collected >> k & 1 and x <= self.cubes[k]]

    def move(
        self, state: LatticeState, action: int, boxes: Boxes
    ) -> Iterator[tuple[LatticeState, Boxes]]:
        """Yield the next state and its part of the boxes, for each set of cubes then collected."""
        sideways = {AHEAD: 0, LEFT: 1, RIGHT: -1}[action]
        moved = dataclasses.replace(
            state,
            ahead=state.ahead + (action == AHEAD),
            left=state.left + sideways,
            steps=state.steps + 1,
            came=action,
        )
        for collected, part in self._touched(moved, self.standing(state), boxes):
            is_new = collected != state.collected
            came = AHEAD if is_new else action
            yield dataclasses.replace(moved, collected=collected, came=came), part

    def ending(self, state: LatticeState) -> Ending | None:
        """Return how the episode has ended, in the order of Algorithm 3; None if it continues."""
        reason = None
        if state.steps >= self.task.step_limit:
            reason = CubesEnd.STEP_LIMIT
        if abs(self.y(state)) > self.task.side_bound:
            reason = CubesEnd.SIDE_BOUNDARY
        if self.x(state) > self.task.front_bound:
            reason = CubesEnd.FRONT_BOUNDARY
        if state.collected == self.everything:
            reason = CubesEnd.ALL_CUBES
        return None if reason is None else Ending(reason, state.collected)

    def _touched(
        self, state: LatticeState, stood: list[int], boxes: Boxes
    ) -> Iterator[tuple[int, Boxes]]:
        """Split boxes by which of the cubes that stood the drone touches."""
        parts = [(state.collected, boxes)]
        reach, y = self.task.touch_distance, self.y(state)
        first, beyond = _least(y, reach), math.nextafter(-_least(-y, reach), math.inf)
        for cube in stood:
            if abs(self.x(state) - self.cubes[cube]) > reach:
                continue
            for _ in range(len(parts)):
                collected, part = parts.pop(0)
                right, rest = cut(part, cube, first)
                touched, left = cut(rest, cube, beyond)
                with_it = collected | 1 << cube
                parts += [(collected, right), (with_it, touched), (collected, left)]
        yield from ((collected, part) for collected, part in parts if len(part))


def _least(y: float, reach: float) -> float:
    """Return the smallest float within `reach` of y, by float subtraction."""
    least = y - reach
    while abs(y - least) <= reach:
        least = math.nextafter(least, -math.inf)
    while abs(y - least) > reach:
        least = math.nextafter(least, math.inf)
    return least


MAX_NODES = 2**24  # reachable or not, per placement; bounds memory


@dataclasses.dataclass
class Nodes(Batch):
    """Graph nodes, K in number; each determines the image and the effect of each move."""

    placement: Tensor  # (K,) int64; index of the placement of the cubes
    ahead: Tensor  # (K,) int64; steps forward from the origin
    aside: Tensor  # (K,) int64; steps to the left of it; negative to the right
    collected: Tensor  # (K,) int64; bit k is set if cube k is collected


Shape = tuple[int, int, int]  # number of values of each part of a node, without the placement


@dataclasses.dataclass
class Graph:
    """All reachable nodes, and where each of the A moves leads.

    It depends on the placement only through which moves touch which cubes.
    """

    settings: TaskSettings
    cubes: Tensor  # (P, C, 3) float64; placements, metres
    nodes: Nodes  # the first P are the start nodes, in the order of the placements
    target: Tensor  # (K, A) int64; node that a move leads to; -1 where the episode ends
    reason: Tensor  # (K, A) int64; `CubesEnd`; never the step limit
    collected: Tensor  # (K, A) int64; cubes collected after the move, as in `Nodes`

    def states(self) -> ObjectState:
        """Return the nodes as states that can be rendered."""
        return _states(self.settings, self.cubes, self.nodes)

    def images(self) -> tuple[Tensor, Tensor]:
        """Return one node per distinct image, (U,), and the image of each node, (K,)."""
        standing = dataclasses.replace(self.nodes, collected=_as_bits(self.states().present))
        keys, image = _keys(shape_of(self.settings), standing).unique(return_inverse=True)
        node = torch.empty_like(keys)
        node[image] = torch.arange(len(image))  # whichever node is written last is one of them
        return node, image


def explore(settings: TaskSettings, cubes: Tensor) -> Graph:
    """Follow every move from the start until no node is new; see `shape_of` for errors.

    The placements of the cubes are in metres, world frame. Shape: (P, C, 3), float64.
    """
    shape, count = shape_of(settings), len(cubes)
    number = torch.full((count * math.prod(shape),), -1)
    zeros = torch.zeros(count, dtype=torch.int64)
    frontier = Nodes(torch.arange(count), zeros, zeros, zeros)
    parts, num_nodes = [], 0
    while len(frontier):
        number[_keys(shape, frontier)] = torch.arange(num_nodes, num_nodes + len(frontier))
        num_nodes += len(frontier)
        moved, reason = _follow(settings, cubes, frontier)
        goes_on = reason == CubesEnd.RUNNING
        keys = torch.where(goes_on.flatten(), _keys(shape, moved), -1).view(reason.shape)
        parts.append((frontier, keys, reason, moved.collected.view(reason.shape)))
        new = keys[goes_on].unique()
        frontier = Nodes(*torch.unravel_index(new[number[new] < 0], (count, *shape)))
        frontier.aside -= shape[1] // 2
    nodes, keys, reason, collected = zip(*parts, strict=True)
    key = torch.cat(keys)
    return Graph(
        settings,
        cubes,
        Nodes.joined(nodes),
        target=torch.where(key < 0, -1, number[key]),
        reason=torch.cat(reason),
        collected=torch.cat(collected),
    )


def _follow(settings: TaskSettings, cubes: Tensor, nodes: Nodes) -> tuple[Nodes, Tensor]:
    """Return the nodes after each move (K * A), and the `CubesEnd` of each move (K, A)."""
    moves = MOVES.speeds_of(torch.arange(len(MOVES)))[:, :3].long()
    each = torch.arange(len(nodes)).repeat_interleave(len(moves))
    before = nodes[each]
    ahead, aside, _ = (moves.repeat(len(nodes), 1)).unbind(-1)
    moved = dataclasses.replace(before, ahead=before.ahead + ahead, aside=before.aside + aside)
    body = BodyState.at_rest(_positions(settings, moved))
    after, _ = CollectCubes(settings).step(_states(settings, cubes, before), body)
    moved.collected = _as_bits(after.reached)
    return moved, after.end_reason.view(len(nodes), len(moves))


def _states(settings: TaskSettings, cubes: Tensor, nodes: Nodes) -> ObjectState:
    """Convert nodes to states; steps are -1, so that the step limit is never met."""
    body = BodyState.at_rest(_positions(settings, nodes))
    state = CollectCubes(settings).start(cubes[nodes.placement], body)
    bit = torch.arange(cubes.shape[1])
    state.reached = (nodes.collected[:, None] >> bit & 1).bool()
    state.present = ~state.reached & (state.drone[:, None, 0] <= state.places[..., 0])
    state.steps = state.steps - 1
    return state


def shape_of(settings: TaskSettings) -> Shape:
    """Return the numbers of possible nodes; raise InputError if there are too many."""
    ahead = math.ceil(settings.front_bound / settings.step_length) + 2
    aside = 2 * (math.ceil(settings.side_bound / settings.step_length) + 1) + 1
    shape = ahead, aside, 2**settings.num_cubes
    if math.prod(shape) > MAX_NODES:
        raise InputError(
            f"num_cubes={settings.num_cubes} and step_length={settings.step_length} give "
            f"{math.prod(shape):.2g} nodes per placement, more than {MAX_NODES:.2g}; give fewer "
            "cubes or longer steps"
        )
    return shape


def _positions(settings: TaskSettings, nodes: Nodes) -> Tensor:
    """Return positions, metres, rounded like the simulator's repeated addition. Shape: (K, 3).

    They equal the simulator's to the last bit, but for y: where steps are no sums of powers of two,
    it depends on the path by about 1e-15.
    """
    farthest = max(int(nodes.ahead.max()), int(nodes.aside.abs().max()))
    steps = np.full(farthest + 1, settings.step_length)
    steps[0] = 0.0
    metres = torch.from_numpy(np.add.accumulate(steps))
    y = metres[nodes.aside.abs()] * nodes.aside.sign()
    return torch.stack([metres[nodes.ahead], y, torch.full_like(y, settings.altitude)], -1)


def _as_bits(flags: Tensor) -> Tensor:
    """Pack flags into integers. Shapes: (K, C) to (K,)."""
    return (flags.long() << torch.arange(flags.shape[1])).sum(-1)


def _keys(shape: Shape, nodes: Nodes) -> Tensor:
    """Return a unique number for each node. Shape: (K,)."""
    num_ahead, num_aside, num_sets = shape
    row = nodes.placement * num_ahead + nodes.ahead
    return (row * num_aside + nodes.aside + num_aside // 2) * num_sets + nodes.collected
