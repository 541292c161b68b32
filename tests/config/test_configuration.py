import subprocess
import sys

import pytest

from drone_rl.cli.evaluation import PlayCommand
from drone_rl.config import AppearanceSettings, PillarsSettings, TaskSettings
from drone_rl.config.configuration import (
    Changes,
    as_changes,
    as_config,
    check_same_config,
    from_arguments,
    from_config,
    locate,
    variant_of,
)
from drone_rl.config.learning import Adam, Optimizer, Returns
from drone_rl.config.networks import Lstm, Mlp, Network, OriginalCnn, SmallCnn
from drone_rl.config.training import TrainerSettings, TrainSettings
from drone_rl.config.transforms import Crop, Gray
from drone_rl.utils.errors import InputError


def test_settings_round_trip():
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
        ({"task": {"vertical_bound": 3.0}}, "task.altitude=2.5 lets the drone fly into"),
        ({"trainer": 3}, "trainer=3 must be a mapping"),
        ({"optimizer": {"_target_": Adam.target, "lr": 0}}, "optimizer.lr=0 is out of range"),
        ({"transforms": {"a": {"_target_": Crop.target, "top": -1}}}, r"transforms\.a\.top=-1"),
        ([], "settings="),
    ],
)
def test_errors_begin_with_the_place(config, message):
    with pytest.raises(InputError, match=f"{message}"):
        from_config(TrainSettings, config)


def test_classes_of_other_packages():
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
    code += "assert not {'torch', 'hydra', 'mujoco', 'scipy'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_mujoco_warp_renders_only_the_minimal_appearance():
    look = AppearanceSettings(fog_visibility=50.0)
    with pytest.raises(InputError, match=r"^renderer=mujoco_warp supports only appearance=minimal"):
        TrainSettings(renderer="mujoco_warp", appearance=look)
    assert TrainSettings(appearance=look).replace(seed=1).appearance is look
    given = from_config(TrainSettings, {"appearance": {"fog_visibility": 50.0}})
    assert given.appearance == look
    assert from_config(TrainSettings, as_config(given)) == given


def test_optional_settings():
    given = {"appearance": {"exposure": 2.0}}
    assert from_config(PlayCommand, given).appearance == AppearanceSettings(exposure=2.0)
    assert from_config(PlayCommand, {"appearance": None}).appearance is None
    with pytest.raises(InputError, match=r"^appearance\.exposure=0 is out of range"):
        from_config(PlayCommand, {"appearance": {"exposure": 0}})


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
        (judged, {"apperance": 1}, "apperance is unknown"),
        (judged, {"num_cubes": 2}, "num_cubes is a setting of task"),
    ],
)
def test_unknown_changes_are_refused(function, change, message):
    with pytest.raises(InputError, match=message):
        from_arguments(Adam, None, change, function)


def test_changes_of_a_task():
    kind = Changes(TaskSettings)
    assert kind.read({"num_cubes": 5, "spacing": None}, "task") == {"num_cubes": 5}
    with pytest.raises(InputError, match=r"^task\.num_cubes=0"):
        kind.read({"num_cubes": 0}, "task")
    with pytest.raises(InputError, match=r"^task\.num_cubs is unknown"):
        kind.read({"num_cubs": 1}, "task")


def test_check_same_config():
    saved = {"seed": 0, "optimizer": {"lr": 0.1}, "trainer": {"total_frames": 10}}
    check_same_config(saved, {**saved, "trainer": {"total_frames": 99}}, ["trainer.total_frames"])
    with pytest.raises(InputError, match=r"optimizer.lr=0.2: .* optimizer.lr=0.1"):
        check_same_config(saved, {**saved, "optimizer": {"lr": 0.2}}, ["trainer.total_frames"])
    with pytest.raises(InputError, match="extra=1"):
        check_same_config(saved, {**saved, "extra": 1}, [])


def test_the_variants_of_a_part():
    ours = {variant for variant in Network.variants() if variant.__module__.startswith("drone_rl.")}
    assert ours == {SmallCnn, OriginalCnn, Lstm, Mlp}  # Other tests may have added their own.
    assert "_Discounted" not in {variant.__name__ for variant in Returns.variants()}
    ours = [v for v in Returns.variants() if v.__module__.startswith("drone_rl.")]
    assert len(ours) == 9
    assert SmallCnn().name == "small_cnn"


def test_locate():
    with pytest.raises(InputError, match=r"_target_=no\.such can't be imported"):
        locate("no.such")
    with pytest.raises(InputError, match="can't be imported"):
        locate("os.no_such")
    with pytest.raises(InputError, match="can't be imported"):
        locate("")
    assert locate("os.path").__name__ == "posixpath"


def test_an_unknown_name_without_a_module_is_refused():
    with pytest.raises(InputError, match=r"^network\._target_='resnet' is not registered"):
        variant_of(Network, {"_target_": "resnet"}, "network")


def test_a_registered_part_keeps_its_factory_with_values_of_the_users_own():
    import drone_rl.policies.networks  # noqa: F401 (connects the settings with their factories)

    part = variant_of(Network, {"_target_": "mlp", "hidden": [4], "more": 1}, "network")
    assert part.values() == {"hidden": [4], "more": 1}
    assert type(part).factory is Mlp.factory is not None
    other = variant_of(Network, {"_target_": "os.path.join", "more": 1}, "network")
    assert type(other).factory is None
