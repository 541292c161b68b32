"""Images of cubes: in closed form, and by the renderer.

The camera is level and at the height of the cubes' centres. Let a cube's centre be D metres ahead
of the camera and Y metres to the left, h half its edge, and T = D - h the distance of its front. A
pixel whose ray goes a metres left and b metres up per metre ahead shows

- the front, where |Y - a T| <= h, if the front is ahead and |b| T <= h;
- a side, where Y is further out than that, up to a U + h, with U = min(D + h, h / |b|);
- the background elsewhere.

So at a fixed D the image changes only where Y is a T - h, a T + h or a U + h for some pixel. The
colors of faces, floor and sky come from the renderer; `CubeImages.check` compares the closed form
with its images byte for byte.
"""

import dataclasses
from typing import cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.sim.entities import FRONT_CENTER
from drone_rl.sim.tasks.objects import ObjectState
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.lattice import Lattice

NOTHING, FRONT, LEFT_SIDE, RIGHT_SIDE = range(4)  # sides are seen of cubes that stand there
UNIT = 2.0**-24  # largest relative error of a float32 operation


@dataclasses.dataclass(frozen=True)
class CameraModel:
    """The policy's camera among cubes of one size."""

    left: NDArray[np.float64]  # slope of each column's rays, metres left per metre ahead. (width,)
    up: NDArray[np.float64]  # slope of each row's rays, metres up per metre ahead. (height,)
    half: float  # half the edge of a cube, metres
    farthest: float  # bound on every x, metres
    widest: float  # bound on every |y|, metres
    bound: float  # bound on the cubes' |y|, metres

    @classmethod
    def of(cls, task: TaskSettings, camera: CameraSettings) -> "CameraModel":
        """Build the model of a policy's camera."""
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
        """Return the lateral positions, ascending, at which a cube's image changes, metres.

        Also returns how far to either side of each a float32 renderer may show the other image. Its
        error, in units of 2^-24, is at most 16 per metre of a ray's lateral offset (slopes are good
        to 10; a division, a product and a sum add 4), 3 times the slope per metre of x (rounding of
        both positions and their difference), and 3 per metre of y.
        """
        front, back = self._depths(ahead)
        shown = back >= front
        if not shown.any():
            return np.empty(0), np.empty(0)
        slopes = np.unique(np.abs(self.left))
        places = [slopes * front + self.half]
        if ahead > self.half:
            places.append(slopes * front - self.half)
        places += [slopes * depth + self.half for depth in np.unique(back[shown])]
        slope, place = np.tile(slopes, len(places)), np.concatenate(places)
        error = 16 * (np.abs(place) + self.half) + 3 * slope * self.farthest + 3 * self.widest
        both, errors = np.concatenate([place, -place]), np.concatenate([error, error]) * UNIT
        order = np.argsort(both)
        return both[order], errors[order]

    def faces(
        self, ahead: float | NDArray[np.float64], left: NDArray[np.float64]
    ) -> NDArray[np.uint8]:
        """Compute what each pixel shows of a cube, such as `FRONT`. Shape: (N, height, width).

        The cube's centre is `ahead` metres from the camera, one for all or (N,), and `left` (N,).
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
        """Return how far float32 may move a cube that stands so far to the left of the camera.

        Its y and its difference from the camera's, which is exact, are rounded; one metre more
        covers the error of this sum.
        """
        return UNIT * (self.bound + np.abs(left) + 1)

    def grazed(self, ahead: float) -> NDArray[np.bool_]:
        """Return which rows end within rounding error of a front edge. Shape: (height,)."""
        front, back = self._depths(ahead)
        return np.abs(back - front) <= 32 * UNIT * self.farthest

    def _depths(
        self, ahead: float | NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the distances where each row's rays meet a cube's front, and leave the cube."""
        with np.errstate(divide="ignore"):
            above = self.half / np.abs(self.up)
        return np.maximum(ahead - self.half, 0.0), np.minimum(ahead + self.half, above)


def camera_ahead() -> float:
    """Return the metres from the drone's centre to the camera."""
    return FRONT_CENTER.pos[0]


def _middles(count: int) -> NDArray[np.float64]:
    return (np.arange(count) + 0.5) / count * 2 - 1


ANYTHING = 255  # no face


class CubeImages:
    """Images of cubes at given positions, rendered and in closed form."""

    def __init__(self, worlds: Worlds, lattice: Lattice, camera: CameraModel) -> None:
        """Read the colors of the faces; raise InputError if one is not visible."""
        self._worlds, self.lattice, self.camera = worlds, lattice, camera
        task = lattice.task
        self.num_cubes = task.num_cubes
        nowhere = np.zeros((1, task.num_cubes))
        self.background = self.render(nowhere, np.zeros((1, 2)), nowhere == 0)[0]
        self.colors = torch.zeros(4, 3, dtype=torch.uint8)
        near = task.first_distance - camera_ahead() - 2 * task.cube_size
        steps = max(0, int(near / task.step_length))
        left = np.array([0.0, 2 * task.cube_size, -2 * task.cube_size])
        images = self.render(
            np.broadcast_to(left[:, None], (3, task.num_cubes)).copy(),
            np.array([[steps, 0]] * 3),
            np.arange(task.num_cubes) != 0,
        )
        ahead = self.lattice.cubes[0] - steps * task.step_length - camera_ahead()
        faces = camera.faces(ahead, left)
        for face in (FRONT, LEFT_SIDE, RIGHT_SIDE):
            shown = images[torch.from_numpy(faces == face)]
            if not len(shown):
                raise InputError(
                    f"the camera does not show all faces of cubes {ahead:g} m ahead and up to "
                    f"{left[1]:g} m to the side, so their colors are unknown; prove a policy with "
                    "a larger camera.horizontal_fov"
                )
            self.colors[face] = shown[0]

    def read(self, images: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Convert images of one cube to faces; raise InputError if a pixel shows something else."""
        faces = np.full(images.shape[:3], ANYTHING, np.uint8)
        packed = _packed(images)
        for face, color in enumerate(self.colors):
            shown = self.background if face == NOTHING else color
            faces[packed == _packed(shown.numpy())] = face
        if (faces == ANYTHING).any():
            raise InputError(
                "a pixel has none of the colors of floor, sky and the cubes' faces, so nothing "
                "can be proved; prove the policy in the default environment"
            )
        return faces

    def render(
        self, cubes: NDArray, places: NDArray, hidden: NDArray[np.bool_] | None = None
    ) -> Tensor:
        """Render RGB images. Shape: (N, height, width, 3), uint8.

        The cubes stand so many metres to the left of the start (N, num_cubes), the drone so many
        steps ahead and to the left (N, 2). Hidden cubes are left out, by default those that the
        drone has touched or passed.
        """
        task = self.lattice.task
        hidden = self._gone(cubes, places) if hidden is None else hidden
        x = np.broadcast_to(self.lattice.cubes, cubes.shape)
        where = np.stack([x, cubes, np.full(cubes.shape, task.altitude)], -1)
        state = cast(ObjectState, self._worlds.start(torch.from_numpy(where)))
        state.body.position[:, :2] = torch.from_numpy(places[:, :2] * task.step_length)
        state.present[:] = torch.from_numpy(~hidden)
        return self._worlds.render(state)

    def closed_form(
        self, cubes: NDArray[np.float64], places: NDArray[np.int64]
    ) -> tuple[Tensor, NDArray[np.bool_]]:
        """Compute the same images in closed form, and which of them are on no border."""
        count = len(cubes)
        shown = np.full((count, *self.background.shape[:2]), NOTHING, np.uint8)
        is_clear = np.ones(count, bool)
        gone = self._gone(cubes, places)
        for k in reversed(range(cubes.shape[1])):
            ahead = self.lattice.cubes[k] - places[:, 0] * self.lattice.task.step_length
            left = cubes[:, k] - places[:, 1] * self.lattice.task.step_length
            for distance in np.unique(ahead):
                those = np.flatnonzero((ahead == distance) & ~gone[:, k])
                if not len(those):
                    continue
                seen = distance - camera_ahead()
                faces = self.camera.faces(seen, left[those])
                shown[those] = np.where(faces == NOTHING, shown[those], faces)
                borders, errors = self.camera.borders(seen)
                if len(borders):
                    near = np.abs(left[those, None] - borders) <= errors
                    is_clear[those] &= ~near.any(-1)
                is_clear[those] &= not self.camera.grazed(seen).any()
        return self.paint(shown), is_clear

    def paint(self, faces: NDArray[np.uint8]) -> Tensor:
        """Return RGB images (N, height, width, 3), uint8, of the face that each pixel shows."""
        shown = torch.from_numpy(faces).long()
        return torch.where((shown == NOTHING)[..., None], self.background, self.colors[shown])

    def check(self, count: int, random_state: np.random.RandomState) -> int:
        """Compare random images with the closed form; return how many were on no border.

        Raises:
            InputError: They differ.
        """
        task, compared = self.lattice.task, 0
        farthest = int(task.front_bound / task.step_length)
        widest = int((task.lateral_bound + 2 * task.touch_distance) / task.step_length)
        for begin in range(0, count, 2000):
            size = min(2000, count - begin)
            bound = task.lateral_bound
            cubes = random_state.uniform(-bound, bound, (size, task.num_cubes))
            ahead = random_state.randint(0, farthest + 1, size)
            left = random_state.randint(-widest, widest + 1, size)
            places = np.stack([ahead, left], -1)
            rendered = self.render(cubes, places)
            expected, is_clear = self.closed_form(cubes, places)
            is_wrong = (rendered != expected).flatten(1).any(-1).numpy() & is_clear
            compared += int(is_clear.sum())
            if is_wrong.any():
                worst = int(np.flatnonzero(is_wrong)[0])
                raise InputError(
                    f"the renderer's image at {places[worst].tolist()} steps of cubes at "
                    f"y={cubes[worst].tolist()} differs from the closed form, so nothing can be "
                    "proved; prove the policy in the default environment"
                )
        return compared

    def _gone(self, cubes: NDArray[np.float64], places: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return which cubes the drone has touched or passed. Shape: (N, num_cubes)."""
        task = self.lattice.task
        ahead = self.lattice.cubes - places[:, :1] * task.step_length
        left = cubes - places[:, 1:] * task.step_length
        return (ahead < 0) | (np.maximum(np.abs(ahead), np.abs(left)) <= task.touch_distance)


def _packed(colors: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """Pack each color into one number. Shape: (*, 3) to (*)."""
    red, green, blue = (colors[..., k].astype(np.uint32) for k in range(3))
    return (red | green << 8 | blue << 16).astype(np.uint32)


@dataclasses.dataclass(frozen=True)
class CubeView:
    """The renderer's images of one cube at one distance."""

    images: CubeImages
    cube: int
    steps: int

    def render(self, left: NDArray[np.float32]) -> NDArray[np.uint8]:
        """Render the cube, metres left of the camera (N,), as RGB (N, height, width, 3)."""
        count = len(left)
        cubes = np.zeros((count, self.images.num_cubes))
        cubes[:, self.cube] = left
        hidden = np.broadcast_to(np.arange(cubes.shape[1]) != self.cube, cubes.shape)
        return self.images.render(cubes, np.array([[self.steps, 0]] * count), hidden).numpy()

    def read(self, images: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """See `CubeImages.read`."""
        return self.images.read(images)
