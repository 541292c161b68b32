"""Camera faults as transforms with a memory of each environment."""

import dataclasses
import zlib
from collections.abc import Callable
from typing import Any, ClassVar

from tensordict import TensorDictBase
from torch import Tensor

from drone_rl.config import transforms as settings
from drone_rl.config.registry import implements
from drone_rl.envs.fault_models import (
    FaultModel,
    bias,
    blur,
    dead_rows,
    frozen_frames,
    held_frames,
    late_frames,
    noise,
    random_shift,
)
from drone_rl.envs.transforms import BuiltIn, PixelTransform, call_text, read_fields
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import Settings


class CameraFault(PixelTransform):
    """A fault of the cameras of a `DroneEnv`, independent in each environment.

    Put it where "pixels" are floats from 0 to 1: after `GrayPixels` or `RgbPixels`, before
    `StandardizePixels`. It acts among the transforms of `make_env` or `DroneEnv`; on single images
    it has no effect.

    Random numbers come from `DroneEnv.side_streams`. So the environment's seed is the fault's seed,
    the first k environments do not depend on the batch size, and the fault does not change which
    episodes are sampled. A task that samples nothing at a reset meets the same random numbers in
    every episode of an environment.
    """

    def __init__(self, model: FaultModel, values: Settings | None = None) -> None:
        """Take the fault, and its settings for `repr`."""
        super().__init__()
        self.values = values
        self.model = dataclasses.replace(
            model, begin=lambda images, sample: model.begin(self._checked(images), sample)
        )
        self.key = zlib.crc32(type(self).__name__.encode())
        """Key of its random streams."""

    def _apply_transform(self, obs: Tensor) -> Tensor:
        return obs

    def _reset(
        self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase
    ) -> TensorDictBase:
        raise InputError(
            f"{type(self).__name__} has a memory of each environment; give it to make_env or "
            "DroneEnv as one of the transforms instead of TorchRL's TransformedEnv"
        )

    def _checked(self, images: Tensor) -> Tensor:
        name = type(self).__name__
        if not images.is_floating_point():
            raise InputError(f"{name} got {images.dtype} images; put it after gray or rgb")
        low, high = (float(end) for end in images.aminmax())
        if not (low >= 0 and high <= 1):
            raise InputError(
                f"{name} got images from {low:.3g} to {high:.3g}; put it after gray or rgb and "
                "before standardize, where they are from 0 to 1"
            )
        return images

    def __repr__(self) -> str:
        return call_text(self, self.values) if self.values else f"{type(self).__name__}()"


class _BuiltInFault(CameraFault):
    """A fault with the fields of its settings as arguments, in order or by name."""

    Settings: ClassVar[type[settings.Fault]]
    make_model: ClassVar[Callable[..., FaultModel]]
    """Returns the model for the fields of the settings."""

    def __init__(self, *args: Any, **fields: Any) -> None:
        values = read_fields(self.Settings, args, fields)
        super().__init__(self.make_model(**vars(values)), values)


@implements(settings.Noise)
class Noise(_BuiltInFault):
    """Add noise to each pixel; see `drone_rl.config.transforms.Noise`."""

    make_model = staticmethod(noise)


@implements(settings.Bias)
class Bias(_BuiltInFault):
    """Add a constant to all pixels of an episode; see `drone_rl.config.transforms.Bias`."""

    make_model = staticmethod(bias)


@implements(settings.DeadRows)
class DeadRows(_BuiltInFault):
    """Blank `rows` and `count` random rows per episode; see `config.transforms.DeadRows`."""

    make_model = staticmethod(dead_rows)

    def _checked(self, images: Tensor) -> Tensor:
        assert isinstance(self.values, settings.DeadRows)
        self.values.check_height(super()._checked(images).shape[-2])
        return images


@implements(settings.FrozenFrames)
class FrozenFrames(_BuiltInFault):
    """Repeat the previous frame at random; see `drone_rl.config.transforms.FrozenFrames`."""

    make_model = staticmethod(frozen_frames)


@implements(settings.HeldFrames)
class HeldFrames(_BuiltInFault):
    """Renew frames every few steps; see `drone_rl.config.transforms.HeldFrames`."""

    make_model = staticmethod(held_frames)


@implements(settings.LateFrames)
class LateFrames(_BuiltInFault):
    """Delay frames; see `drone_rl.config.transforms.LateFrames`."""

    make_model = staticmethod(late_frames)


@implements(settings.Shift)
class Shift(_BuiltInFault):
    """Shift the frames of an episode; see `drone_rl.config.transforms.Shift`."""

    make_model = staticmethod(random_shift)


@implements(settings.Blur)
class Blur(BuiltIn):
    """Blur images (*, C, H, W) by a Gaussian; it has no memory and samples nothing."""

    def _apply_transform(self, obs: Tensor) -> Tensor:
        if not obs.is_floating_point():
            raise InputError(f"Blur got {obs.dtype} images; put it after gray or rgb")
        return blur(obs, self.values.width)
