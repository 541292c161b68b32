"""Training until proved: its rounds, what they practise, and that it goes on bit for bit."""

import contextlib
import json
import shutil
import signal

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.config import TaskSettings
from drone_rl.config.commands import ProvableSettings
from drone_rl.config.learning import Episodes
from drone_rl.config.training import TrainerSettings, TrainSettings
from drone_rl.training import Callback
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.verification import provable
from drone_rl.verification.prove import Proof

TINY = TrainSettings(
    task=TaskSettings(num_cubes=1, first_distance=8.0, step_limit=60),
    collector=Episodes(num_envs=4),
    trainer=TrainerSettings(total_frames=3000, target_share=0.01, confirm_episodes=0),
)
HOW = ProvableSettings(rounds=3, frames=200, share=1.0, margin=0.25, flights=0)
LOSING = [[[[2.0, 3.0]], [[5.0, 6.0]]], [[[1.0, 1.5]]], []]
"""Boxes that the first, the second and the third proof find."""


def outcome(end, share, boxes):
    return {"end": end, "share": share, "boxes": boxes}


class Prover:
    """Stands for `prove`: loses from given boxes, fewer at each call in the folder of a round."""

    def __init__(self):
        self.weights = []

    def __call__(self, policy, *, folder, limit_s, renderer, progress):
        boxes = LOSING[int(folder.name)]
        lost = sum(upper - lower for ((lower, upper),) in boxes) / 12
        outcomes = [outcome("all_cubes", 1 - lost, [[[-6.0, 6.0]]])]
        outcomes += [outcome("front_boundary", lost, boxes)] if boxes else []
        certificate = {
            "policy": {"description": policy.description.as_dict()},
            "outcomes": outcomes,
            "undecided": {"share": 0.0, "boxes": []},
            "finished": True,
            "found": {"seconds": 0.5},
        }
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "certificate.json").write_text(json.dumps(certificate))
        self.weights.append(policy.state["policy"])
        return Proof(certificate, folder)


@pytest.fixture(autouse=True)
def prover(monkeypatch):
    prover = Prover()
    monkeypatch.setattr(provable, "prove", prover)
    return prover


class Watch(Callback):
    """Notes where episodes begin, and may end the program."""

    def __init__(self, at=None):
        self.at, self.count = at, 0

    def on_update(self, training, metrics):
        self.count += 1
        if self.count == self.at:
            raise KeyboardInterrupt


def train(folder, how=HOW, **kwargs):
    return drone_rl.train_until_proved(TINY, how, folder=folder, progress=silent, **kwargs)


def weights(folder):
    return drone_rl.load_policy(folder).state["policy"]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(provable, "prove", Prover())
        return train(tmp_path_factory.mktemp("run") / "whole")


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    return drone_rl.train(TINY, folder=tmp_path_factory.mktemp("usual"), progress=silent)


def test_rounds_until_nothing_is_left(whole):
    assert whole.reason == "proved"
    rounds = whole.result["rounds"]
    assert [r["boxes"] for r in rounds] == [2, 1, 0]
    assert [r["losing"] for r in rounds] == pytest.approx([2 / 12, 0.5 / 12, 0.0])
    frames = [r["frames"] for r in rounds]
    assert frames[0] + 200 <= frames[1] and frames[1] + 200 <= frames[2] == whole.result["frames"]
    assert json.loads((whole.folder / "result.json").read_text()) == whole.result
    last = (whole.folder / "rounds" / "2" / "certificate.json").read_text()
    assert (whole.folder / "certificate.json").read_text() == last
    first = np.load(whole.folder / "rounds" / "0" / "failures.npy")
    assert first.tolist() == [[[1.75, 3.25]], [[4.75, 6.0]]]


def test_the_first_part_is_the_usual_training_and_the_largest_boxes_are_kept(
    tmp_path, prover, usual
):
    done = train(tmp_path, HOW.replace(rounds=0, most_boxes=1))
    assert done.result["rounds"][0]["boxes"] == 1
    assert usual.reason == "solved"
    one, two = weights(usual.folder), prover.weights[0]
    assert all(torch.equal(one[name], two[name]) for name in one)


def test_failures_are_practised(tmp_path, monkeypatch):
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


def test_killed_and_resumed_is_bit_for_bit_the_uninterrupted(whole, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        train(tmp_path, callbacks=[Watch(3)])
    done = drone_rl.train_until_proved(folder=tmp_path, resume=True, progress=silent)
    assert done.result["frames"] == whole.result["frames"]
    one, two = weights(tmp_path), weights(whole.folder)
    assert all(torch.equal(one[name], two[name]) for name in one)
    same = ("frames", "failures", "losing", "undecided", "boxes")
    told, expected = done.result["rounds"], whole.result["rounds"]
    assert [[r[k] for k in same] for r in told] == [[r[k] for k in same] for r in expected]


def test_killed_in_a_proof(whole, tmp_path, monkeypatch, prover):
    def killed(policy, **kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr(provable, "prove", killed)
    with pytest.raises(KeyboardInterrupt):
        train(tmp_path)
    monkeypatch.setattr(provable, "prove", prover)
    done = drone_rl.train_until_proved(folder=tmp_path, resume=True, progress=silent)
    assert done.reason == "proved" and done.result["frames"] == whole.result["frames"]


def test_a_usual_run_that_is_refused_stays_one_and_else_is_made_provable(whole, usual, tmp_path):
    shutil.copytree(usual.folder, tmp_path, dirs_exist_ok=True)
    with pytest.raises(InputError, match="can't resume with seed=9"):
        drone_rl.train_until_proved(None, HOW, folder=tmp_path, resume=True, seed=9)
    assert not (tmp_path / "provable.json").exists()
    done = drone_rl.train_until_proved(None, HOW, folder=tmp_path, resume=True, progress=silent)
    assert done.reason == "proved" and done.result["frames"] == whole.result["frames"]


class Interrupt(Callback):
    def on_update(self, training, metrics):
        signal.raise_signal(signal.SIGINT)


def test_ctrl_c_ends_it_and_a_resume_goes_on(whole, tmp_path):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt) as stopped:
            train(tmp_path, callbacks=[Interrupt()])
    finally:
        signal.signal(signal.SIGINT, before)
    assert stopped.value.training.result["updates"] == 1
    done = drone_rl.train_until_proved(folder=tmp_path, resume=True, progress=silent)
    assert done.reason == "proved" and done.result["frames"] == whole.result["frames"]


def test_a_proved_run_that_is_resumed_is_left_alone(whole):
    before = weights(whole.folder)
    again = drone_rl.train_until_proved(folder=whole.folder, resume=True, progress=silent)
    assert again.reason == "proved" and again.result["frames"] == whole.result["frames"]
    after = weights(whole.folder)
    assert all(torch.equal(before[name], after[name]) for name in before)


def test_a_finished_run_is_not_replaced(whole):
    before = (whole.folder / "provable.json").read_bytes()
    with pytest.raises(InputError, match="holds a finished run, which a new one would replace"):
        train(whole.folder)
    assert (whole.folder / "provable.json").read_bytes() == before


def test_a_budget_ends_it_unproved_and_more_of_it_goes_on(whole, tmp_path):
    done = train(tmp_path, HOW.replace(rounds=1))
    assert done.reason == "frames" and len(done.result["rounds"]) == 2
    done = drone_rl.train_until_proved(None, HOW, folder=tmp_path, resume=True, progress=silent)
    assert done.reason == "proved" and done.result["frames"] == whole.result["frames"]


def test_flights_come_first(tmp_path, monkeypatch, prover):
    found = [np.array([[2.0], [-5.9]]), np.empty((0, 1))]

    def fly(env, actor, num_episodes, enough):
        assert (num_episodes, enough, env.batch_size[0]) == (300, 7, 250)
        return found.pop(0), num_episodes

    monkeypatch.setattr(provable, "find_failures", fly)
    monkeypatch.setitem(globals(), "LOSING", [[], [], []])
    done = train(tmp_path, HOW.replace(flights=300, enough=7))
    first, second = done.result["rounds"]
    assert (first["failures"], first["losing"], first["boxes"]) == (2, None, 2)
    assert (second["failures"], second["losing"]) == (0, 0.0)
    boxes = np.load(tmp_path / "rounds" / "0" / "failures.npy")
    np.testing.assert_allclose(boxes, [[[1.75, 2.25]], [[-6.0, -5.65]]])
    assert len(prover.weights) == 1


def test_what_a_stopped_proof_leaves_open_is_not_practised():
    open_ = {"share": 0.5, "boxes": [[[0.0, 6.0]]]}
    lost = outcome("front_boundary", 0.1, [[[-2.0, -1.0]]])
    about = {"policy": {"description": {"task": {"num_cubes": 1}}}}
    proof = Proof({**about, "outcomes": [lost], "undecided": open_, "finished": False})
    assert provable._doubtful(proof).tolist() == [[[-2.0, -1.0]]]
    whole = Proof({**proof.certificate, "finished": True})
    assert provable._doubtful(whole).tolist() == [[[-2.0, -1.0]], [[0.0, 6.0]]]


def test_other_rounds_are_refused(whole):
    with pytest.raises(InputError, match=r"can't resume with share=0.1: .* share=1.0"):
        train(whole.folder, HOW.replace(share=0.1), resume=True)
    with pytest.raises(InputError, match="can't resume with seed=3"):
        train(whole.folder, resume=True, seed=3)


class Stop(Callback):
    def on_update(self, training, metrics):
        training.stop_request = "enough"


def test_a_callback_stops_it(tmp_path):
    done = train(tmp_path, callbacks=[Stop()])
    assert done.reason == "enough" and done.result["rounds"] == []


def test_spent_episodes_end_it(tmp_path):
    limits = TINY.trainer.replace(total_episodes=1, target_share=None)
    settings = TINY.replace(trainer=limits)
    done = drone_rl.train_until_proved(settings, HOW, folder=tmp_path, progress=silent)
    assert done.reason == "episodes" and len(done.result["rounds"]) == 1


def test_a_search_of_a_later_policy_proves_nothing_of_an_older_checkpoint(whole, tmp_path, prover):
    """As if last.pt had been replaced by a checkpoint from before the last search."""
    folder = tmp_path / "run"
    shutil.copytree(whole.folder, folder)
    noted = json.loads((folder / "provable.json").read_text())
    for done in noted["rounds"]:
        done["frames"] += 50
    (folder / "provable.json").write_text(json.dumps(noted))
    train(folder, resume=True)
    assert prover.weights  # it was searched again


def test_a_run_that_ended_while_this_one_waited_is_not_replaced(tmp_path, monkeypatch):
    @contextlib.contextmanager
    def lock(folder):
        (folder / "result.json").write_text("{}")
        yield

    monkeypatch.setattr("drone_rl.training.run_folder.folder_lock", lock)
    with pytest.raises(InputError, match="holds a finished run"):
        train(tmp_path)
