"""What an evaluation and a verdict can be told."""

import dataclasses
from typing import Annotated

from drone_rl.config import RendererName
from drone_rl.utils.schema import Real, Whole
from drone_rl.utils.settings import Settings


@dataclasses.dataclass(frozen=True, kw_only=True)
class FlightSettings(Settings):
    """How many episodes are flown, in which worlds, and where."""

    episodes: Annotated[int, Whole(1, unit="episodes")] = 1000
    """Held-out episodes, each in a world of its own; the same worlds for all that is flown."""
    seed: Annotated[int, Whole(0)] | None = None
    """Root of the held-out environments' random streams; null takes a fresh one from the operating
    system, which is printed and recorded."""
    num_envs: Annotated[int, Whole(1, unit="worlds")] = 250
    """Worlds in one batch; bounds memory."""
    device: str = "cpu"
    """Where worlds are drawn and the policy runs: cpu, cuda or cuda:N."""
    renderer: RendererName = "raytrace"
    """Who draws: raytrace, our own, or mujoco_warp, MuJoCo Warp's."""

    @property
    def num_worlds(self) -> int:
        """Worlds in a batch, of which none flies in vain."""
        return min(self.num_envs, self.episodes)


@dataclasses.dataclass(frozen=True, kw_only=True)
class EvaluateSettings(FlightSettings):
    """How a policy is evaluated."""

    baselines: bool = True
    """Whether to evaluate luck (random actions, each action always) and the oracle beside it."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class JudgeSettings(FlightSettings):
    """How a policy is judged."""

    episodes: Annotated[int, Whole(1, unit="episodes")] = 400
    """Held-out episodes, flown greedily, with drawn actions and by luck and the oracle alike."""
    num_envs: Annotated[int, Whole(1, unit="worlds")] = 400
    """Worlds in one batch; bounds memory."""
    sampled: bool = True
    """Whether to fly the policy with drawn actions, too; told beside the verdict."""
    good_share: Annotated[float, Real(0.0, 1.0, is_above=True, is_below=True)] = 0.9
    """A good policy succeeds in more than this share of the oracle's episodes."""
    certificate_flights: Annotated[int, Whole(0, 10_000_000, "flights")] = 1000
    """Rollouts that re-check a certificate, as `drone-rl check` does; with 0 it proves nothing."""
    domain_flights: Annotated[int, Whole(0, 100_000, "episodes")] = 200
    """New episodes at each strength of a sample of those of a required domain; with 0 it is not
    covered."""
