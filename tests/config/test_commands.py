import pytest

from drone_rl.config.commands import BODIES, BodiesSettings, ProvableSettings, ShiftSettings
from drone_rl.utils.errors import InputError


def test_bodies_by_default():
    assert BodiesSettings().bodies == BODIES and len(BODIES) == 7
    assert BodiesSettings(bodies=("wind 5 m/s",)).bodies == ("wind 5 m/s",)


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({"bodies": ("submarine",)}, "submarine': it must be .*'simple flight'"),
        ({"bodies": ()}, "bodies"),
        ({"policies": ()}, "policies"),
        ({"policies": ("good", "good")}, "each once"),
        ({"bodies": ("simple flight", "simple flight")}, "each once"),
        ({"episodes": 0}, "episodes=0"),
    ],
)
def test_values_of_bodies_out_of_bounds(told, message):
    with pytest.raises(InputError, match=message):
        BodiesSettings(**told)


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({"strengths": (6,)}, r"strengths\[0\]=6"),
        ({"strengths": (2, 1)}, r"strengths=\[2, 1\] don't rise"),
        ({"strengths": (2, 2)}, "don't rise"),
        ({"strengths": ()}, "strengths"),
        ({"modes": ("constant", "constant")}, "modes=.* has one twice; give each once"),
        ({"modes": ("drifting",)}, r"modes=\['drifting'\] leaves out constant"),
        ({"modes": ("sudden",)}, "sudden': it must be 'constant', 'drifting' or 'onset'"),
        ({"episodes": 0}, "episodes=0"),
        ({"good_share": 1.0}, "good_share=1.0"),
        ({"axes": ("sun", "sun")}, "each once"),
    ],
)
def test_values_of_shifts_out_of_bounds(told, message):
    with pytest.raises(InputError, match=message):
        ShiftSettings(**told)


@pytest.mark.parametrize(
    "change", [{"rounds": -1}, {"share": 1.5}, {"frames": 0}, {"margin": -0.1}, {"enough": 0}]
)
def test_values_of_provable_training_out_of_bounds(change):
    (name,) = change
    with pytest.raises(InputError, match=f"^{name}="):
        ProvableSettings(**change)
