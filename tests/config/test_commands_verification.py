"""What rounds of practice can be told."""

import pytest

from drone_rl.config.commands import ProvableSettings
from drone_rl.utils.errors import InputError


def test_nothing_is_proved_unless_it_is_asked_for():
    assert ProvableSettings().rounds == 0


@pytest.mark.parametrize(
    "change", [{"rounds": -1}, {"share": 1.5}, {"frames": 0}, {"margin": -0.1}, {"enough": 0}]
)
def test_what_is_out_of_bounds(change):
    (name,) = change
    with pytest.raises(InputError, match=f"^{name}="):
        ProvableSettings(**change)
