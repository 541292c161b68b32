import pytest

from drone_rl.config.commands import BODIES, BodiesSettings
from drone_rl.utils.errors import InputError


def test_all_bodies_by_default():
    assert BodiesSettings().bodies == BODIES and len(BODIES) == 7
    assert BodiesSettings(bodies=("wind 5 m/s",)).bodies == ("wind 5 m/s",)


@pytest.mark.parametrize(
    ("told", "message"),
    [
        ({"bodies": ("submarine",)}, "submarine.* is unknown; give .*simple flight"),
        ({"bodies": ()}, "bodies"),
        ({"policies": ()}, "policies"),
        ({"policies": ("good", "good")}, "each once"),
        ({"bodies": ("simple flight", "simple flight")}, "each once"),
        ({"episodes": 0}, "episodes=0"),
    ],
)
def test_mistakes(told, message):
    with pytest.raises(InputError, match=message):
        BodiesSettings(**told)
