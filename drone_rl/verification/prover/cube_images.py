"""The picture of a cube in closed form: which face each pixel shows, and where that changes.

The camera looks ahead, level and at the height of the cubes' centres. Of a cube whose centre stands
D metres ahead and Y metres to the left of the camera, a pixel whose ray goes a metres to the left
and b metres up for each metre ahead shows

- the front, where |Y - a T| <= h, with h half the cube's edge and T = D - h the distance of its
  front, if that is ahead and the ray is not above or below it, |b| T <= h;
- a side, where Y is farther out than that, up to a U + h, with U = min(D + h, h / |b|);
- what stands behind, elsewhere.

So for a fixed D a picture changes only where Y is a T - h, a T + h or a U + h of some pixel.
"""

import dataclasses
from typing import cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.sim.entities import FRONT_CENTER
from drone_rl.sim.tasks.collect_cubes import WorldState
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.lattice import Lattice

NOTHING, FRONT, LEFT_SIDE, RIGHT_SIDE = range(4)
"""What a pixel shows of a cube: its side is seen where the cube stands to that side."""
UNIT = 2.0**-24
"""Largest relative error of an operation in float32."""


@dataclasses.dataclass(frozen=True)
class Eye:
    """The policy's camera among cubes of one size."""

    left: NDArray[np.float64]
    """Of each column's rays: metres to the left for each ahead. Shape: (width,)."""
    up: NDArray[np.float64]
    """Of each row's rays: metres up for each ahead. Shape: (height,)."""
    half: float
    """Half the edge of a cube, metres."""
    farthest: float
    """No x is larger, metres."""
    widest: float
    """No |y| is larger, metres."""
    bound: float
    """No cube's |y| is larger, metres."""

    @classmethod
    def of(cls, task: TaskSettings, camera: CameraSettings) -> "Eye":
        """The eye of a policy."""
        wide = np.tan(np.radians(camera.horizontal_fov) / 2)
        high = wide * camera.height / camera.width
        return cls(
            left=-_middles(camera.width) * wide,
            up=-_middles(camera.height) * high,
            half=task.cube_size / 2,
            farthest=task.front_bound + task.step_length,
            widest=task.side_bound + task.step_length,
            bound=task.lateral_bound,
        )

    def borders(self, ahead: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Where the picture of a cube changes as it stands farther to the left.

        Args:
            ahead: Metres from the camera to the cube's centre.

        Returns:
            Metres to the left of the camera, in ascending order, and how far to either side of each
            a renderer that computes in float32 may already, or still, show the other picture. Its
            error, in units of 2^-24, is at most 16 for each metre of a ray's way to the left (the
            slopes are good to 10, a division, a product and a sum add 4), 3 times the ray's slope
            for each metre of x (which the places, the camera's and their difference are rounded
            to) and 3 for each metre of y.
        """
        front, back = self._depths(ahead)
        shown = back >= front
        if not shown.any():
            return np.empty(0), np.empty(0)
        slopes = np.unique(np.abs(self.left))
        ways = [slopes * front + self.half]
        if ahead > self.half:
            ways.append(slopes * front - self.half)
        ways += [slopes * depth + self.half for depth in np.unique(back[shown])]
        slope, way = np.tile(slopes, len(ways)), np.concatenate(ways)
        error = 16 * (np.abs(way) + self.half) + 3 * slope * self.farthest + 3 * self.widest
        both, errors = np.concatenate([way, -way]), np.concatenate([error, error]) * UNIT
        order = np.argsort(both)
        return both[order], errors[order]

    def faces(
        self, ahead: float | NDArray[np.float64], left: NDArray[np.float64]
    ) -> NDArray[np.uint8]:
        """What each pixel shows of a cube.

        Args:
            ahead: Metres from the camera to the cube's centre; one for all, or of shape (N,).
            left: The same to the left. Shape: (N,).

        Returns:
            NOTHING, FRONT, LEFT_SIDE or RIGHT_SIDE. Shape: (N, height, width).
        """
        ahead = np.reshape(ahead, (-1, 1))
        front, back = self._depths(ahead)
        slope = np.abs(self.left)
        out = np.where(self.left < 0, -1.0, 1.0) * left[:, None]
        is_front = (np.abs(out - slope * front) <= self.half) & (ahead > self.half)
        is_beyond = out > slope * front + self.half
        ends = slope * back[..., None] + self.half
        side = np.where(self.left < 0, RIGHT_SIDE, LEFT_SIDE).astype(np.uint8)
        faces = np.where(is_beyond[:, None] & (out[:, None] <= ends), side, np.uint8(NOTHING))
        faces[np.broadcast_to(is_front[:, None], faces.shape)] = FRONT
        faces[np.broadcast_to(back < front, faces.shape[:2])] = NOTHING
        return faces

    def rounding(self, left: NDArray[np.float64]) -> NDArray[np.float64]:
        """By how much float32 may move a cube that stands so far to the left of the camera.

        Its y is rounded, which is at most `bound`, and so is the difference from the camera's; a
        metre more covers errors of this sum itself. Where a drone is, is no matter of rounding.
        """
        return UNIT * (self.bound + np.abs(left) + 1)

    def grazed(self, ahead: float) -> NDArray[np.bool_]:
        """Rows that end within rounding errors of a cube's upper or lower front edge.

        Whether they show it can't be told. Shape: (height,).
        """
        front, back = self._depths(ahead)
        return np.abs(back - front) <= 32 * UNIT * self.farthest

    def _depths(
        self, ahead: float | NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Metres ahead of the camera where rays reach a cube's front, and leave it, by row.

        Shapes: that of `ahead`, which is one number or (N, 1); and (height,) or (N, height).
        """
        with np.errstate(divide="ignore"):
            above = self.half / np.abs(self.up)
        return np.maximum(ahead - self.half, 0.0), np.minimum(ahead + self.half, above)


def camera_ahead() -> float:
    """Metres from the drone's centre to its policy's camera."""
    return FRONT_CENTER.pos[0]


def _middles(count: int) -> NDArray[np.float64]:
    return (np.arange(count) + 0.5) / count * 2 - 1


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
