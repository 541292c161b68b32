from drone_rl.flight.in_the_loop.drone import FlightControllerError
from drone_rl.utils.errors import InputError


def test_it_is_no_mistake_of_the_user():
    assert issubclass(FlightControllerError, RuntimeError)
    assert not issubclass(FlightControllerError, InputError)
