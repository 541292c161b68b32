"""From camera frames to what a network sees, in TorchRL transforms that need no torchvision."""

import torch
from tensordict import TensorDictBase
from tensordict.utils import NestedKey
from torch import Tensor
from torch.nn import functional
from torchrl.data import TensorSpec, Unbounded
from torchrl.envs.transforms import ObservationTransform

from drone_rl.config import transforms as settings
from drone_rl.config.registry import implements
from drone_rl.sim.rendering.view import to_gray
from drone_rl.utils.errors import InputError


class PixelTransform(ObservationTransform):
    """A map from pixels to pixels, applied alike at reset and at every step."""

    def __init__(
        self,
        in_keys: list[NestedKey] | None = None,
        out_keys: list[NestedKey] | None = None,
    ) -> None:
        in_keys = in_keys if in_keys is not None else ["pixels"]
        super().__init__(in_keys=in_keys, out_keys=out_keys or list(in_keys))

    @property
    def is_in_place(self) -> bool:
        """Whether it takes "pixels" and puts what it makes of them in their place."""
        return list(self.in_keys) == list(self.out_keys) == ["pixels"]

    def _reset(
        self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase
    ) -> TensorDictBase:
        return self._call(tensordict_reset)

    def transform_observation_spec(self, observation_spec: TensorSpec) -> TensorSpec:
        """Declares the shape that the transform makes of each pixel entry."""
        for in_key, out_key in zip(self.in_keys, self.out_keys, strict=True):
            before = observation_spec[in_key]  # pyright: ignore[reportIndexIssue] (a composite)
            after = self._apply_transform(before.zero())
            observation_spec[out_key] = Unbounded(  # pyright: ignore[reportIndexIssue]
                shape=after.shape, dtype=after.dtype, device=before.device
            )
        return observation_spec


@implements(settings.Gray)
class GrayPixels(PixelTransform):
    """RGB bytes (*, H, W, 3) to gray (*, 1, H, W), float32 in [0, 1], in one pass.

    The same as TorchRL's `ToTensorImage` and `GrayScale`, several times faster on a CPU.

    Raises:
        InputError: The frames are not RGB bytes with the colour last.
    """

    def _apply_transform(self, obs: Tensor) -> Tensor:
        _check_bytes(self, obs)
        return to_gray(obs).unsqueeze(-3)


@implements(settings.Rgb)
class RgbPixels(PixelTransform):
    """RGB bytes (*, H, W, 3) to floats (*, 3, H, W), float32 in [0, 1].

    Raises:
        InputError: The frames are not RGB bytes with the colour last.
    """

    def _apply_transform(self, obs: Tensor) -> Tensor:
        _check_bytes(self, obs)
        return obs.movedim(-1, -3).float() / 255.0


@implements(settings.Chromaticity)
class ChromaticityPixels(PixelTransform):
    """Colors (*, 3, H, W) to shares of red and blue in each (*, 2, H, W), less a third.

    Light, shadow and exposure change brightness and not these; every gray becomes 0. Shares are of
    the sum of red, green and blue, and of `floor`, or else the noise of a dark pixel would look
    like a color. From -1/3 to 2/3.

    Raises:
        InputError: There are not three channels, or the floor is not above 0.
    """

    def __init__(
        self,
        floor: float = settings.Chromaticity.floor,
        in_keys: list[NestedKey] | None = None,
        out_keys: list[NestedKey] | None = None,
    ) -> None:
        super().__init__(in_keys, out_keys)
        if not floor > 0:
            raise InputError(f"ChromaticityPixels(floor={floor}): give a floor above 0")
        self.floor = float(floor)

    def _apply_transform(self, obs: Tensor) -> Tensor:
        if obs.shape[-3] != 3:
            raise InputError(
                f"ChromaticityPixels got pictures of shape {tuple(obs.shape)}; let rgb come before"
            )
        total = obs.sum(-3, keepdim=True)
        red_and_blue = torch.stack((obs[..., 0, :, :], obs[..., 2, :, :]), -3)
        return (red_and_blue - total / 3).div_(total + self.floor)

    def __repr__(self) -> str:
        return f"ChromaticityPixels(floor={self.floor:g})"


@implements(settings.Crop)
class CropRows(PixelTransform):
    """Keeps the rows `top` to `bottom` (exclusive) of frames (*, C, H, W).

    Raises:
        InputError: The rows are not in the frame.
    """

    def __init__(
        self,
        top: int,
        bottom: int,
        in_keys: list[NestedKey] | None = None,
        out_keys: list[NestedKey] | None = None,
    ) -> None:
        super().__init__(in_keys, out_keys)
        if not 0 <= top < bottom:
            raise InputError(f"CropRows({top}, {bottom}) keeps no row; give 0 <= top < bottom")
        self.top, self.bottom = top, bottom

    def _apply_transform(self, obs: Tensor) -> Tensor:
        if self.bottom > obs.shape[-2]:
            raise InputError(
                f"CropRows({self.top}, {self.bottom}) of a frame of {obs.shape[-2]} rows; "
                f"give a bottom of at most {obs.shape[-2]}"
            )
        return obs[..., self.top : self.bottom, :]

    def __repr__(self) -> str:
        return f"CropRows(top={self.top}, bottom={self.bottom})"


@implements(settings.Resize)
class Resize(PixelTransform):
    """Resizes frames (*, C, H, W) by averaging over areas.

    Raises:
        InputError: A size is below 1.
    """

    def __init__(
        self,
        *,
        height: int,
        width: int,
        in_keys: list[NestedKey] | None = None,
        out_keys: list[NestedKey] | None = None,
    ) -> None:
        super().__init__(in_keys, out_keys)
        if height < 1 or width < 1:
            raise InputError(f"Resize(height={height}, width={width}): give 1 pixel or more")
        self.height, self.width = height, width

    def _apply_transform(self, obs: Tensor) -> Tensor:
        size = (self.height, self.width)
        if obs.shape[-2:] == size:
            return obs
        flat = obs.reshape(-1, *obs.shape[-3:])
        resized = functional.interpolate(flat, size, mode="area")
        return resized.reshape(*obs.shape[:-2], *size)

    def __repr__(self) -> str:
        return f"Resize(height={self.height}, width={self.width})"


@implements(settings.Standardize)
class StandardizePixels(PixelTransform):
    """Shifts and scales pixels: (x - mean) / std. The defaults are the original study's.

    Raises:
        InputError: The deviation is not above 0.
    """

    def __init__(
        self,
        mean: float = settings.Standardize.mean,
        std: float = settings.Standardize.std,
        in_keys: list[NestedKey] | None = None,
        out_keys: list[NestedKey] | None = None,
    ) -> None:
        super().__init__(in_keys, out_keys)
        if not std > 0:
            raise InputError(f"StandardizePixels(std={std}): give a deviation above 0")
        self.mean, self.std = float(mean), float(std)

    def _apply_transform(self, obs: Tensor) -> Tensor:
        return (obs - self.mean).div_(self.std)

    def __repr__(self) -> str:
        return f"StandardizePixels(mean={self.mean:g}, std={self.std:g})"


def _check_bytes(transform: PixelTransform, obs: Tensor) -> None:
    if obs.dtype != torch.uint8 or obs.shape[-1] != 3:
        raise InputError(
            f"{type(transform).__name__} got {obs.dtype} frames of shape {tuple(obs.shape)}; "
            "give uint8 of shape (..., height, width, 3)"
        )
