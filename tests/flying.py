"""Drones in flight for tests, and a slow one in double precision to measure them by."""

import math

import numpy as np
import torch
import warp as wp

from drone_rl.config import DynamicsSettings
from drone_rl.sim.dynamics import FlightState, Goals, Mode, Quadrotor
from drone_rl.sim.dynamics.rigid_body_kernel import make_airframe

PLACES = (Mode.POSITION, Mode.POSITION, Mode.ANGLE, Mode.POSITION)
SPEEDS = (Mode.VELOCITY, Mode.VELOCITY, Mode.RATE, Mode.VELOCITY)
ANGLES = (Mode.ANGLE, Mode.ANGLE, Mode.ANGLE, Mode.POSITION)
GRAVITY = 9.81


def settings(**changes):
    """SimpleFlight's own drone."""
    return DynamicsSettings(mode="simple_flight", **changes)


def quadrotor(**changes):
    return Quadrotor(settings(**changes))


def frame(**changes):
    wp.config.log_level = wp.LOG_ERROR
    return make_airframe(settings(**changes))


def numbers(*rows):
    return torch.tensor(rows, dtype=torch.float64)


def still(drone, *, height=100.0, count=1, seeds=None):
    """Drones that hover side by side, far from each other and from the ground."""
    places = torch.zeros(count, 3, dtype=torch.float64)
    places[:, 2] = height
    return drone.start(places, seeds)


def told(modes, *values, count=1, drift=None):
    goals = numbers(values).repeat(count, 1)
    return Goals(modes, goals, None if drift is None else numbers(drift).repeat(count, 1))


def falling(height=100.0, velocity=(0.0, 0.0, 0.0), rates=(0.0, 0.0, 0.0)):
    """One drone whose rotors stand still."""
    state = FlightState.at_rest(numbers((0.0, 0.0, height)))
    state.velocity[:], state.angular_velocity[:] = numbers(velocity), numbers(rates)
    return state


def history(drone, state, goals, ticks, every=1):
    """All states, one after every so many ticks."""
    states = [state]
    for _ in range(ticks // every):
        states.append(drone.fly(states[-1], goals, every))
    return states


def angles(state):
    """Roll, pitch and heading, radians. Shape: (num_worlds, 3)."""
    w, x, y, z = state.attitude.unbind(-1)
    roll = torch.atan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
    pitch = torch.asin((2 * (w * y - x * z)).clamp(-1, 1))
    return torch.stack([roll, pitch, state.heading], -1)


class Answer:
    """How something went from 0 to what was wanted, tick by tick."""

    def __init__(self, values, wanted, tick=0.003):
        self.share, self.tick = np.asarray(values) / wanted, tick

    @property
    def rise(self):
        """Seconds until 0.9 of it."""
        return int(np.argmax(self.share >= 0.9)) * self.tick

    @property
    def overshoot(self):
        """Share beyond it."""
        return float(self.share.max()) - 1.0

    def settled(self, within):
        """Seconds after which it stays so near."""
        away = np.flatnonzero(np.abs(self.share - 1.0) > within)
        return (int(away[-1]) + 1) * self.tick if len(away) else 0.0


def limit(value, most=1.0):
    return max(-most, min(most, value))


def turned(angle):
    return angle - 2 * math.pi * round(angle / (2 * math.pi))


class Slow:
    """One drone in NumPy and double precision, written down from the formulas anew.

    Rotation matrices and Rodrigues' formula instead of quaternions; gusts are left out.
    """

    def __init__(self, what, place, heading=0.0):
        self.s = what
        c, s = math.cos(heading), math.sin(heading)
        self.place, self.velocity, self.rates = np.array(place, float), np.zeros(3), np.zeros(3)
        self.turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
        self.rotors = np.full(4, what.hover_throttle)
        self.climb = 2 * what.hover_throttle - 1
        side = what.arm_length / math.sqrt(2)
        at = np.array([[side, -side], [-side, side], [side, side], [-side, -side]])
        spins = np.array([-1.0, -1.0, 1.0, 1.0])
        push, twist = what.rotor_thrust, what.rotor_torque
        self.to_torque = np.stack([at[:, 1] * push, -at[:, 0] * push, spins * twist])
        self.mixer = np.stack([np.sign(at[:, 1]), -np.sign(at[:, 0]), spins], -1)

    def wanted(self, modes, goal, drift, seconds):
        """Rotors that the cascade asks for."""
        s, r = self.s, self.turn
        heading = math.atan2(r[1, 0], r[0, 0])
        c, si = math.cos(heading), math.sin(heading)
        if modes[0] == Mode.ANGLE:
            roll, pitch = goal[0], goal[1]
        else:
            speed = list(goal[:2])
            for i in range(2):
                if modes[0] == Mode.POSITION:
                    away = goal[i] + drift[i] * seconds - self.place[i]
                    back = s.velocity_limit * limit(s.position_gain * away)
                    speed[i] = limit(drift[i] + back, s.velocity_limit)
            x, y = speed[0] - self.velocity[0], speed[1] - self.velocity[1]
            if modes[0] == Mode.HEADING_VELOCITY:
                x = c * speed[0] - si * speed[1] - self.velocity[0]
                y = si * speed[0] + c * speed[1] - self.velocity[1]
            pitch = s.angle_limit * limit(s.velocity_gain * (c * x + si * y))
            roll = -s.angle_limit * limit(s.velocity_gain * (c * y - si * x))
        now = (math.atan2(r[2, 1], r[2, 2]), math.asin(-r[2, 0]))
        rates = [0.0, 0.0, goal[2]]
        for i, (want, have) in enumerate(zip((roll, pitch), now, strict=True)):
            rates[i] = s.rate_limit[i] * limit(s.angle_gain[i] * turned(want - have))
        if modes[2] == Mode.ANGLE:
            away = turned(goal[2] + drift[2] * seconds - heading)
            rates[2] = s.rate_limit[2] * limit(s.angle_gain[2] * away) + drift[2]
        rates[2] = limit(rates[2], s.rate_limit[2])
        climb = goal[3]
        if modes[3] == Mode.POSITION:
            away = goal[3] + drift[3] * seconds - self.place[2]
            climb = drift[3] + s.climb_limit * limit(s.position_gain * away)
            climb = limit(climb, s.climb_limit)
        miss = climb - self.velocity[2]
        throttle = 0.5 + 0.5 * limit(s.climb_gain * miss + self.climb)
        self.climb = limit(self.climb + s.climb_integral * miss * s.tick)
        return self.mixed(throttle, np.clip(s.rate_gain * (rates - self.rates), -1, 1))

    def mixed(self, throttle, control):
        out = throttle + self.mixer @ control
        out += max(0.0, -out.min())
        return out / max(1.0, out.max())

    def fly(self, modes, goal, ticks, drift=(0, 0, 0, 0)):
        s, dt = self.s, self.s.tick
        inertia, area = np.array(s.inertia), np.array(s.drag_area)
        pace = 1 - math.exp(-dt / s.rotor_time_constant) if s.rotor_time_constant else 1.0
        for tick in range(ticks):
            asked = self.wanted(modes, goal, drift, tick * dt)
            self.rotors = self.rotors + pace * (asked - self.rotors)
            air = self.turn.T @ (self.velocity - s.wind)
            force = -s.air_density * area * np.abs(air) * air
            force[2] += s.rotor_thrust * self.rotors.sum()
            torque = self.to_torque @ self.rotors
            gained = (torque - np.cross(self.rates, inertia * self.rates)) / inertia
            self.velocity = self.velocity + dt * (self.turn @ force / s.mass - [0, 0, GRAVITY])
            self.rates = self.rates + dt * gained
            self.place = self.place + dt * self.velocity
            self.turn = self.turn @ rotation(dt * self.rates)
        return self


def rotation(angle):
    """Rodrigues' formula. Shape: (3, 3)."""
    x, y, z = angle
    size = math.sqrt(x * x + y * y + z * z)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    if size < 1e-12:
        return np.eye(3) + cross
    return (
        np.eye(3) + math.sin(size) / size * cross + (1 - math.cos(size)) / size**2 * (cross @ cross)
    )


def matrix(attitude):
    """Of one quaternion. Shape: (3, 3)."""
    w, x, y, z = (float(v) for v in attitude)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def degrees_between(one, other):
    """Of the turn from one rotation matrix to another."""
    difference = one.T @ other
    sine = np.array([difference[2, 1] - difference[1, 2], difference[0, 2] - difference[2, 0],
                     difference[1, 0] - difference[0, 1]])  # fmt: skip
    return math.degrees(math.atan2(np.linalg.norm(sine), np.trace(difference) - 1.0))
