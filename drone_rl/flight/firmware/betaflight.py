"""Betaflight's packets for simulators: what its SITL target reads and writes, byte for byte.

All are little-endian, without padding, over UDP. Each part has a frame of its own.
"""

import struct
from collections.abc import Sequence

import numpy as np

from drone_rl.flight.firmware.senses import Senses, Vector
from drone_rl.sim.coordinates import enu_from_world, frd_from_body, ned_attitude_from_world

STATE_PORT, RC_PORT, ROTOR_PORT, CLI_PORT = 9003, 9004, 9002, 5761
"""UDP into the firmware: the drone's state; UDP into it: sticks; UDP out of it: rotors; TCP: its
command line on the first serial port."""
CHANNELS = 16
LOWEST, MIDDLE, HIGHEST = 1000, 1500, 2000
"""Of a channel, microseconds."""
_STATE = struct.Struct("<d3d3d4d3d3dd")
_RC = struct.Struct(f"<d{CHANNELS}H")
_ROTORS = struct.Struct("<4f")
STATE_BYTES, RC_BYTES, ROTOR_BYTES = _STATE.size, _RC.size, _ROTORS.size


def pack_state(senses: Senses, time: float) -> bytes:
    """The packet `fdm_packet`: time, gyroscope, accelerometer, attitude, velocity, place, pressure.

    The gyroscope's axes are forward, right, down, and so are the attitude's, against north, east,
    down; the accelerometer's are ours with all signs turned; the velocity is east, north, up; the
    place is longitude, latitude, altitude, as the firmware's virtual GPS wants it.

    Args:
        senses: Of the drone.
        time: Seconds. The firmware's own clock goes as many times as fast as the clock on the wall
            as these do; where they stand still, it goes as fast as that.
    """
    latitude, longitude, altitude = senses.place
    return _STATE.pack(
        time,
        *frd_from_body(senses.rates),
        *-senses.force,
        *ned_attitude_from_world(senses.attitude),
        *enu_from_world(senses.velocity),
        *(longitude, latitude, altitude),
        senses.pressure,
    )


def pack_sticks(time: float, channels: Sequence[int]) -> bytes:
    """The packet `rc_packet`.

    Args:
        time: Seconds.
        channels: Microseconds: roll, pitch, throttle, yaw, then switches; those not given are low.

    Raises:
        ValueError: There are too many, or one is out of 1000 to 2000.
    """
    if len(channels) > CHANNELS or any(not LOWEST <= c <= HIGHEST for c in channels):
        raise ValueError(f"channels={list(channels)}: give at most 16 from 1000 to 2000")
    return _RC.pack(time, *channels, *[LOWEST] * (CHANNELS - len(channels)))


def unpack_rotors(packet: bytes) -> Vector:
    """The packet `servo_packet`: what each rotor must do, 0 to 1.

    Args:
        packet: From the firmware.

    Returns:
        Front right, rear left, front left, rear right. Shape: (4,).

    Raises:
        ValueError: It is no such packet.
    """
    if len(packet) != ROTOR_BYTES:
        raise ValueError(f"a packet of {len(packet)} bytes is none of rotors; those have 16")
    rotors = np.array(_ROTORS.unpack(packet), dtype=np.float64)
    if not np.isfinite(rotors).all():
        raise ValueError(f"rotors={rotors.tolist()} are no numbers")
    return rotors.clip(0.0, 1.0)


SETUP = (
    "aux 0 0 0 1700 2100 0 0",  # fifth channel: armed
    "aux 1 1 1 1700 2100 0 0",  # sixth channel: ANGLE
    "set pid_process_denom = 8",  # of 8 kHz: its controllers take it that a step is 1 ms
    "set small_angle = 180",
    "set angle_limit = {angle}",
    *(f"set {axis}_expo = 0" for axis in ("roll", "pitch", "yaw")),
    # Equal values make an axis linear; ANGLE takes its shape from them, too.
    *(f"set {axis}_{rate} = 60" for axis in ("roll", "pitch") for rate in ("rc_rate", "srate")),
    *(f"set yaw_{rate} = {{yaw}}" for rate in ("rc_rate", "srate")),
    # As for any large frame: its defaults are those of small ones, which turn ten times as readily.
    "set p_yaw = 250",
    "set i_yaw = 20",
    # How fast sticks move it measures by the clock on the wall, which simulation doesn't keep to:
    # fed forward, the same sticks would tilt it by 30 degrees now and by 80 then.
    "set angle_feedforward = 0",
    "set f_yaw = 0",
)
"""Lines for the command line of a firmware that was never set up, without `save`."""


def setup_lines(angle: int, yaw: int) -> list[str]:
    """What a firmware is told once.

    Args:
        angle: Degrees of roll or pitch at full stick, 10 to 80.
        yaw: Tens of degrees a second of yaw at full stick.
    """
    return [line.format(angle=angle, yaw=yaw) for line in SETUP]
