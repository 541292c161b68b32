"""Last policies are judged in worlds to choose by, and keep the whole verdict."""

import pytest

import drone_rl
from drone_rl.policies.policy import Policy
from drone_rl.trust.verdict import judge_for_selection
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.seeding import Stream
from tests.training.test_train import TINY


@pytest.fixture
def trained(tmp_path):
    """The folder of a training that was not judged."""
    return drone_rl.train(TINY, folder=tmp_path / "run", progress=silent).folder


def test_the_worlds_are_those_to_choose_by(trained, monkeypatch):
    asked = {}

    def note(self, num_envs, **kwargs):
        asked.update(kwargs, num_envs=num_envs)
        raise InputError("enough")

    monkeypatch.setattr(Policy, "make_env", note)
    with pytest.raises(InputError, match="enough"):
        judge_for_selection(trained / "checkpoints" / "last.pt", 5, "cpu", "mujoco_warp")
    where = {"device": "cpu", "renderer": "mujoco_warp"}
    seed = asked.pop("seed")
    assert asked == {"stream": Stream.CHOICE, "num_envs": 5, **where}
    with pytest.raises(InputError, match="enough"):
        judge_for_selection(trained / "checkpoints" / "last.pt", 5, "cpu")
    assert asked["seed"] != seed, "both are fresh"
