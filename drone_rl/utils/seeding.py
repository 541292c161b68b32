"""Independent random streams from one seed.

A stream is a child of `numpy.random.SeedSequence(seed)` with its own key, so the streams of two
environments, of two purposes, or of seed and seed + 1 don't overlap. The exceptions are
`side_stream`, and `plain_generator` and `legacy_seed`, which use the seed itself.
"""

import contextlib
import dataclasses
import enum
import secrets
import threading
from collections.abc import Iterator
from typing import Any, Protocol, Self, TypeVar

import numpy as np
import torch

from drone_rl.utils.errors import InputError


class Stream(enum.IntEnum):
    """Purpose of a random stream."""

    WORLDS = 0
    """Environments of training."""
    POLICY_INIT = 1
    ACTIONS = 2
    CHOICE = 3
    """Environments for the selection of policies."""
    REPORT = 4
    """Environments for reported figures, never for selection."""
    SEARCH = 5
    """Environments in which a training searches for failures."""
    CRITIC_INIT = 6
    MINIBATCHES = 7
    """Order of a batch's steps in a learner."""
    CONFIRMATION = 8
    """Environments that confirm that a training has solved its task."""
    SHIFTED = 9
    """Environments for evaluation under perturbations."""
    SHIFTS = 10
    """Perturbations of environments and steps."""
    SENSORS = 11
    """Noise of sensors other than cameras."""
    SCENES = 12
    """Positions of targets in explanations."""
    CLONING = 13
    """Held-out demonstrations, and the order of frames, in behavior cloning."""
    TORCH = 14
    """Draws of a training's parts that have no generator of their own, such as dropout."""


FRESH_BITS = 48
"""Bits of a fresh seed: exact in JSON and JavaScript, and short."""
_LEGACY_BITS = 32
"""Bits of the largest seed of `numpy.random.RandomState`."""

_GLOBAL = threading.RLock()
"""Held while torch's global generator continues another stream."""


class _Seeded(Protocol):
    """Settings with a seed that may be left open."""

    @property
    def seed(self) -> int | None: ...

    def replace(self, **changes: Any) -> Self: ...


T = TypeVar("T", bound=_Seeded)


@dataclasses.dataclass(frozen=True)
class RootSeed:
    """Root of all random streams of one analysis."""

    value: int
    """The seed."""
    is_fixed: bool
    """Whether it was known before, so that a policy could have been fitted to it."""

    def as_dict(self) -> dict[str, Any]:
        """Return the entries of every result that states a claim."""
        return {"seed": self.value, "seed_is_fixed": self.is_fixed}


def fresh_seed() -> int:
    """Return a seed from the operating system's entropy."""
    return secrets.randbits(FRESH_BITS)


def root_seed(seed: int | None) -> RootSeed:
    """Return the given seed, or a fresh one."""
    return RootSeed(fresh_seed(), False) if seed is None else RootSeed(seed, True)


def with_seed(settings: T, drawn: RootSeed | None = None) -> tuple[T, RootSeed]:
    """Return settings with a concrete seed, and that seed; call it once, where an analysis begins.

    A seed of None takes a fresh one. `drawn` is the root seed of the analysis that this one is part
    of, and takes precedence.
    """
    drawn = drawn or root_seed(settings.seed)
    return settings.replace(seed=drawn.value), drawn


def legacy_seed(seed: int) -> int:
    """Return a seed of 32 bits; the seed itself if it is that short."""
    if seed < 2**_LEGACY_BITS:
        return seed
    return int(seed_sequence(seed).generate_state(1, np.uint32)[0])


def seed_sequence(seed: int, *key: int) -> np.random.SeedSequence:
    """Return the child of `seed` under `key`; raise an `InputError` for an invalid seed."""
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise InputError(f"seed={seed!r} is out of range; give a whole number, 0 or more")
    return np.random.SeedSequence(int(seed), spawn_key=key)


def world_random_state(
    seed: int, world: int, stream: Stream = Stream.WORLDS
) -> np.random.RandomState:
    """Return the stream of all episodes of environment number `world`."""
    return np.random.RandomState(np.random.PCG64(seed_sequence(seed, stream, world)))


def side_stream(random_state: np.random.RandomState, *key: int) -> np.random.Generator:
    """Return a new stream, seeded by the state of an environment's stream, which is not advanced.

    It depends on the state and the key only, so it is the same after a restart from a saved state.
    """
    state = get_state(random_state)
    child = np.random.SeedSequence([state["state"], state["inc"]], spawn_key=key)
    return np.random.Generator(np.random.PCG64(child))


def plain_generator(seed: int) -> torch.Generator:
    """Return a torch generator seeded by the seed itself, of which it uses the last 64 bits."""
    return torch.Generator().manual_seed(seed % 2**64)


def torch_generator(
    seed: int, stream: Stream, *, number: int = 0, device: torch.device | str = "cpu"
) -> torch.Generator:
    """Return a torch generator for one purpose.

    `number` distinguishes streams of one purpose, such as those of workers, sensors or faults.
    """
    state = seed_sequence(seed, stream, number).generate_state(1, np.uint64)[0]
    return torch.Generator(device).manual_seed(int(state >> np.uint64(1)))


@contextlib.contextmanager
def as_global_stream(generator: torch.Generator | None) -> Iterator[None]:
    """Continue a CPU stream by torch's global generator; then restore that. None: do nothing.

    For code that draws from no other, such as the initialization of layers and dropout. Other
    threads wait to enter.
    """
    if generator is None:
        yield
        return
    with _GLOBAL:
        before = torch.get_rng_state()
        torch.set_rng_state(generator.get_state())
        try:
            yield
        finally:
            generator.set_state(torch.get_rng_state())
            torch.set_rng_state(before)


def get_state(random_state: np.random.RandomState) -> dict[str, int]:
    """Return the state of a `world_random_state`.

    That is the generator's, and the half of a 64-bit draw that it keeps for the next integer. There
    is no state of normal samples, which tasks must not draw by `RandomState`.
    """
    full = random_state.get_state(legacy=False)
    return {**full["state"], "has_uint32": full["has_uint32"], "uinteger": full["uinteger"]}


def set_state(random_state: np.random.RandomState, state: dict[str, int]) -> None:
    """Restore the state that `get_state` returned."""
    full = random_state.get_state(legacy=False)
    inner = {name: state[name] for name in ("state", "inc")}
    kept = {name: state[name] for name in ("has_uint32", "uinteger")}
    random_state.set_state({**full, "state": inner, **kept})
