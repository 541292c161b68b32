"""Trainings that begin with demonstrations: clone, continue, resume."""

import json
import shutil

import pytest
import torch

import drone_rl
from drone_rl.config import TaskSettings
from drone_rl.config.learning import Episodes, Ppo
from drone_rl.config.training import CloningSettings, TrainerSettings, TrainSettings
from drone_rl.training.demonstrations import record_oracle
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.run_result import RunResult

TINY = TrainSettings(
    task=TaskSettings(num_cubes=1, first_distance=6.0, step_limit=40),
    collector=Episodes(num_envs=4),
    cloning=CloningSettings(epochs=3),
    trainer=TrainerSettings(total_frames=100, confirm_episodes=0, target_share=None, num_threads=1),
)
NOTHING = TINY.trainer.replace(total_frames=0)


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demonstrations")
    record_oracle(folder, TINY, flights=4, seed=9)
    return folder


@pytest.fixture(scope="module")
def cloned(flights, tmp_path_factory):
    """A run that only clones."""
    messages = []
    done = drone_rl.train(
        TINY,
        folder=tmp_path_factory.mktemp("run") / "clone",
        trainer=NOTHING,
        demonstrations=str(flights),
        progress=lambda *message: messages.append(message),
    )
    return done, messages


def weights(folder):
    return drone_rl.load_policy(folder).state.weights


def assert_same(one, other):
    assert all(torch.equal(one[name], other[name]) for name in one)


def test_a_run_may_only_clone(cloned, flights):
    done, messages = cloned
    assert (done.reason, done.result.frames, done.result.updates) == ("frames", 0, 0)
    written = json.loads((done.folder / "result.json").read_text())
    assert RunResult.of(done.folder) == done.result and written["cloning"]["folder"] == str(flights)
    counts = [written["cloning"][name] for name in ("demonstrations", "held_out_demonstrations")]
    assert counts == [3, 1]
    assert messages[2][0].startswith("cloning: accuracy ") and messages[2][1:] == (3, 3)
    assert done.metrics()["frames"] == [] and "<td>reason</td>" in done._repr_html_()
    head, *rows = (done.folder / "cloning.csv").read_text().splitlines()
    assert head == (
        "epoch,cloning/loss,cloning/accuracy,cloning/held_out_loss,cloning/held_out_accuracy"
    )
    assert [row.split(",")[0] for row in rows] == ["1", "2", "3"]
    assert float(rows[-1].split(",")[1]) == pytest.approx(written["cloning"]["loss"], rel=1e-5)


def test_reinforce_continues_from_the_clone_and_resumes_bit_for_bit(cloned, flights, tmp_path):
    """A run of the clone that is resumed, and one stopped in between, equal one without a stop."""
    path, longer = str(flights), TINY.trainer.replace(total_frames=300)
    whole = drone_rl.train(
        TINY, folder=tmp_path / "whole", trainer=longer, demonstrations=path, progress=silent
    )
    half = drone_rl.train(TINY, folder=tmp_path / "half", demonstrations=path, progress=silent)
    only = shutil.copytree(cloned[0].folder, tmp_path / "only")
    assert 0 < half.result.frames < whole.result.frames
    for folder in (half.folder, only):
        again = drone_rl.train(folder=folder, resume=True, trainer=longer, progress=silent)
        assert_same(weights(whole.folder), weights(folder))
        own, other = (r.result.cloning.replace(seconds=0) for r in (whole, again))
        assert own == other
        assert again.metrics()["frames"] == whole.metrics()["frames"]
    assert not torch.equal(
        *(weights(folder)["layers.logits.bias"] for folder in (whole.folder, cloned[0].folder))
    )


def test_a_resumed_run_needs_no_demonstrations(cloned, tmp_path):
    folder = shutil.copytree(cloned[0].folder, tmp_path / "run")
    for changes in ({"demonstrations": None}, {"demonstrations": "/moved"}):
        done = drone_rl.train(folder=folder, resume=True, progress=silent, **changes)
        assert done.result.cloning == cloned[0].result.cloning
    with pytest.raises(InputError, match=r"^can't resume with cloning\.epochs=9: .*epochs=3"):
        drone_rl.train(folder=folder, resume=True, cloning=CloningSettings(epochs=9))


def test_a_critic_continues_from_the_clone(flights, tmp_path):
    settings = TINY.replace(objective=Ppo())
    runs = {}
    for name, trainer in (("clone", NOTHING), ("on", NOTHING.replace(total_frames=200))):
        folder = tmp_path / name
        runs[name] = drone_rl.train(
            settings,
            folder=folder,
            trainer=trainer,
            collector=settings.collector.replace(num_envs=2),
            demonstrations=str(flights),
            progress=silent,
        )
    assert runs["on"].result.updates > 0
    own, other = (r.result.cloning.replace(seconds=0, folder="") for r in runs.values())
    assert own == other
