"""Our quadrotor with the stub on board; with the real firmware where it was built."""

import shlex
import struct

import numpy as np
import pytest

from drone_rl.config import DynamicsSettings
from drone_rl.flight.betaflight.build import find_firmware
from drone_rl.flight.betaflight.sitl import (
    MEMORY,
    STARTS,
    Betaflight,
    betaflight_drone,
    pack_state,
    pack_sticks,
    unpack_rotors,
)
from drone_rl.flight.in_the_loop.control import AT_REST, RcSticks, Setpoint
from drone_rl.flight.in_the_loop.drone import FlightControllerError
from drone_rl.flight.in_the_loop.instruments import Readings
from drone_rl.flight.in_the_loop.trial_flight import Course, fly_course, take_off
from drone_rl.sim.coordinates import GeoPoint
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


READINGS = Readings(
    time=7.0,
    position=np.zeros(3),
    velocity=np.array([1.0, 2.0, 3.0]),  # 1 m/s north, 2 west, 3 up
    attitude=np.array([0.5, 0.5, 0.5, 0.5]),
    rates=np.array([0.1, 0.2, 0.3]),
    force=np.array([1.0, 2.0, 9.0]),
    home=GeoPoint(48.0, 11.0, 0.0),
)


def test_a_state_byte_for_byte():
    packet = pack_state(READINGS)
    values = (
        *(0.0,),
        *(0.1, -0.2, -0.3),
        *(-1.0, -2.0, -9.0),
        *(0.5, 0.5, -0.5, -0.5),
        *(-2.0, 1.0, 3.0),
        *(11.0, 48.0, 0.0),
        *(101_325.0,),
    )
    assert len(packet) == 144
    assert packet == b"".join(struct.pack("<d", value) for value in values)
    assert packet[-8:] == bytes.fromhex("00000000d0bcf840")


def test_sticks_byte_for_byte():
    packet = pack_sticks(1.5, [1500, 2000, 1000, 1250])
    assert len(packet) == 40
    assert packet[8:16] == bytes.fromhex("dc05 d007 e803 e204")
    assert packet[16:] == bytes.fromhex("e803") * 12


def test_rotors():
    packet = bytes.fromhex("0000003f 0000803f 000080bf 00004040")  # 0.5, 1, -1, 3
    assert unpack_rotors(packet).tolist() == [0.5, 1.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("packet", "words"), [(b"\0" * 12, "got 12"), (bytes.fromhex("0000c07f") * 4, "not finite")]
)
def test_what_is_no_packet_of_rotors(packet, words):
    with pytest.raises(ValueError, match=words):
        unpack_rotors(packet)


ZEROS = np.zeros(3)


def standing(step):
    level, force = np.array([1.0, 0.0, 0.0, 0.0]), np.array([0.0, 0.0, 9.81])
    return Readings(step * 0.001, ZEROS, ZEROS, level, ZEROS, force)


def test_it_is_set_up_once_and_then_armed(stub, tmp_path):
    with Betaflight(stub(), tmp_path / "new", answer_within=2.0) as firmware:
        assert "set yaw_srate = 20" in (tmp_path / "new" / MEMORY).read_text()
        for step in range(40):
            assert firmware.step(standing(step), AT_REST).tolist() == [0.0] * 4
        armed = RcSticks(armed=True, throttle=0.5)
        for step in range(40, 80):
            rotors = firmware.step(standing(step), armed)
        assert rotors == pytest.approx([0.5] * 4)
        assert firmware.missed == 0
    (tmp_path / "new" / MEMORY).write_text("kept")
    with Betaflight(stub(), tmp_path / "new") as firmware:
        firmware.step(standing(0), AT_REST)
    assert (tmp_path / "new" / MEMORY).read_text() == "kept"
    assert firmware.log.read_text().startswith("stub")


def test_it_can_be_started_again(stub, tmp_path):
    """The time begins again at 0, and so do the packets of sticks."""
    firmware, armed = Betaflight(stub(), tmp_path), RcSticks(armed=True, throttle=0.5)
    for first in (100, 0):
        with firmware:
            for step in range(first, first + 40):
                rotors = firmware.step(standing(step), armed)
        assert rotors == pytest.approx([0.5] * 4)


def test_sides_are_not_swapped(stub, tmp_path):
    with Betaflight(stub(), tmp_path) as firmware:
        told = RcSticks(armed=True, throttle=0.5, roll=0.1)
        for step in range(40):
            right_down = firmware.step(standing(step), told)
        turned = RcSticks(armed=True, throttle=0.5, yaw=0.1)
        for step in range(40, 80):
            to_left = firmware.step(standing(step), turned)
    assert right_down[1] == right_down[2] > right_down[0] == right_down[3]
    assert to_left[2] == to_left[3] > to_left[0] == to_left[1]


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("dies", "ended with status 3"),
        ("mute", "silent for 0.2 s"),
        ("babbles", "sent an invalid packet .*not finite"),
    ],
)
def test_a_firmware_that_is_lost(stub, tmp_path, how, words):
    with Betaflight(stub(), tmp_path):
        pass  # set up by a sound one
    firmware = Betaflight(stub(how), tmp_path, patience=10.0)
    with firmware, pytest.raises(FlightControllerError, match=f"{words}.*firmware.log"):
        firmware.patience = 0.2
        for step in range(2000):
            firmware.step(standing(step), AT_REST)


def test_one_that_does_not_understand_leaves_no_memory(stub, tmp_path):
    with pytest.raises(FlightControllerError, match=r"can't be set up.*refuses 'set p_yaw = 250'"):
        Betaflight(stub("refuses"), tmp_path).__enter__()
    assert not (tmp_path / MEMORY).exists()


def test_one_that_never_steps_is_started_again_and_given_up(own_network, tmp_path):
    (tmp_path / MEMORY).write_text("")
    program = ["/bin/sh", "-c", "echo begun; sleep 60"]
    with pytest.raises(FlightControllerError, match="did not answer in"):
        Betaflight(program, tmp_path, patience=0.5).__enter__()
    assert (tmp_path / "firmware.log").read_text().count("begun") == STARTS


def test_an_exception_in_flight_ends_it(stub, tmp_path):
    firmware = Betaflight(stub(), tmp_path)
    with pytest.raises(KeyError), firmware:
        raise KeyError("a pilot's mistake")
    assert firmware._process.status() is not None
