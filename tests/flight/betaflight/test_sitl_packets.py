import struct

import numpy as np
import pytest

from drone_rl.flight.betaflight.sitl import SETUP, pack_state, pack_sticks, unpack_rotors
from drone_rl.flight.in_the_loop.instruments import Readings
from drone_rl.sim.coordinates import GeoPoint

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


def test_what_a_new_firmware_is_told():
    lines = [line.format(angle=60, yaw=20) for line in SETUP]
    assert lines[:2] == ["aux 0 0 0 1700 2100 0 0", "aux 1 1 1 1700 2100 0 0"]
    assert {"set angle_limit = 60", "set yaw_srate = 20", "set yaw_rc_rate = 20"} <= {*lines}
    assert not any("{" in line for line in lines)
