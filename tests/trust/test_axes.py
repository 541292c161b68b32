import itertools
import math

import pytest
import torch

import drone_rl
from drone_rl.config import PillarsSettings
from drone_rl.config.task import BaseTaskSettings
from drone_rl.sim.rendering.appearance import Appearance
from drone_rl.trust.axes import AXES, FACTORS, GROUPS, INVERSE, LINEAR, Axis, check_axes, find_axes
from drone_rl.trust.perturbations import Condition, sun_at
from drone_rl.utils.errors import InputError
from tests.house import write_house
from tests.trust.making import subject_of
from tests.trust.subjects import subject


@pytest.mark.parametrize("axis", AXES.values(), ids=AXES)
def test_strengths_increase(axis):
    away = [abs(axis.position(strength)) for strength in axis.strengths]
    assert all(later >= earlier * 0.75 for earlier, later in itertools.pairwise(away))
    assert min(away) > 0 and away[-1] == max(away)
    for side in (-1, 1):
        one_way = [
            a for a, s in zip(away, axis.strengths, strict=True) if side * axis.position(s) > 0
        ]
        assert one_way == sorted(one_way)


def test_values_are_in_units_of_the_task():
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


def test_unknown_axes():
    with pytest.raises(InputError, match=r"axes=sunn is unknown.*did you mean sun\?"):
        check_axes(["sunn"])
    with pytest.raises(InputError, match="axes=wind is unknown; give some of: color"):
        check_axes(["wind"])
    with pytest.raises(InputError, match="axes=wind"):
        find_axes(["blur", "wind"], subject())


def test_task_without_a_size():
    class Other(PillarsSettings):
        name = "other"
        object_size = None

    other = subject(task=Other())
    with pytest.raises(InputError, match="axes=object_size is not for task=other"):
        find_axes(["object_size"], other)
    assert "object_size" not in [a.name for a in find_axes(None, other)]


def axis(scale=LINEAR, neutral=0.0, **kwargs):
    strengths = (1.0, 2.0, 3.0, 4.0, 5.0)
    return Axis("a", "b", "m", neutral, strengths, lambda s, _: Condition(), scale=scale, **kwargs)


def test_positions_on_a_scale_of_factors():
    of_factors = axis(FACTORS, 1.0)
    assert of_factors.position(2.0) == -of_factors.position(0.5) == pytest.approx(math.log(2))
    assert of_factors.at(-math.log(2)) == pytest.approx(0.5)
    assert of_factors.position(1.0) == 0


def test_positions_on_an_inverse_scale():
    of_visibility = axis(INVERSE, math.inf)
    assert of_visibility.position(50.0) == pytest.approx(0.02)
    assert of_visibility.at(0.01) == pytest.approx(100.0)
    assert INVERSE.inverse(0.0) == math.inf


def test_strength_at_a_position():
    for one in (axis(), axis(FACTORS, 1.0), axis(INVERSE, math.inf)):
        assert one.at(one.position(4.0)) == pytest.approx(4.0)
        assert one.at(0.0) == pytest.approx(one.neutral)


@pytest.mark.parametrize("name", list(AXES))
def test_strength_of_a_value(name):
    of, one = subject_of(drone_rl.load_policy("good")), AXES[name]
    for strength in one.strengths:
        assert one.strength(one.value(strength, of), of) == pytest.approx(strength)
    assert one.strength(math.inf, of) == math.inf


def test_the_sun_of_a_scene_file_keeps_its_azimuth(tmp_path):
    scene = {"name": "reach", "scene": [str(write_house(tmp_path))]}  # its sun: (0.3, 0.4, -1)
    of = subject(task=BaseTaskSettings.read(scene, "task"))
    axis = AXES["sun"].of(of)
    assert axis.neutral == pytest.approx(math.degrees(math.atan2(1.0, 0.5)))
    (change,) = axis.make(axis.neutral, of).appearance_changes
    towards = change.change(Appearance(), torch.zeros(1, 0)).sun_direction
    torch.testing.assert_close(towards, torch.tensor([0.3, 0.4, -1.0]).double() / 1.25**0.5)


def test_a_sun_above_has_an_azimuth_at_other_elevations():
    change = sun_at(0.0, (0.0, 0.0, -1.0)).change
    towards = change(Appearance(), torch.zeros(1, 0)).sun_direction
    assert float(towards[:2].norm()) == pytest.approx(1.0) and float(towards[2]) == 0.0
