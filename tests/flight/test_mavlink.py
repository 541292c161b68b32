"""The bridge against an autopilot of a thread, over a pseudo-terminal and over TCP."""

import os
import pty
import sys
import time

import numpy as np
import pytest

from drone_rl.config import DynamicsSettings
from drone_rl.flight.in_the_loop.control import AT_REST
from drone_rl.flight.in_the_loop.drone import DroneInTheLoop, FlightControllerError
from drone_rl.flight.in_the_loop.instruments import Readings
from drone_rl.flight.mavlink import Link, MavlinkBridge, SerialLink, TcpLink
from drone_rl.utils.errors import InputError
from tests.flight.simple_body import SimpleBody

SETTINGS = DynamicsSettings(tick=0.004)
ZEROS = np.zeros(3)


@pytest.fixture
def stubs():
    """How to make stub autopilots; pymavlink is needed."""
    pytest.importorskip("pymavlink", reason="pymavlink isn't installed: extra [hil]")
    from tests.flight import stub_autopilot

    return stub_autopilot


def readings(seconds):
    level, force = np.array([1.0, 0.0, 0.0, 0.0]), np.array([0.0, 0.0, 9.81])
    return Readings(seconds, ZEROS, ZEROS, level, ZEROS, force)


def climb(bridge, seconds):
    body = SimpleBody(SETTINGS.tick)
    drone = DroneInTheLoop(body, body.start(), bridge, SETTINGS)
    drone.hold(AT_REST, seconds)
    return drone


def test_it_hovers_over_tcp(stubs):
    link = TcpLink(0)
    stub = stubs.on_tcp(link.port, height=2.0)
    with MavlinkBridge(link) as bridge:
        drone = climb(bridge, 8.0)
    assert drone.readings.position == pytest.approx([0.0, 0.0, 2.0], abs=0.05)
    assert (bridge.missed, bridge.is_armed) == (0, True)
    assert (bridge.patience, bridge.answer_within, bridge.connect_within) == (5.0, 1.0, 30.0)
    stub.link.close()
    assert stub.heard["HIL_SENSOR"] == 2000
    assert stub.sequence == [k % 256 for k in range(len(stub.sequence))]
    assert stub.heard["HIL_GPS"] == 80
    assert stub.last_gps.alt == pytest.approx(124_000, abs=50)
    assert stub.heard["HEARTBEAT"] >= 1


def test_it_hovers_over_a_serial_port(stubs):
    far, near = pty.openpty()
    stub = stubs.on_file(far, height=1.0)
    with MavlinkBridge(SerialLink(os.ttyname(near))) as bridge:
        drone = climb(bridge, 2.0)
    assert 0.5 < drone.readings.position[2] < 1.3  # with an overshoot of 7% at most
    assert bridge.missed == 0
    os.close(near)
    assert stub.heard["HIL_SENSOR"] == 500


def test_without_lockstep_no_step_waits(stubs):
    link = TcpLink(0)
    stubs.on_tcp(link.port, mute_after=1)
    with MavlinkBridge(link, lockstep=False) as bridge:
        end = time.monotonic() + 5.0
        while not bridge.is_armed and time.monotonic() < end:
            bridge.step(readings(0.0))
        rotors = [bridge.step(readings(k / 1000)).copy() for k in range(20)]
    assert (rotors[0] == rotors[-1]).all()
    assert rotors[0][0] > 0.5
    assert bridge.missed == 0


def test_controls_after_a_reboot_are_the_newest(stubs):
    """Its clock starts again at 0."""
    codec, sent = stubs.common.MAVLink(None, srcSystem=1), []

    class Line(Link):
        def read(self, within):
            return sent.pop(0) if sent else b""

        def write(self, data):
            pass

    bridge = MavlinkBridge(Line("the autopilot", 1.0), lockstep=False)
    for time_usec, thrust in ((9_000_000, 0.75), (1_000, 0.25)):
        controls = codec.hil_actuator_controls_encode(time_usec, [thrust] * 16, 128, 1)
        sent.append(controls.pack(codec))
        assert bridge.step(readings(0.0)).tolist() == [thrust] * 4


def test_an_autopilot_that_falls_silent(stubs):
    link = TcpLink(0)
    stub = stubs.on_tcp(link.port, mute_after=5)
    with MavlinkBridge(link, patience=0.2, answer_within=0.05) as bridge:
        stub.beats = False
        with pytest.raises(FlightControllerError, match=r"silent for 0\.2 s"):
            for k in range(1000):
                bridge.step(readings(k / 1000))
    assert bridge.missed >= 3


def test_an_autopilot_that_hangs_up(stubs):
    link = TcpLink(0)
    stub = stubs.on_tcp(link.port)
    with MavlinkBridge(link) as bridge:
        bridge.step(readings(0.0))
        stub.link.shutdown(2)
        with pytest.raises(FlightControllerError, match="autopilot"):
            for k in range(1, 1000):
                bridge.step(readings(k / 1000))


def test_nobody_there(stubs):
    link = TcpLink(0)
    with pytest.raises(FlightControllerError, match="no autopilot connected"):
        MavlinkBridge(link, connect_within=0.05).__enter__()
    far, near = pty.openpty()
    with pytest.raises(FlightControllerError, match=r"no message in 0\.2 seconds"):
        MavlinkBridge(SerialLink(os.ttyname(near)), connect_within=0.2).__enter__()
    os.close(near)
    os.close(far)


def test_noise_is_no_message(stubs):
    """A message of an unknown kind, whose check sum can't be computed, may be noise."""
    far, near = pty.openpty()
    link = SerialLink(os.ttyname(near))
    os.write(far, bytes.fromhex("fd 01 00 00 05 01 01 60ea00 07 0000"))
    with pytest.raises(FlightControllerError, match=r"no message in 0\.2 seconds"):
        MavlinkBridge(link, connect_within=0.2).__enter__()
    os.close(near)
    os.close(far)


def test_without_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymavlink.dialects.v20.common", None)
    link = TcpLink(0)
    with pytest.raises(InputError, match=r"pip install -e '\.\[hil\]'"):
        MavlinkBridge(link)
    link.close()
