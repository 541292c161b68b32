"""What a run's folder says of its settings is taken over only if it can do nothing else."""

import pytest
import yaml

from drone_rl.utils.errors import InputError
from drone_rl.utils.overrides import (
    COMMAND,
    check_harmless,
    must_be_typed,
    read_overrides,
    taken_over,
    with_current_name,
)


@pytest.fixture
def noted(tmp_path):
    def note(content):
        (tmp_path / ".hydra").mkdir(exist_ok=True)
        text = content if isinstance(content, str) else yaml.safe_dump(content)
        (tmp_path / ".hydra" / "overrides.yaml").write_text(text)
        return tmp_path

    return note


def test_settings_of_a_training_are_taken_over(noted):
    settings = [
        *("seed=1", "device=cuda:0", "evaluate_after=200"),
        *("experiment=smoke", "logger=csv", "policy=mlp", "collector=ray", "transforms=stack"),
        *("policy.hidden=[128,64]", "policy.hidden=[128, 64]", "policy.channels=[]"),
        *("optimizer.lr=1e-3", "task.spacing=-9.5", "trainer.total_episodes=null"),
        *("task.cube_color=[0.1, 0.2, 0.3]", "transforms.crop.top=3", "~transforms.standardize"),
        *("+optimizer.amsgrad=true", "objective.reduction=sum", "collector.num_envs=8"),
        *("cloning.epochs=5", "collector.compiled=false", "renderer=mujoco_warp"),
    ]
    assert taken_over(noted(settings), []) == settings


def test_nothing_noted_is_nothing(tmp_path):
    assert read_overrides(tmp_path) == []


def test_what_is_told_anew_is_not_taken_over(noted):
    folder = noted(["seed=1", "optimizer.lr=1", "policy=mlp"])
    assert taken_over(folder, ["optimizer.lr=2", "+seed=2"]) == ["policy=mlp"]


def test_where_a_run_was_does_not_matter(noted):
    """It may have been moved or copied, or out of a sweep that is not there any more."""
    place = ["paths.outputs=/x", "+paths.outputs=/x", "paths=mine", "resume=x", "trial=3"]
    place += ["demonstrations=/x"]
    assert taken_over(noted([*place, "seed=1"]), []) == ["seed=1"]
    assert must_be_typed([*place, "seed=1", "collector.make=a"]) == ["collector.make=a"]


@pytest.mark.parametrize(
    "setting",
    [
        *("policy._target_=os.system", "policy={_target_:os.system}", "+a={_target_:os.system}"),
        *("hydra.run.dir=/x", "hydra/launcher=ray", "+hydra.job.name=x", "pathsx.outputs=/x"),
        *("logger.tensorboard.log_dir=/x", "collector.address=ray://x", "collector.make=os.system"),
        *("policy=../x", "policy=/x", "policy=a/b", "experiment=[a,b]", "+policy=mlp"),
        *("seed=${oc.env:HOME}", "task.spacing=${task.num_cubes}", "seed=1,2", "seed=range(9)"),
        *("--config-dir=/x", "-m", "seed", "~policy", "seed=1\nx=2", "device=os.system"),
        *("trainer.x.y.z=1", "task.spacing=a b", "optimizer.lr='1'", "seed=`id`", "seed=\x1b"),
    ],
)
def test_what_no_file_may_set(noted, setting):
    with pytest.raises(InputError) as error:
        taken_over(noted([setting]), [])
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("- !!python/object/apply:os.system ['x']", "damaged"),
        ("{a: 1}", r"\(dict\) does not fit"),
        ("- {a: 1}", r"\[0\]=\(dict\) is no text"),
        ("- " + "x" * 501, "at most 500"),
        ("- a=1\n" * 201, "0 to 200"),
        ("[" * 3000, "damaged"),
        ("x" * 2**17, "too large"),
    ],
)
def test_files_that_hydra_does_not_write(noted, content, message):
    with pytest.raises(InputError, match=message):
        read_overrides(noted(content))


@pytest.mark.parametrize("setting", ["paths.outputs=/x y", "a=1", "logger.x.y=z", "~a.b"])
def test_what_people_may_see(setting):
    assert check_harmless(setting, "x") == setting


@pytest.mark.parametrize(
    "setting", ["a._target_=b", "hydra.x=1", "+hydra.x=1", "a=${b}", "-m", "--x=1", "a=`b`", "a"]
)
def test_what_people_should_not_copy(setting):
    with pytest.raises(InputError, match="not a plain setting"):
        check_harmless(setting, "x")


def test_commands():
    for command in ("drone-rl train", "drone-rl train 'policy.hidden=[1]' seed=1"):
        assert COMMAND.read(command, "x") == command
    bad = ["rm", "drone-rl evaluate", "drone-rl train; rm x", "drone-rl train $(rm x)", "'", 5]
    for command in [*bad, "drone-rl train '`rm x`'", "drone-rl train\nrm x"]:
        with pytest.raises(InputError):
            COMMAND.read(command, "x")


def test_former_names_in_a_file_are_read_as_the_present_ones(noted):
    older = ["optimiser=sgd", "+optimiser.amsgrad=true", "~optimiser.lr", "seed=1"]
    read = ["optimizer=sgd", "+optimizer.amsgrad=true", "~optimizer.lr", "seed=1"]
    assert read_overrides(noted(older)) == read
    assert taken_over(noted(older), ["optimizer.amsgrad=false", "optimizer.lr=1"]) == [
        *("optimizer=sgd", "seed=1")
    ]
    for other in (
        *("network.optimiser=1", "optimisers=1", "x.optimiser.lr=1", "minibatch_frames=1"),
        *("trainer_minibatch_frames=1", "name=standardised", "returns=standardised_2"),
    ):
        assert with_current_name(other) == other


@pytest.mark.parametrize(
    ("former", "current"),
    [
        ("trainer.minibatch_frames=8", "trainer.chunk_frames=8"),
        ("++trainer.minibatch_frames=8", "++trainer.chunk_frames=8"),
        ("returns=standardised", "returns=standardized"),
        ("+returns=gae,batch_normalised", "+returns=gae,batch_normalized"),
        ("appearance=randomised", "appearance=randomized"),
        ("scheduler=none", "scheduler=constant"),
    ],
)
def test_former_names_of_nested_settings_and_choices(former, current):
    assert with_current_name(former) == current
    assert with_current_name(current) == current
