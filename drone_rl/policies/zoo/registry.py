"""What a policy may consist of, by name: the one table of networks, transforms and their bounds.

A file names a part and gives it values; only what stands here can be named. Programs add parts of
their own with `register_network` and `register_transform`, in a module that an installed package
names in the entry point group "drone_rl.policies"; a file can't.
"""

import dataclasses
import functools
from collections.abc import Callable, Mapping
from importlib import metadata
from typing import Any

from torch import nn
from torchrl.envs import CatFrames, RewardSum, StepCounter, Transform

from drone_rl import envs
from drone_rl.config.networks import Mlp, OriginalCnn, SmallCnn
from drone_rl.config.transforms import (
    Blur,
    Chromaticity,
    Crop,
    DeadRows,
    EpisodeReward,
    FrozenFrames,
    Gray,
    LateFrames,
    Noise,
    Resize,
    Rgb,
    Shift,
    Stack,
    Standardize,
    StepCount,
)
from drone_rl.policies import MLP, OriginalCNN, SmallCNN
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Kind, Record, shown
from drone_rl.utils.settings import below, kinds_of, snake_case

ENTRY_POINTS = "drone_rl.policies"
"""Group of the modules that register parts of their own."""


@dataclasses.dataclass(frozen=True)
class Picture:
    """What the next part gets to see of a frame."""

    shape: tuple[int, ...]
    """RGB bytes are (H, W, 3); floats are (C, H, W)."""
    is_float: bool = False
    """Whether these are float32 numbers, as networks want them."""


@dataclasses.dataclass(frozen=True)
class Part:
    """A registered network or transform."""

    make: Callable[..., Any]
    """Takes the parameters by name; a network's also takes shape, actions and generator."""
    parameters: Record
    """The parameters that a file gives, each with type and bounds."""
    targets: tuple[str, ...]
    """The `_target_`s of settings that mean this part."""
    fixed: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    """Arguments that are always the same."""
    change: Callable[[Picture, Mapping[str, Any]], Picture] = lambda picture, _: picture
    """What a transform makes of a picture, given its parameters."""

    @property
    def is_fault(self) -> bool:
        """Whether it is what goes wrong in a camera, and no part of a policy's own program."""
        return isinstance(self.make, type) and issubclass(self.make, envs.CameraFault)


NETWORKS: dict[str, Part] = {}
"""By name."""
TRANSFORMS: dict[str, Part] = {}
"""By name."""


def register_network(
    name: str, make: Callable[..., nn.Module], parameters: Mapping[str, Kind], *targets: str
) -> None:
    """Makes a network known to descriptions, in files too.

    Args:
        name: Which files give.
        make: Called as `make(in_shape, num_actions, generator=..., **parameters)`.
        parameters: Type and bounds of each, see `drone_rl.utils.schema`.
        targets: `_target_`s that mean it; by default the place where it is defined.
    """
    NETWORKS[name] = Part(make, Record(parameters), targets or (_place(make),))


def register_transform(
    name: str,
    make: Callable[..., Transform],
    parameters: Mapping[str, Kind],
    *targets: str,
    fixed: Mapping[str, Any] | None = None,
    change: Callable[[Picture, Mapping[str, Any]], Picture] = lambda picture, _: picture,
) -> None:
    """Makes a transform known to descriptions, in files too.

    Args:
        name: Which files give.
        make: Called as `make(**parameters, **fixed)`.
        parameters: Type and bounds of each, see `drone_rl.utils.schema`.
        targets: `_target_`s that mean it; by default the place where it is defined.
        fixed: Arguments that are always the same.
        change: What it makes of a picture's shape; nothing by default.
    """
    targets = targets or (_place(make),)
    TRANSFORMS[name] = Part(make, Record(parameters), targets, dict(fixed or {}), change)


def find_part(parts: Mapping[str, Part], name: object, where: str) -> Part:
    """A registered part.

    Raises:
        InputError: There is none of that name.
    """
    if name not in list(parts):
        load_entry_points()
    if name not in list(parts):
        raise InputError(f"{where}={shown(name)} is unknown; there are: {', '.join(parts)}")
    return parts[str(name)]


@functools.cache
def load_entry_points() -> None:
    """Imports what installed packages register; once, and only if something isn't known."""
    for point in metadata.entry_points(group=ENTRY_POINTS):
        point.load()


def _place(make: Any) -> str:
    return f"{make.__module__}.{make.__qualname__}"


def _gray(picture: Picture, _: Mapping[str, Any]) -> Picture:
    return _of_bytes("gray", picture, 1)


def _rgb(picture: Picture, _: Mapping[str, Any]) -> Picture:
    return _of_bytes("rgb", picture, 3)


def _chromaticity(picture: Picture, _: Mapping[str, Any]) -> Picture:
    if not picture.is_float or picture.shape[0] != 3:
        raise InputError("the transform chromaticity needs three colors; let rgb come before")
    return Picture((2, *picture.shape[1:]), True)


def _of_bytes(name: str, picture: Picture, channels: int) -> Picture:
    if picture.is_float or picture.shape[-1] != 3:
        raise InputError(f"the transform {name} needs the camera's own RGB; let it come first")
    return Picture((channels, *picture.shape[:2]), True)


def _crop(picture: Picture, values: Mapping[str, Any]) -> Picture:
    top, bottom, rows = values["top"], values["bottom"], picture.shape[-2]
    if not top < bottom <= rows:
        raise InputError(
            f"the transform crop keeps rows {top} to {bottom} of {rows}; give top < bottom and at "
            f"most {rows}"
        )
    return Picture((*picture.shape[:-2], bottom - top, picture.shape[-1]), picture.is_float)


def _floats(name: str) -> Callable[[Picture, Mapping[str, Any]], Picture]:
    """A change of levels alone, of pictures from 0 to 1."""

    def change(picture: Picture, _: Mapping[str, Any]) -> Picture:
        if not picture.is_float:
            raise InputError(f"the transform {name} needs floats; let gray come first")
        return picture

    return change


def _dead_rows(picture: Picture, values: Mapping[str, Any]) -> Picture:
    floats = _floats("dead_rows")(picture, values)
    with below("transforms.dead_rows"):
        DeadRows(**values).check_height(floats.shape[-2])
    return floats


def _resize(picture: Picture, values: Mapping[str, Any]) -> Picture:
    floats = _floats("resize")(picture, values)
    return Picture((floats.shape[0], values["height"], values["width"]), True)


def _stack(picture: Picture, values: Mapping[str, Any]) -> Picture:
    return Picture((picture.shape[0] * values["N"], *picture.shape[1:]), picture.is_float)


def _standardize(picture: Picture, _: Mapping[str, Any]) -> Picture:
    return Picture(picture.shape, True)


register_network(
    "small_cnn", SmallCNN, kinds_of(SmallCnn), SmallCnn.target, "drone_rl.policies.cnn.SmallCNN"
)
register_network(
    "original_cnn",
    OriginalCNN,
    kinds_of(OriginalCnn),
    *(OriginalCnn.target, "drone_rl.policies.cnn.OriginalCNN"),
)
register_network("mlp", MLP, kinds_of(Mlp), Mlp.target, "drone_rl.policies.mlp.MLP")
register_transform(
    "gray",
    envs.GrayPixels,
    kinds_of(Gray),
    *(Gray.target, "drone_rl.envs.GrayPixels"),
    change=_gray,
)
register_transform("rgb", envs.RgbPixels, kinds_of(Rgb), Rgb.target, change=_rgb)
register_transform(
    "chromaticity",
    envs.ChromaticityPixels,
    kinds_of(Chromaticity),
    Chromaticity.target,
    change=_chromaticity,
)
register_transform(
    "standardize",
    envs.StandardizePixels,
    kinds_of(Standardize),
    *(Standardize.target, "drone_rl.envs.StandardizePixels"),
    change=_standardize,
)
register_transform(
    "crop", envs.CropRows, kinds_of(Crop), Crop.target, "drone_rl.envs.CropRows", change=_crop
)
register_transform(
    "resize", envs.Resize, kinds_of(Resize), Resize.target, "drone_rl.envs.Resize", change=_resize
)
register_transform(
    "stack",
    CatFrames,
    kinds_of(Stack),
    *(Stack.target, "torchrl.envs.transforms.CatFrames"),
    fixed={"dim": -3, "in_keys": ["pixels"]},
    change=_stack,
)
register_transform(
    "episode_reward",
    RewardSum,
    kinds_of(EpisodeReward),
    *(EpisodeReward.target, "torchrl.envs.transforms.RewardSum"),
)
register_transform(
    "step_count",
    StepCounter,
    kinds_of(StepCount),
    *(StepCount.target, "torchrl.envs.transforms.StepCounter"),
)
for make, settings, change in (
    (envs.Blur, Blur, _floats("blur")),
    (envs.Noise, Noise, _floats("noise")),
    (envs.DeadRows, DeadRows, _dead_rows),
    (envs.FrozenFrames, FrozenFrames, _floats("frozen_frames")),
    (envs.LateFrames, LateFrames, _floats("late_frames")),
    (envs.Shift, Shift, _floats("shift")),
):
    kinds, target = kinds_of(settings), settings.target
    register_transform(snake_case(settings), make, kinds, target, change=change)
