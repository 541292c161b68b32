from drone_rl.flight.commands.command import PilotError
from drone_rl.utils.errors import InputError


def test_it_is_a_users_mistake():
    assert issubclass(PilotError, InputError)
