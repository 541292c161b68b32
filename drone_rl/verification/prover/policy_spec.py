"""What can be proved, and of which policy: everything that is refused is refused here."""

import contextlib
import dataclasses
import math
from collections.abc import Iterator

import numpy as np
import torch

from drone_rl.config import TaskSettings
from drone_rl.envs import on_pixels
from drone_rl.policies import PolicyNetwork
from drone_rl.policies.zoo import PolicyDescription
from drone_rl.sim.actions import MOVES
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.bounds import Bounds, Painter
from drone_rl.verification.prover.boxes import Boxes, whole
from drone_rl.verification.prover.cells import Cells
from drone_rl.verification.prover.cube_images import FRONT, Eye, Seeing, camera_ahead
from drone_rl.verification.prover.lattice import Lattice
from drone_rl.verification.requirements import require_cubes, require_moves

_SHADES = ("gray", "standardize")
"""Transforms of each pixel alone, by which a brighter pixel stays brighter."""
_MONOTONE = (*_SHADES, "crop", "resize", "blur")
"""Transforms by which brighter pixels make nothing darker."""
_BLIND = ("step_count", "episode_reward")
"""Transforms that leave pictures alone."""


@dataclasses.dataclass(frozen=True)
class Subject:
    """A policy in a task, in the parts that proofs are made of."""

    lattice: Lattice
    eye: Eye
    bounds: Bounds
    painter: Painter
    seeing: Seeing
    worlds: Worlds

    def cells(self, cube: int, steps: int, lowest: float, highest: float) -> Cells:
        """The cells of one cube, for a drone that has gone so many steps ahead.

        Args:
            cube: Its number.
            steps: Of the drone.
            lowest: Where the first cell begins, metres to the left of the drone.
            highest: Where the last one ends.

        Raises:
            InputError: See `Cells`.
        """
        ahead = self.lattice.cubes[cube] - steps * self.lattice.task.step_length - camera_ahead()
        return Cells(self.eye, ahead, lowest, highest, self.seeing.of(cube, steps))

    def close(self) -> None:
        """Ends the worlds that draw."""
        self.worlds.close()


def make_subject(
    description: PolicyDescription,
    network: PolicyNetwork,
    gap: float,
    renderer: str = "raytrace",
) -> Subject:
    """Takes a policy apart.

    Args:
        description: Of the policy, with the task that is to be proved.
        network: Its own, on the CPU.
        gap: See `Bounds`.
        renderer: Who draws, see `drone_rl.sim.rendering.find_renderer`.

    Raises:
        InputError: Nothing can be proved of it; the message says why.
    """
    task = require_cubes(description.task, "what is proved")
    check_task(task)
    require_moves(description.dynamics, description.actions, "what is proved")
    if not description.appearance.is_minimal:
        raise InputError(
            "the policy sees worlds of another appearance than minimal, whose pictures have no "
            "closed form; prove one that was trained with appearance=minimal"
        )
    if network.actions is not MOVES:
        raise InputError(f"the policy does not choose among {', '.join(MOVES.names)}; prove one")
    lattice, eye = Lattice(task), Eye.of(task, description.camera)
    bounds = Bounds(network.eval(), gap)
    worlds = Worlds(64, task, description.camera, renderer=renderer)
    seeing = Seeing(worlds, lattice, eye)
    return Subject(lattice, eye, bounds, make_painter(description, seeing), seeing, worlds)


def check_task(task: TaskSettings) -> None:
    """Refuses worlds whose pictures have no closed form.

    Raises:
        InputError: The first reason.
    """
    if task.vertical_bound:
        raise InputError(
            f"task.vertical_bound={task.vertical_bound} spreads cubes in height, for which no "
            "proof is known; give 0"
        )
    if task.spacing <= task.cube_size:
        raise InputError(
            f"task.spacing={task.spacing} puts cubes beside each other, so that neither always "
            f"covers the other; give more than {task.cube_size} (cube_size)"
        )
    if task.lateral_bound <= 0:
        raise InputError("task.lateral_bound=0 leaves a single placement; simply fly it")


def make_painter(description: PolicyDescription, seeing: Seeing) -> Painter:
    """What the policy's transforms make of what its camera shows.

    Raises:
        InputError: A transform remembers, goes wrong, or makes something darker of brighter pixels.
    """
    chosen = [choice for choice in description.transforms if choice.name not in _BLIND]
    names = [choice.name for choice in chosen]
    if "stack" in names:
        raise InputError(
            "the policy sees a stack of frames, so what it does depends on the past; prove one "
            "without memory"
        )
    if description.faults:
        raise InputError(
            f"the policy's camera goes wrong (transform {description.faults[0]}), so what it does "
            "depends on chance or the past; prove one without"
        )
    if strange := [name for name in names if name not in _MONOTONE]:
        raise InputError(
            f"the transform {strange[0]} may make pixels darker that were brighter; prove a policy "
            f"with no transforms but {', '.join(_MONOTONE)}"
        )
    if names[:1] != ["gray"]:
        raise InputError("the policy does not see in gray; prove one whose first transform is gray")
    count = next((i for i, n in enumerate(names) if n not in _SHADES), len(names))
    made = [choice.make() for choice in chosen]
    shade, rest = on_pixels(made[:count]), on_pixels(made[count:])
    background = shade(seeing.background[None])[0, 0]
    faces = shade(seeing.colors[None, None, FRONT:])[0, 0, 0]
    return Painter(background, faces, rest if made[count:] else None)


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """Has torch compute in one thread, as long as this lasts."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


PICTURES = 3
"""About so many pictures there are for each border: beside it, and within its band."""
MOST_PARTS = 1_000
"""A task of more would take days."""


def pictures_of_each(subject: Subject) -> list[int]:
    """About how many pictures each cube has alone where together they have the most."""
    lattice, found = subject.lattice, []
    for steps in range(lattice.last):
        away = lattice.cubes - steps * lattice.task.step_length
        found.append([_count(subject, ahead) if ahead >= 0 else 1 for ahead in away])
    return max(found, key=math.prod)


def _count(subject: Subject, away: float) -> int:
    """About how many pictures a cube has within the placements, metres ahead of the drone."""
    places, _ = subject.eye.borders(away - camera_ahead())
    return 1 + PICTURES * int((np.abs(places) <= subject.lattice.task.lateral_bound).sum())


def in_parts(subject: Subject, most: int) -> Boxes:
    """Cuts all placements.

    Args:
        subject: Policy and task.
        most: Combinations of pictures of a part, about.

    Returns:
        Disjoint boxes that are all placements. Shape: (N, num_cubes, 2).

    Raises:
        InputError: There are too many.
    """
    counts = pictures_of_each(subject)
    strips, total = [1] * len(counts), math.prod(counts)
    for cube in reversed(range(len(counts))):
        left = math.prod(n / s for n, s in zip(counts, strips, strict=True))
        strips[cube] = min(counts[cube], max(1, math.ceil(left / most)))
    if math.prod(strips) > MOST_PARTS:
        raise InputError(
            f"task.num_cubes={len(counts)} gives about {total:.0e} combinations of pictures, in "
            f"{math.prod(strips):,} parts, which would take days; give fewer cubes, a smaller "
            "task.lateral_bound, or a policy whose camera has fewer pixels"
        )
    boxes = whole(subject.lattice.task.lateral_bound, len(counts))
    for cube, count in enumerate(strips):
        low, high = boxes[0, cube, 0], boxes[-1, cube, 1]
        ends = np.linspace(low, high, count + 1)
        boxes = np.repeat(boxes, count, 0)
        boxes[:, cube, 0] = np.tile(ends[:-1], len(boxes) // count)
        boxes[:, cube, 1] = np.tile(ends[1:], len(boxes) // count)
    return boxes
