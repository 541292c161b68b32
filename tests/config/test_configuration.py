import pytest

from drone_rl.config import TaskSettings
from drone_rl.config.configuration import (
    Changes,
    as_changes,
    check_same_config,
    from_arguments,
)
from drone_rl.config.learning import Adam
from drone_rl.utils.errors import InputError


def test_changes_of_settings_have_names():
    assert as_changes(None, "task") == {}
    assert as_changes({"num_cubes": 2}, "task") == {"num_cubes": 2}
    assert as_changes(TaskSettings(num_cubes=2), "task")["num_cubes"] == 2
    for wrong in (5, "pillars", [1]):
        with pytest.raises(InputError, match=r"^task=.* gives no changes; .*'num_cubes': 5"):
            as_changes(wrong, "task")
    kind = Changes(TaskSettings)
    assert kind.read({"name": "collect_cubes", "num_cubes": 2, "spacing": None}, "task") == {
        "num_cubes": 2
    }
    with pytest.raises(InputError, match=r"^task\.name='pillars' would replace the task, which is"):
        kind.read({"name": "pillars"}, "task")
    with pytest.raises(InputError, match=r"^task\.cubes is unknown; .* did you mean num_cubes\?"):
        kind.read({"cubes": 2}, "task")


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


def test_check_same_config():
    saved = {"seed": 0, "optimizer": {"lr": 0.1}, "trainer": {"total_frames": 10}}
    check_same_config(saved, {**saved, "trainer": {"total_frames": 99}}, ["trainer.total_frames"])
    with pytest.raises(InputError, match=r"optimizer.lr=0.2: .* optimizer.lr=0.1"):
        check_same_config(saved, {**saved, "optimizer": {"lr": 0.2}}, ["trainer.total_frames"])
    with pytest.raises(InputError, match="extra=1"):
        check_same_config(saved, {**saved, "extra": 1}, [])
