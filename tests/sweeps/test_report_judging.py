"""Each run keeps the verdict on its last policy."""

import json
import shutil

import pytest

import drone_rl
from drone_rl.sweeps.report import judge_run
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import silent
from drone_rl.utils.seeding import RootSeed
from tests.training.test_train import TINY


@pytest.fixture(scope="module")
def training(tmp_path_factory):
    return drone_rl.train(TINY, folder=tmp_path_factory.mktemp("run"), progress=silent).folder


@pytest.fixture
def trained(training, tmp_path):
    """The folder of a training that was not judged."""
    return shutil.copytree(training, tmp_path / "run")


def test_a_run_keeps_its_verdict_beside_its_result(trained):
    before = json.loads((trained / "result.json").read_text())
    assert "verdict" not in before
    seed = RootSeed(4, is_fixed=False)
    verdict = judge_run(trained, 12, "cpu", seed=seed)
    assert (verdict["seed"], verdict["seed_is_fixed"]) == (4, False)
    after = json.loads((trained / "result.json").read_text())
    assert after == {**before, "verdict": json.loads(json.dumps(verdict))}
    assert verdict["greedy"]["episodes"] == verdict["sampled"]["episodes"] == 12
    assert judge_run(trained, 12, "cpu", seed=seed) == verdict  # once more, to the last bit


def test_a_checkpoint_that_is_not_that_of_the_result_is_refused(trained):
    result = json.loads((trained / "result.json").read_text())
    (trained / "result.json").write_text(json.dumps({**result, "frames": 7}))
    with pytest.raises(InputError, match=r"frame 7; resume with"):
        judge_run(trained, 4, "cpu")
    (trained / "result.json").write_text(json.dumps({**result, "frames": 10**6}))
    with pytest.raises(InputError, match=r"frame 1000000; resume with"):
        judge_run(trained, 4, "cpu")
    (trained / "result.json").unlink()
    with pytest.raises(InputError, match=r"no result\.json"):
        judge_run(trained, 4, "cpu")
