"""Result of a training run, the file `result.json` in its folder; needs no torch."""

import contextlib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Self

import pydantic
from pydantic import NonNegativeFloat, NonNegativeInt, PositiveFloat

from drone_rl.utils.models import Stored

NAME = "result.json"
_Rate = Annotated[float, pydantic.Field(ge=0.0, le=1.0)]


class Cloning(Stored):
    """Result of behavior cloning, also saved in checkpoints."""

    folder: str
    """Folder of the demonstrations."""
    demonstrations: NonNegativeInt
    """Demonstrations that it learned from."""
    frames: NonNegativeInt
    """Frames of these."""
    held_out_demonstrations: NonNegativeInt
    """Demonstrations that were only used to measure."""
    held_out_frames: NonNegativeInt
    """Frames of these."""
    epochs: NonNegativeInt
    loss: float
    """Mean over the frames of the last epoch, measured while learning."""
    accuracy: _Rate
    """Fraction of the same frames whose most probable action is the recorded one."""
    held_out_loss: float | None
    """Mean loss after the last epoch; None without held-out demonstrations."""
    held_out_accuracy: _Rate | None
    seconds: NonNegativeFloat


class Round(Stored):
    """Result of one search for failures; the next training starts episodes there."""

    frames: NonNegativeInt
    """Frames that training has collected so far."""
    trained_s: NonNegativeFloat
    """Training time so far, seconds."""
    flights: NonNegativeInt
    """Greedy episodes, each from its own placement."""
    failures: NonNegativeInt
    """Failed episodes."""
    losing: float | None = None
    """Fraction of all placements proved to fail; None without a proof."""
    undecided: float | None = None
    """Fraction of all placements that the proof leaves open."""
    proof_s: float | None = None
    """Duration of the proof since its last resume, seconds."""
    boxes: NonNegativeInt
    """Boxes of failures to train on."""


class OwnVerdict(Stored, extra="allow"):
    """Verdict of the last policy: the entries of a `drone_rl.trust.results.Verdict`."""

    kind: str = ""
    rule: str = ""
    """The rule as text."""


class RunResult(Stored):
    """Why a training run stopped, and how far it came."""

    reason: Annotated[str, pydantic.Field(max_length=100)]
    """Why it stopped: "solved", "frames", "episodes", "proved", a signal's name, or a callback's
    `stop_request`, such as "pruned"."""
    frames: NonNegativeInt = 0
    episodes: NonNegativeInt = 0
    updates: NonNegativeInt = 0
    seconds: NonNegativeFloat = 0.0
    """Training time, over all resumptions."""
    running_reward: float = 0.0
    """Running mean of the episodes' rewards."""
    largest_reward: PositiveFloat | None
    """Largest reward of an episode; None if the task does not know it."""
    confirming_attempts: NonNegativeInt = 0
    """Confirmations since the run began or was last resumed."""
    confirming_flights: NonNegativeInt = 0
    """Greedy episodes of the last confirmation."""
    confirming_flights_succeeded: NonNegativeInt = 0
    collapsed_at_frames: NonNegativeInt | None = None
    """Frames when learning collapsed; None if it did not."""
    cloning: Cloning | None = None
    """None without demonstrations."""
    rounds: tuple[Round, ...] = ()
    """Searches for failures, with `provable.rounds`."""
    verdict: OwnVerdict | None = None
    """None if the last policy was not judged."""

    @property
    def is_interrupted(self) -> bool:
        """Whether a signal stopped it, so that it is unfinished."""
        return self.reason.startswith("SIG")

    def with_verdict(self, verdict: Mapping[str, Any]) -> Self:
        """Return a copy with the plain data of a verdict."""
        return self.replace(verdict=OwnVerdict.read(verdict, "verdict"))

    def write(self, folder: Path) -> None:
        """Write it to the folder of its run."""
        self.write_json(folder / NAME)

    @classmethod
    def of(cls, folder: Path) -> Self | None:
        """Return the result of a finished run, or None for an unfinished one.

        Raises:
            InputError: The file is damaged.
        """
        path = folder / NAME
        result = cls.read_json(path) if path.exists() else None
        return None if result is None or result.is_interrupted else result


def read_result(folder: Path) -> RunResult | None:
    """Return the result of a finished run; None for an unfinished run or a damaged file."""
    with contextlib.suppress(ValueError):
        return RunResult.of(folder)
    return None
