"""Steps from the camera's frame to what a network sees."""

import dataclasses
from typing import Annotated, Any, ClassVar

from drone_rl.settings.variant import Variant
from drone_rl.utils.schema import Real, Whole


@dataclasses.dataclass(frozen=True, kw_only=True)
class Transform(Variant):
    """Which step, and with which values."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Gray(Transform):
    """RGB bytes to gray from 0 to 1."""

    target: ClassVar[str] = "drone_rl.envs.transforms.GrayPixels"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Rgb(Transform):
    """RGB bytes to colours from 0 to 1."""

    target: ClassVar[str] = "drone_rl.envs.transforms.RgbPixels"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Standardize(Transform):
    """Shifted and scaled: (x - mean) / std."""

    target: ClassVar[str] = "drone_rl.envs.transforms.StandardizePixels"
    mean: Annotated[float, Real(-1000.0, 1000.0)] = 0.53
    """Gray level that becomes 0."""
    std: Annotated[float, Real(1e-6, 1000.0)] = 0.21
    """Deviation that becomes 1."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Crop(Transform):
    """The rows that are kept, from top (included) to bottom (excluded)."""

    target: ClassVar[str] = "drone_rl.envs.transforms.CropRows"
    top: Annotated[int, Whole(0, 1023, "pixels")] = 5
    """First row."""
    bottom: Annotated[int, Whole(1, 1024, "pixels")] = 30
    """First row that is not kept."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Resize(Transform):
    """Averaging over areas."""

    target: ClassVar[str] = "drone_rl.envs.transforms.Resize"
    height: Annotated[int, Whole(1, 1024, "pixels")] = 25
    """Pixels down."""
    width: Annotated[int, Whole(1, 1024, "pixels")] = 64
    """Pixels across."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Stack(Transform):
    """The newest frames as channels, oldest first."""

    target: ClassVar[str] = "torchrl.envs.CatFrames"
    N: Annotated[int, Whole(1, 16, "frames")] = 2
    """Frames."""

    def make(self, *args: Any, **kwargs: Any) -> Any:
        """See `Variant`; the dimension is that of channels."""
        return super().make(*args, dim=-3, in_keys=["pixels"], **kwargs)


@dataclasses.dataclass(frozen=True, kw_only=True)
class EpisodeReward(Transform):
    """Sum of the episode's rewards so far, as "episode_reward"."""

    target: ClassVar[str] = "torchrl.envs.RewardSum"


@dataclasses.dataclass(frozen=True, kw_only=True)
class StepCount(Transform):
    """Steps of the episode so far, as "step_count"."""

    target: ClassVar[str] = "torchrl.envs.StepCounter"
