import pytest

from drone_rl.flight.commands.command import PilotError
from drone_rl.flight.commands.pilot import Pilot


def test_taking_off_and_landing():
    pilot = Pilot(start=(1, 1))
    pilot.arm()
    assert pilot.take_off() is True
    pilot.advance(3.0)
    assert pilot.state.position == pytest.approx((1, 1, 2.3), abs=0.02)
    assert pilot.state.landed == "flying"
    assert pilot.land() is True
    assert pilot.state.landed == "landed"
    assert pilot.state.position == pytest.approx((1, 1, 0.3), abs=0.02)
    pilot.disarm()
    assert not pilot.state.armed


def test_nobody_takes_off_while_moving(flying):
    flying.move_by_velocity(1, 0, 0, 1)
    with pytest.raises(PilotError, match="can't take off while moving at 0"):
        flying.take_off()


def test_there_is_too_little_time(flying):
    assert flying.land(timeout=1.0) is False
    assert flying.state.landed == "flying"


def test_hovering_stays(flying):
    flying.advance(3.0)
    before = flying.time
    assert flying.hover(2.1) is True
    assert flying.time == pytest.approx(before + 2.1)
    assert flying.state.position == pytest.approx((0, 0, 2.3), abs=0.02)


def test_going_home(flying):
    assert flying.move_to(4, 3, 2.3, speed=2) is True
    assert flying.go_home(speed=2) is True
    assert flying.state.landed == "landed"
    assert flying.state.position == pytest.approx((0, 0, 0.3), abs=0.05)


def test_going_home_takes_no_longer_than_it_may(flying):
    before = flying.time
    assert flying.go_home(timeout=1.05) is False
    assert flying.time == pytest.approx(before + 1.05, abs=0.021)


def test_the_same_commands_give_the_same_flight():
    def fly(seed):
        with Pilot(gusts=2.0, seed=seed) as pilot:
            pilot.arm()
            pilot.take_off()
            return pilot.state.position

    assert fly(1) == fly(1)
    assert fly(1) != fly(2)
