"""What a condition looks like: one picture of each strength, from the same place."""

import base64
import math
import zlib

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.robustness.axis import Axis
from drone_rl.robustness.condition import Condition
from drone_rl.robustness.eyes import Sight
from drone_rl.robustness.flying import Airfield
from drone_rl.utils.errors import InputError

STEP = 8
"""The step whose picture is shown: the first cube is near, and late pictures show it late."""


class FilmEyes:
    """Flies straight on and keeps one picture, in colour, as the camera gave it."""

    knows_truth = False

    def __init__(self) -> None:
        """Has kept none yet."""
        self._step = 0
        self.picture: Tensor | None = None

    def act(self, sight: Sight) -> tuple[Tensor, Tensor | None]:
        """See `Eyes`."""
        pictures = sight.draw("rgb").movedim(-1, 1).float() / 255.0
        pictures = sight.spoil(pictures, sight.flying)
        if self._step <= STEP:  # some flights end before
            self.picture = (pictures[0] * 255).round().to(torch.uint8).movedim(0, -1)
        self._step += 1
        return torch.zeros_like(sight.flying), None


def make_strip(bed: Airfield, axis: Axis) -> list[NDArray | None]:
    """The policy's camera with nothing different, then at each strength; None where it can't be.

    Args:
        bed: Of one world.
        axis: Which.

    Returns:
        Shapes: (H, W, 3), uint8.
    """
    made = (axis.make(strength, bed.subject) for strength in axis.strengths)
    return [_picture(bed, condition) for condition in (Condition(), *made)]


def _picture(bed: Airfield, condition: Condition) -> NDArray | None:
    eyes = FilmEyes()
    try:
        bed.fly(condition, eyes=eyes)
    except InputError:
        return None
    return None if eyes.picture is None else eyes.picture.cpu().numpy()


def packed(picture: NDArray) -> str:
    """A picture as text for a file."""
    return base64.b64encode(zlib.compress(picture.tobytes(), 9)).decode()


def unpacked(text: str, shape: tuple[int, ...], where: str) -> NDArray:
    """A picture out of such text.

    Args:
        text: From `packed`, perhaps.
        shape: That it must have, as uint8.
        where: Its name, for people.

    Raises:
        InputError: It is none, or of another shape.
    """
    size = math.prod(shape)
    try:
        unpacking = zlib.decompressobj()
        content = unpacking.decompress(base64.b64decode(text, validate=True), size + 1)
    except (ValueError, zlib.error):
        content = b""
    if len(content) != size:
        raise InputError(f"{where} is no picture of {shape[0]} rows and {shape[1]} columns")
    return np.frombuffer(content, np.uint8).reshape(shape)
