"""Training until nothing is left that the policy fails at, and that is proved.

A round: failures are searched for, first in flights, which are cheap, and where those find none by
a proof, which misses none; then training goes on with a share of its episodes where they were.
"""

import dataclasses
import io
import json
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray

from drone_rl.config import TaskSettings
from drone_rl.config.configuration import as_config, check_same_config
from drone_rl.config.training import TrainSettings
from drone_rl.config.verification import ProvableSettings
from drone_rl.evaluation.rollouts import find_failures
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.policies.zoo import read_checkpoint
from drone_rl.sim.tasks import FailureReplayTask
from drone_rl.sim.tasks.failure_replay import inflated
from drone_rl.training import Callback
from drone_rl.training.callbacks import ForwardProgress, OngoingTraining
from drone_rl.training.run_folder import (
    MAY_CHANGE,
    Training,
    finish,
    hand_on_signal,
    last_of,
    new_folder,
    settings_of,
)
from drone_rl.training.train import learn
from drone_rl.utils.archives import read_array
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import folder_lock, read_json, write_atomically
from drone_rl.utils.progress import Bar, Progress
from drone_rl.utils.schema import Plain, Real, Record, Several, Whole
from drone_rl.utils.seeding import Stream
from drone_rl.utils.settings import Settings
from drone_rl.verification.prove import Proof, prove
from drone_rl.verification.prover.boxes import volumes
from drone_rl.verification.requirements import require_cubes, require_moves

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


WORLDS = 250
"""That search at the same time; each search flies in others."""


def train_until_proved(
    settings: TrainSettings | None = None,
    how: ProvableSettings | None = None,
    *,
    folder: str | Path | None = None,
    resume: bool = False,
    callbacks: Sequence[Callback] = (),
    progress: Progress | None = None,
    **changes: Any,
) -> Training:
    """Trains as usual, then in rounds, until the policy succeeds from every placement.

    The result's reason is "proved" if it does, and its "rounds" say what each search found. If the
    last search was a proof, its certificate is `certificate.json` in the folder.

    Args:
        settings: What is learned, how, and for how long in all.
        how: How many rounds, and what is done in them; 10 by default.
        folder: See `train`.
        resume: Whether to go on with what is in the folder, in whichever round it was left: what
            is learned is the same bit for bit, unless the clock stops a proof.
        callbacks: Told of every update.
        progress: Told how far each training and each proof is; a bar by default.
        changes: Settings of the training to change.

    Raises:
        InputError: A setting is unusable, nothing can be proved of such a policy, or learning broke
            down.
        KeyboardInterrupt: Ctrl-C stopped it, see `train`; a search for failures ends at once, and
            is repeated by a resume.
        SystemExit: SIGTERM stopped it, see `train`.
    """
    folder = new_folder() if folder is None else Path(folder)
    state = read_checkpoint(last_of(folder)) if resume else None
    folder.mkdir(parents=True, exist_ok=True)
    progress = progress or Bar()
    with folder_lock(folder):
        journal = Journal.open(folder, settings, how, state, changes)
        callbacks = [_Note(journal), *callbacks, ForwardProgress(progress)]
        result = _learn(journal, state, callbacks)
        while not (journal.is_over or result["reason"].startswith("SIG")):
            _search(journal, progress)
            if not journal.is_over:
                state = read_checkpoint(last_of(folder))
                result = _learn(journal, state, callbacks)
        certificate = journal.certificate
        if certificate is not None:
            write_atomically(folder / "certificate.json", certificate.read_bytes())
        if journal.is_proved and not result["reason"].startswith("SIG"):
            result["reason"] = "proved"
        result["rounds"] = [done.values() for done in journal.rounds]
        done = finish(journal.settings, folder, result)
    return hand_on_signal(done)


class _Note(Callback):
    """Writes the journal once the training has accepted its settings."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal

    def on_start(self, training: OngoingTraining) -> None:
        self._journal.note()


def _learn(
    journal: Journal, state: Mapping[str, Any] | None, callbacks: Sequence[Callback]
) -> dict[str, Any]:
    """Trains to the target at first, and then for a round's frames on its failures."""
    settings, how, practice = journal.settings, journal.how, None
    if journal.rounds:
        more = 0 if journal.is_over else how.frames
        until = min(journal.rounds[-1].frames + more, settings.trainer.total_frames)
        trainer = settings.trainer.replace(total_frames=until, target_share=None)
        settings, failures = settings.replace(trainer=trainer), journal.failures()
        practice = FailureReplayTask(journal.task, failures, how.share) if len(failures) else None
    return learn(settings, journal.folder, state, callbacks, practice)


def _search(journal: Journal, progress: Progress) -> None:
    """Looks for failures by flights, then by a proof, and notes them."""
    how = journal.how
    policy = load_policy(last_of(journal.folder))
    progress(f"{how.flights} flights in search of failures", 0, how.flights)
    places, flights = _fly(policy, journal)
    progress(f"{len(places)} of {flights} flights failed", how.flights, how.flights)
    proof, boxes = None, np.repeat(places[..., None], 2, -1)
    if not len(places):
        proof = prove(
            policy,
            folder=journal.next_folder,
            limit_s=how.limit_s,
            renderer=journal.settings.renderer,
            progress=progress,
        )
        boxes = _largest(_doubtful(proof), how.most_boxes)
    done = Round(
        frames=policy.state["progress"]["frames"],
        trained_s=policy.state["progress"]["seconds"],
        flights=flights,
        failures=len(places),
        losing=None if proof is None else proof.lost,
        undecided=None if proof is None else proof.undecided,
        proof_s=None if proof is None else proof.certificate["found"]["seconds"],
        boxes=len(boxes),
    )
    journal.add(done, inflated(boxes, how.margin, journal.task.lateral_bound))


def _fly(policy: Policy, journal: Journal) -> tuple[NDArray[np.float64], int]:
    """See `find_failures`; in worlds of this search alone."""
    settings, how = journal.settings, journal.how
    if not how.flights:
        return np.empty((0, journal.task.num_cubes)), 0
    env = policy.make_env(
        min(WORLDS, how.flights),
        seed=settings.seed,
        stream=Stream.SEARCH,
        device=settings.device,
        renderer=settings.renderer,
        first_world=len(journal.rounds) * WORLDS,
    )
    try:
        return find_failures(env, policy.make_actor(env), how.flights, how.enough)
    finally:
        env.close()


def _doubtful(proof: Proof) -> NDArray[np.float64]:
    """What fails or may fail; where a proof was stopped, only what is known to fail."""
    is_whole = proof.certificate["finished"]
    return np.concatenate([proof.losing(), proof.open()]) if is_whole else proof.losing()


def _largest(boxes: NDArray[np.float64], most: int) -> NDArray[np.float64]:
    """So many boxes at most, by volume."""
    return boxes[np.argsort(-volumes(boxes), kind="stable")[:most]]
