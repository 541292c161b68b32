"""One seed, many random streams that never overlap.

Every stream is a child of `numpy.random.SeedSequence(seed)` with a key of its own, so the streams
of two worlds, of two purposes, or of seed and seed + 1 share nothing.
"""

import dataclasses
import enum
import secrets
from typing import Any, Protocol, Self, TypeVar

import numpy as np
import torch

from drone_rl.utils.errors import InputError


class Stream(enum.IntEnum):
    """What a random stream is for."""

    WORLDS = 0
    POLICY_INIT = 1
    ACTIONS = 2
    CHOICE = 3
    """Worlds by which one policy of several is chosen; never those of a report."""
    REPORT = 4
    """Worlds of which figures are reported; nothing is ever chosen by them."""
    SEARCH = 5
    """Worlds in which a training looks for what its policy can't do yet."""
    CRITIC_INIT = 6
    MINIBATCHES = 7
    """The order in which a learner goes through the steps of a batch."""
    CONFIRMATION = 8
    """Worlds in which a training makes sure that it has solved its task."""
    SHIFTED = 9
    """Worlds in which a policy is flown under other conditions than it was trained in."""
    SHIFTS = 10
    """How these conditions differ from world to world and from step to step."""
    SENSORS = 11
    """Noise of what drones sense beside pictures."""
    SCENES = 12
    """Where explanations place a target."""


FRESH_BITS = 48
"""Of a fresh seed: short enough to copy by hand, and exact in JSON and JavaScript."""
_LEGACY_BITS = 32
"""Of the largest seed that `numpy.random.RandomState` and its users take."""


class _Seeded(Protocol):
    """Settings with a seed that may be left open."""

    @property
    def seed(self) -> int | None: ...

    def replace(self, **changes: Any) -> Self: ...


T = TypeVar("T", bound=_Seeded)


@dataclasses.dataclass(frozen=True)
class RootSeed:
    """The root of all random streams of one analysis, and where it comes from."""

    value: int
    """The seed."""
    is_fixed: bool
    """Whether it was chosen beforehand, so that a policy could have been fitted to it."""

    def as_dict(self) -> dict[str, Any]:
        """Plain values, as in every result that states a claim."""
        return {"seed": self.value, "seed_is_fixed": self.is_fixed}


def fresh_seed() -> int:
    """A seed from the operating system's entropy, which nobody can know beforehand."""
    return secrets.randbits(FRESH_BITS)


def root_seed(given: int | None) -> RootSeed:
    """The seed that a user gives, or a fresh one."""
    return RootSeed(fresh_seed(), False) if given is None else RootSeed(given, True)


def with_seed(settings: T, drawn: RootSeed | None = None) -> tuple[T, RootSeed]:
    """Make the seed of settings concrete.

    Call it once, where an analysis begins; what it calls gets the returned settings.

    Args:
        settings: Of an analysis; a seed of None takes a fresh one.
        drawn: The root seed of a larger analysis of which this one is a part; takes precedence.

    Returns:
        The settings with a seed that is a number, and that seed.
    """
    drawn = drawn or root_seed(settings.seed)
    return settings.replace(seed=drawn.value), drawn


def legacy_seed(seed: int) -> int:
    """A seed for generators that take 32 bits only; the seed itself if it is that short."""
    if seed < 2**_LEGACY_BITS:
        return seed
    return int(seed_sequence(seed).generate_state(1, np.uint32)[0])


def seed_sequence(seed: int, *key: int) -> np.random.SeedSequence:
    """The child of `seed` under `key`.

    Raises:
        InputError: The seed is not a whole number, 0 or more.
    """
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise InputError(f"seed={seed!r} is out of range; give a whole number, 0 or more")
    return np.random.SeedSequence(int(seed), spawn_key=key)


def world_random_state(
    seed: int, world: int, stream: Stream = Stream.WORLDS
) -> np.random.RandomState:
    """The stream from which one world draws all its episodes."""
    return np.random.RandomState(np.random.PCG64(seed_sequence(seed, stream, world)))


def side_stream(random_state: np.random.RandomState, *key: int) -> np.random.Generator:
    """A stream beside that of a world, which is left where it stands.

    It follows from where that one stands and from the key alone, so it needs no seed of its own,
    and begins the same wherever the world's goes on from a saved state.
    """
    own = get_state(random_state)
    child = np.random.SeedSequence([own["state"], own["inc"]], spawn_key=key)
    return np.random.Generator(np.random.PCG64(child))


def torch_generator(
    seed: int, stream: Stream, *, number: int = 0, device: torch.device | str = "cpu"
) -> torch.Generator:
    """A torch generator for one purpose; `number` tells apart those of several workers."""
    state = seed_sequence(seed, stream, number).generate_state(1, np.uint64)[0]
    return torch.Generator(device).manual_seed(int(state >> np.uint64(1)))


def get_state(random_state: np.random.RandomState) -> dict[str, int]:
    """The state of a `world_random_state` as plain numbers.

    `RandomState` buffers nothing else for the uniform draws that worlds make.
    """
    return dict(random_state.get_state(legacy=False)["state"])


def set_state(random_state: np.random.RandomState, state: dict[str, int]) -> None:
    """Puts a `world_random_state` where `get_state` found one."""
    full = random_state.get_state(legacy=False)
    random_state.set_state({**full, "state": dict(state)})
