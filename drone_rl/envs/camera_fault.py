# pyright: reportIncompatibleMethodOverride=false
# (torch annotates a module's extra state as anything.)
"""A fault of each world's camera, by chance or with memory, as a TorchRL transform."""

import abc
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from tensordict import TensorDictBase
from torch import Tensor
from torchrl.envs.transforms import ObservationTransform

from drone_rl.envs.drone_env import DroneEnv
from drone_rl.utils.errors import InputError

Streams = Sequence[np.random.Generator]
"""Random numbers of worlds, a stream each."""


class CameraFault(ObservationTransform, abc.ABC):
    """Something that goes wrong in the cameras of `DroneEnv`, in each world for itself.

    It stands where "pixels" are floats from 0 to 1: behind `GrayPixels` or `RgbPixels`, before
    `StandardizePixels`. It is no map from picture to picture: with no environment around it, where
    a single picture is looked at, nothing goes wrong.

    What is drawn in an episode follows from the stream out of which the environment drew that
    episode, which is left where it stands (`DroneEnv.side_streams`). So it is seeded with the
    environment, the first k worlds are the same whatever the size of the batch, and with or without
    a fault, or at another strength, the same episodes are flown. A task that draws nothing at a
    reset meets the same random numbers in every episode of a world.

    Partial resets and steps are honoured: a world outside the mask keeps its memory, and shows what
    it last showed. `state_dict` holds all that is needed to go on within episodes.
    """

    def __init__(self) -> None:
        """Nothing is remembered before the first reset."""
        super().__init__(in_keys=["pixels"], out_keys=["pixels"])
        self._memory: Tensor | None = None
        self._streams: list[np.random.Generator] = []

    @abc.abstractmethod
    def begin(self, pictures: Tensor, streams: Streams) -> Tensor:
        """What is remembered with the first pictures of episodes.

        Args:
            pictures: From 0 to 1. Shape: (k, C, H, W).
            streams: Of these worlds.

        Returns:
            Shape: (k, *).
        """

    @abc.abstractmethod
    def go_on(self, memory: Tensor, pictures: Tensor, streams: Streams) -> Tensor:
        """What is remembered after the next pictures; see `begin`.

        Args:
            memory: From before them. Shape: (k, *).
            pictures: Shape (k, C, H, W).
            streams: Of these worlds.
        """

    @abc.abstractmethod
    def show(self, memory: Tensor, pictures: Tensor) -> Tensor:
        """What the cameras show. Shape: (N, C, H, W).

        Args:
            memory: With these pictures in it. Shape: (N, *).
            pictures: Shape (N, C, H, W).
        """

    def _apply_transform(self, obs: Tensor) -> Tensor:
        return obs

    def _reset(
        self, tensordict: TensorDictBase, tensordict_reset: TensorDictBase
    ) -> TensorDictBase:
        pictures = self._checked(tensordict_reset.get("pixels"))
        mask = tensordict.get("_reset", None) if self._knows(pictures) else None
        self._begin(_indices(mask, pictures), pictures)
        return self._shown(tensordict_reset, pictures)

    def _step(self, tensordict: TensorDictBase, next_tensordict: TensorDictBase) -> TensorDictBase:
        pictures = next_tensordict.get("pixels")
        if self._memory is None or not self._knows(pictures):
            raise InputError(f"{type(self).__name__} was given a step before any reset; reset()")
        worlds = _indices(tensordict.get("_step", None), pictures)
        streams = [self._streams[i] for i in worlds.tolist()]
        before = _rows(self._memory.to(pictures.device), worlds)
        self._remember(worlds, self.go_on(before, _rows(pictures, worlds), streams))
        return self._shown(next_tensordict, pictures)

    def _knows(self, pictures: Tensor) -> bool:
        """Whether there is a memory of so many worlds."""
        return self._memory is not None and len(self._memory) == len(pictures)

    def _begin(self, worlds: Tensor, pictures: Tensor) -> None:
        fresh = self._worlds().side_streams(worlds, *self._key())
        begun = dict(zip(worlds.tolist(), fresh, strict=True))
        self._streams = [begun.get(i) or self._streams[i] for i in range(len(pictures))]
        if begun:
            self._remember(worlds, self.begin(_rows(pictures, worlds), fresh))

    def _remember(self, worlds: Tensor, memory: Tensor) -> None:
        """Never in place: what was shown or saved may be what was remembered."""
        if self._memory is None or len(worlds) == len(self._streams):
            self._memory = memory
        else:
            self._memory = self._memory.to(memory.device).index_copy(0, worlds, memory)

    def _shown(self, tensordict: TensorDictBase, pictures: Tensor) -> TensorDictBase:
        assert self._memory is not None
        return tensordict.set("pixels", self.show(self._memory.to(pictures.device), pictures))

    def _checked(self, pictures: Tensor) -> Tensor:
        name = type(self).__name__
        if not pictures.is_floating_point():
            raise InputError(f"{name} got {pictures.dtype} pictures; let gray or rgb come first")
        low, high = (float(end) for end in pictures.aminmax())
        if not (low >= 0 and high <= 1):
            raise InputError(
                f"{name} got pictures from {low:.3g} to {high:.3g}; put it behind gray or rgb and "
                "before standardize, where they are from 0 to 1"
            )
        return pictures

    def _worlds(self) -> DroneEnv:
        base: Any = getattr(self.container, "base_env", None)
        if not isinstance(base, DroneEnv):
            raise InputError(
                f"{type(self).__name__} stands before {type(base).__name__}, whose worlds have no "
                "random streams; put it before a DroneEnv"
            )
        return base

    def _key(self) -> tuple[int, int]:
        """Tells this fault from others, by its kind and its place among those of its kind."""
        env: Any = self.container
        same = [t for t in env.transform.modules() if type(t) is type(self)]
        number = next(i for i, transform in enumerate(same) if transform is self)
        return zlib.crc32(type(self).__name__.encode()), number

    def get_extra_state(self) -> dict[str, Any]:
        """What is remembered, and where the random streams stand; part of `state_dict`."""
        states = [stream.bit_generator.state for stream in self._streams]
        return {"memory": self._memory, "streams": states}

    def set_extra_state(self, state: dict[str, Any]) -> None:
        """Goes on with what `get_extra_state` found.

        Raises:
            InputError: It was saved by another number of worlds.
        """
        memory, saved = state["memory"], state["streams"]
        expected = len(self._streams)
        if expected and len(saved) != expected:
            raise InputError(
                f"the saved {type(self).__name__} has {len(saved)} worlds, this one {expected}; "
                f"set num_envs={len(saved)}"
            )
        streams = [np.random.Generator(np.random.PCG64(0)) for _ in saved]
        for stream, where in zip(streams, saved, strict=True):
            stream.bit_generator.state = where
        self._memory, self._streams = memory, streams


def normal(streams: Streams, shape: Sequence[int], device: torch.device) -> Tensor:
    """Independent numbers of mean 0 and variance 1. Shape: (len(streams), *shape)."""
    numbers = np.empty((len(streams), *shape), np.float32)
    for stream, row in zip(streams, numbers, strict=True):
        stream.standard_normal(out=row, dtype=np.float32)
    return torch.from_numpy(numbers).to(device)


def uniform(streams: Streams, shape: Sequence[int], device: torch.device) -> Tensor:
    """Independent numbers from 0 to below 1. Shape: (len(streams), *shape)."""
    numbers = np.empty((len(streams), *shape), np.float32)
    for stream, row in zip(streams, numbers, strict=True):
        stream.random(out=row, dtype=np.float32)
    return torch.from_numpy(numbers).to(device)


def _indices(mask: Tensor | None, pictures: Tensor) -> Tensor:
    count = len(pictures)
    if mask is None:
        return torch.arange(count, device=pictures.device)
    return mask.reshape(count).nonzero()[:, 0].to(pictures.device)


def _rows(values: Tensor, worlds: Tensor) -> Tensor:
    return values if len(worlds) == len(values) else values[worlds]
