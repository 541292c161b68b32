"""An autopilot of a thread: it speaks MAVLink and holds a height by a few gains."""

import math
import socket
import threading

from pymavlink.dialects.v20 import common

HOVER = 9.81 / (4 * 4.179446268)


class StubAutopilot(threading.Thread):
    """Answers each HIL_SENSOR with HIL_ACTUATOR_CONTROLS of its time.

    Args:
        read: Gives bytes, none at the end.
        write: Takes bytes.
        height: Metres above where it first was, to hold.
        mute_after: How many sensors it answers.
        beats: Whether it sends heartbeats.
    """

    def __init__(self, read, write, height=2.0, mute_after=math.inf, beats=True):
        super().__init__(daemon=True)
        self.read, self.write, self.height = read, write, height
        self.mute_after, self.beats = mute_after, beats
        self.codec = common.MAVLink(None, srcSystem=1, srcComponent=1)
        self.codec.robust_parsing = True
        self.heard, self.sequence = {}, []
        self.last_gps = None
        self.first = self.altitude = None
        self.climb, self.answered = 0.0, 0

    def run(self):
        try:
            while data := self.read():
                for message in self.codec.parse_buffer(data) or ():
                    self.take(message)
        except OSError:
            return

    def take(self, message):
        kind = message.get_type()
        self.heard[kind] = self.heard.get(kind, 0) + 1
        self.sequence.append(message.get_seq())
        if kind == "HEARTBEAT" and self.beats:
            beat = self.codec.heartbeat_encode(
                common.MAV_TYPE_QUADROTOR, common.MAV_AUTOPILOT_PX4, 0, 0, common.MAV_STATE_ACTIVE
            )
            self.write(b"noise" + beat.pack(self.codec))
        if kind == "HIL_GPS":
            self.last_gps = message
        if kind == "HIL_SENSOR" and self.answered < self.mute_after:
            self.answered += 1
            rotors = self.control(message)
            controls = [*rotors, *[0.0] * 12]
            reply = self.codec.hil_actuator_controls_encode(message.time_usec, controls, 128, 1)
            self.write(reply.pack(self.codec))

    def control(self, sensor):
        """Proportional in height and climb, and against turning."""
        if self.first is None:
            self.first = self.altitude = sensor.pressure_alt
        self.climb, self.altitude = (
            (sensor.pressure_alt - self.altitude) / 0.004,
            sensor.pressure_alt,
        )
        missing = self.first + self.height - self.altitude
        throttle = HOVER + 0.1 * missing - 0.1 * self.climb
        p, q, r = 0.05 * sensor.xgyro, -0.05 * sensor.ygyro, -0.05 * sensor.zgyro
        signs = ((1, 1, 1), (-1, -1, 1), (-1, 1, -1), (1, -1, -1))
        mixed = (throttle + a * p + b * q + c * r for a, b, c in signs)
        return [min(1.0, max(0.0, m)) for m in mixed]


def on_tcp(port, **kwargs):
    """A stub that connects to a port."""
    link = socket.create_connection(("127.0.0.1", port), 10.0)
    link.settimeout(None)
    stub = StubAutopilot(lambda: link.recv(65536), link.sendall, **kwargs)
    stub.link = link
    stub.start()
    return stub
