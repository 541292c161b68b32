"""The real protocol against a stub of the firmware, in a network of its own."""

import numpy as np
import pytest

from drone_rl.flight.betaflight.sitl import MEMORY, STARTS, Betaflight
from drone_rl.flight.in_the_loop.control import AT_REST, RcSticks
from drone_rl.flight.in_the_loop.drone import FlightControllerError
from drone_rl.flight.in_the_loop.instruments import Readings
from drone_rl.utils.errors import InputError

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


def test_a_folder_that_is_a_file(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"folder=.*file can't be made \(File exists"):
        Betaflight(["sh"], tmp_path / "file").__enter__()


def test_programs_that_are_none(own_network, tmp_path):
    with pytest.raises(FlightControllerError, match="can't start"):
        Betaflight(["/nowhere/firmware"], tmp_path).__enter__()


def test_one_that_never_steps_is_started_again_and_given_up(own_network, tmp_path):
    (tmp_path / MEMORY).write_text("")
    program = ["/bin/sh", "-c", "echo begun; sleep 60"]
    with pytest.raises(FlightControllerError, match="did not answer in"):
        Betaflight(program, tmp_path, patience=0.5).__enter__()
    assert (tmp_path / "firmware.log").read_text().count("begun") == STARTS


def test_an_exception_in_flight_ends_it(stub, tmp_path):
    firmware = Betaflight(stub(), tmp_path)
    with pytest.raises(KeyError), firmware:
        supervisor = firmware._process._process
        raise KeyError("a pilot's mistake")
    assert supervisor.returncode == 0
