"""A drone of a few lines for tests of loops: a rigid body over a floor, without air."""

import dataclasses

import numpy as np
import torch

from drone_rl.config import DynamicsSettings
from drone_rl.flight.in_the_loop.instruments import rotation
from drone_rl.sim.dynamics import BodyState

SETTINGS = DynamicsSettings(tick=0.001)
ARM = SETTINGS.arm_length / np.sqrt(2.0)


class SimpleBody:
    """Answers `fly` and `push` as a quadrotor does."""

    def __init__(self, tick=SETTINGS.tick):
        self.tick = tick
        self.rates = np.zeros(3)

    def start(self):
        return BodyState.at_rest(torch.zeros(1, 3, dtype=torch.float64))

    def fly(self, body, goals, ticks, obstacles=None):
        return self.push(body, goals.values, ticks)

    def push(self, body, rotors, ticks=1):
        for _ in range(ticks):
            body = self._pushed(body, rotors[0].numpy())
        return body

    def _pushed(self, body, r):
        given = (body.position, body.velocity, body.attitude)
        place, velocity, q = (v[0].numpy().copy() for v in given)
        lever = ARM * SETTINGS.rotor_thrust
        torque = np.array(
            [
                lever * (r[1] + r[2] - r[0] - r[3]),
                lever * (r[1] + r[3] - r[0] - r[2]),
                SETTINGS.rotor_torque * (r[2] + r[3] - r[0] - r[1]),
            ]
        )
        self.rates += self.tick * torque / np.array(SETTINGS.inertia)
        half = self.rates * self.tick / 2.0
        w, v = q[0], q[1:]
        q = np.array([w - v @ half, *(v + w * half + np.cross(v, half))])
        q /= np.linalg.norm(q)
        up = rotation(q).apply([0.0, 0.0, 1.0])
        thrust = SETTINGS.rotor_thrust * float(r.sum()) / SETTINGS.mass
        velocity += self.tick * (thrust * up - np.array([0.0, 0.0, 9.81]))
        place += self.tick * velocity
        if place[2] <= 0.0:
            place[2], velocity[:], self.rates[:] = 0.0, 0.0, 0.0
            q = np.array([1.0, 0.0, 0.0, 0.0])
        new = (torch.from_numpy(x)[None] for x in (place, q, velocity, self.rates.copy()))
        return dataclasses.replace(body, **dict(zip(vars(body), new, strict=True)))
