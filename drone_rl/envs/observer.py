"""What policies see of environments: images and vectors, transforms, faults, stacks of frames."""

import dataclasses
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor
from torchrl.envs import CatFrames, Transform

from drone_rl.config.inputs import CAMERAS, CLASSES, PIXELS, ImageInput, VectorInput
from drone_rl.envs.camera_faults import CameraFault
from drone_rl.envs.fault_models import FaultModel, Sample, stacked_frames
from drone_rl.envs.transforms import GrayPixels, RgbPixels, is_of_pixels, without_identities
from drone_rl.envs.vectors import error_models, measure
from drone_rl.sim.rendering import Appearance
from drone_rl.sim.rendering.scene import SemanticClass
from drone_rl.sim.tasks import State
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError

Streams = Callable[[Tensor, tuple[int, ...]], list[np.random.Generator]]
"""From environments, (k,), whose episodes begin and the key of a purpose to fresh streams."""

Starts = Tensor | bool | None
"""Where episodes start, (k,) bool, or one for all; None to show again what was seen last."""


class Source(Protocol):
    """Random numbers of a fault."""

    def __call__(self, rows: Tensor, *, begins: bool) -> Sample:
        """Return the source for environments, (k,), whose episodes begin now, or go on."""
        ...


class EpisodeStreams:
    """A fault's own random stream for each episode."""

    def __init__(self, streams: Streams, key: tuple[int, ...], num_envs: int) -> None:
        self._begin, self._key = streams, key
        self.streams = [np.random.Generator(np.random.PCG64(0)) for _ in range(num_envs)]

    def __call__(self, rows: Tensor, *, begins: bool) -> Sample:
        """See `Source`."""
        numbers = rows.tolist()
        if begins:
            for row, stream in zip(numbers, self._begin(rows, self._key), strict=True):
                self.streams[row] = stream
        streams = [self.streams[row] for row in numbers]

        def sample(*shape: int, normal: bool = False) -> Tensor:
            values = np.empty((len(streams), *shape), np.float32)
            for stream, row in zip(streams, values, strict=True):
                (stream.standard_normal if normal else stream.random)(out=row, dtype=np.float32)
            return torch.from_numpy(values).to(rows.device)

        return sample


def with_rows(memory: Tensor | None, rows: Tensor, values: Tensor) -> Tensor:
    """Return a memory with values, (k, *), of environments, (k,); it grows, never in place."""
    size = int(rows.max()) + 1
    if memory is None or memory.shape[1:] != values.shape[1:]:
        memory = values[:0]
    if len(memory) < size:
        memory = torch.cat([memory, values.new_zeros(size - len(memory), *values.shape[1:])])
    return memory.index_copy(0, rows, values)


class Stage:
    """A step of a pipeline that remembers something of each environment: a fault, or a stack."""

    def __init__(self, model: FaultModel, source: Source | None = None) -> None:
        """Take the model, and its random numbers if it needs some."""
        self.model, self.source = model, source
        self.memory: Tensor | None = None
        """Shape: (num_envs, *)."""

    def __call__(
        self,
        images: Tensor,
        rows: Tensor | None,
        starts: Starts,
        blank: float = 0.0,
    ) -> Tensor:
        """See `Pipeline.__call__`; `blank` is the value of a pixel without signal."""
        rows = torch.arange(len(images), device=images.device) if rows is None else rows
        if isinstance(starts, Tensor):
            parts = [starts.nonzero()[:, 0], (~starts).nonzero()[:, 0]]
            for part, begins in zip(parts, (True, False), strict=True):
                if len(part):
                    self._note(images[part], rows[part], begins)
        elif starts is not None:
            self._note(images, rows, starts)
        assert self.memory is not None
        return self.model.show(images, self.memory[rows], blank)

    def _note(self, images: Tensor, rows: Tensor, starts: bool) -> None:
        """Update the memory; never in place, since what was shown or saved may share it."""
        begins = starts or self.memory is None
        sample: Any = None if self.source is None else self.source(rows, begins=begins)
        if begins or self.memory is None:
            memory = self.model.begin(images, sample)
        else:
            memory = self.model.update(self.memory[rows], images, sample)
        self.memory = with_rows(self.memory, rows, memory)


def _check_has_no_memory(transform: Transform) -> None:
    """Raise an `InputError` if a transform needs a method that is not called."""
    for name in ("_step", "_call", "_reset"):
        method = getattr(type(transform), name)
        is_library = method.__module__.startswith(("torchrl.", "drone_rl."))
        if method is not getattr(Transform, name) and not (name == "_reset" and is_library):
            raise InputError(
                f"{type(transform).__name__} has its own {name}, which is not called: "
                "images pass through _apply_transform alone; derive what remembers something of "
                "each environment from drone_rl.envs.CameraFault"
            )


class Pipeline:
    """Transforms of images, with their memory of each environment.

    Camera faults have an effect only if `streams` gives them random numbers. Of other transforms
    than those and TorchRL's `CatFrames`, `_apply_transform` is called alone; an `InputError` names
    one that has its own `_step`, `_call` or `_reset`.
    """

    def __init__(
        self,
        transforms: Iterable[Transform] = (),
        streams: Streams | None = None,
        num_envs: int = 0,
        *,
        stages: Iterable[Stage] = (),
        key: tuple[int, ...] = (),
    ) -> None:
        """Take transforms, of which those of images are applied, after `stages`.

        `key` begins the keys of all random streams.
        """
        self.transforms = tuple(t for t in transforms if is_of_pixels(t))
        self._steps: list[Transform | Stage] = [*stages]
        for i, transform in enumerate(self.transforms):
            if isinstance(transform, CatFrames):
                padding = transform.padding, transform.padding_value
                stack = stacked_frames(transform.N, transform.dim, *padding)
                self._steps.append(Stage(stack))
            elif not isinstance(transform, CameraFault):
                _check_has_no_memory(transform)
                self._steps.append(transform)
            elif streams is not None:
                number = sum(type(one) is type(transform) for one in self.transforms[:i])
                of = (*key, transform.key, number)
                self._steps.append(Stage(transform.model, EpisodeStreams(streams, of, num_envs)))

    @property
    def stages(self) -> list[Stage]:
        """The steps with a memory."""
        return [step for step in self._steps if isinstance(step, Stage)]

    def __call__(
        self,
        images: Tensor,
        rows: Tensor | None = None,
        starts: Starts = True,
        blank: float = 0.0,
    ) -> Tensor:
        """Return what policies see of new images.

        Args:
            images: Shape: (k, H, W, 3) or (k, C, H, W).
            rows: Environments of the images, (k,); by default the first k.
            starts: Where episodes start; see `Starts`.
            blank: Value of a pixel without signal.
        """
        for step in self._steps:
            images = (
                step(images, rows, starts, blank)
                if isinstance(step, Stage)
                else step._apply_transform(images)
            )
        return images

    def forget(self) -> None:
        """Forget all episodes."""
        for stage in self.stages:
            stage.memory = None

    @property
    def earlier(self) -> int:
        """Number of earlier frames in what a policy sees."""
        return sum(t.N - 1 for t in self.transforms if isinstance(t, CatFrames))

    def state_dict(self) -> list[dict[str, Any]]:
        """Return memory and random streams of each stage."""
        return [
            {
                "memory": stage.memory,
                "streams": [s.bit_generator.state for s in getattr(stage.source, "streams", [])],
            }
            for stage in self.stages
        ]

    def load_state_dict(self, state: Sequence[Mapping[str, Any]]) -> None:
        """Resume from a `state_dict` of as many environments."""
        for stage, saved in zip(self.stages, state, strict=True):
            stage.memory = saved["memory"]
            streams = getattr(stage.source, "streams", [])
            for stream, where in zip(streams, saved["streams"], strict=True):
                stream.bit_generator.state = where


Seen = Sequence[Transform] | ImageInput | VectorInput
"""An input: a description, or the transforms from the policy's camera, RGB bytes, to "pixels"."""
_CLASS_CHANNELS = {
    SemanticClass.TARGET: 0,
    SemanticClass.OBSTACLE: 1,
    SemanticClass.GROUND: 2,
    SemanticClass.DRONE: 3,
    SemanticClass.DISTRACTOR: 3,
    SemanticClass.DECORATION: 3,
    SemanticClass.SKY: 4,
}
"""See `drone_rl.config.inputs.CLASSES`."""


def frames_of(seen: ImageInput, readings: Tensor) -> Tensor:
    """Return a camera's readings, see `drone_rl.envs.readings`, as the first transform's input."""
    if seen.modality == "depth":
        assert seen.maximum is not None
        far = torch.where(readings == 0, seen.maximum, readings)
        return (far / seen.maximum).clamp(max=1.0)[:, None]
    if seen.modality == "segmentation":
        return torch.stack([readings == i for i in range(len(CLASSES))], 1).float()
    if seen.modality == "normals":
        return ((readings + 1.0) / 2.0).movedim(-1, -3).contiguous()
    return readings


def key_of(name: str) -> tuple[int, ...]:
    """Return the key of the random streams of an input."""
    return () if name == PIXELS else (zlib.crc32(name.encode()),)


class ImageSource:
    """Renders an input of policies, an image, with the memory of its episodes.

    If the first transform is `GrayPixels`, gray images are rendered.
    """

    def __init__(
        self,
        name: str,
        worlds: Worlds,
        seen: Sequence[Transform] | ImageInput,
        streams: Streams | None,
    ) -> None:
        """Take the input's name, its worlds, what it is, and the random streams of its faults."""
        self.worlds, self.seen, self.faults = worlds, seen, Pipeline()
        self.modality = "rgb"
        self._to_rgb = RgbPixels()
        transforms, view = seen, worlds.policy_view
        if isinstance(seen, ImageInput):
            camera, (height, width) = seen.settings, seen.size
            self.modality = seen.modality
            transforms = [transform.make() for transform in seen.transforms]
            view = worlds.view(CAMERAS[seen.camera.name], seen.modality, height, width)
            view = dataclasses.replace(view, horizontal_fov=camera.horizontal_fov)
        assert not isinstance(transforms, ImageInput)
        self.transforms: tuple[Transform, ...] = tuple(t for t in transforms if is_of_pixels(t))
        first, rest, self.view = next(iter(self.transforms), None), self.transforms, view
        self._has_bytes = self.modality == "rgb" and type(first) not in (GrayPixels, RgbPixels)
        if self.modality == "rgb" and type(first) is GrayPixels:
            self.view = dataclasses.replace(view, modalities=("gray",))
            frame = torch.zeros(1, view.height, view.width, 3, dtype=torch.uint8)
            rest = without_identities(self.transforms, frame)[1:]
        elif self.modality == "rgb" and type(first) is RgbPixels:
            rest = self.transforms[1:]
        self.pipeline = Pipeline(rest, streams, worlds.num_envs, key=key_of(name))
        """Transforms after gray or rgb, if those are the first."""
        self.last = torch.empty(0)
        """The last images that entered the pipeline."""

    def observe(
        self, state: State, rows: Tensor, starts: Starts, appearance: Appearance | None
    ) -> Tensor:
        """See `Observer.observe`. Shape: (k, *)."""
        images = self.worlds.render(state, self.view, appearance)
        if self.modality == "rgb":
            if self.view.modalities == ("gray",):
                images = images[:, None]
            elif self.faults.stages or not self._has_bytes:
                images = self._to_rgb._apply_transform(images)
        else:
            images = self.measured(images)
        images = self.faults(images, rows, starts)
        if self.faults.stages and self._has_bytes:
            images = (images * 255).round().to(torch.uint8).movedim(-3, -1)
        self.last = images
        return self.pipeline(images, rows, starts)

    def measured(self, images: Tensor) -> Tensor:
        """Return rendered images as transforms take them: colors, or else (k, C, H, W)."""
        readings = self._readings(images)
        return frames_of(self.seen, readings) if isinstance(self.seen, ImageInput) else readings

    def _readings(self, images: Tensor) -> Tensor:
        """Return rendered images as a camera's readings, see `drone_rl.envs.readings`."""
        if self.modality != "segmentation":
            return images
        kinds = [*self.worlds.scene.semantic_classes, SemanticClass.SKY]
        numbers = [_CLASS_CHANNELS[kind] for kind in kinds]
        numbers = torch.tensor(numbers, dtype=torch.uint8, device=images.device)
        return numbers[images.long()]  # -1, the sky, is the last one

    def read(self, state: State, seen: Tensor, appearance: Appearance | None) -> Tensor:
        """Return what the camera gives in states, without errors; see `drone_rl.envs.readings`."""
        del seen
        view = dataclasses.replace(self.view, modalities=(self.modality,))
        return self._readings(self.worlds.render(state, view, appearance))

    def example(self) -> Tensor:
        """Return the input of one environment for images of zeros."""
        height, width, seen = self.view.height, self.view.width, self.seen
        images = torch.zeros(1, height, width, 3, dtype=torch.uint8)
        if isinstance(seen, ImageInput) and seen.modality != "rgb":
            images = torch.zeros(1, *seen.frame.shape)
        return Pipeline(self.transforms)(images.to(self.worlds.device))


class VectorSource:
    """Measures an input of policies, a vector, with the memory of its episodes."""

    def __init__(
        self, name: str, worlds: Worlds, seen: VectorInput, streams: Streams | None
    ) -> None:
        """See `ImageSource`.

        Raises:
            InputError: The drones or the task have no such quantity.
        """
        self.worlds, self.seen, self.faults = worlds, seen, Pipeline()
        measure(seen.quantity, worlds, worlds.state[:1])  # refuses what the worlds lack
        stages = []
        for kind, model in error_models(seen, worlds).items():
            key = (*key_of(name), zlib.crc32(kind.encode()))
            if streams is not None or kind == "imu":
                source = EpisodeStreams(streams, key, worlds.num_envs) if streams else None
                stages.append(Stage(model, source))
        self.pipeline = Pipeline(stages=stages)
        self.last = torch.empty(0)
        """The last values that entered the pipeline. Shape: (k, n, 1, 1)."""

    def observe(
        self, state: State, rows: Tensor, starts: Starts, appearance: Appearance | None
    ) -> Tensor:
        """See `Observer.observe`. Shape: (k, n)."""
        del appearance
        values = measure(self.seen.quantity, self.worlds, state)[..., None, None]
        self.last = self.faults(values, rows, starts)
        return self.pipeline(self.last, rows, starts)[..., 0, 0] / self.seen.scale

    def read(self, state: State, seen: Tensor, appearance: Appearance | None) -> Tensor:
        """Return what the sensor gave, as it was observed. Shape: (k, n)."""
        del state, appearance
        return seen * self.seen.scale

    def example(self) -> Tensor:
        """Return zeros. Shape: (1, n)."""
        return torch.zeros(1, self.seen.size, device=self.worlds.device)


class Observer:
    """Makes the inputs of policies in states of environments, with the memory of their episodes."""

    def __init__(
        self,
        worlds: Worlds,
        inputs: Iterable[Transform] | Mapping[str, Seen] = (),
        *,
        appearance: Callable[[Tensor], Appearance | None] = lambda rows: None,
        streams: Streams | None = None,
        faults: Mapping[str, Pipeline] | None = None,
        earlier: "Observer | None" = None,
    ) -> None:
        """Observe worlds.

        Args:
            worlds: The environments.
            inputs: The inputs by name. Transforms alone are those of "pixels"; others that do not
                change images are ignored.
            appearance: Returns the appearance of environments, (k,).
            streams: Random streams of faults among the inputs; without, they have no effect.
            faults: Further faults of inputs by name, which act before all transforms but gray or
                rgb.
            earlier: Observer of the same environments whose memory goes on.

        Raises:
            InputError: The worlds lack what an input measures.
        """
        self.worlds, self.appearance = worlds, appearance
        self.inputs: Mapping[str, Seen]
        named: Any = inputs if isinstance(inputs, Mapping) else {PIXELS: tuple(inputs)}
        self.inputs = named
        """The inputs by name, for observers of other worlds."""
        self.sources: dict[str, ImageSource | VectorSource] = {}
        for name, seen in self.inputs.items():
            make = VectorSource if isinstance(seen, VectorInput) else ImageSource
            source: Any = make(name, worlds, seen, streams)  # pyright: ignore[reportArgumentType]
            source.faults = (faults or {}).get(name, source.faults)
            if earlier is not None:
                source.pipeline = earlier.sources[name].pipeline
            self.sources[name] = source

    @property
    def sees_pixels(self) -> bool:
        """Whether the only input is the image of the policy's camera."""
        return [*self.inputs] == [PIXELS] and isinstance(self.inputs[PIXELS], tuple)

    @property
    def images(self) -> dict[str, ImageSource]:
        """Those of the inputs that are images, by name."""
        return {n: s for n, s in self.sources.items() if isinstance(s, ImageSource)}

    @property
    def image(self) -> ImageSource:
        """The first image among the inputs; an `InputError` if there is none."""
        for source in self.images.values():
            return source
        raise InputError(f"the policy sees no image, only {', '.join(self.sources)}")

    def observe(
        self,
        state: State,
        rows: Tensor,
        starts: Starts,
        appearance: Appearance | None,
    ) -> dict[str, Tensor]:
        """Return the inputs of policies by name, of shapes (k, *).

        Args:
            state: States of environments.
            rows: Their indices, (k,).
            starts: Where episodes start; see `Starts`.
            appearance: Their appearance.
        """
        return {
            name: source.observe(state, rows, starts, appearance)
            for name, source in self.sources.items()
        }

    def examples(self) -> dict[str, Tensor]:
        """Return inputs of one environment without content, to know their shapes and types."""
        return {name: source.example() for name, source in self.sources.items()}

    def state_dict(self) -> dict[str, Any]:
        """Return memory and random streams of each input."""
        return {name: source.pipeline.state_dict() for name, source in self.sources.items()}

    def load_state_dict(self, state: Mapping[str, Any]) -> None:
        """Resume from a `state_dict` of as many environments."""
        for name, source in self.sources.items():
            source.pipeline.load_state_dict(state[name])
