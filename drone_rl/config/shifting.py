"""What flights under other conditions can be told."""

import dataclasses
from typing import Annotated, Any

from drone_rl.config import RendererName
from drone_rl.utils.errors import InputError
from drone_rl.utils.schema import Listed, Maybe, OneOf, Real, Colors, Whole
from drone_rl.utils.settings import Settings

MODES = ("constant", "drifting", "onset")


@dataclasses.dataclass(frozen=True, kw_only=True)
class ShiftSettings(Settings):
    """Which conditions a policy is flown under, and how often.

    Raises:
        InputError: A value is out of range, strengths don't rise, or nothing is constant.
    """

    axes: Annotated[Any, Maybe(Listed("axis"))] = None
    """Axes, or groups of them; none for all that the task has."""
    strengths: Annotated[tuple[int, ...], Several(Whole(1, 5), 1, 5)] = (1, 2, 3, 4, 5)
    """Which of the five strengths of each axis, from the weakest on; rising."""
    modes: Annotated[tuple[str, ...], Several(OneOf(MODES), 1, 3)] = MODES
    """When a condition holds: constant, drifting within the strength, or from an onset on."""
    domain: bool = True
    """Whether to search for the widest range of each axis in which the policy stays good."""
    episodes: Annotated[int, Whole(1, 100_000, "episodes")] = 200
    """Flights under each condition, each in a world of its own; the same worlds for all."""
    domain_episodes: Annotated[int, Whole(1, 100_000, "episodes")] = 400
    """The same of each strength at which the range's ends are looked for: more make it wider."""
    seed: Annotated[int, Whole(0)] | None = None
    """Root of the held-out environments' random streams; null takes a fresh one from the operating
    system, which is printed and recorded."""
    good_share: Annotated[float, Real(0.0, 1.0, is_above=True, is_below=True)] = 0.9
    """A good policy succeeds in more than this share of the oracle's episodes."""
    possible_share: Annotated[float, Real(0.0, 1.0, is_above=True, is_below=True)] = 0.9
    """A strength is impossible if who knows where all is that the camera shows surely succeeds less
    often."""
    device: str = "cpu"
    """Where worlds are drawn and the policy runs: cpu, cuda or cuda:N."""
    renderer: RendererName = "raytrace"
    """Who draws: raytrace, our own, or mujoco_warp, MuJoCo Warp's."""

    def check(self) -> None:
        """Refuses strengths twice, and what has nothing to be compared with."""
        if [*self.strengths] != sorted({*self.strengths}):
            raise InputError(f"strengths={[*self.strengths]} don't rise; give each once, in order")
        if MODES[0] not in self.modes:
            raise InputError(
                f"modes={[*self.modes]} leaves out constant, with which all others are compared; "
                "add it"
            )
