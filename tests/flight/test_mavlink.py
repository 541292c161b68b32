"""The bridge against an autopilot of a thread, over a pseudo-terminal and over TCP."""

import math
import os
import pty
import socket
import time

import numpy as np
import pytest

from drone_rl.config import DynamicsSettings
from drone_rl.flight.in_the_loop.control import AT_REST
from drone_rl.flight.in_the_loop.drone import DroneInTheLoop, FlightControllerError
from drone_rl.flight.in_the_loop.instruments import Readings
from drone_rl.flight.mavlink import (
    FIELD,
    Link,
    MavlinkBridge,
    SerialLink,
    TcpLink,
    gps_fields,
    rotor_outputs,
    sensor_fields,
)
from drone_rl.sim.coordinates import GeoPoint
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


@pytest.fixture
def terminal():
    far, near = pty.openpty()
    yield far, os.ttyname(near)
    for number in (far, near):
        try:
            os.close(number)
        except OSError:
            continue


def test_serial_links_change_no_byte(terminal):
    far, name = terminal
    link = SerialLink(name)
    assert link.patience == 1.0
    every = bytes(range(256))
    link.write(every)
    assert os.read(far, 1024) == every
    os.write(far, every)
    assert link.read(5.0) == every
    assert link.read(0.0) == b""
    link.close()


def test_a_serial_link_that_is_full(terminal):
    far, name = terminal
    link = SerialLink(name, patience=0.1)
    with pytest.raises(FlightControllerError, match="accepts no more bytes"):
        link.write(b"x" * 1_000_000)
    link.close()
    assert os.read(far, 1)


def test_serial_ports_that_are_none(tmp_path, terminal):
    (tmp_path / "file").write_text("")
    for device in (tmp_path / "none", tmp_path / "file", tmp_path):
        with pytest.raises(InputError, match=f"device={device} with baud=921600 can't be used"):
            SerialLink(str(device))
    for baud in (12345, 0):
        with pytest.raises(InputError, match=f"with baud={baud} can't be used"):
            SerialLink(terminal[1], baud=baud)


def test_tcp_links():
    link = TcpLink(0)
    with pytest.raises(FlightControllerError, match="call accept first"):
        link.read(0.0)
    with pytest.raises(
        FlightControllerError, match=r"no autopilot connected to port \d+ in 0.01 s"
    ):
        link.accept(0.01)
    with pytest.raises(FlightControllerError, match="no autopilot connected"):
        link.accept(0.0)
    with socket.create_connection(("127.0.0.1", link.port)) as far:
        link.accept(5.0)
        link.write(b"abc")
        assert far.recv(16) == b"abc"
        assert link.read(0.0) == b""
        far.sendall(b"def")
        assert link.read(5.0) == b"def"
    with pytest.raises(FlightControllerError, match="the autopilot is gone"):
        link.read(5.0)
    link.close()


HALF = math.sqrt(0.5)
READINGS = Readings(
    time=1.25,
    position=np.array([0.0, 0.0, 2.5]),
    velocity=np.array([3.0, -4.0, 0.5]),  # 3 m/s north, 4 east, half up
    attitude=np.array([1.0, 0.0, 0.0, 0.0]),
    rates=np.array([0.1, 0.2, 0.3]),
    force=np.array([1.0, 2.0, 9.0]),
    home=GeoPoint(48.0, 11.0, 100.0),
)


def test_what_is_sensed_is_forward_right_down():
    fields = sensor_fields(READINGS)
    assert [fields[f"{a}acc"] for a in "xyz"] == [1.0, -2.0, -9.0]
    assert [fields[f"{a}gyro"] for a in "xyz"] == [0.1, -0.2, -0.3]
    assert fields["time_usec"] == 1_250_000
    assert fields["pressure_alt"] == 102.5
    assert fields["abs_pressure"] == pytest.approx(1000.99, abs=0.05)


def test_the_field_turns_against_the_drone():
    assert [sensor_fields(READINGS)[f"{a}mag"] for a in "xyz"] == pytest.approx(FIELD)
    west = Readings(**{**vars(READINGS), "attitude": np.array([HALF, 0.0, 0.0, HALF])})
    fields = sensor_fields(west)  # north is on its right, and what was east is behind it
    assert [fields[f"{a}mag"] for a in "xyz"] == pytest.approx([-FIELD[1], FIELD[0], FIELD[2]])


def test_gps():
    fields = gps_fields(READINGS)
    assert (fields["lat"], fields["lon"], fields["alt"]) == (480_000_000, 110_000_000, 102_500)
    assert (fields["vn"], fields["ve"], fields["vd"]) == (300, 400, -50)
    assert fields["vel"] == 500
    assert fields["cog"] == 5313  # atan2(4, 3)


def test_rotors():
    controls = [0.1, 2.0, -1.0, math.nan, *[0.5] * 12]
    assert rotor_outputs(controls, 128).tolist() == [0.1, 1.0, 0.0, 0.0]
    assert rotor_outputs(controls, 0).tolist() == [0.0] * 4
