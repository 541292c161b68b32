import pytest

from drone_rl.config.commands import MODES, ShiftSettings
from drone_rl.trust.perturbations import Mode
from drone_rl.utils.errors import InputError


def test_modes_are_those_that_are_flown():
    assert [*MODES] == [mode.value for mode in Mode]
    assert ShiftSettings().modes == MODES


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({"strengths": (6,)}, r"strengths\[0\]=6 is out of range; give a whole number from 1 to 5"),
        ({"strengths": (2, 1)}, r"strengths=\[2, 1\] don't rise"),
        ({"strengths": (2, 2)}, "don't rise"),
        ({"strengths": ()}, "strengths"),
        ({"modes": ("constant", "constant")}, "modes=.* has one twice; give each once"),
        ({"modes": ("drifting",)}, r"modes=\['drifting'\] leaves out constant"),
        ({"modes": ("sudden",)}, "sudden.* is unknown; give constant, drifting, onset"),
        ({"episodes": 0}, "episodes=0"),
        ({"good_share": 1.0}, "good_share=1.0"),
        ({"axes": ("sun", "sun")}, "each once"),
    ],
)
def test_mistakes(told, message):
    with pytest.raises(InputError, match=message):
        ShiftSettings(**told)
