"""Faults of a camera as TorchRL transforms of pictures from 0 to 1."""

import torch
from torch import Tensor

from drone_rl.config import transforms as settings
from drone_rl.config.registry import implements
from drone_rl.envs import faults
from drone_rl.envs.camera_fault import CameraFault, Streams, normal, uniform
from drone_rl.envs.transforms import PixelTransform
from drone_rl.utils.errors import InputError


@implements(settings.Blur)
class Blur(PixelTransform):
    """Blurs pictures (*, C, H, W) by a Gaussian; a map from picture to picture.

    Raises:
        InputError: The width is out of range, or the pictures are bytes.
    """

    def __init__(self, width: float = settings.Blur.width) -> None:
        """See `drone_rl.config.transforms.Blur`."""
        super().__init__()
        self.width = settings.Blur(width=width).width

    def _apply_transform(self, obs: Tensor) -> Tensor:
        if not obs.is_floating_point():
            raise InputError(f"Blur got {obs.dtype} pictures; let gray or rgb come first")
        return faults.blur(obs, self.width)

    def __repr__(self) -> str:
        return f"Blur(width={self.width:g})"


@implements(settings.Noise)
class Noise(CameraFault):
    """Adds noise to each pixel, white or correlated in time.

    Raises:
        InputError: A value is out of range.
    """

    def __init__(
        self,
        strength: float = settings.Noise.strength,
        correlation_time: float = settings.Noise.correlation_time,
    ) -> None:
        """See `drone_rl.config.transforms.Noise`."""
        super().__init__()
        told = settings.Noise(strength=strength, correlation_time=correlation_time)
        self.strength, self.correlation_time = told.strength, told.correlation_time

    def begin(self, pictures: Tensor, streams: Streams) -> Tensor:
        """See `CameraFault`; the noise, as it is long after the camera was switched on."""
        return normal(streams, pictures.shape[1:], pictures.device)

    def go_on(self, memory: Tensor, pictures: Tensor, streams: Streams) -> Tensor:
        """See `CameraFault`."""
        fresh = self.begin(pictures, streams)
        return faults.correlate(memory, fresh, self.correlation_time)

    def show(self, memory: Tensor, pictures: Tensor) -> Tensor:
        """See `CameraFault`."""
        return faults.add_noise(pictures, self.strength, memory)

    def __repr__(self) -> str:
        return f"Noise(strength={self.strength:g}, correlation_time={self.correlation_time:g})"


@implements(settings.DeadRows)
class DeadRows(CameraFault):
    """Rows of the sensor that show nothing: always the same, drawn for each episode, or both.

    Raises:
        InputError: A value is out of range, or the pictures have fewer rows.
    """

    def __init__(
        self,
        count: int = settings.DeadRows.count,
        rows: tuple[int, ...] = settings.DeadRows.rows,
        level: float = settings.DeadRows.level,
    ) -> None:
        """See `drone_rl.config.transforms.DeadRows`."""
        super().__init__()
        told = settings.DeadRows(count=count, rows=rows, level=level)
        self.count, self.rows, self.level = told.count, told.rows, told.level
        self._told = told

    def begin(self, pictures: Tensor, streams: Streams) -> Tensor:
        """See `CameraFault`; which rows are dead."""
        height = pictures.shape[-2]
        self._told.check_height(height)
        numbers = uniform(streams, (height,), pictures.device)
        numbers[:, list(self.rows)] = -1.0  # before all others
        return faults.choose_rows(numbers, self.count + len(self.rows))

    def go_on(self, memory: Tensor, pictures: Tensor, streams: Streams) -> Tensor:
        """See `CameraFault`."""
        return memory

    def show(self, memory: Tensor, pictures: Tensor) -> Tensor:
        """See `CameraFault`."""
        return faults.kill_rows(pictures, memory, self.level)

    def __repr__(self) -> str:
        return f"DeadRows(count={self.count}, rows={self.rows}, level={self.level:g})"


@implements(settings.FrozenFrames)
class FrozenFrames(CameraFault):
    """Shows, by chance, the frame before once more.

    Raises:
        InputError: The share is out of range.
    """

    def __init__(self, share: float = settings.FrozenFrames.share) -> None:
        """See `drone_rl.config.transforms.FrozenFrames`."""
        super().__init__()
        self.share = settings.FrozenFrames(share=share).share

    def begin(self, pictures: Tensor, streams: Streams) -> Tensor:
        """See `CameraFault`; what is shown."""
        return pictures

    def go_on(self, memory: Tensor, pictures: Tensor, streams: Streams) -> Tensor:
        """See `CameraFault`."""
        is_frozen = uniform(streams, (1,), pictures.device)[:, 0] < self.share
        return faults.freeze(pictures, memory, is_frozen)

    def show(self, memory: Tensor, pictures: Tensor) -> Tensor:
        """See `CameraFault`."""
        return memory

    def __repr__(self) -> str:
        return f"FrozenFrames(share={self.share:g})"


@implements(settings.LateFrames)
class LateFrames(CameraFault):
    """Shows each frame some frames late, and until then the first of the episode.

    Raises:
        InputError: The delay is out of range.
    """

    def __init__(self, frames: int = settings.LateFrames.frames) -> None:
        """See `drone_rl.config.transforms.LateFrames`."""
        super().__init__()
        self.frames = settings.LateFrames(frames=frames).frames

    def begin(self, pictures: Tensor, streams: Streams) -> Tensor:
        """See `CameraFault`; the pictures that are under way, oldest first."""
        return pictures[:, None].repeat(1, self.frames + 1, 1, 1, 1)

    def go_on(self, memory: Tensor, pictures: Tensor, streams: Streams) -> Tensor:
        """See `CameraFault`."""
        return torch.cat([memory[:, 1:], pictures[:, None]], 1)

    def show(self, memory: Tensor, pictures: Tensor) -> Tensor:
        """See `CameraFault`."""
        return memory[:, 0].contiguous()

    def __repr__(self) -> str:
        return f"LateFrames(frames={self.frames})"


@implements(settings.Shift)
class Shift(CameraFault):
    """Shows pictures aside, each episode by as much as is drawn for it.

    Raises:
        InputError: A shift is out of range.
    """

    def __init__(
        self, down: int = settings.Shift.down, across: int = settings.Shift.across
    ) -> None:
        """See `drone_rl.config.transforms.Shift`."""
        super().__init__()
        told = settings.Shift(down=down, across=across)
        self.down, self.across = told.down, told.across

    def begin(self, pictures: Tensor, streams: Streams) -> Tensor:
        """See `CameraFault`; how far down and to the right."""
        most = torch.tensor([self.down, self.across], device=pictures.device)
        drawn = uniform(streams, (2,), pictures.device)
        return (drawn * (2 * most + 1)).long() - most

    def go_on(self, memory: Tensor, pictures: Tensor, streams: Streams) -> Tensor:
        """See `CameraFault`."""
        return memory

    def show(self, memory: Tensor, pictures: Tensor) -> Tensor:
        """See `CameraFault`."""
        return faults.shift(pictures, memory)

    def __repr__(self) -> str:
        return f"Shift(down={self.down}, across={self.across})"
