"""What a policy can ask for."""

import pytest

from drone_rl.config import MOVES_SETTINGS, ActionSettings
from drone_rl.utils.errors import InputError


def test_the_chapters_moves_are_first():
    assert ActionSettings() == MOVES_SETTINGS
    assert ActionSettings(kind="velocity") != MOVES_SETTINGS


@pytest.mark.parametrize(
    "wrong", [{"kind": "thrust"}, {"move_speed": 0.0}, {"yaw_rate": -1.0}, {"forward_speed": 51.0}]
)
def test_what_can_not_be_asked_for_is_named(wrong):
    with pytest.raises(InputError, match=f"^{min(wrong)}="):
        ActionSettings(**wrong)
