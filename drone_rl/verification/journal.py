"""What a training until proved has behind it, on disk: enough to go on after whatever ended it."""

import dataclasses
import io
import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray

from drone_rl.config import TaskSettings
from drone_rl.config.configuration import as_config, check_same_config
from drone_rl.config.training import TrainSettings
from drone_rl.config.verification import ProvableSettings
from drone_rl.sim.tasks.collect_cubes import require_cubes, require_moves
from drone_rl.training.train import MAY_CHANGE, settings_of
from drone_rl.utils.archives import read_array
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import read_json, write_atomically
from drone_rl.utils.schema import Plain, Real, Record, Several, Whole
from drone_rl.utils.settings import Settings

HOW_MAY_CHANGE = ("rounds", "limit_s")
"""What a resumed run may change of its rounds."""
_Count = Annotated[int, Whole(0, 2**62)]
_Seconds = Annotated[float, Real(0.0, 1e12)]
_Share = Annotated[float, Real(0.0, 1.0)]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Round(Settings):
    """A search for failures, which are practised next."""

    frames: _Count
    """That training had collected."""
    trained_s: _Seconds
    """Seconds that it had spent."""
    flights: _Count
    """Greedy ones, each from a placement of its own."""
    failures: _Count
    """Of these flights."""
    losing: _Share | None = None
    """Share of all placements that is proved to fail; none where no proof was made."""
    undecided: _Share | None = None
    """Share of all placements of which the proof says nothing."""
    proof_s: _Seconds | None = None
    """Seconds that the proof took."""
    boxes: _Count
    """Places of failures to practise."""


@dataclasses.dataclass
class Journal:
    """The rounds of one training, in its folder."""

    folder: Path
    settings: TrainSettings
    how: ProvableSettings
    rounds: list[Round]
    is_noted: bool = dataclasses.field(default=True, compare=False)
    """Whether its file says what this says."""

    @classmethod
    def open(
        cls,
        folder: Path,
        settings: TrainSettings | None,
        how: ProvableSettings | None,
        state: Mapping[str, Any] | None,
        changes: Mapping[str, Any],
    ) -> Self:
        """Begins a journal, or goes on with the one that is in the folder.

        Where there is a checkpoint, nothing is written before `note`.

        Args:
            folder: Of the training.
            settings: Its own; None for those that it was begun with, or the defaults.
            how: What a round is; None likewise.
            state: Of the checkpoint to go on from, if any; of a usual training, too.
            changes: Of the settings.

        Raises:
            InputError: It is damaged, or was begun with other settings.
        """
        path, rounds = folder / "provable.json", []
        saved = _JOURNAL.read(read_json(path), str(path)) if state and path.exists() else None
        if settings is None and state is not None:
            settings = settings_of(saved["settings"] if saved else state["config"])
        settings = (settings or TrainSettings()).replace(**changes)
        if saved is not None:
            how = how or ProvableSettings.read(saved["how"], "how")
            check_same_config(saved["settings"], as_config(settings), MAY_CHANGE)
            check_same_config(saved["how"], how.values(), HOW_MAY_CHANGE)
            rounds = [Round.read(row, "rounds") for row in saved["rounds"]]
        journal = cls(folder, settings, how or ProvableSettings(rounds=10), rounds, is_noted=False)
        _ = journal.task  # refused before anything is written
        if state is None:  # whoever is killed from here on finds the rounds of this training
            journal.note()
        return journal

    def note(self) -> None:
        """Writes it, once the training has accepted the settings; forgets what lay there before."""
        if self.is_noted:
            return
        if not self.rounds:
            shutil.rmtree(self.folder / "rounds", ignore_errors=True)
        self._write()

    @property
    def task(self) -> TaskSettings:
        """The task, of which something can be proved."""
        told, what = self.settings, "training until it is proved"
        require_moves(told.dynamics, told.actions, what)
        return require_cubes(told.task, what)

    @property
    def is_proved(self) -> bool:
        """Whether the last search was a proof that found nothing left."""
        last = self.rounds[-1] if self.rounds else None
        return last is not None and last.losing == last.undecided == last.boxes == 0

    @property
    def is_over(self) -> bool:
        """Whether it is proved, or nothing is left of rounds or frames."""
        if not self.rounds:
            return False
        is_spent = self.rounds[-1].frames >= self.settings.trainer.total_frames
        return self.is_proved or len(self.rounds) > self.how.rounds or is_spent

    @property
    def certificate(self) -> Path | None:
        """That of the last search, if it was a proof."""
        path = self.folder / "rounds" / str(len(self.rounds) - 1) / "certificate.json"
        is_proof = bool(self.rounds) and self.rounds[-1].losing is not None
        return path if is_proof and path.exists() else None

    @property
    def next_folder(self) -> Path:
        """For what the next search leaves."""
        return self.folder / "rounds" / str(len(self.rounds))

    def add(self, done: Round, failures: NDArray[np.float64]) -> None:
        """Notes a search.

        Args:
            done: What it found.
            failures: Boxes to practise, metres. Shape: (boxes, num_cubes, 2).
        """
        buffer = io.BytesIO()
        np.save(buffer, failures)
        self.next_folder.mkdir(parents=True, exist_ok=True)
        write_atomically(self.next_folder / "failures.npy", buffer.getvalue())
        self.rounds.append(done)
        self._write()

    def failures(self) -> NDArray[np.float64]:
        """Those of the last search. Shape: (boxes, num_cubes, 2), metres.

        Raises:
            InputError: They are damaged.
        """
        path = self.folder / "rounds" / str(len(self.rounds) - 1) / "failures.npy"
        cubes = self.task.num_cubes
        try:
            boxes = read_array(path)
            if boxes.dtype != np.float64 or boxes.shape[1:] != (cubes, 2) or not _are_boxes(boxes):
                raise InputError(f"it holds no boxes of {cubes} cubes")
        except InputError as error:
            raise InputError(f"{path} is damaged ({error}); train again") from None
        return boxes

    def _write(self) -> None:
        noted = {
            "settings": as_config(self.settings),
            "how": self.how.values(),
            "rounds": [done.values() for done in self.rounds],
        }
        write_atomically(self.folder / "provable.json", json.dumps(noted, indent=2))
        self.is_noted = True


def _are_boxes(boxes: NDArray[np.float64]) -> bool:
    return bool(np.isfinite(boxes).all() and (boxes[..., 0] <= boxes[..., 1]).all())


_JOURNAL = Record({"settings": Plain(), "how": Plain(), "rounds": Several(Plain(), 0, 10_000)})
