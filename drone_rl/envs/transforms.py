"""Image transforms from camera frames to network inputs; they need no torchvision."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, ClassVar

import torch
from tensordict import TensorDictBase
from tensordict.utils import NestedKey
from torch import Tensor
from torch.nn import functional
from torchrl.data import TensorSpec, Unbounded
from torchrl.envs import CatFrames, Transform
from torchrl.envs.transforms import ObservationTransform

from drone_rl.config import transforms as settings
from drone_rl.config.registry import implements
from drone_rl.sim.rendering.view import to_gray
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import Settings

Keys = list[NestedKey] | None


class PixelTransform(ObservationTransform):
    """A stateless transform of images, applied at reset and at every step.

    Raises:
        InputError: A setting is out of range, or images have another type or shape than it needs.
    """

    values: Settings | None = None
    """Its settings, for `repr`."""

    def __init__(self, in_keys: Keys = None, out_keys: Keys = None) -> None:
        in_keys = in_keys if in_keys is not None else ["pixels"]
        super().__init__(in_keys=in_keys, out_keys=out_keys or list(in_keys))

    def __repr__(self) -> str:
        return call_text(self, self.values) if self.values else super().__repr__()

    def _reset(
        self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase
    ) -> TensorDictBase:
        return self._call(tensordict_reset)

    def transform_observation_spec(self, observation_spec: TensorSpec) -> TensorSpec:
        """Return the spec with the transformed shape of each image entry."""
        for in_key, out_key in zip(self.in_keys, self.out_keys, strict=True):
            before = observation_spec[in_key]  # pyright: ignore[reportIndexIssue] (a composite)
            after = self._apply_transform(before.zero())
            observation_spec[out_key] = Unbounded(  # pyright: ignore[reportIndexIssue]
                shape=after.shape, dtype=after.dtype, device=before.device
            )
        return observation_spec


class BuiltIn(PixelTransform):
    """A transform with the fields of its settings as arguments, in order or by name."""

    Settings: ClassVar[type[settings.Transform]]
    """Set by `implements`."""

    def __init__(self, *args: Any, **fields: Any) -> None:
        super().__init__()
        self.values: Any = read_fields(self.Settings, args, fields)


def read_fields(
    kind: type[settings.Transform], args: Sequence[Any], fields: Mapping[str, Any]
) -> settings.Transform:
    """Return settings whose fields are given in order or by name."""
    names = [*kind.model_fields][: len(args)]
    return kind(**dict(zip(names, args, strict=True)), **fields)


@implements(settings.Gray)
class GrayPixels(PixelTransform):
    """Convert RGB bytes (*, H, W, 3) to gray (*, 1, H, W), float32 in [0, 1], in one pass.

    The same as TorchRL's `ToTensorImage` and `GrayScale`, several times faster on a CPU.
    """

    def _apply_transform(self, obs: Tensor) -> Tensor:
        _check_bytes(self, obs)
        return to_gray(obs).unsqueeze(-3)


@implements(settings.Rgb)
class RgbPixels(PixelTransform):
    """Convert RGB bytes (*, H, W, 3) to floats (*, 3, H, W), float32 in [0, 1]."""

    def _apply_transform(self, obs: Tensor) -> Tensor:
        _check_bytes(self, obs)
        return obs.movedim(-1, -3).float() / 255.0


@implements(settings.Chromaticity)
class ChromaticityPixels(BuiltIn):
    """Convert RGB floats (*, 3, H, W) to chromaticities of red and blue (*, 2, H, W).

    The red and blue fractions, minus a third: every gray becomes 0. Lighting, shadows and exposure
    change the brightness, not the chromaticity. Red and blue are divided by the sum of the channels
    and `floor`, which suppresses the color noise of dark pixels. Range: -1/3 to 2/3.
    """

    def _apply_transform(self, obs: Tensor) -> Tensor:
        if obs.shape[-3] != 3:
            raise InputError(
                f"ChromaticityPixels got images of shape {tuple(obs.shape)}; put it after rgb"
            )
        total = obs.sum(-3, keepdim=True)
        red_and_blue = torch.stack((obs[..., 0, :, :], obs[..., 2, :, :]), -3)
        return (red_and_blue - total / 3).div_(total + self.values.floor)


@implements(settings.Crop)
class CropRows(BuiltIn):
    """Keep the rows `top` to `bottom` (exclusive) of frames (*, C, H, W)."""

    def _apply_transform(self, obs: Tensor) -> Tensor:
        self.values.check_height(obs.shape[-2])
        return obs[..., self.values.top : self.values.bottom, :]


@implements(settings.Resize)
class Resize(BuiltIn):
    """Resize frames (*, C, H, W) by averaging over areas; those of the size stay as they are."""

    def _apply_transform(self, obs: Tensor) -> Tensor:
        size = (self.values.height, self.values.width)
        if obs.shape[-2:] == size:
            return obs
        flat = obs.reshape(-1, *obs.shape[-3:])
        resized = functional.interpolate(flat, size, mode="area")
        return resized.reshape(*obs.shape[:-2], *size)


@implements(settings.Standardize)
class StandardizePixels(BuiltIn):
    """Standardize pixels: (x - mean) / std. The defaults are the original study's."""

    def _apply_transform(self, obs: Tensor) -> Tensor:
        return (obs - self.values.mean).div_(self.values.std)


def call_text(transform: Transform, values: Settings) -> str:
    """Return the text of a constructor call."""
    arguments = (
        f"{name}={value:g}" if isinstance(value, float) else f"{name}={value}"
        for name, value in vars(values).items()
    )
    return f"{type(transform).__name__}({', '.join(arguments)})"


def _check_bytes(transform: PixelTransform, obs: Tensor) -> None:
    if obs.dtype != torch.uint8 or obs.shape[-1] != 3:
        raise InputError(
            f"{type(transform).__name__} got {obs.dtype} frames of shape {tuple(obs.shape)}; "
            "give uint8 of shape (..., height, width, 3)"
        )


def is_of_pixels(transform: Transform) -> bool:
    """Return whether a transform changes images; others, such as `RewardSum`, need TorchRL."""
    return "pixels" in (transform.in_keys or [])


def without_identities(transforms: Iterable[Transform], images: Tensor) -> list[Transform]:
    """Leave out each resize to the size that images already have; `images` are an example."""
    kept: list[Transform] = []
    for transform in transforms:
        before = images
        if not isinstance(transform, CatFrames):
            images = transform._apply_transform(images)
        if type(transform) is not Resize or images.shape != before.shape:
            kept.append(transform)
    return kept
