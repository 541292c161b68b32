"""Camera faults as TorchRL transforms."""

import zlib
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

import numpy as np
import torch
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.envs.transforms import ObservationTransform

from drone_rl.config import transforms as settings
from drone_rl.config.registry import implements
from drone_rl.envs.drone_env import DroneEnv
from drone_rl.envs.fault_models import (
    FaultModel,
    Sample,
    blur,
    dead_rows,
    frozen_frames,
    late_frames,
    noise,
    random_shift,
)
from drone_rl.envs.transforms import PixelTransform, call_text
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import Settings


class CameraFault(ObservationTransform):
    """Apply a fault model to the cameras of a `DroneEnv`, independently in each environment.

    Put it where "pixels" are floats from 0 to 1: after `GrayPixels` or `RgbPixels`, before
    `StandardizePixels`. Without an environment, on single images, it has no effect.

    Random numbers come from `DroneEnv.side_streams`. So the environment's seed is the fault's seed,
    the first k environments do not depend on the batch size, and the fault does not change which
    episodes are sampled. A task that samples nothing at a reset meets the same random numbers in
    every episode of an environment.

    Partial resets and steps are supported: an environment outside the mask keeps its memory and
    its last image. `state_dict` holds all that is needed to resume within episodes.
    """

    def __init__(self, model: FaultModel, values: Settings | None = None) -> None:
        """Take the fault, and its settings for `repr`."""
        super().__init__(in_keys=["pixels"], out_keys=["pixels"])
        self.model = model
        self.values = values
        self._memory: Tensor | None = None
        self._streams: list[np.random.Generator] = []

    def _apply_transform(self, obs: Tensor) -> Tensor:
        return obs

    def _reset(
        self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase
    ) -> TensorDictBase:
        images = self._checked(tensordict_reset.get("pixels"))
        mask = tensordict.get("_reset", None) if self._fits(images) else None
        self._begin(_indices(mask, images), images)
        return self._show(tensordict_reset, images)

    def _step(self, tensordict: TensorDictBase, next_tensordict: TensorDictBase) -> TensorDictBase:
        images = next_tensordict.get("pixels")
        if self._memory is None or not self._fits(images):
            raise InputError(f"{type(self).__name__} got a step before any reset; call reset()")
        envs = _indices(tensordict.get("_step", None), images)
        before = self._memory.to(images.device)[envs]
        sample = _sampler([self._streams[i] for i in envs.tolist()], images.device)
        self._remember(envs, self.model.update(before, images[envs], sample))
        return self._show(next_tensordict, images)

    def _fits(self, images: Tensor) -> bool:
        """Return whether the memory has as many environments as the images."""
        return self._memory is not None and len(self._memory) == len(images)

    def _begin(self, envs: Tensor, images: Tensor) -> None:
        fresh = self._env().side_streams(envs, *self._key())
        begun = dict(zip(envs.tolist(), fresh, strict=True))
        self._streams = [begun.get(i) or self._streams[i] for i in range(len(images))]
        if begun:
            sample = _sampler(fresh, images.device)
            self._remember(envs, self.model.begin(images[envs], sample))

    def _remember(self, envs: Tensor, memory: Tensor) -> None:
        """Store the memory, never in place: images that were shown or saved may share it."""
        if self._memory is None or len(envs) == len(self._streams):
            self._memory = memory
        else:
            self._memory = self._memory.to(memory.device).index_copy(0, envs, memory)

    def _show(self, tensordict: TensorDictBase, images: Tensor) -> TensorDictBase:
        assert self._memory is not None
        faulty = self.model.show(images, self._memory.to(images.device), 0.0)
        return tensordict.set("pixels", faulty)

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

    def _env(self) -> DroneEnv:
        base: Any = getattr(self.container, "base_env", None)
        if not isinstance(base, DroneEnv):
            raise InputError(
                f"{type(self).__name__} wraps {type(base).__name__}, which has no random streams "
                "of its environments; wrap a DroneEnv"
            )
        return base

    def _key(self) -> tuple[int, int]:
        """Return the key of the fault's streams: its class and its index within the class."""
        env: Any = self.container
        same = [t for t in env.transform.modules() if type(t) is type(self)]
        number = next(i for i, transform in enumerate(same) if transform is self)
        return zlib.crc32(type(self).__name__.encode()), number

    def get_extra_state(self) -> Any:
        """Return memory and random streams; part of `state_dict`."""
        states = [stream.bit_generator.state for stream in self._streams]
        return {"memory": self._memory, "streams": states}

    def set_extra_state(self, state: Any) -> None:
        """Resume from `get_extra_state` of as many environments, else raise an `InputError`."""
        memory, saved = state["memory"], state["streams"]
        expected = len(self._streams)
        if expected and len(saved) != expected:
            raise InputError(
                f"the saved {type(self).__name__} has {len(saved)} environments, this one "
                f"{expected}; set num_envs={len(saved)}"
            )
        streams = [np.random.Generator(np.random.PCG64(0)) for _ in saved]
        for stream, where in zip(streams, saved, strict=True):
            stream.bit_generator.state = where
        self._memory, self._streams = memory, streams

    def __repr__(self) -> str:
        return call_text(self, self.values) if self.values else f"{type(self).__name__}()"


class _BuiltInFault(CameraFault):
    """A fault with the fields of its settings as arguments, in order or by name."""

    Settings: ClassVar[type[settings.Fault]]
    make_model: ClassVar[Callable[..., FaultModel]]
    """Returns the model for the fields of the settings."""

    def __init__(self, *args: Any, **fields: Any) -> None:
        names = [*self.Settings.model_fields][: len(args)]
        values = self.Settings(**dict(zip(names, args, strict=True)), **fields)
        super().__init__(self.make_model(**vars(values)), values)


@implements(settings.Noise)
class Noise(_BuiltInFault):
    """Add noise to each pixel; see `drone_rl.config.transforms.Noise`."""

    make_model = staticmethod(noise)


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


@implements(settings.LateFrames)
class LateFrames(_BuiltInFault):
    """Delay frames; see `drone_rl.config.transforms.LateFrames`."""

    make_model = staticmethod(late_frames)


@implements(settings.Shift)
class Shift(_BuiltInFault):
    """Shift the frames of an episode; see `drone_rl.config.transforms.Shift`."""

    make_model = staticmethod(random_shift)


@implements(settings.Blur)
class Blur(PixelTransform):
    """Blur images (*, C, H, W) by a Gaussian; it has no memory and samples nothing."""

    def __init__(self, width: float = settings.Blur().width) -> None:
        """See `drone_rl.config.transforms.Blur`."""
        super().__init__()
        self.values = settings.Blur(width=width)
        self.width = width

    def _apply_transform(self, obs: Tensor) -> Tensor:
        if not obs.is_floating_point():
            raise InputError(f"Blur got {obs.dtype} images; put it after gray or rgb")
        return blur(obs, self.width)


def _sampler(streams: Sequence[np.random.Generator], device: torch.device) -> Sample:
    """Sample from one NumPy stream per environment."""

    def sample(*shape: int, normal: bool = False) -> Tensor:
        numbers = np.empty((len(streams), *shape), np.float32)
        for stream, row in zip(streams, numbers, strict=True):
            (stream.standard_normal if normal else stream.random)(out=row, dtype=np.float32)
        return torch.from_numpy(numbers).to(device)

    return sample


def _indices(mask: Tensor | None, images: Tensor) -> Tensor:
    count = len(images)
    if mask is None:
        return torch.arange(count, device=images.device)
    return mask.reshape(count).nonzero()[:, 0].to(images.device)
