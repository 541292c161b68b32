"""`drone-rl train provable.rounds=N`: train until a proof finds no placement of failure."""

import dataclasses
import io
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Self

import numpy as np
import torch
from numpy.typing import NDArray
from tensordict.nn import TensorDictModuleBase
from torchrl.envs import EnvBase

from drone_rl.collectors.complete_episodes import rollout
from drone_rl.config import TaskSettings
from drone_rl.config.commands import ProvableSettings, ProveSettings
from drone_rl.config.configuration import check_same_config, from_arguments
from drone_rl.config.training import TrainSettings
from drone_rl.envs.rollout import Agent
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.policies.zoo import Checkpoint, describe, read_checkpoint
from drone_rl.sim.tasks import FailureReplayTask
from drone_rl.sim.tasks.collect_cubes import inflated
from drone_rl.training import Callback
from drone_rl.training.callbacks import OngoingTraining, with_progress
from drone_rl.training.run_folder import (
    MAY_CHANGE,
    Judge,
    RunFolder,
    Training,
    finish,
    reraise_signal,
    settings_of,
)
from drone_rl.training.train import learn
from drone_rl.trust.verdict import check_judged, judge_for_selection
from drone_rl.utils.archives import read_array
from drone_rl.utils.files import last_of, read_json, write_atomically
from drone_rl.utils.models import Model
from drone_rl.utils.progress import Progress, as_progress
from drone_rl.utils.run_result import Round, RunResult
from drone_rl.utils.schema import Instance
from drone_rl.utils.seeding import Stream
from drone_rl.verification.prove import STATE_NAME, Proof, prove
from drone_rl.verification.prover.boxes import volumes
from drone_rl.verification.prover.policy_spec import make_policy_spec, partition_placements
from drone_rl.verification.requirements import require_cubes

WORLDS = 250  # environments of a search; each search uses other seeds
HOW_MAY_CHANGE = ("rounds", "limit_s")  # settings of rounds that a resumed run may change


class _Saved(Model):
    """The content of `provable.json`."""

    settings: dict[str, Any]
    how: ProvableSettings
    rounds: tuple[Round, ...]


@dataclasses.dataclass
class Journal(Callback):
    """The rounds of one training run, saved in its folder once the settings are accepted."""

    folder: Path
    settings: TrainSettings
    how: ProvableSettings
    rounds: list[Round]

    @classmethod
    def open(
        cls,
        folder: Path,
        settings: TrainSettings | None,
        how: ProvableSettings | None,
        state: Checkpoint | None,
        changes: Mapping[str, Any],
    ) -> Self:
        """Start a journal or, with a checkpoint, continue the one in the folder, if there is one.

        Settings that are None are the saved ones, or the defaults. Nothing is written before
        `on_start`.

        Raises:
            InputError: It is damaged, or has other settings.
        """
        path, rounds = folder / "provable.json", []
        saved = _Saved.read(read_json(path), str(path)) if state and path.exists() else None
        if settings is None and state is not None:
            settings = settings_of(saved.settings if saved else state.config)
        settings = from_arguments(TrainSettings, settings, changes, train_until_proved)
        if saved is not None:
            how = how or saved.how
            before = TrainSettings.read(saved.settings)
            check_same_config(before.config(), settings.config(), MAY_CHANGE)
            check_same_config(saved.how.values(), how.values(), HOW_MAY_CHANGE)
            rounds = [*saved.rounds]
        how = how or ProvableSettings(rounds=10)
        _check_support(settings)  # refused before anything is written
        return cls(folder, settings, how, rounds)

    def on_start(self, training: OngoingTraining) -> None:
        """Write the file."""
        self.save()

    def on_update(self, training: OngoingTraining, metrics: Mapping[str, float]) -> None:
        """Delete the state of an unfinished proof, which is of the policy before this update."""
        (self.next_folder / STATE_NAME).unlink(missing_ok=True)

    @property
    def task(self) -> TaskSettings:
        """The task, if it can be proved."""
        return require_cubes(describe(self.settings), "proofs")

    @property
    def is_proved(self) -> bool:
        """Whether the last search was a proof that left nothing open."""
        last = self.rounds[-1] if self.rounds else None
        return last is not None and last.losing == last.undecided == last.boxes == 0

    @property
    def is_over(self) -> bool:
        """Whether it is proved, or the rounds or frames are used up."""
        if not self.rounds:
            return False
        is_spent = self.rounds[-1].frames >= self.settings.trainer.total_frames
        return self.is_proved or len(self.rounds) > self.how.rounds or is_spent

    @property
    def certificate(self) -> Path | None:
        """The certificate of the last search, if it was a proof."""
        path = self._folder_of(len(self.rounds) - 1) / "certificate.json"
        is_proof = bool(self.rounds) and self.rounds[-1].losing is not None
        return path if is_proof and path.exists() else None

    @property
    def next_folder(self) -> Path:
        """Folder of the next search."""
        return self._folder_of(len(self.rounds))

    def _folder_of(self, search: int) -> Path:
        return self.folder / "rounds" / str(search)

    def forget_after(self, frames: int) -> None:
        """Forget searches of later policies than that of a checkpoint with so many frames."""
        self.rounds = [search for search in self.rounds if search.frames <= frames]

    def add(self, search: Round, failures: NDArray[np.float64]) -> None:
        """Record a search and the boxes to train on, metres, shape (boxes, num_cubes, 2)."""
        buffer = io.BytesIO()
        np.save(buffer, failures)
        self.next_folder.mkdir(parents=True, exist_ok=True)
        write_atomically(self.next_folder / "failures.npy", buffer.getvalue())
        self.rounds.append(search)
        self.save()

    def failures(self) -> NDArray[np.float64]:
        """Return the boxes of the last search. Shape: (boxes, num_cubes, 2), metres."""
        return read_array(self._folder_of(len(self.rounds) - 1) / "failures.npy")

    def save(self) -> None:
        """Write the file."""
        saved = _Saved(settings=self.settings.config(), how=self.how, rounds=tuple(self.rounds))
        saved.write_json(self.folder / "provable.json")


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
    """Train as usual, then in rounds, until the policy succeeds from every placement.

    Each round searches for failures: first in episodes, which are fast, and if all succeed by a
    proof, which misses none. Then training continues, with a fraction of its episodes at failures.
    The result's reason is "proved" if the last proof leaves no failure and nothing undecided; its
    "rounds" list what each search found, up to one more than `how.rounds`. If the last search was a
    proof, its certificate is `certificate.json` in the folder.

    Args:
        settings: Settings of the training run, for all rounds together.
        how: Number of rounds and their settings; 10 rounds by default.
        folder: See `train`.
        resume: Whether to resume the run in the folder, in any round. The result is identical
            bit for bit unless a time limit stops a proof.
        callbacks: Called at every update.
        progress: Called with the progress of training and proofs; a bar by default.
        changes: Changes to the settings of the training run.

    Raises:
        InputError: A setting is unusable, the folder holds another run, proofs do not support
            the policy, or training diverged.
        KeyboardInterrupt: Ctrl-C stopped it, see `train`; a search for failures ends at once. On
            resume its episodes are repeated, and its proof continues from its last saved state.
        SystemExit: SIGTERM stopped it, see `train`.
    """
    progress = as_progress(progress)
    how = Instance(ProvableSettings | None).read(how, "how")
    hooks = with_progress(callbacks, progress)
    run, state = RunFolder.open(folder, resume)
    folder = run.path
    with run.locked(is_new=state is None):
        journal = Journal.open(folder, settings, how, state, changes)
        if state is not None:
            journal.forget_after(state.progress.frames)
        callbacks = [journal, *hooks]
        result = _learn(journal, state, callbacks)
        while not (journal.is_over or _is_stopped(journal, result)):
            _search(journal, progress)
            if not journal.is_over:
                state = read_checkpoint(last_of(folder))
                result = _learn(journal, state, callbacks)
        certificate = journal.certificate
        if certificate is not None:
            write_atomically(folder / "certificate.json", certificate.read_bytes())
        is_same = journal.is_proved and journal.rounds[-1].frames == result.frames
        if is_same and not result.is_interrupted:
            result = result.replace(reason="proved")
        result = result.replace(rounds=tuple(journal.rounds))
        judge = Judge(check_judged, judge_for_selection)
        training = finish(journal.settings, folder, result, judge)
    return reraise_signal(training, "train_until_proved")


def find_failures(
    env: EnvBase, actor: TensorDictModuleBase | Agent, num_episodes: int, enough: int
) -> tuple[NDArray[np.float64], int]:
    """Search for cube placements from which a greedy policy misses a cube.

    It runs at least `num_episodes`, in whole batches, unless `enough` failures were found before.

    Returns:
        Placements, metres to the left of the start, (failures, num_cubes); number of episodes.
    """
    failures: list[NDArray[np.float64]] = []
    episodes = 0
    while episodes < num_episodes and sum(map(len, failures)) < enough:
        goals = rollout(actor, env, env.batch_size[0]).goals
        cubes = goals.world.reshape(len(goals.world), -1, 3)
        failures.append(np.asarray(cubes[~goals.reached.all(-1)][..., 1].double()))
        episodes += len(cubes)
    return np.concatenate(failures), episodes


def _is_stopped(journal: Journal, result: RunResult) -> bool:
    """Whether a signal or callback ended training, or no episodes are left since a search."""
    if result.reason == "episodes":
        return bool(journal.rounds) and journal.rounds[-1].frames == result.frames
    return result.reason not in ("solved", "frames")


def _check_support(settings: TrainSettings) -> None:
    """Raise the InputError with which a proof would refuse the trained policy."""
    described = describe(settings)
    require_cubes(described, "proofs")
    network, gap = described.build_network(torch.Generator()), ProveSettings().logit_gap
    with closing(make_policy_spec(described, network, gap, settings.renderer)) as spec:
        partition_placements(spec, ProveSettings().most_combinations)


def _learn(journal: Journal, state: Checkpoint | None, callbacks: Sequence[Callback]) -> RunResult:
    """Train to the target at first, then for a round's frames on its failures."""
    settings, how, practice = journal.settings, journal.how, None
    if journal.rounds:
        more = 0 if journal.is_over else how.frames
        until = min(journal.rounds[-1].frames + more, settings.trainer.total_frames)
        trainer = settings.trainer.replace(total_frames=until, target_share=None)
        settings, failures = settings.replace(trainer=trainer), journal.failures()
        practice = FailureReplayTask(journal.task, failures, how.share) if len(failures) else None
    return learn(settings, journal.folder, state, callbacks, practice)


def _search(journal: Journal, progress: Progress) -> None:
    """Search for failures in episodes, then by a proof, and record them."""
    how = journal.how
    policy = load_policy(last_of(journal.folder))
    progress(f"{how.flights} episodes in search of failures", 0, how.flights)
    places, flights = np.empty((0, journal.task.num_cubes)), 0
    if how.flights:
        places, flights = _fly(policy, journal)
    progress(f"{len(places)} of {flights} episodes failed", how.flights, how.flights)
    proof, boxes = None, np.repeat(places[..., None], 2, -1)
    if not len(places):
        proof = prove(
            policy,
            folder=journal.next_folder,
            limit_s=how.limit_s,
            renderer=journal.settings.renderer,
            progress=progress,
        )
        boxes = _doubtful(proof)
        boxes = boxes[np.argsort(-volumes(boxes), kind="stable")[: how.most_boxes]]
    search = Round(
        frames=policy.state.progress.frames,
        trained_s=policy.state.progress.seconds,
        flights=flights,
        failures=len(places),
        losing=None if proof is None else proof.lost,
        undecided=None if proof is None else proof.undecided,
        proof_s=None if proof is None else proof.certificate.found.seconds,
        boxes=len(boxes),
    )
    journal.add(search, inflated(boxes, how.margin, journal.task.lateral_bound))


def _fly(policy: Policy, journal: Journal) -> tuple[NDArray[np.float64], int]:
    """Search in environments that no other search uses, see `find_failures`."""
    settings, how = journal.settings, journal.how
    env = policy.make_env(
        min(WORLDS, how.flights),
        seed=settings.seed,
        stream=Stream.SEARCH,
        device=settings.device,
        renderer=settings.renderer,
        first_world=len(journal.rounds) * WORLDS,
    )
    with closing(env):
        return find_failures(env, policy.make_actor(env), how.flights, how.enough)


def _doubtful(proof: Proof) -> NDArray[np.float64]:
    """Return boxes of possible failure; of a stopped proof, only those of certain failure."""
    is_whole = proof.certificate.finished
    return np.concatenate([proof.losing(), proof.open()]) if is_whole else proof.losing()
