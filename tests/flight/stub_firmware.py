"""A program that answers as Betaflight's SITL does: its command line, its packets, its memory.

python stub_firmware.py [HOW]: what is wrong with it, if anything: mute, never-arms, dies, refuses,
garbles.
"""

import math
import select
import socket
import struct
import sys
from pathlib import Path

HOW = sys.argv[1] if len(sys.argv) > 1 else ""
MEMORY = Path("eeprom.bin")
ANGLE, YAW = math.radians(60.0), math.radians(200.0)


def talk(link):
    """The command line; ends the program at `save`."""
    link.recv(16)
    link.sendall(b"\r\nEntering CLI Mode, type 'exit' to reboot, or 'help'\r\n\r\n# ")
    lines = []
    while True:
        text = b""
        while not text.endswith(b"\n"):
            part = link.recv(256)
            if not part:
                return
            text += part
        line = text.strip().decode()
        if line == "save":
            MEMORY.write_text("\n".join(lines))
            sys.exit(0)
        lines.append(line)
        if HOW == "refuses" and line.startswith("set p_yaw"):
            link.sendall(text + b"###ERROR IN set: INVALID NAME: p_yaw###\r\n\r\n# ")
        else:
            link.sendall(text + b"\r\n# ")


def within(value, limit):
    return max(-limit, min(limit, value))


def rotor_outputs(state, channels):
    """ANGLE mode: rates for angles, torques for rates."""
    gyro, attitude = state[1:4], state[7:11]
    w, x, y, z = attitude  # of a body whose z points down, in a world whose z does
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    nose_down = -math.asin(within(2 * (w * y - z * x), 1.0))
    stick = [(c - 1500) / 500 for c in channels[:4]]
    wanted = (5 * (ANGLE * stick[0] - roll), 5 * (ANGLE * stick[1] - nose_down), -YAW * stick[3])
    rates = (gyro[0], -gyro[1], -gyro[2])
    p, q, r = (k * (a - b) for k, a, b in zip((0.08, 0.08, 0.3), wanted, rates, strict=True))
    throttle = max((channels[2] - 1000) / 1000, 0.05)
    mixed = (throttle - p - q - r, throttle + p + q - r, throttle + p - q + r, throttle - p + q + r)
    return [max(0.0, min(1.0, m)) for m in mixed]


def main():
    sys.stdout.write(f"stub {HOW}\n")
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listener.bind(("0.0.0.0", 5761))
    listener.listen()
    states, sticks = (socket.socket(type=socket.SOCK_DGRAM) for _ in range(2))
    states.bind(("0.0.0.0", 9003))
    sticks.bind(("0.0.0.0", 9004))
    out = socket.socket(type=socket.SOCK_DGRAM)
    channels, armed, told = [1500, 1500, 1000, 1500, 1000, 1000], False, 0
    while True:
        ready, _, _ = select.select([listener, states, sticks], [], [])
        if listener in ready:
            talk(listener.accept()[0])
        if sticks in ready:
            channels = struct.unpack("<d16H", sticks.recv(256))[1:]
            armed = channels[4] > 1700 and HOW != "never-arms" and MEMORY.exists()
        if states in ready:
            state = struct.unpack("<18d", states.recv(256))
            told += 1
            if HOW == "dies" and told > 300:
                sys.exit(3)
            if HOW == "mute" and told > 300:
                continue
            rotors = rotor_outputs(state, channels) if armed else [0.0] * 4
            if HOW == "garbles" and told > 300:
                rotors[0] = math.nan
            out.sendto(struct.pack("<4f", *rotors), ("127.0.0.1", 9002))


if __name__ == "__main__":
    main()
