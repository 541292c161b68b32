import pytest

from drone_rl.config.commands import BODIES, BodiesSettings, ShiftSettings
from drone_rl.utils.errors import InputError


def test_bodies_by_default():
    assert BodiesSettings().bodies == BODIES and len(BODIES) == 7
    assert BodiesSettings(bodies=("wind 5 m/s",)).bodies == ("wind 5 m/s",)


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({"bodies": ("submarine",)}, "submarine': it must be .*'simple flight'"),
        ({"bodies": ()}, "bodies"),
        ({"policies": ("good", "good")}, "each once"),
    ],
)
def test_values_of_bodies_out_of_bounds(told, message):
    with pytest.raises(InputError, match=message):
        BodiesSettings(**told)


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({"strengths": (2, 1)}, r"strengths=\[2, 1\] don't rise"),
        ({"modes": ("constant", "constant")}, "modes=.* has one twice; give each once"),
        ({"modes": ("drifting",)}, r"modes=\['drifting'\] leaves out constant"),
        ({"axes": ("sun", "sun")}, "each once"),
    ],
)
def test_values_of_shifts_out_of_bounds(told, message):
    with pytest.raises(InputError, match=message):
        ShiftSettings(**told)
