"""Training until nothing is left that the policy fails at, and that is proved.

A round: failures are searched for, first in flights, which are cheap, and where those find none by
a proof, which misses none; then training goes on with a share of its episodes where they were.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drone_rl.config.provable import ProvableSettings
from drone_rl.config.training import TrainSettings
from drone_rl.evaluation.rollouts import find_failures
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.policies.zoo import read_checkpoint
from drone_rl.sim.tasks import Practice
from drone_rl.sim.tasks.collect_cubes.practice import inflated
from drone_rl.training import Callback
from drone_rl.training.progress import OngoingTraining
from drone_rl.training.train import (
    Tell,
    Training,
    finish,
    hand_on_signal,
    last_of,
    learn,
    new_folder,
)
from drone_rl.utils.files import folder_lock, write_atomically
from drone_rl.utils.progress import Bar, Progress
from drone_rl.utils.seeding import Stream
from drone_rl.verification.journal import Journal, Round
from drone_rl.verification.prove import Proof, prove
from drone_rl.verification.prover.boxes import volumes

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
        callbacks = [_Note(journal), *callbacks, Tell(progress)]
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
        practice = Practice(journal.task, failures, how.share) if len(failures) else None
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
