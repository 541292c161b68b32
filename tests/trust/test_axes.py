import itertools

import pytest
import torch

from drone_rl.config import BaseTaskSettings, PillarsSettings
from drone_rl.sim.rendering.appearance import Appearance
from drone_rl.trust.axes import AXES, GROUPS, check_axes, find_axes
from drone_rl.trust.shifts_text import NAMES
from drone_rl.utils.errors import InputError
from tests.trust.subjects import subject


@pytest.mark.parametrize("axis", AXES.values(), ids=AXES)
def test_strengths_grow_from_no_difference(axis):
    away = [abs(axis.position(strength)) for strength in axis.strengths]
    assert all(later >= earlier * 0.75 for earlier, later in itertools.pairwise(away))
    assert min(away) > 0 and away[-1] == max(away)
    for side in (-1, 1):
        one_way = [
            a for a, s in zip(away, axis.strengths, strict=True) if side * axis.position(s) > 0
        ]
        assert one_way == sorted(one_way)


def test_people_have_words_for_every_axis():
    assert set(NAMES) == set(AXES)


def test_values_are_in_the_tasks_own_units():
    of = subject()
    assert AXES["object_size"].value(1.5, of) == 3.75
    assert AXES["object_size"].make(1.5, of).task == {"cube_size": 3.75}
    assert AXES["field_of_view"].value(-45.0, of) == 90.0
    assert AXES["field_of_view"].make(20.0, of).camera == {"horizontal_fov": 155.0}
    assert AXES["step_length"].make(0.5, of).task == {"step_length": 0.5}
    assert AXES["action_delay"].make(3.0, of).delay == 3
    pillars = subject(task=PillarsSettings())
    assert AXES["object_size"].make(0.5, pillars).task == {"width": 0.5}


def test_axes_are_found_by_name_and_by_group():
    of = subject()
    assert [a.name for a in find_axes(None, of)] == [*AXES]
    assert [a.name for a in find_axes(["blur", "light"], of)] == ["sun", "brightness", "blur"]
    assert len(GROUPS) == 10  # as many kinds of shift as were to be tried


def test_there_is_no_such_axis():
    with pytest.raises(InputError, match=r"axes=sunn is unknown.*did you mean sun\?"):
        check_axes(["sunn"])
    with pytest.raises(InputError, match="axes=wind is unknown; give some of: color"):
        check_axes(["wind"])
    with pytest.raises(InputError, match="axes=wind"):
        find_axes(["blur", "wind"], subject())


def test_a_task_of_which_no_size_is_known():
    class Other(PillarsSettings):
        name = "other"

    other = subject(task=Other())
    with pytest.raises(InputError, match="axes=object_size is not for task=other"):
        find_axes(["object_size"], other)
    assert "object_size" not in [a.name for a in find_axes(None, other)]


def test_a_task_without_steps_of_its_own():
    class Plain(BaseTaskSettings):
        name = "plain"

    plain = subject(task=Plain())
    with pytest.raises(InputError, match="axes=step_length is not for task=plain; leave it out"):
        find_axes(["step_length"], plain)
    assert {"object_size", "step_length"}.isdisjoint(a.name for a in find_axes(None, plain))


@pytest.mark.parametrize(
    ("name", "offset"), [("camera_height", [0.0, 0.0, 0.5]), ("camera_sideways", [0.0, 0.5, 0.0])]
)
def test_a_moved_camera_moves_along_one_axis(name, offset):
    (mount,) = AXES[name].make(0.5, subject()).mounts
    camera = mount.change(Appearance(), torch.ones(1, 1, dtype=torch.float64)).camera
    assert camera.offset.tolist() == [offset]
    assert camera.turn.tolist() == [[1.0, 0.0, 0.0, 0.0]]
