from drone_rl.flight.firmware.errors import LoopError
from drone_rl.utils.errors import InputError


def test_it_is_no_mistake_of_the_user():
    assert issubclass(LoopError, RuntimeError)
    assert not issubclass(LoopError, InputError)
