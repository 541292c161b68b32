"""Settings of transforms, from the camera's frame to the network's input."""

from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, NamedTuple

from drone_rl.config.parts import Part
from drone_rl.config.values import Fraction, Pixels
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Real, Several, Whole, shown
from drone_rl.utils.settings import prefixed_errors

MOST_TRANSFORMS = 16


class Frame(NamedTuple):
    """Shape and type of an image."""

    shape: tuple[int, ...]
    """(H, W, 3) for RGB bytes, (C, H, W) for floats."""
    is_float: bool = False
    """Whether the values are float32, as networks need them."""


class Transform(Part):
    """Settings of a transform."""

    needs: ClassVar[str] = ""
    """Required input: "bytes" (RGB of the camera), "floats", or "" for both."""

    def output(self, frame: Frame) -> Frame | None:
        """Return shape and type of the output; None if only a call of the transform shows them.

        Raises:
            InputError: The transform can't process images of this shape and type.
        """
        if self.needs == "bytes" and (frame.is_float or frame.shape[-1] != 3):
            raise InputError(f"the transform {self.name} needs the camera's bytes; put it first")
        if self.needs == "floats" and not frame.is_float:
            raise InputError(f"the transform {self.name} needs floats; put gray before it")
        return self._transformed(frame)

    def _transformed(self, frame: Frame) -> Frame:
        return frame


def as_transforms(value: Transform | Sequence[Transform]) -> tuple[Transform, ...]:
    """Return one or several transforms as a tuple; raise an `InputError` for other values."""
    transforms: Any = value if isinstance(value, list | tuple) else (value,)
    for i, transform in enumerate(transforms):
        if not isinstance(transform, Transform):
            raise InputError(
                f"transforms[{i}]={shown(transform)} is no transform; give settings such as "
                "drone_rl.config.transforms.Rgb()"
            )
    return tuple(transforms)


class Gray(Transform, target="gray"):
    """RGB bytes to gray from 0 to 1."""

    needs: ClassVar[str] = "bytes"

    def _transformed(self, frame: Frame) -> Frame:
        return Frame((1, *frame.shape[:2]), True)


class Rgb(Transform, target="rgb"):
    """RGB bytes to colors from 0 to 1."""

    needs: ClassVar[str] = "bytes"

    def _transformed(self, frame: Frame) -> Frame:
        return Frame((3, *frame.shape[:2]), True)


class Chromaticity(Transform, target="chromaticity"):
    """Fractions of red and blue in each pixel, minus a third: 0 for every gray level."""

    floor: Annotated[float, Real(0.0, 3.0, is_above=True)] = 0.15
    """Constant added to the sum of red, green and blue, so that dark pixels are gray."""

    def _transformed(self, frame: Frame) -> Frame:
        if not frame.is_float or frame.shape[0] != 3:
            raise InputError("the transform chromaticity needs three colors; put rgb before it")
        return Frame((2, *frame.shape[1:]), True)


class Standardize(Transform, target="standardize"):
    """Shift and scale: (x - mean) / std."""

    mean: Annotated[float, Real(-1000.0, 1000.0)] = 0.53
    """Gray level that becomes 0."""
    std: Annotated[float, Real(1e-6, 1000.0)] = 0.21
    """Deviation that becomes 1."""

    def _transformed(self, frame: Frame) -> Frame:
        return Frame(frame.shape, True)


class Crop(Transform, target="crop"):
    """Crop to the rows from top (included) to bottom (excluded)."""

    top: Annotated[int, Whole(0, 1023, "pixels")] = 5
    """First row."""
    bottom: Pixels = 30
    """First row that is not kept."""

    def _transformed(self, frame: Frame) -> Frame:
        if not frame.is_float and frame.shape[-1] == 3:
            raise InputError("the transform crop needs channels first; put gray or rgb before it")
        self.check_height(frame.shape[-2])
        return Frame((*frame.shape[:-2], self.bottom - self.top, frame.shape[-1]), frame.is_float)

    def check_height(self, height: int) -> None:
        """Raise an `InputError` if no row is kept of an image of this height, or too many."""
        if not self.top < self.bottom <= height:
            raise InputError(
                f"the transform crop keeps rows {self.top} to {self.bottom} of {height}; give top "
                f"< bottom and at most {height}"
            )


class Resize(Transform, target="resize"):
    """Resize by area averaging; images that already have the size do not change."""

    needs: ClassVar[str] = "floats"
    height: Pixels = 25
    """Height of the output in pixels."""
    width: Pixels = 64
    """Width of the output in pixels."""

    def _transformed(self, frame: Frame) -> Frame:
        return Frame((frame.shape[0], self.height, self.width), True)


DEFAULT_TRANSFORMS = (Gray(), Resize(), Standardize())
"""Networks get 25x64 pixels from any camera; the default camera's images are not resized."""


class Stack(Transform, target="torchrl.envs.CatFrames"):
    """The newest frames as channels, oldest first."""

    N: Annotated[int, Whole(1, 16, "frames")] = 2
    """Number of frames."""

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of TorchRL's transform, which concatenates channels."""
        return {**self.values(), "dim": -3, "in_keys": ["pixels"]}

    def _transformed(self, frame: Frame) -> Frame:
        return Frame((frame.shape[0] * self.N, *frame.shape[1:]), frame.is_float)


class EpisodeReward(Transform, target="torchrl.envs.RewardSum"):
    """Sum of the episode's rewards so far, as "episode_reward"."""


class StepCount(Transform, target="torchrl.envs.StepCounter"):
    """Steps of the episode so far, as "step_count"."""


class Blur(Transform, target="blur"):
    """Gaussian blur."""

    needs: ClassVar[str] = "floats"
    width: Annotated[float, Real(0.0, 16.0, unit="pixels")] = 0.5
    """Standard deviation of the Gaussian."""


class Fault(Transform):
    """Camera fault that is random or has memory."""

    needs: ClassVar[str] = "floats"


class Noise(Fault, target="noise"):
    """Sensor noise, clipped at black and white."""

    strength: Fraction = 0.02
    """Standard deviation; black is 0 and white is 1."""
    correlation_time: Annotated[float, Real(0.0, 10_000.0, unit="frames")] = 0.0
    """Time after which the correlation of a pixel's noise has fallen to 1/e; white noise at 0."""


class Bias(Fault, target="bias"):
    """Constant error of each episode, clipped at black and white."""

    most: Fraction = 0.02
    """Bound of the error; black is 0 and white is 1. It is uniformly distributed."""


class DeadRows(Fault, target="dead_rows"):
    """Dead rows of the sensor."""

    count: Annotated[int, Whole(0, 1024, "rows")] = 1
    """Rows sampled for each episode, in addition to `rows`."""
    rows: Annotated[tuple[int, ...], Several(Whole(0, 1023, "rows"), 0, 1024)] = ()
    """Rows that are always dead, from 0 at the top."""
    level: Fraction = 0.0
    """Gray level of dead rows; 0 is black, 1 is white."""

    def check(self) -> None:
        """Reject duplicate rows."""
        if len(set(self.rows)) < len(self.rows):
            self.refuse("rows", "names a row twice; name each once")

    def _transformed(self, frame: Frame) -> Frame:
        with prefixed_errors(f"transforms.{self.name}"):
            self.check_height(frame.shape[-2])
        return frame

    def check_height(self, height: int) -> None:
        """Raise an `InputError` if an image of this height has too few rows."""
        if max(self.rows, default=0) >= height:
            self.refuse("rows", f"are beyond the image's {height} rows; give at most {height - 1}")
        most = height - len(self.rows)
        if self.count > most:
            self.refuse("count", f"exceeds the image's other rows; give at most {most}")


class FrozenFrames(Fault, target="frozen_frames"):
    """Frames that repeat the previous one at random."""

    share: Fraction = 0.05
    """Probability that a frame repeats the previous one."""


class HeldFrames(Fault, target="held_frames"):
    """Frames of a camera that is slower than the control steps: each is repeated until the next."""

    every: Annotated[int, Whole(1, 1000, "steps")] = 2
    """Control steps from one frame to the next."""


class LateFrames(Fault, target="late_frames"):
    """Delayed frames; the first frame is repeated until delayed ones arrive."""

    frames: Annotated[int, Whole(0, 16, "frames")] = 1
    """Delay in frames."""


class Shift(Fault, target="shift"):
    """Image shift that is constant within an episode, as from a misaligned camera."""

    down: Annotated[int, Whole(0, 1023, "pixels")] = 4
    """Largest vertical shift, up or down; shifts are uniformly distributed."""
    across: Annotated[int, Whole(0, 1023, "pixels")] = 6
    """Largest horizontal shift, to the left or right."""
