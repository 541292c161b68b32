"""A policy and a task in the form that proofs need; partition of the placements of large tasks."""

import dataclasses
import math

import numpy as np

from drone_rl.config import TaskSettings
from drone_rl.envs import GrayPixels, Pipeline, StandardizePixels
from drone_rl.policies import ImageNetwork
from drone_rl.policies.zoo import PolicyDescription
from drone_rl.sim.actions import MOVES
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.bounds import Compositor, NetworkBounds
from drone_rl.verification.prover.boxes import Boxes, all_placements
from drone_rl.verification.prover.cells import Cells
from drone_rl.verification.prover.cube_images import (
    FRONT,
    CameraModel,
    CubeImages,
    CubeView,
    camera_ahead,
)
from drone_rl.verification.prover.lattice import Lattice
from drone_rl.verification.requirements import require_cubes

_MONOTONE = ("gray", "standardize", "crop", "resize", "blur")  # monotone transforms
_BLIND = ("step_count", "episode_reward")  # transforms that do not change images


@dataclasses.dataclass(frozen=True)
class PolicySpec:
    """The components of a proof: rules, camera, network bounds and images."""

    lattice: Lattice
    camera: CameraModel
    bounds: NetworkBounds
    compositor: Compositor
    images: CubeImages
    worlds: Worlds

    def cells(self, cube: int, steps: int, lowest: float, highest: float) -> Cells:
        """Return the intervals of a cube's lateral position over which its image is constant.

        `lowest` and `highest` are metres to the left of the drone, which has flown `steps` steps.
        """
        ahead = self.lattice.cubes[cube] - steps * self.lattice.task.step_length - camera_ahead()
        return Cells(self.camera, ahead, lowest, highest, CubeView(self.images, cube, steps))

    def close(self) -> None:
        """Close the environments that render."""
        self.worlds.close()


def make_policy_spec(
    description: PolicyDescription,
    network: ImageNetwork,
    gap: float,
    renderer: str = "raytrace",
) -> PolicySpec:
    """Build the components of a proof from a policy description, whose task is proved.

    The network must be on the CPU; for the gap see `NetworkBounds`.

    Raises:
        InputError: The policy or task is not supported; the message says why.
    """
    task = require_cubes(description, "proofs")
    check_task(task)
    if not description.appearance.is_minimal:
        raise InputError(
            "proofs support only appearance=minimal, whose images have a closed form; prove a "
            "policy trained with it"
        )
    if network.actions is not MOVES:
        raise InputError(
            f"proofs support only the actions {', '.join(MOVES.names)}; prove a policy with them"
        )
    lattice, camera = Lattice(task), CameraModel.of(task, description.camera)
    bounds = NetworkBounds(network.eval(), gap)
    worlds = Worlds(64, task, description.camera, renderer=renderer)
    try:
        images = CubeImages(worlds, lattice, camera)
        compositor = make_compositor(description, images)
    except InputError:
        worlds.close()
        raise
    return PolicySpec(lattice, camera, bounds, compositor, images, worlds)


def check_task(task: TaskSettings) -> None:
    """Raise InputError if the task's images have no closed form, or there is one placement only."""
    if task.vertical_bound:
        raise InputError(f"task.vertical_bound={task.vertical_bound} is not supported; give 0")
    if task.spacing <= task.cube_size:
        raise InputError(
            f"task.spacing={task.spacing} puts cubes next to each other, so neither always "
            f"occludes the other; give more than {task.cube_size} (cube_size)"
        )
    if task.lateral_bound <= 0:
        raise InputError(
            "task.lateral_bound=0 leaves a single placement; evaluate the policy instead"
        )


def make_compositor(description: PolicyDescription, images: CubeImages) -> Compositor:
    """Return the colors after pixelwise transforms, and the other transforms.

    Raises:
        InputError: The first transform is not gray, or one is not supported.
    """
    chosen = [choice for choice in description.transforms if choice.name not in _BLIND]
    names = [choice.name for choice in chosen]
    if names[:1] != ["gray"]:
        raise InputError("the policy observes colors; prove one whose first transform is gray")
    if strange := [name for name in names if name not in _MONOTONE]:
        raise InputError(
            f"proofs do not support the transform {strange[0]}; prove a policy whose only "
            f"transforms are {', '.join(_MONOTONE)}"
        )
    made = [choice.make() for choice in chosen]
    shades = (GrayPixels, StandardizePixels)
    count = next((i for i, t in enumerate(made) if not isinstance(t, shades)), len(made))
    shade, rest = Pipeline(made[:count]), Pipeline(made[count:])
    background = shade(images.background[None])[0, 0]
    faces = shade(images.colors[None, None, FRONT:])[0, 0, 0]
    return Compositor(background, faces, rest)


IMAGES_PER_BORDER = 3  # approximate number: the one beyond it, and two within its rounding band
MAX_PARTS = 1_000  # a task with more would take days


def images_per_cube(spec: PolicySpec) -> list[int]:
    """Return the approximate numbers of images of the cubes, at the step of the largest product."""
    lattice, per_step = spec.lattice, []
    for steps in range(lattice.last):
        counts = []
        for ahead in lattice.cubes - steps * lattice.task.step_length:
            borders = spec.camera.borders(ahead - camera_ahead())[0] if ahead >= 0 else np.empty(0)
            inside = np.abs(borders) <= lattice.task.lateral_bound
            counts.append(1 + IMAGES_PER_BORDER * int(inside.sum()))
        per_step.append(counts)
    return max(per_step, key=math.prod)


def partition_placements(spec: PolicySpec, most: int) -> Boxes:
    """Cut all placements into parts. Shape: (N, num_cubes, 2).

    A part has about `most` combinations of cube images. Each cube multiplies their number by a few
    hundred, so the placements of the furthest cubes are cut into strips.

    Raises:
        InputError: There are too many parts.
    """
    counts = images_per_cube(spec)
    strips, total = [1] * len(counts), math.prod(counts)
    for cube in reversed(range(len(counts))):
        remaining = math.prod(n / s for n, s in zip(counts, strips, strict=True))
        strips[cube] = min(counts[cube], max(1, math.ceil(remaining / most)))
    if math.prod(strips) > MAX_PARTS:
        raise InputError(
            f"task.num_cubes={len(counts)} gives about {total:.0e} combinations of images in "
            f"{math.prod(strips):,} parts, which takes days; give fewer cubes, a smaller "
            "task.lateral_bound, or a policy whose camera has fewer pixels"
        )
    boxes = all_placements(spec.lattice.task.lateral_bound, len(counts))
    for cube, count in enumerate(strips):
        low, high = boxes[0, cube, 0], boxes[-1, cube, 1]
        ends = np.linspace(low, high, count + 1)
        boxes = np.repeat(boxes, count, 0)
        boxes[:, cube, 0] = np.tile(ends[:-1], len(boxes) // count)
        boxes[:, cube, 1] = np.tile(ends[1:], len(boxes) // count)
    return boxes
