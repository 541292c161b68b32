"""Packets and settings of Betaflight's SITL target.

Packets are little-endian, without padding, over UDP. Each field has its own frame.
"""

import struct
from collections.abc import Sequence

import numpy as np

from drone_rl.flight.in_the_loop.control import HIGHEST, LOWEST
from drone_rl.flight.in_the_loop.instruments import Readings, Vector
from drone_rl.sim.coordinates import enu_from_world, frd_from_body, ned_attitude_from_world

STATE_PORT, RC_PORT, ROTOR_PORT, CLI_PORT = 9003, 9004, 9002, 5761
"""UDP into the firmware: state, RC channels; UDP out of it: rotors; TCP: its command line."""
CHANNELS = 16
_STATE = struct.Struct("<d3d3d4d3d3dd")
_RC = struct.Struct(f"<d{CHANNELS}H")
_ROTORS = struct.Struct("<4f")
STATE_BYTES, RC_BYTES, ROTOR_BYTES = _STATE.size, _RC.size, _ROTORS.size


def pack_state(readings: Readings, time: float) -> bytes:
    """Pack `fdm_packet`: time, gyroscope, accelerometer, attitude, velocity, place, pressure.

    The gyroscope is in forward-right-down, the attitude relates that frame to north-east-down, the
    accelerometer is our body frame with all signs inverted, the velocity is east-north-up, and the
    place is longitude, latitude, altitude, as the firmware's virtual GPS expects.

    Args:
        readings: Measurements.
        time: Seconds. The firmware scales its clock by the progress of these; if they are constant,
            its clock is the wall clock.
    """
    latitude, longitude, altitude = readings.place
    return _STATE.pack(
        time,
        *frd_from_body(readings.rates),
        *-readings.force,
        *ned_attitude_from_world(readings.attitude),
        *enu_from_world(readings.velocity),
        *(longitude, latitude, altitude),
        readings.pressure,
    )


def pack_sticks(time: float, channels: Sequence[int]) -> bytes:
    """Pack `rc_packet`.

    Args:
        time: Seconds.
        channels: Microseconds: roll, pitch, throttle, yaw, then switches; missing ones are low.

    Raises:
        ValueError: There are too many, or one is out of 1000 to 2000.
    """
    if len(channels) > CHANNELS or any(not LOWEST <= c <= HIGHEST for c in channels):
        raise ValueError(f"channels={list(channels)}: give at most 16 from 1000 to 2000")
    return _RC.pack(time, *channels, *[LOWEST] * (CHANNELS - len(channels)))


def unpack_rotors(packet: bytes) -> Vector:
    """Unpack `servo_packet`: the rotor commands.

    Returns:
        Front right, rear left, front left, rear right, 0 to 1. Shape: (4,).

    Raises:
        ValueError: The packet is invalid.
    """
    if len(packet) != ROTOR_BYTES:
        raise ValueError(f"a rotor packet must have {ROTOR_BYTES} bytes, got {len(packet)}")
    rotors = np.array(_ROTORS.unpack(packet), dtype=np.float64)
    if not np.isfinite(rotors).all():
        raise ValueError(f"rotors={rotors.tolist()} are not finite")
    return rotors.clip(0.0, 1.0)


SETUP = (
    "aux 0 0 0 1700 2100 0 0",  # fifth channel: armed
    "aux 1 1 1 1700 2100 0 0",  # sixth channel: ANGLE
    "set pid_process_denom = 8",  # of 8 kHz: its controllers assume a step of 1 ms
    "set small_angle = 180",
    "set angle_limit = {angle}",
    *(f"set {axis}_expo = 0" for axis in ("roll", "pitch", "yaw")),
    # Equal values make an axis linear; ANGLE mode uses the same curve.
    *(f"set {axis}_{rate} = 60" for axis in ("roll", "pitch") for rate in ("rc_rate", "srate")),
    *(f"set yaw_{rate} = {{yaw}}" for rate in ("rc_rate", "srate")),
    # Gains for a large frame; the defaults suit small ones, which turn ten times as readily.
    "set p_yaw = 250",
    "set i_yaw = 20",
    # The firmware measures stick speeds by the wall clock, which simulation does not follow: with
    # feedforward the same sticks tilt the drone by 30 degrees in one flight and by 80 in another.
    "set angle_feedforward = 0",
    "set f_yaw = 0",
)
"""Command lines that set up a new firmware, without `save`."""


def setup_lines(angle: int, yaw: int) -> list[str]:
    """Return the command lines that set up a new firmware.

    Args:
        angle: Roll or pitch at full stick, degrees, 10 to 80.
        yaw: Yaw rate at full stick, tens of degrees per second.
    """
    return [line.format(angle=angle, yaw=yaw) for line in SETUP]
