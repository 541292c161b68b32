"""Our quadrotor with the stub on board; with the real firmware where it was built."""

import contextlib
import json
import shlex

import numpy as np
import pytest

from drone_rl.config import DynamicsSettings
from drone_rl.flight.betaflight import sitl
from drone_rl.flight.betaflight.build import find_firmware
from drone_rl.flight.betaflight.sitl import betaflight_drone
from drone_rl.flight.in_the_loop.control import Setpoint
from drone_rl.flight.in_the_loop.drone import FlightControllerError
from drone_rl.flight.in_the_loop.trial_flight import Course, CourseReport, fly_course, take_off
from drone_rl.utils.errors import InputError


@pytest.fixture
def program(stub, tmp_path):
    """The stub as a program of its own."""
    path = tmp_path / "stub"
    path.write_text(f"#!/bin/sh\nexec {shlex.join(stub())}\n")
    path.chmod(0o755)
    return path


def test_it_stands_and_takes_off(program, tmp_path):
    heavy = DynamicsSettings(mass=1.2)
    with betaflight_drone(heavy, firmware=program, folder=tmp_path / "kept") as drone:
        assert drone.settings == heavy.replace(mode="simple_flight", tick=0.001)
        assert drone.readings.position.tolist() == [0.0, 0.0, heavy.radius]
        drone.arm(settle=0.1)
        take_off(drone, np.array([0.0, 0.0, 1.0]))
    assert (tmp_path / "kept" / "eeprom.bin").exists()


def test_a_policy_flies_by_setpoints(program):
    """Asked as often as an action lasts, with a state of one world."""
    asked = []

    def policy(body, readings):
        asked.append(body.position.shape)
        return Setpoint((1.0, 0.0, 0.0))

    with betaflight_drone(firmware=program) as drone:
        drone.arm(settle=0.1)
        take_off(drone, np.array([0.0, 0.0, 1.0]))
        drone.fly(policy, 1.98, every=0.099)
    assert asked == [(1, 3)] * 20
    assert 0.3 < drone.readings.position[0] < 2.0


def test_the_command(monkeypatch, capsys):
    report = CourseReport(0.1, 0.2, 0.3, 0.4, 5.0, 6.0)
    monkeypatch.setattr(sitl, "betaflight_drone", contextlib.nullcontext)
    monkeypatch.setattr(sitl, "fly_course", lambda drone: report)
    sitl.main()
    assert json.loads(capsys.readouterr().out) == vars(report)

    def fails(drone):
        raise FlightControllerError("it fell silent")

    monkeypatch.setattr(sitl, "fly_course", fails)
    with pytest.raises(SystemExit, match="error: it fell silent"):
        sitl.main()


def test_without_a_firmware(tmp_path):
    with (
        pytest.raises(InputError, match="doesn't exist"),
        betaflight_drone(firmware=tmp_path / "x"),
    ):
        pass


@pytest.mark.slow
def test_the_real_firmware_flies_a_square(own_network):
    try:
        find_firmware()
    except InputError as error:
        pytest.skip(str(error))
    with betaflight_drone() as drone:
        report = fly_course(drone, Course(height=1.0, side=2.5, speed=0.8, hover=3.5))
    assert report.hover_error_m < 0.3
    assert report.path_error_m < 0.5
    assert report.landing_error_m < 0.5
