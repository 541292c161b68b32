"""Proofs by the API: folders, limits, what is shown and what is refused."""

import json

import numpy as np
import pytest
import torch

import drone_rl
from drone_rl.sim.rendering.renderer import _CLASSES
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.verification.prove import Proof

ONE = {"num_cubes": 1}


def prove(name="right_and_forward", **kwargs):
    return drone_rl.prove(name, task=ONE, compared=100, progress=silent, **kwargs)


@pytest.fixture(scope="module")
def proof(tmp_path_factory):
    return prove(folder=tmp_path_factory.mktemp("proof"))


def test_what_is_known(proof):
    assert proof.success == pytest.approx(0.6375, abs=1e-9)
    assert proof.undecided < 1e-6
    assert not proof.is_proved
    losing = proof.losing()
    assert losing.shape[1:] == (1, 2)
    assert losing.min() == pytest.approx(1.65) and losing.max() == 6.0


def test_a_policy_that_collects_from_everywhere(tmp_path):
    proof = prove("good")
    assert proof.is_proved and proof.success == 1.0
    assert proof.losing().shape == (0, 1, 2)
    assert proof.folder is None


def test_it_shows_itself(proof):
    text = str(proof)
    assert "front boundary" in text and "0.6375" in text and "Proved: with" in text
    assert "<table" in proof._repr_html_()


def test_it_is_loaded_again(proof):
    assert drone_rl.load_proof(proof.folder).certificate == proof.certificate
    assert not (proof.folder / "state.npz").exists()
    with pytest.raises(InputError, match="can't be read"):
        drone_rl.load_proof(proof.folder / "nothing.json")


def test_fractions_do_not_exceed_one_by_rounding():
    shares = (0.07, 0.8725, 0.0575)
    assert sum(shares) > 1
    for end, found in (("all_cubes", "success"), ("front_boundary", "lost")):
        outcomes = [{"end": end, "share": share} for share in shares]
        assert getattr(Proof({"outcomes": outcomes}), found) == 1.0


@pytest.mark.parametrize("content", ["[]", '{"format": "another"}'])
def test_a_file_that_is_no_certificate_is_refused(tmp_path, content):
    (tmp_path / "certificate.json").write_text(content)
    with pytest.raises(InputError, match="its format is not 'drone_rl certificate'"):
        drone_rl.load_proof(tmp_path)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ('{"format": "drone_rl certificate", "policy": {}}', "it has no outcomes, undecided"),
        ("[" * 100_000, "nested"),
        (" " * (2**25 + 1), "large"),
    ],
    ids=["incomplete", "nested", "large"],
)
def test_a_damaged_certificate_is_refused(tmp_path, content, reason):
    (tmp_path / "certificate.json").write_text(content)
    with pytest.raises(InputError, match=reason):
        drone_rl.load_proof(tmp_path)


def test_stopped_and_gone_on_with(proof, tmp_path):
    stopped = prove(folder=tmp_path, limit_s=0.0)
    assert not stopped.certificate["finished"]
    assert stopped.undecided == pytest.approx(1.0)
    assert "the proof was stopped" in str(stopped)
    assert (tmp_path / "state.npz").exists()
    done = prove(folder=tmp_path)
    same = ("outcomes", "undecided", "finished")
    assert [done.certificate[k] for k in same] == [proof.certificate[k] for k in same]


def test_memory_is_bounded(tmp_path):
    stopped = prove(folder=tmp_path, most_boxes=1)
    assert not stopped.certificate["finished"]


def test_a_state_of_another_policy_is_refused(tmp_path):
    prove(folder=tmp_path, limit_s=0.0)
    with pytest.raises(InputError, match="belongs to another proof"):
        prove("good", folder=tmp_path)


def test_a_state_by_another_renderer_is_refused(tmp_path, monkeypatch):
    """A certificate names one renderer; here the other name stands for the same one."""
    monkeypatch.setitem(_CLASSES, "mujoco_warp", _CLASSES["raytrace"])
    prove(folder=tmp_path, limit_s=0.0)
    with pytest.raises(InputError, match="belongs to another proof"):
        prove(folder=tmp_path, renderer="mujoco_warp")


def test_progress_is_told():
    told = []
    drone_rl.prove("good", task=ONE, compared=100, progress=lambda *args: told.append(args))
    texts = [text for text, *_ in told]
    assert "step 0 of 27" in texts[0] and texts[-1] == "finished"
    assert np.diff([done for _, done, _ in told]).min() >= 0


def test_parts_to_come_are_told():
    told, narrow = [], {**ONE, "lateral_bound": 2.0}
    stopped = drone_rl.prove(
        "good", task=narrow, compared=1, most_combinations=400, most_boxes=1,
        progress=lambda text, *_: told.append(text),
    )  # fmt: skip
    assert told[0].endswith(" images, 1 part to come")
    assert "with a smaller most_combinations" in told[-1] and told[-1] in str(stopped)
    assert stopped.undecided == pytest.approx(1.0)


def test_the_certificate_is_of_the_task_that_was_asked_for(proof):
    written = json.loads((proof.folder / "certificate.json").read_text())
    assert written["policy"]["description"]["task"]["num_cubes"] == 1


def test_torch_has_its_threads_again():
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        told = []
        drone_rl.prove(
            "good", task=ONE, compared=1, limit_s=0.0,
            progress=lambda *_: told.append(torch.get_num_threads()),
        )  # fmt: skip
        assert {*told} == {1} and torch.get_num_threads() == 2
        with pytest.raises(InputError, match=r"vertical_bound=1\.0"):
            drone_rl.prove("good", task={"vertical_bound": 1.0}, progress=silent)
        assert torch.get_num_threads() == 2
    finally:
        torch.set_num_threads(before)


def test_what_takes_days_is_refused_before_images_are_compared():
    with pytest.raises(InputError, match=r"task\.num_cubes=30 gives about .* which takes days"):
        drone_rl.prove("good", task={"num_cubes": 30}, progress=silent)
