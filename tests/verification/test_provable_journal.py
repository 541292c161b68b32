"""A training's rounds on disk: begun, gone on with, over, damaged."""

import json

import numpy as np
import pytest

from drone_rl.config import ActionSettings, AppearanceSettings, TaskSettings
from drone_rl.config.commands import ProvableSettings
from drone_rl.config.configuration import as_config
from drone_rl.config.training import TrainerSettings, TrainSettings
from drone_rl.utils.errors import InputError
from drone_rl.verification.provable import Journal, Round
from tests.fake_flight import FLIGHT

SETTINGS = TrainSettings(trainer=TrainerSettings(total_frames=1000))
STATE = {"config": as_config(SETTINGS)}
HOW = ProvableSettings(rounds=2)


def search(frames, boxes=1, **proved):
    return Round(frames=frames, trained_s=1.0, flights=8, failures=1, boxes=boxes, **proved)


def begin(folder, how=HOW, state=None, settings=SETTINGS, **changes):
    return Journal.open(folder, settings, how, state, changes)


def test_it_goes_on(tmp_path):
    boxes = np.array([[[1.0, 2.0], [0.0, 0.5], [-6.0, 6.0]]])
    journal = begin(tmp_path)
    assert (journal.rounds, journal.is_over, journal.certificate) == ([], False, None)
    assert journal.next_folder == tmp_path / "rounds" / "0"
    journal.add(search(100), boxes)
    again = begin(tmp_path, None, STATE, None)
    assert again == journal
    assert again.failures().tolist() == boxes.tolist()
    assert again.next_folder == tmp_path / "rounds" / "1"


def test_when_it_is_over(tmp_path):
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


def test_the_certificate_is_that_of_the_last_search(tmp_path):
    journal = begin(tmp_path)
    journal.next_folder.mkdir(parents=True)
    path = journal.next_folder / "certificate.json"
    path.write_text("{}")
    journal.add(search(100, losing=0.1, undecided=0.0), np.empty((0, 3, 2)))
    assert journal.certificate == path
    journal.add(search(200), np.empty((0, 3, 2)))
    assert journal.certificate is None


def test_a_new_one_forgets_what_lies_there(tmp_path):
    begin(tmp_path).add(search(100), np.empty((0, 3, 2)))
    assert begin(tmp_path).rounds == []
    assert not (tmp_path / "rounds").exists()


def test_only_the_budget_may_change(tmp_path):
    begin(tmp_path)
    assert begin(tmp_path, HOW.replace(rounds=9, limit_s=5.0), STATE).how.rounds == 9
    with pytest.raises(InputError, match=r"can't resume with margin=1\.0"):
        begin(tmp_path, HOW.replace(margin=1.0), STATE)
    with pytest.raises(InputError, match="can't resume with seed=4"):
        begin(tmp_path, None, STATE, seed=4)


def test_one_that_goes_on_is_noted_only_once_it_is_accepted(tmp_path):
    begin(tmp_path).add(search(100), np.empty((1, 3, 2)))
    before = (tmp_path / "provable.json").read_bytes()
    again = begin(tmp_path, HOW.replace(rounds=9), STATE)
    assert (tmp_path / "provable.json").read_bytes() == before
    again.save()
    assert begin(tmp_path, None, STATE, None).how.rounds == 9
    (tmp_path / "provable.json").unlink()
    usual = begin(tmp_path, None, STATE)  # as if the rounds were of an earlier training
    assert (tmp_path / "rounds").exists() and not (tmp_path / "provable.json").exists()
    usual.save()
    assert (tmp_path / "provable.json").exists() and not (tmp_path / "rounds").exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rounds": [{"frames": -1}]}, "rounds.trained_s is missing"),
        ({"how": {"rounds": 1}}, "how.frames is missing"),
        ({"settings": {"seed": -1}}, "seed=-1 is out of range"),
        ({"rounds": 3}, "rounds=3"),
        ({"more": 3}, "more.* is unknown"),
    ],
)
def test_a_damaged_one_is_refused(tmp_path, change, message):
    begin(tmp_path)
    path = tmp_path / "provable.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(InputError, match=message):
        begin(tmp_path, None, STATE, None)


def test_damaged_failures_are_refused(tmp_path):
    journal = begin(tmp_path)
    journal.add(search(100), np.empty((1, 3, 2)))
    (tmp_path / "rounds" / "0" / "failures.npy").write_bytes(b"nothing")
    with pytest.raises(InputError, match=r"failures\.npy is damaged"):
        journal.failures()


def test_nothing_is_begun_for_who_flies(tmp_path):
    for changes in ({"dynamics": FLIGHT}, {"actions": ActionSettings(kind="velocity")}):
        with pytest.raises(InputError, match="proofs support only"):
            begin(tmp_path / "new", **changes)
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"task": TaskSettings(spacing=2.0)}, "task.spacing=2.0 puts cubes next to each other"),
        ({"appearance": AppearanceSettings(exposure=2.0)}, "only appearance=minimal"),
        ({"task": TaskSettings(num_cubes=8)}, "task.num_cubes=8 gives about"),
    ],
)
def test_what_no_proof_supports_is_not_begun(change, message, tmp_path):
    with pytest.raises(InputError, match=message):
        begin(tmp_path / "new", **change)
    assert not (tmp_path / "new").exists()


def test_the_first_proof_goes_on_after_a_kill(tmp_path):
    begin(tmp_path)
    state = tmp_path / "rounds" / "0" / "state.npz"
    state.parent.mkdir(parents=True)
    state.write_bytes(b"a state")
    again = begin(tmp_path, None, STATE, None)
    again.on_start(None)
    assert state.exists()
    again.on_update(None, {})  # of another policy
    assert not state.exists()
