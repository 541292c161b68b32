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

import numpy as np
from numpy.typing import NDArray

from drone_rl.config import CameraSettings, TaskSettings
from drone_rl.sim.entities import FRONT_CENTER

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
