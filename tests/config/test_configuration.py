"""Settings become plain data and come back; what can't is named by its place."""

import subprocess
import sys

import pytest

from drone_rl.cli.evaluation import PlayCommand
from drone_rl.config import AppearanceSettings, PillarsSettings, TaskSettings
from drone_rl.config.configuration import (
    Changes,
    as_changes,
    as_config,
    from_arguments,
    from_config,
    variant_of,
)
from drone_rl.config.learning import Adam, Optimizer
from drone_rl.config.networks import Mlp
from drone_rl.config.training import TrainerSettings, TrainSettings
from drone_rl.config.transforms import Crop, Gray
from drone_rl.utils.errors import InputError


def test_a_training_comes_back_as_it_was():
    told = TrainSettings(
        task=TaskSettings(num_cubes=2),
        transforms=(Gray(), Crop(top=1, bottom=9), Crop(top=0, bottom=4)),
        network=Mlp(hidden=()),
        trainer=TrainerSettings(total_episodes=7),
        seed=4,
    )
    config = as_config(told)
    assert list(config["transforms"]) == ["gray", "crop", "crop_2"]
    assert config["network"] == {"_target_": "mlp", "hidden": []}
    assert from_config(TrainSettings, config) == told
    assert from_config(TrainSettings, as_config(told.replace(transforms=()))).transforms == ()


@pytest.mark.parametrize(
    ("config", "message"),
    [
        ({"task": {"num_cubes": 0}}, "task.num_cubes=0 is out of range"),
        ({"task": {"num_cubs": 1}}, "num_cubs is unknown"),
        ({"task": {"vertical_bound": 3.0}}, "task.altitude=2.5 lets the drone fly into"),
        ({"trainer": 3}, "trainer=3 must be a mapping"),
        ({"unheard": 3}, "unheard is unknown"),
        (
            {"optimizer": {"lr": 1.0}},
            "optimizer._target_ must be a .* name, got None",
        ),
        ({"optimizer": {"_target_": Adam.target, "lr": 0}}, "optimizer.lr=0 is out of range"),
        ({"transforms": {"a": {"_target_": Crop.target, "top": -1}}}, r"transforms\.a\.top=-1"),
        ({"collector": {"_target_": "their.Own", "num_envs": 0}}, "collector.num_envs=0"),
        ([], "settings="),
    ],
)
def test_mistakes_are_named_by_their_place(config, message):
    with pytest.raises(InputError, match=f"{message}"):
        from_config(TrainSettings, config)


def test_what_only_the_user_knows_is_kept_and_checked_where_it_is_known():
    sgd = {"_target_": "mine.Optimizer", "momentum": 0.9}
    found = variant_of(Optimizer, sgd, "optimizer")
    assert not found.is_known
    assert as_config(found) == sgd
    more = {"_target_": Adam.target, "lr": 0.1, "amsgrad": True}
    assert as_config(variant_of(Optimizer, more, "optimizer")) == more
    with pytest.raises(InputError, match=r"optimizer\.lr=-1 "):
        variant_of(Optimizer, {**more, "lr": -1}, "optimizer")
    assert variant_of(Optimizer, {"_target_": Adam.target, "lr": 0.1}, "x") == Adam(lr=0.1)
    with pytest.raises(InputError, match=r"_target_=mine\.Optimizer can't be imported"):
        found.make()


def test_settings_import_nothing_heavy():
    code = "import sys, drone_rl.config.training, drone_rl.config.commands\n"
    code += "assert not {'torch', 'hydra', 'mujoco', 'scipy', 'numpy'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_other_renderer_draws_the_minimal_look_alone():
    look = AppearanceSettings(fog_visibility=50.0)
    with pytest.raises(InputError, match=r"^renderer=mujoco_warp supports only appearance=minimal"):
        TrainSettings(renderer="mujoco_warp", appearance=look)
    assert TrainSettings(appearance=look).replace(seed=1).appearance is look
    given = from_config(TrainSettings, {"appearance": {"fog_visibility": 50.0}})
    assert given.appearance == look
    assert from_config(TrainSettings, as_config(given)) == given


def test_settings_that_may_be_none_are_made_of_mappings_too():
    given = {"appearance": {"exposure": 2.0}}
    assert from_config(PlayCommand, given).appearance == AppearanceSettings(exposure=2.0)
    assert from_config(PlayCommand, {"appearance": None}).appearance is None
    with pytest.raises(InputError, match=r"^appearance\.exposure=0 is out of range"):
        from_config(PlayCommand, {"appearance": {"exposure": 0}})


def test_an_appearance_without_room_is_refused_with_the_training():
    with pytest.raises(InputError, match="puts the camera into the ground"):
        TrainSettings(appearance=AppearanceSettings(camera_offset=(0.0, 0.0, -3.0)))


def test_changes_of_settings_have_names():
    assert as_changes(None, "task") == {}
    assert as_changes({"num_cubes": 2}, "task") == {"num_cubes": 2}
    assert as_changes(TaskSettings(num_cubes=2), "task")["num_cubes"] == 2
    for wrong in (5, "pillars", [1]):
        with pytest.raises(InputError, match=r"^task=.* gives no changes; .*'num_cubes': 5"):
            as_changes(wrong, "task")
    with pytest.raises(InputError, match=r"^task\.name='pillars' would replace the task, which is"):
        Changes(TaskSettings).read({"name": "pillars"}, "task")
    settings = PillarsSettings(num_rows=2)
    read = Changes(PillarsSettings).read(as_changes(settings, "task"), "task")
    assert PillarsSettings(**read) == settings


def judged(policy, settings=None, *, task=None, appearance=None, **changes):
    """A function with settings, its further arguments, and changes."""


def evaluated(policy, settings=None, **changes):
    """A function of a policy without further arguments."""


def test_settings_of_a_function_and_its_changes_to_them():
    assert from_arguments(Adam, None, {}, judged) == Adam()
    assert from_arguments(Adam, Adam(lr=0.5), {}, judged) == Adam(lr=0.5)
    assert from_arguments(Adam, Adam(lr=0.5), {"lr": 0.25}, judged) == Adam(lr=0.25)
    for wrong in (Adam, {"lr": 0.5}, TaskSettings(), 5):
        with pytest.raises(InputError, match=r"^settings=.* is no Adam; give "):
            from_arguments(Adam, wrong, {}, judged)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize(
    ("function", "change", "message"),
    [
        (
            judged,
            {"apperance": 1},
            r"^apperance is unknown; valid names: lr, task, .* mean appearance\?",
        ),
        (
            judged,
            {"num_cubes": 2},
            r"^num_cubes is a setting of task; give task=\{'num_cubes': 2\}$",
        ),
        (evaluated, {"num_cubes": 2}, r"give load_policy\(\.\.\.\)\.in_task\(num_cubes=2\)$"),
        (evaluated, {"mass": 2.0}, r"give load_policy\(\.\.\.\)\.in_dynamics\(mass=2\.0\)$"),
        (judged, {"lrr": 2.0}, "lrr is unknown; .*did you mean lr"),
    ],
)
def test_changes_that_are_no_settings(function, change, message):
    with pytest.raises(InputError, match=message):
        from_arguments(Adam, None, change, function)
