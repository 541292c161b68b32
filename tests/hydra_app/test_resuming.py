"""What a training's command line leaves out."""

import pytest
import yaml

from drone_rl.hydra_app.resuming import complete
from drone_rl.utils.errors import InputError


@pytest.fixture
def run(tmp_path):
    """A run that was made when networks were called policies."""
    (tmp_path / "checkpoints").mkdir()
    (tmp_path / "checkpoints" / "last.pt").write_bytes(b"")
    (tmp_path / ".hydra").mkdir()
    told = ["policy=mlp", "policy.hidden=[8]", "seed=3"]
    (tmp_path / ".hydra" / "overrides.yaml").write_text(yaml.safe_dump(told))
    return tmp_path


def test_one_training_is_left_as_it_is():
    assert complete(["seed=1", "policy=mlp"]) == ["seed=1", "network=mlp"]


def test_a_run_that_goes_on_takes_over_its_settings_in_todays_words(run):
    told = [f"resume={run}", "seed=3"]
    assert complete(told) == [
        *("network=mlp", "network.hidden=[8]"),
        *told,
        *("hydra.mode=RUN", f"hydra.run.dir='{run}'"),
    ]


@pytest.mark.parametrize("again", ["network=small_cnn", "policy=small_cnn"])
def test_what_is_told_anew_is_not_taken_over(run, again):
    found = complete([f"resume={run}", again])
    assert "network=mlp" not in found
    assert "network=small_cnn" in found


def test_a_sweep_is_named_by_its_settings():
    first, again, other = (complete(["-m", f"seed={s}"]) for s in ("0,1", "0,1", "0,2"))
    assert first[-1] == again[-1] != other[-1]
    assert first[-1].startswith("hydra.sweep.dir=${paths.outputs}/")
    assert complete(["-m", "seed=0,1", "hydra.sweep.dir=x"])[-1] == "hydra.sweep.dir=x"


def test_no_run_to_go_on_with(tmp_path):
    with pytest.raises(InputError, match="folder of a run"):
        complete([f"resume={tmp_path}"])
