import dataclasses
import time

import numpy as np
import pytest
import torch

from drone_rl.flight.in_the_loop import drone as module
from drone_rl.flight.in_the_loop.control import Setpoint
from drone_rl.flight.in_the_loop.drone import DroneInTheLoop, FlightControllerError
from tests.flight.simple_body import SETTINGS, SimpleBody

HOVER = SETTINGS.hover_throttle


class Direct:
    """Rotors follow the throttle once it is armed."""

    def __init__(self, arms=True):
        self.arms, self.seen = arms, []

    def step(self, readings, sticks):
        self.seen.append((readings, sticks))
        return np.full(4, max(sticks.throttle, 0.05) if sticks.armed and self.arms else 0.0)


def drone(controller=None, body=None):
    body = body or SimpleBody()
    return DroneInTheLoop(body, body.start(), controller or Direct(), SETTINGS)


def test_arming_waits_then_turns_the_switch():
    controller = Direct()
    flown = drone(controller)
    flown.arm(settle=0.1)
    assert [s.armed for _, s in controller.seen] == [False] * 100 + [True]
    assert flown.rotors.tolist() == [0.05] * 4
    assert flown.time == pytest.approx(0.101)


def test_a_firmware_that_never_arms():
    flown = drone(Direct(arms=False))
    with pytest.raises(FlightControllerError, match="not all rotors turned in 2 attempts"):
        flown.arm(tries=2, settle=0.01, within=0.01)


def test_pilots_are_asked_on_time():
    asked = []

    def pilot(body, readings):
        asked.append((round(readings.time, 6), body.position.shape))
        return Setpoint((0.0, 0.0, 1.0))

    flown = drone()
    assert not flown.fly(pilot, 0.1, every=0.04)
    assert asked == [(0.0, (1, 3)), (0.04, (1, 3)), (0.08, (1, 3))]
    assert [m.time for m in flown.trace] == pytest.approx([0.0, 0.04, 0.08])


def test_a_flight_is_over_when_it_should_be():
    flown = drone()
    climb = lambda body, readings: Setpoint((0.0, 0.0, 1.0))  # noqa: E731
    assert flown.fly(climb, 10.0, until=lambda s: bool(s.position[2] > 0.5))
    assert 0.5 < flown.readings.position[2] < 0.6
    assert flown.time < 2.0


def test_a_pilot_who_thinks_for_too_long(monkeypatch):
    monkeypatch.setattr(module, "LONGEST_DECISION", 0.01)
    flown = drone()
    with pytest.raises(FlightControllerError, match="the setpoint took"):
        flown.fly(lambda body, readings: time.sleep(0.02) or Setpoint((0.0, 0.0, 0.0)), 1.0)


def test_a_motion_that_diverges():
    class Broken(SimpleBody):
        def push(self, body, rotors, ticks=1):
            return dataclasses.replace(body, position=torch.full_like(body.position, torch.nan))

    with pytest.raises(FlightControllerError, match=r"diverged after 0\.001 s"):
        drone(body=Broken()).hold(module.AT_REST, 0.1)
