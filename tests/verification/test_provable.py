"""Training until proved: rounds, failure replay, exact resume and the journal of the rounds."""

import json
import shutil

import numpy as np
import pytest
import torch

import drone_rl
from benchmarks.gamed_certificates import certificate_of
from drone_rl.config import TaskSettings
from drone_rl.config.commands import ProvableSettings
from drone_rl.config.learning import Episodes
from drone_rl.config.training import TrainerSettings, TrainSettings
from drone_rl.envs import DroneEnv
from drone_rl.policies.baselines import ConstantAgent
from drone_rl.sim.actions import Move
from drone_rl.training import Callback
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.run_result import Round, RunResult
from drone_rl.utils.seeding import world_random_state
from drone_rl.verification import provable
from drone_rl.verification.checker.certificate import Certificate
from drone_rl.verification.provable import Journal, find_failures
from drone_rl.verification.prove import Proof
from tests.fake_flight import FLIGHT

TINY = TrainSettings(
    task=TaskSettings(num_cubes=1, first_distance=8.0, step_limit=60),
    collector=Episodes(num_envs=4),
    trainer=TrainerSettings(total_frames=3000, target_share=0.01, confirm_episodes=0),
)


HOW = ProvableSettings(rounds=3, frames=200, share=1.0, margin=0.25, flights=0)


LOSING = [[[[2.0, 3.0]], [[5.0, 6.0]]], [[[1.0, 1.5]]], []]
"""Boxes that the first, the second and the third proof find."""


def proof_of(policy, losing, undecided=(), finished=True):
    """Return a proof that loses from these boxes of one cube, and leaves others undecided."""
    lost, left = (sum(high - low for ((low, high),) in boxes) / 12 for boxes in (losing, undecided))
    about = {"loops": False, "steps": {}}
    won = {"end": "all_cubes", "collected": [True], "share": 1 - lost - left, "boxes": []}
    failed = {"end": "front_boundary", "collected": [False], "share": lost, "boxes": losing}
    outcomes = [about | part for part in (won, failed) if part["share"]]
    data = certificate_of(policy, outcomes, undecided, left, finished)
    return Proof(Certificate.read(data))


class Prover:
    """Stands for `prove`: loses from given boxes, fewer at each call in the folder of a round."""

    def __init__(self):
        self.weights = []

    def __call__(self, policy, *, folder, limit_s, renderer, progress):
        proof = proof_of(policy, LOSING[int(folder.name)])
        folder.mkdir(parents=True, exist_ok=True)
        proof.certificate.write_json(folder / "certificate.json")
        self.weights.append(policy.state.weights)
        return proof


@pytest.fixture(autouse=True)
def prover(monkeypatch):
    prover = Prover()
    monkeypatch.setattr(provable, "prove", prover)
    return prover


def train(folder, how=HOW, **kwargs):
    return drone_rl.train_until_proved(TINY, how, folder=folder, progress=silent, **kwargs)


def weights(folder):
    return drone_rl.load_policy(folder).state.weights


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(provable, "prove", Prover())
        return train(tmp_path_factory.mktemp("run") / "whole")


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    return drone_rl.train(TINY, folder=tmp_path_factory.mktemp("usual"), progress=silent)


def test_rounds_until_proved(whole):
    assert whole.reason == "proved"
    rounds = whole.result.rounds
    assert [r.boxes for r in rounds] == [2, 1, 0]
    assert [r.losing for r in rounds] == pytest.approx([2 / 12, 0.5 / 12, 0.0])
    frames = [r.frames for r in rounds]
    assert frames[0] + 200 <= frames[1] and frames[1] + 200 <= frames[2] == whole.result.frames
    assert RunResult.of(whole.folder) == whole.result
    last = (whole.folder / "rounds" / "2" / "certificate.json").read_text()
    assert (whole.folder / "certificate.json").read_text() == last
    first = np.load(whole.folder / "rounds" / "0" / "failures.npy")
    assert first.tolist() == [[[1.75, 3.25]], [[4.75, 6.0]]]


def test_episodes_start_at_failures(tmp_path, monkeypatch):
    begun = []
    sample = provable.FailureReplayTask.sample

    def note(self, random_state):
        begun.append((self.boxes[0, 0, 0], float(sample(self, random_state)[0, 1])))
        return sample(self, random_state)

    monkeypatch.setattr(provable.FailureReplayTask, "sample", note)
    train(tmp_path)
    first = [y for low, y in begun if low == 1.75]
    second = [y for low, y in begun if low == 0.75]
    assert first and second
    assert all(1.75 <= y <= 3.25 or 4.75 <= y <= 6.0 for y in first)
    assert all(0.75 <= y <= 1.75 for y in second)


def test_an_interrupted_run_resumes_exactly(whole, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        train(tmp_path, callbacks=[Interrupt(3)])
    done = drone_rl.train_until_proved(folder=tmp_path, resume=True, progress=silent)
    assert done.result.frames == whole.result.frames
    one, two = weights(tmp_path), weights(whole.folder)
    assert all(torch.equal(one[name], two[name]) for name in one)
    same = {"frames", "failures", "losing", "undecided", "boxes"}
    told, expected = ([r.model_dump(include=same) for r in x.result.rounds] for x in (done, whole))
    assert told == expected


def test_resuming_an_ordinary_run(whole, usual, tmp_path):
    shutil.copytree(usual.folder, tmp_path, dirs_exist_ok=True)
    with pytest.raises(InputError, match="can't resume with seed=9"):
        drone_rl.train_until_proved(None, HOW, folder=tmp_path, resume=True, seed=9)
    assert not (tmp_path / "provable.json").exists()
    done = drone_rl.train_until_proved(None, HOW, folder=tmp_path, resume=True, progress=silent)
    assert done.reason == "proved" and done.result.frames == whole.result.frames


def test_resuming_a_proved_run_changes_nothing(whole):
    before = weights(whole.folder)
    again = drone_rl.train_until_proved(folder=whole.folder, resume=True, progress=silent)
    assert again.reason == "proved" and again.result.frames == whole.result.frames
    after = weights(whole.folder)
    assert all(torch.equal(before[name], after[name]) for name in before)


def test_more_rounds_continue_a_run(whole, tmp_path):
    done = train(tmp_path, HOW.replace(rounds=1))
    assert done.reason == "frames" and len(done.result.rounds) == 2
    done = drone_rl.train_until_proved(None, HOW, folder=tmp_path, resume=True, progress=silent)
    assert done.reason == "proved" and done.result.frames == whole.result.frames


def test_episodes_are_searched_first(tmp_path, monkeypatch, prover):
    found = [np.array([[2.0], [-5.9]]), np.empty((0, 1))]

    def fly(env, actor, num_episodes, enough):
        assert (num_episodes, enough, env.batch_size[0]) == (300, 7, 250)
        return found.pop(0), num_episodes

    monkeypatch.setattr(provable, "find_failures", fly)
    monkeypatch.setitem(globals(), "LOSING", [[], [], []])
    done = train(tmp_path, HOW.replace(flights=300, enough=7))
    first, second = done.result.rounds
    assert (first.failures, first.losing, first.boxes) == (2, None, 2)
    assert (second.failures, second.losing) == (0, 0.0)
    boxes = np.load(tmp_path / "rounds" / "0" / "failures.npy")
    np.testing.assert_allclose(boxes, [[[1.75, 2.25]], [[-6.0, -5.65]]])
    assert len(prover.weights) == 1


def test_later_searches_are_forgotten(whole, tmp_path, prover):
    """As if last.pt had been replaced by a checkpoint from before the last search."""
    folder = tmp_path / "run"
    shutil.copytree(whole.folder, folder)
    journal = json.loads((folder / "provable.json").read_text())
    for done in journal["rounds"]:
        done["frames"] += 50
    (folder / "provable.json").write_text(json.dumps(journal))
    train(folder, resume=True)
    assert prover.weights  # it was searched again


SETTINGS = TrainSettings(trainer=TrainerSettings(total_frames=1000))


STATE = {"config": SETTINGS.config()}


LIMITS = ProvableSettings(rounds=2)


def search(frames, boxes=1, **proved):
    return Round(frames=frames, trained_s=1.0, flights=8, failures=1, boxes=boxes, **proved)


def begin(folder, how=LIMITS, state=None, settings=SETTINGS, **changes):
    journal = Journal.open(folder, settings, how, state, changes)
    journal.on_start(None)
    return journal


def test_is_over_and_is_proved(tmp_path):
    journal = begin(tmp_path)
    for frames, is_over in ((100, False), (200, False), (300, True)):  # two rounds of practice
        journal.rounds.append(search(frames))
        assert journal.is_over == is_over
    assert not journal.is_proved
    journal.rounds = [search(1000)]
    assert journal.is_over and not journal.is_proved  # the frames are spent
    for boxes, proved, is_proved in (
        (0, {"losing": 0.0, "undecided": 0.0}, True),
        (0, {"losing": 0.0, "undecided": 0.5}, False),
        (3, {"losing": 0.0, "undecided": 0.0}, False),
        (0, {}, False),
    ):
        journal.rounds = [search(10, boxes, **proved)]
        assert journal.is_proved == journal.is_over == is_proved


def test_only_rounds_and_time_limit_may_change(tmp_path):
    begin(tmp_path)
    assert begin(tmp_path, LIMITS.replace(rounds=9, limit_s=5.0), STATE).how.rounds == 9
    with pytest.raises(InputError, match=r"can't resume with margin=1\.0"):
        begin(tmp_path, LIMITS.replace(margin=1.0), STATE)
    with pytest.raises(InputError, match="can't resume with seed=4"):
        begin(tmp_path, None, STATE, seed=4)


def test_a_state_is_deleted_at_the_first_update(tmp_path):
    begin(tmp_path)
    state = tmp_path / "rounds" / "0" / "state.pt"
    state.parent.mkdir(parents=True)
    state.write_bytes(b"a state")
    again = begin(tmp_path, None, STATE, None)
    again.on_start(None)
    assert state.exists()
    again.on_update(None, {})  # of another policy
    assert not state.exists()


class Interrupt(Callback):
    """Interrupts training at an update."""

    def __init__(self, at):
        self.at, self.count = at, 0

    def on_update(self, training, metrics):
        self.count += 1
        if self.count == self.at:
            raise KeyboardInterrupt


def test_training_before_the_first_search_is_ordinary(tmp_path, prover, usual):
    done = train(tmp_path, HOW.replace(rounds=0, most_boxes=1))
    assert done.result.rounds[0].boxes == 1
    one, two = weights(usual.folder), prover.weights[0]
    assert all(torch.equal(one[name], two[name]) for name in one)


def test_undecided_boxes_are_replayed_only_of_finished_proofs():
    policy = drone_rl.load_policy("good").in_task(num_cubes=1)
    lost, left = [[[-2.0, -1.0]]], [[[0.0, 6.0]]]
    assert provable._doubtful(proof_of(policy, lost, left, finished=False)).tolist() == lost
    assert provable._doubtful(proof_of(policy, lost, left)).tolist() == lost + left


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rounds": [{"frames": 1}]}, r"rounds\[0\]\.trained_s is missing"),
        ({"more": 3}, "more is unknown"),
    ],
)
def test_a_malformed_journal_is_refused(tmp_path, change, message):
    begin(tmp_path)
    path = tmp_path / "provable.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(InputError, match=message):
        begin(tmp_path, None, STATE, None)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"dynamics": FLIGHT}, "proofs support only"),
        ({"task": TaskSettings(spacing=2.0)}, "task.spacing=2.0 puts cubes next to each other"),
        ({"task": TaskSettings(num_cubes=8)}, "task.num_cubes=8 gives about"),
    ],
)
def test_unsupported_settings_are_refused_before_training(change, message, tmp_path):
    with pytest.raises(InputError, match=message):
        begin(tmp_path / "new", **change)
    assert not (tmp_path / "new").exists()


TASK = TaskSettings(num_cubes=1, first_distance=8.0, step_limit=60)


def flown(num_episodes, enough):
    env = DroneEnv(8, TASK, seed=4, pixels=False)
    try:
        return find_failures(env, ConstantAgent(Move.FORWARD), num_episodes, enough)
    finally:
        env.close()


def test_find_failures_of_flying_straight():
    places, episodes = flown(20, 1000)
    assert episodes == 24  # whole batches
    worlds = [world_random_state(4, i) for i in range(8)]
    drawn = [w.uniform(-1.0, 1.0, size=(1, 2))[0, 0] * 6.0 for _ in range(3) for w in worlds]
    aside = [y for y in drawn if abs(y) > TASK.touch_distance]
    assert 0 < len(aside) < 24
    np.testing.assert_allclose(places[:, 0], aside, rtol=1e-6)


def test_find_failures_stops_at_enough():
    places, episodes = flown(1000, 1)
    assert episodes == 8 and 0 < len(places) <= 8
