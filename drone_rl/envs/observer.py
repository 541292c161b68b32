"""What policies see of environments: images, transforms, camera faults and stacks of frames."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np
import torch
from torch import Tensor
from torchrl.envs import CatFrames, Transform

from drone_rl.envs.camera_faults import CameraFault
from drone_rl.envs.fault_models import FaultModel, Sample, stacked_frames
from drone_rl.envs.transforms import GrayPixels, RgbPixels, is_of_pixels, without_identities
from drone_rl.sim.rendering import Appearance
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
    ) -> None:
        """Take transforms, of which those of images are applied, after `stages`."""
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
                key = (transform.key, number)
                self._steps.append(Stage(transform.model, EpisodeStreams(streams, key, num_envs)))

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

    def of_frames(self, frames: Sequence[Tensor]) -> Tensor:
        """Return what is seen with the last of consecutive images, as if the first were a start."""
        *earlier, last = frames
        for i, images in enumerate(earlier):
            self(images, starts=not i)
        return self(last, starts=not earlier)

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


class Observer:
    """Renders the inputs of policies in states of environments, with the memory of their episodes.

    If the first transform is `GrayPixels`, gray images are rendered.
    """

    def __init__(
        self,
        worlds: Worlds,
        transforms: Iterable[Transform] = (),
        *,
        appearance: Callable[[Tensor], Appearance | None] = lambda rows: None,
        streams: Streams | None = None,
        faults: Pipeline | None = None,
        earlier: "Observer | None" = None,
    ) -> None:
        """Observe worlds.

        Args:
            worlds: The environments.
            transforms: From the camera's image, RGB bytes, to the network's input; others that do
                not change "pixels" are ignored.
            appearance: Returns the appearance of environments, (k,).
            streams: Random streams of camera faults among the transforms; without, they have no
                effect.
            faults: Further camera faults, which act before all transforms but gray or rgb.
            earlier: Observer of the same environments whose memory goes on.
        """
        self.worlds, self.appearance = worlds, appearance
        self.faults = faults or Pipeline()
        self._to_rgb = RgbPixels()
        self.transforms = tuple(t for t in transforms if is_of_pixels(t))
        first = next(iter(self.transforms), None)
        self._has_bytes = type(first) not in (GrayPixels, RgbPixels)
        self.view = worlds.policy_view
        camera, rest = worlds.camera, self.transforms
        if type(first) is GrayPixels:
            self.view = worlds.view(modality="gray")
            frame = torch.zeros(1, camera.height, camera.width, 3, dtype=torch.uint8)
            rest = without_identities(self.transforms, frame)[1:]
        elif type(first) is RgbPixels:
            rest = self.transforms[1:]
        self.pipeline = (
            Pipeline(rest, streams, worlds.num_envs) if earlier is None else earlier.pipeline
        )
        """Transforms after gray or rgb, if those are the first."""
        self.images = torch.empty(0)
        """The last images that entered the pipeline."""

    def observe(
        self,
        state: State,
        rows: Tensor,
        starts: Starts,
        appearance: Appearance | None,
    ) -> dict[str, Tensor]:
        """Return the inputs of policies by name: "pixels", of shape (k, *).

        Args:
            state: States of environments.
            rows: Their indices, (k,).
            starts: Where episodes start; see `Starts`.
            appearance: Their appearance.
        """
        images = self.worlds.render(state, self.view, appearance)
        if self.view.modalities == ("gray",):
            images = images[:, None]
        elif self.faults.stages or not self._has_bytes:
            images = self._to_rgb._apply_transform(images)
        images = self.faults(images, rows, starts)
        if self.faults.stages and self._has_bytes:
            images = (images * 255).round().to(torch.uint8).movedim(-3, -1)
        self.images = images
        return {"pixels": self.pipeline(images, rows, starts)}

    def example(self) -> Tensor:
        """Return an input of one environment for images of zeros, to know its shape and type."""
        camera = self.worlds.camera
        images = torch.zeros(1, camera.height, camera.width, 3, dtype=torch.uint8)
        return Pipeline(self.transforms)(images.to(self.worlds.device))
