"""What the policy's camera shows of cubes, by the renderer in use and by the closed form.

The colours of faces, floor and sky are taken from the renderer; that nothing else is ever seen is
checked on pictures of its own, byte for byte.
"""

import dataclasses
from typing import cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.sim.tasks.collect_cubes import WorldState
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.lattice import Lattice
from drone_rl.verification.prover.silhouettes import (
    FRONT,
    LEFT_SIDE,
    NOTHING,
    RIGHT_SIDE,
    Eye,
    camera_ahead,
)

ANYTHING = 255
"""No face."""


class Seeing:
    """The pictures of cubes that stand in given places, drawn and worked out."""

    def __init__(self, worlds: Worlds, lattice: Lattice, eye: Eye) -> None:
        """Takes the colours from the renderer.

        Args:
            worlds: Of the task, with the policy's camera.
            lattice: The task's.
            eye: The camera's.

        Raises:
            InputError: A face, or what is behind it, is not of one even colour.
        """
        self._worlds, self._lattice, self._eye = worlds, lattice, eye
        task = lattice.task
        nowhere = np.zeros((1, task.num_cubes))
        self.background = self._draw(nowhere, np.zeros((1, 2)), nowhere == 0)[0]
        self.colors = torch.zeros(4, 3, dtype=torch.uint8)
        near = task.first_distance - camera_ahead() - 2 * task.cube_size
        steps = max(0, int(near / task.step_length))
        left = np.array([0.0, 2 * task.cube_size, -2 * task.cube_size])
        pictures = self._draw(
            np.broadcast_to(left[:, None], (3, task.num_cubes)).copy(),
            np.array([[steps, 0]] * 3),
            np.arange(task.num_cubes) != 0,
        )
        ahead = self._lattice.cubes[0] - steps * task.step_length - camera_ahead()
        faces = eye.faces(ahead, left)
        for face in (FRONT, LEFT_SIDE, RIGHT_SIDE):
            shown = pictures[torch.from_numpy(faces == face)]
            if not len(shown) or (shown != shown[0]).any():
                raise InputError(
                    "the faces of the cubes are not of one colour each, so that their pictures "
                    "have no closed form; prove the policy in a world without textures and shadows"
                )
            self.colors[face] = shown[0]
        behind = self.background.reshape(-1, 3).unique(dim=0)
        if len(torch.cat([behind, self.colors[FRONT:]]).unique(dim=0)) < len(behind) + 3:
            raise InputError(
                f"task.cube_color={task.cube_color} makes a face look like another one, the floor "
                "or the sky, so that none can be told from the other; give another colour"
            )

    def of(self, cube: int, steps: int) -> "OneCube":
        """What is seen of one cube by a drone that has gone so many steps ahead."""
        return OneCube(self, cube, steps)

    def read(self, pictures: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """From a renderer's pictures of one cube to what each pixel shows, as `Eye.faces` says it.

        Raises:
            InputError: A pixel shows something else.
        """
        faces = np.full(pictures.shape[:3], ANYTHING, np.uint8)
        packed = _packed(pictures)
        for face, color in enumerate(self.colors):
            shown = self.background if face == NOTHING else color
            faces[packed == _packed(shown.numpy())] = face
        if (faces == ANYTHING).any():
            raise InputError(
                "a pixel is of none of the colours of floor, sky and the cubes' faces, so nothing "
                "can be proved of it; prove the policy in the default world"
            )
        return faces

    def look(self, cube: int, steps: int, left: NDArray[np.float32]) -> NDArray[np.uint8]:
        """Pictures of one cube alone, by the renderer; see `OneCube.look`."""
        count, num_cubes = len(left), self._lattice.task.num_cubes
        cubes = np.zeros((count, num_cubes))
        cubes[:, cube] = left
        hidden = np.broadcast_to(np.arange(num_cubes) != cube, cubes.shape)
        return self._draw(cubes, np.array([[steps, 0]] * count), hidden).numpy()

    def draw(self, cubes: NDArray[np.float64], places: NDArray[np.int64]) -> Tensor:
        """Pictures by the renderer.

        Args:
            cubes: Metres to the left of the start. Shape: (N, num_cubes).
            places: Of the drone, steps ahead and to the left. Shape: (N, 2).

        Returns:
            RGB. Shape: (N, height, width, 3), uint8. Cubes that a drone there has touched or
            passed are not seen.
        """
        return self._draw(cubes, places, self._gone(cubes, places))

    def work_out(
        self, cubes: NDArray[np.float64], places: NDArray[np.int64]
    ) -> tuple[Tensor, NDArray[np.bool_]]:
        """The same pictures by the closed form.

        Returns:
            The pictures, and which of them are on no border, so that they must be the renderer's.
        """
        count = len(cubes)
        shown = np.full((count, *self.background.shape[:2]), NOTHING, np.uint8)
        is_clear = np.ones(count, bool)
        gone = self._gone(cubes, places)
        for k in reversed(range(cubes.shape[1])):
            ahead = self._lattice.cubes[k] - places[:, 0] * self._lattice.task.step_length
            left = cubes[:, k] - places[:, 1] * self._lattice.task.step_length
            for distance in np.unique(ahead):
                those = np.flatnonzero((ahead == distance) & ~gone[:, k])
                if not len(those):
                    continue
                seen = distance - camera_ahead()
                faces = self._eye.faces(seen, left[those])
                shown[those] = np.where(faces == NOTHING, shown[those], faces)
                borders, errors = self._eye.borders(seen)
                if len(borders):
                    near = np.abs(left[those, None] - borders) <= errors
                    is_clear[those] &= ~near.any(-1)
                is_clear[those] &= not self._eye.grazed(seen).any()
        colored = self.colors.numpy()[shown]
        pictures = np.where((shown == NOTHING)[..., None], self.background.numpy(), colored)
        return torch.from_numpy(pictures), is_clear

    def check(self, count: int, random_state: np.random.RandomState) -> int:
        """Compares the two on random placements and places.

        Args:
            count: How many pictures.
            random_state: Draws them.

        Returns:
            How many were compared: those on no border.

        Raises:
            InputError: They differ.
        """
        task, compared = self._lattice.task, 0
        farthest = int(task.front_bound / task.step_length)
        widest = int((task.lateral_bound + 2 * task.touch_distance) / task.step_length)
        for begin in range(0, count, 2000):
            size = min(2000, count - begin)
            bound = task.lateral_bound
            cubes = random_state.uniform(-bound, bound, (size, task.num_cubes))
            ahead = random_state.randint(0, farthest + 1, size)
            left = random_state.randint(-widest, widest + 1, size)
            places = np.stack([ahead, left], -1)
            drawn, (made, is_clear) = self.draw(cubes, places), self.work_out(cubes, places)
            is_wrong = (drawn != made).flatten(1).any(-1).numpy() & is_clear
            compared += int(is_clear.sum())
            if is_wrong.any():
                worst = int(np.flatnonzero(is_wrong)[0])
                raise InputError(
                    f"the renderer's picture at {places[worst].tolist()} steps of cubes at "
                    f"y={cubes[worst].tolist()} is not the closed form's, so nothing can be proved "
                    "of it; prove the policy in the default world"
                )
        return compared

    def _gone(self, cubes: NDArray[np.float64], places: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Cubes that are out of sight. Shape: (N, num_cubes)."""
        task = self._lattice.task
        ahead = self._lattice.cubes - places[:, :1] * task.step_length
        left = cubes - places[:, 1:] * task.step_length
        return (ahead < 0) | (np.maximum(np.abs(ahead), np.abs(left)) <= task.touch_distance)

    def _draw(self, cubes: NDArray, places: NDArray, hidden: NDArray[np.bool_]) -> Tensor:
        """Draws all cubes but the hidden ones, wherever they stand."""
        task = self._lattice.task
        x = np.broadcast_to(self._lattice.cubes, cubes.shape)
        where = np.stack([x, cubes, np.full(cubes.shape, task.altitude)], -1)
        state = cast(WorldState, self._worlds.start(torch.from_numpy(where)))
        steps = torch.from_numpy(places[:, :2] * task.step_length)
        state.body.position[:, :2] = steps
        state.passed[:] = torch.from_numpy(hidden.copy())
        return self._worlds.render(state)


def _packed(colors: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """One number for each colour. Shape: (*, 3) to (*)."""
    red, green, blue = (colors[..., k].astype(np.uint32) for k in range(3))
    return (red | green << 8 | blue << 16).astype(np.uint32)


@dataclasses.dataclass(frozen=True)
class OneCube:
    """One cube at one distance, by the renderer."""

    seeing: Seeing
    cube: int
    steps: int

    def look(self, left: NDArray[np.float32]) -> NDArray[np.uint8]:
        """Its pictures, so many metres to the left of the camera.

        Args:
            left: Shape (N,).

        Returns:
            RGB. Shape: (N, height, width, 3).
        """
        return self.seeing.look(self.cube, self.steps, left)

    def read(self, pictures: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """What each pixel shows of it, see `Seeing.read`."""
        return self.seeing.read(pictures)
