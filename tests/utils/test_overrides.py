import pytest
import yaml

from drone_rl.utils.errors import InputError
from drone_rl.utils.overrides import (
    COMMAND,
    check_harmless,
    must_be_typed,
    read_overrides,
    taken_over,
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
        *("experiment=smoke", "logger=csv", "network=mlp", "collector=ray", "transforms=stack"),
        *("network.hidden=[128,64]", "network.hidden=[128, 64]", "network.channels=[]"),
        *("optimizer.lr=1e-3", "task.spacing=-9.5", "trainer.total_episodes=null"),
        "++task.reward.near_wall.weight=-0.5",
        *("task.cube_color=[0.1, 0.2, 0.3]", "transforms.crop.top=3", "~transforms.standardize"),
        *("+optimizer.amsgrad=true", "objective.reduction=sum", "collector.num_envs=8"),
        *("inputs=[gray,goal]", "+inputs@inputs.down=depth", "inputs.down.size=[48,64]"),
        *("cloning.epochs=5", "collector.compiled=false", "renderer=mujoco_warp"),
    ]
    assert taken_over(noted(settings), []) == settings


def test_a_folder_without_overrides(tmp_path):
    assert read_overrides(tmp_path) == []


def test_typed_settings_take_precedence(noted):
    folder = noted(["seed=1", "optimizer.lr=1", "network=mlp"])
    assert taken_over(folder, ["optimizer.lr=2", "+seed=2"]) == ["network=mlp"]


def test_paths_of_the_first_run_are_left_out(noted):
    """It may have been moved or copied, or out of a sweep that is not there any more."""
    place = ["paths.outputs=/x", "+paths.outputs=/x", "paths=mine", "resume=x", "trial=3"]
    place += ["demonstrations=/x"]
    assert taken_over(noted([*place, "seed=1"]), []) == ["seed=1"]
    assert must_be_typed([*place, "seed=1", "collector.make=a"]) == ["collector.make=a"]


@pytest.mark.parametrize(
    "setting",
    [
        *("network._target_=os.system", "network={_target_:os.system}", "+a={_target_:os.system}"),
        *("hydra.run.dir=/x", "hydra/launcher=ray", "+hydra.job.name=x", "pathsx.outputs=/x"),
        *("logger.tensorboard.log_dir=/x", "collector.address=ray://x", "collector.make=os.system"),
        *("inputs.a._target_=os.system", "+inputs@inputs.a=os.system", "inputs=[os.system]"),
        *("network=../x", "network=/x", "network=a/b", "experiment=[a,b]", "+network=mlp"),
        *("seed=${oc.env:HOME}", "task.spacing=${task.num_cubes}", "seed=1,2", "seed=range(9)"),
        *("--config-dir=/x", "-m", "seed", "~network", "seed=1\nx=2", "device=os.system"),
        *("trainer.w.x.y.z=1", "task.spacing=a b", "optimizer.lr='1'", "seed=`id`", "seed=\x1b"),
    ],
)
def test_unsafe_settings_are_refused(noted, setting):
    with pytest.raises(InputError) as error:
        taken_over(noted([setting]), [])
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "content", ["{a: 1}", "- {a: 1}", "- " + "x" * 501, "- a=1\n" * 201, "[" * 3000, "x" * 2**17]
)
def test_damaged_files_are_refused(noted, content):
    with pytest.raises(InputError):
        read_overrides(noted(content))


@pytest.mark.parametrize("setting", ["paths.outputs=/x y", "a=1", "logger.x.y=z", "~a.b"])
def test_harmless_settings_are_shown(setting):
    assert check_harmless(setting, "x") == setting


@pytest.mark.parametrize(
    "setting", ["a._target_=b", "hydra.x=1", "+hydra.x=1", "a=${b}", "-m", "--x=1", "a=`b`", "a"]
)
def test_settings_that_run_code_are_not_shown(setting):
    with pytest.raises(InputError, match="not a plain setting"):
        check_harmless(setting, "x")


def test_commands():
    for command in ("drone-rl train", "drone-rl train 'network.hidden=[1]' seed=1"):
        assert COMMAND.read(command, "x") == command
    bad = ["rm", "drone-rl evaluate", "drone-rl train; rm x", "drone-rl train $(rm x)", "'", 5]
    for command in [*bad, "drone-rl train '`rm x`'", "drone-rl train\nrm x"]:
        with pytest.raises(InputError):
            COMMAND.read(command, "x")
