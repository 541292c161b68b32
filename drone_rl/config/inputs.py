"""Settings of the inputs of policies: images of the drone's cameras, and vectors.

`Input` and its variants are what users select by name, as in `inputs=[depth,goal]`. Policy files
contain an `ImageInput` or a `VectorInput` for each, which says everything about it.
"""

import dataclasses
import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal, Self

import pydantic
from annotated_types import MaxLen

from drone_rl.config.camera import CameraSettings
from drone_rl.config.parts import Part, Parts
from drone_rl.config.transforms import (
    DEFAULT_TRANSFORMS,
    MOST_TRANSFORMS,
    Bias,
    Fault,
    Frame,
    FrozenFrames,
    Gray,
    LateFrames,
    Noise,
    Rgb,
    Stack,
    Standardize,
    Transform,
)
from drone_rl.config.values import Fraction
from drone_rl.utils.errors import InputError
from drone_rl.utils.models import Model
from drone_rl.utils.schema import Annotation, Real, Several, Text, Whole, shown
from drone_rl.utils.settings import prefixed_errors

PIXELS = "pixels"
"""Name of the input that `camera` and `transforms` describe, the only one by default."""
MOST_INPUTS = 16
MAX_PIXELS = 2**18
"""Of a camera's frame."""
CAMERAS = {
    "front": "front_center",
    "front_left": "front_left",
    "front_right": "front_right",
    "down": "bottom_center",
    "back": "back_center",
}
"""Names of the drone's cameras, and those in its model, which are AirSim's."""
CameraName = Literal["front", "front_left", "front_right", "down", "back"]
Modality = Literal["rgb", "depth", "segmentation", "normals"]
CLASSES = ("target", "obstacle", "ground", "other", "sky")
"""Channels of a segmentation, in order; the same in every scene."""
SIZES = {
    "goal": 3,
    "velocity": 3,
    "attitude": 4,
    "rates": 3,
    "altitude": 1,
    "imu": 6,
    "last_action": 4,
}
"""Lengths of the vectors."""


class Camera(Model):
    """A camera on the drone."""

    name: CameraName = "front"
    horizontal_fov: float
    """Horizontal field of view, degrees."""


def require_name(part: Any) -> Any:
    """Return plain data of a part; raise an `InputError` if it names another package's class."""
    if isinstance(part, Mapping) and "_target_" in part:
        target = shown(part["_target_"])
        raise InputError(f"_target_={target} is refused; files name registered parts alone")
    return part


class ImageInput(Model):
    """An input that is an image: who takes it, and what is done with it."""

    kind: Literal["image"] = "image"
    camera: Camera
    size: tuple[int, int]
    """Height and width of the camera's frame, pixels."""
    modality: Modality = "rgb"
    """What the camera measures."""
    maximum: float | None = None
    """Depth that becomes 1, metres, as do greater ones and the sky; null for other modalities."""
    transforms: Annotated[
        tuple[Annotated[Transform, pydantic.BeforeValidator(require_name)], ...],
        MaxLen(MOST_TRANSFORMS),
    ]
    """In the order in which they are applied."""

    @classmethod
    def of(cls, camera: CameraSettings, transforms: Sequence[Transform]) -> Self:
        """Return the input that settings of a camera and transforms describe."""
        return cls(
            camera=Camera(horizontal_fov=camera.horizontal_fov),
            size=(camera.height, camera.width),
            transforms=tuple(transforms),
        )

    @property
    def settings(self) -> CameraSettings:
        """Settings of the camera and its frame."""
        height, width = self.size
        fov = self.camera.horizontal_fov
        return CameraSettings(height=height, width=width, horizontal_fov=fov)

    @property
    def frame(self) -> Frame:
        """Shape and type of the first transform's input."""
        channels = {"rgb": 3, "depth": 1, "segmentation": len(CLASSES), "normals": 3}[self.modality]
        return (
            Frame((*self.size, 3))
            if self.modality == "rgb"
            else Frame((channels, *self.size), True)
        )

    def reading(self) -> Self:
        """Return what the camera gives, without what is done with it."""
        return self.replace(transforms=(), maximum=None if self.maximum is None else 1.0)

    def without_errors(self) -> Self:
        """Return the same without camera faults."""
        return self.replace(
            transforms=tuple(t for t in self.transforms if not isinstance(t, Fault))
        )

    @pydantic.model_validator(mode="after")
    def _check(self) -> Self:
        pixels = self.settings.width * self.settings.height
        if pixels > MAX_PIXELS:
            raise InputError(f"camera has {pixels} pixels; give at most {MAX_PIXELS}")
        if (self.maximum is None) == (self.modality == "depth"):
            raise InputError(f"maximum={self.maximum} does not fit modality={self.modality}")
        return self


class VectorInput(Model):
    """An input that is a vector of numbers."""

    kind: Literal["vector"] = "vector"
    quantity: Literal["goal", "velocity", "attitude", "rates", "altitude", "imu", "last_action"]
    """What is measured; see the variants of `Vector`."""
    scale: Annotated[float, pydantic.Field(gt=0)]
    """The quantity is divided by it; in its unit."""
    noise: Annotated[float, pydantic.Field(ge=0)] = 0.0
    """Standard deviation of white noise, in the quantity's unit."""
    bias: Annotated[float, pydantic.Field(ge=0)] = 0.0
    """Bound of a constant error of each episode, in the quantity's unit."""
    delay: Annotated[int, pydantic.Field(ge=0)] = 0
    """Steps by which it is late."""
    loss: Annotated[float, pydantic.Field(ge=0, le=1)] = 0.0
    """Probability that a step repeats the value before."""

    @property
    def size(self) -> int:
        """Number of its numbers."""
        return SIZES[self.quantity]

    def reading(self) -> Self:
        """Return what the sensor gives, without what is done with it."""
        return self.without_errors().replace(scale=1.0)

    def without_errors(self) -> Self:
        """Return the same without noise, bias, delay and loss."""
        return self.replace(noise=0.0, bias=0.0, delay=0, loss=0.0)


def _kind(value: Any) -> Any:
    if isinstance(value, Mapping):
        return value.get("kind", "image")
    return getattr(value, "kind", None)


InputDescription = Annotated[
    Annotated[ImageInput, pydantic.Tag("image")] | Annotated[VectorInput, pydantic.Tag("vector")],
    pydantic.Discriminator(_kind),
]


class Input(Part):
    """Settings of an input of the policy."""

    def described(self, camera: CameraSettings, transforms: Sequence[Transform]) -> Any:
        """Return the complete description, given those of `pixels`."""
        raise NotImplementedError


class CameraPixels(Input, target="pixels"):
    """The image that `camera` and `transforms` describe."""

    def described(self, camera: CameraSettings, transforms: Sequence[Transform]) -> ImageInput:
        """See `Input`."""
        return ImageInput.of(camera, transforms)


class Image(Input):
    """Settings of an image; errors act on values from 0 to 1, before all transforms."""

    camera: CameraName = "front"
    """Camera: front, front_left, front_right, down or back."""
    size: Annotated[tuple[int, ...], Several(Whole(1, 1024, "pixels"), 2, 2)] = (25, 64)
    """Height and width in pixels."""
    horizontal_fov: Annotated[float, Real(4.0, 170.0, unit="degrees")] = 135.0
    """Horizontal field of view in degrees."""
    transforms: Annotated[tuple[Transform, ...], Parts(Transform, MOST_TRANSFORMS)] = ()
    """Further transforms, in this order, before the image is standardized."""
    stack: Annotated[int, Whole(1, 16, "frames")] = 1
    """Number of the newest frames that are seen at once."""
    noise: Fraction = 0.0
    """Standard deviation of white noise."""
    bias: Fraction = 0.0
    """Bound of a constant error of each episode."""
    delay: Annotated[int, Whole(0, 16, "frames")] = 0
    """Frames by which images are late."""
    loss: Fraction = 0.0
    """Probability that a frame repeats the one before."""

    modality: ClassVar[Modality] = "rgb"
    first: ClassVar[tuple[Transform, ...]] = ()
    """Transforms to values from 0 to 1."""
    last: ClassVar[tuple[Transform, ...]] = ()
    """Transforms that standardize them."""

    def described(self, camera: CameraSettings, transforms: Sequence[Transform]) -> ImageInput:
        """See `Input`."""
        del camera, transforms
        errors = {
            Noise(strength=self.noise): self.noise,
            Bias(most=self.bias): self.bias,
            LateFrames(frames=self.delay): self.delay,
            FrozenFrames(share=self.loss): self.loss,
        }
        steps = [*self.first, *(step for step, amount in errors.items() if amount)]
        steps += [*self.transforms, *self.last]
        steps += [Stack(N=self.stack)] if self.stack > 1 else []
        height, width = self.size
        return ImageInput(
            camera=Camera(name=self.camera, horizontal_fov=self.horizontal_fov),
            size=(height, width),
            modality=self.modality,
            maximum=getattr(self, "maximum", None),
            transforms=tuple(steps),
        )


class GrayImage(Image, target="gray"):
    """Gray image, standardized."""

    first: ClassVar[tuple[Transform, ...]] = (Gray(),)
    last: ClassVar[tuple[Transform, ...]] = (Standardize(),)


class RgbImage(Image, target="rgb"):
    """Color image, standardized."""

    first: ClassVar[tuple[Transform, ...]] = (Rgb(),)
    last: ClassVar[tuple[Transform, ...]] = (Standardize(),)


class DepthImage(Image, target="depth"):
    """Depth along the camera's axis, as a fraction of a greatest one, standardized."""

    maximum: Annotated[float, Real(0.1, 1000.0, unit="m")] = 20.0
    """Depth in metres that becomes 1, as do greater ones and the sky."""

    modality: ClassVar[Modality] = "depth"
    last: ClassVar[tuple[Transform, ...]] = (Standardize(mean=0.5, std=0.25),)


class SegmentationImage(Image, target="segmentation"):
    """A channel of 0 and 1 for each class: target, obstacle, ground, other, sky."""

    modality: ClassVar[Modality] = "segmentation"


class NormalsImage(Image, target="normals"):
    """Unit normals of surfaces in the world's frame, 0 for the sky."""

    modality: ClassVar[Modality] = "normals"
    last: ClassVar[tuple[Transform, ...]] = (Standardize(mean=0.5, std=0.5),)


class Vector(Input):
    """Settings of a vector; errors are in its unit."""

    noise: Annotated[float, Real(0.0)] = 0.0
    """Standard deviation of white noise."""
    bias: Annotated[float, Real(0.0)] = 0.0
    """Bound of a constant error of each episode."""
    delay: Annotated[int, Whole(0, 16, "steps")] = 0
    """Steps by which it is late."""
    loss: Fraction = 0.0
    """Probability that a step repeats the value before."""

    def described(self, camera: CameraSettings, transforms: Sequence[Transform]) -> VectorInput:
        """See `Input`."""
        del camera, transforms
        return VectorInput(quantity=self.target, **self.values())


Scale = Annotated[float, Real(0.0, is_above=True)]


class Goal(Vector, target="goal"):
    """From the drone to its goal: forward, left and up as the drone is turned, metres."""

    scale: Scale = 10.0
    """Metres that become 1."""


class Velocity(Vector, target="velocity"):
    """Velocity forward, left and up as the drone is turned, metres a second."""

    scale: Scale = 5.0
    """Metres a second that become 1."""


class Attitude(Vector, target="attitude"):
    """Unit quaternion (w, x, y, z) from the drone's to the world's frame; w is not negative."""

    scale: Scale = 1.0
    """Length that becomes 1."""


class Rates(Vector, target="rates"):
    """Angular velocity about the drone's axes, radians a second."""

    scale: Scale = 3.0
    """Radians a second that become 1."""


class Altitude(Vector, target="altitude"):
    """Height of the drone's centre above the ground, metres."""

    scale: Scale = 5.0
    """Metres that become 1."""


class Imu(Vector, target="imu"):
    """Mean specific force since the last step, m/s^2, and angular velocity, rad/s, drone's axes."""

    scale: Scale = 10.0
    """Value that becomes 1."""


class LastAction(Vector, target="last_action"):
    """The last action: forward, left, up, turning left, each as a fraction of the greatest speed.

    It is 0 at the start of an episode.
    """

    scale: Scale = 1.0
    """Fraction that becomes 1."""


def _named(inputs: Any) -> Any:
    """Return inputs by name, given a list of variants: an input is called as its variant."""
    inputs = [inputs] if isinstance(inputs, str) else inputs
    if not isinstance(inputs, list | tuple):
        return inputs
    names = [getattr(one, "name", one) for one in inputs]
    if len(set(map(str, names))) < len(names):
        raise InputError(
            f"{shown(names)} names an input twice; give names of their own, as in "
            "+inputs@inputs.down=depth, or a dictionary in Python"
        )
    return dict(zip(names, inputs, strict=True))


def _check_names(inputs: dict[str, Input]) -> dict[str, Input]:
    if not inputs:
        raise InputError("the policy would see nothing; give inputs, such as inputs=[gray]")
    for name in inputs:
        if not re.fullmatch("[a-z][a-z0-9_]*", name) or name in RESERVED:
            raise InputError(
                f"{shown(name)} can't be an input's name; give one of small letters, digits and _, "
                f"and none of {', '.join(sorted(RESERVED))}"
            )
    return inputs


RESERVED = {
    *("action", "reward", "done", "terminated", "truncated", "info", "next", "collector", "logits"),
    *("features", "vectors", "is_init", "step_count", "episode_reward", "state_value", "advantage"),
    *("value_target", "entropy", "probabilities"),
}
"""Names of other entries of a batch."""


@dataclasses.dataclass(frozen=True)
class InputsByName(Annotation):
    """The kind of a mapping from names to inputs, which is also read from a list of variants."""

    of: type[Part] = Input

    @property
    def hint(self) -> Any:
        """See `Annotation`."""
        return Annotated[
            dict[Annotated[str, Text(40)], self.of],
            pydantic.BeforeValidator(_named),
            MaxLen(MOST_INPUTS),
            pydantic.AfterValidator(_check_names),
        ]


Inputs = Annotated[Mapping[str, Input], InputsByName()]
_CAMERA = CameraSettings()
DEFAULT_INPUTS: dict[str, Input] = {PIXELS: CameraPixels()}


def describe_inputs(
    inputs: Mapping[str, Input],
    camera: CameraSettings = _CAMERA,
    transforms: Sequence[Transform] = DEFAULT_TRANSFORMS,
) -> dict[str, ImageInput | VectorInput]:
    """Return the description of each input; an `InputError` names one that is invalid."""
    made = {}
    for name, settings in inputs.items():
        with prefixed_errors(f"inputs.{name}"):
            made[name] = settings.described(camera, transforms)
    return made


def is_plain(inputs: Mapping[str, ImageInput | VectorInput]) -> bool:
    """Return whether the only input is the image that `camera` and `transforms` describe."""
    seen = inputs.get(PIXELS)
    if len(inputs) > 1 or not isinstance(seen, ImageInput):
        return False
    return (seen.modality, seen.camera.name) == ("rgb", "front")


def recorded_inputs(
    inputs: Mapping[str, ImageInput | VectorInput],
) -> dict[str, ImageInput | VectorInput]:
    """Return what demonstrations for a policy record by name; nothing for the plain image."""
    return {} if is_plain(inputs) else {name: seen.reading() for name, seen in inputs.items()}


def first_camera(inputs: Mapping[str, ImageInput | VectorInput]) -> CameraSettings:
    """Return the camera of the first image; the default one without images."""
    images = (seen.settings for seen in inputs.values() if isinstance(seen, ImageInput))
    return next(images, _CAMERA)
