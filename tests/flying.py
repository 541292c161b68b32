"""Simulated drones for tests, and a reference implementation in double precision."""

import math

import numpy as np
import torch
import warp as wp

from drone_rl.config import DynamicsSettings
from drone_rl.sim.dynamics import FlightGoals, FlightState, Mode, Quadrotor
from drone_rl.sim.dynamics.rigid_body_kernel import make_airframe

POSITIONS = (Mode.POSITION, Mode.POSITION, Mode.ANGLE, Mode.POSITION)
VELOCITIES = (Mode.VELOCITY, Mode.VELOCITY, Mode.RATE, Mode.VELOCITY)
ANGLES = (Mode.ANGLE, Mode.ANGLE, Mode.ANGLE, Mode.POSITION)
GRAVITY = 9.81


def settings(**changes):
    """Return the settings of SimpleFlight's drone."""
    return DynamicsSettings(mode="simple_flight", **changes)


def quadrotor(**changes):
    return Quadrotor(settings(**changes))


def frame(**changes):
    wp.config.log_level = wp.LOG_ERROR
    return make_airframe(settings(**changes))


def doubles(*rows):
    return torch.tensor(rows, dtype=torch.float64)


def hovering(drone, *, height=100.0, count=1, seeds=None):
    """Return drones that hover at a height at which they touch nothing."""
    positions = torch.zeros(count, 3, dtype=torch.float64)
    positions[:, 2] = height
    return drone.start(positions, seeds)


def make_goals(modes, *values, count=1, drift=None):
    goals = doubles(values).repeat(count, 1)
    return FlightGoals(modes, goals, None if drift is None else doubles(drift).repeat(count, 1))


def falling(height=100.0, velocity=(0.0, 0.0, 0.0), rates=(0.0, 0.0, 0.0)):
    """Return the state of one drone whose rotors do not turn."""
    state = FlightState.at_rest(doubles((0.0, 0.0, height)))
    state.velocity[:], state.angular_velocity[:] = doubles(velocity), doubles(rates)
    return state


def trajectory(drone, state, goals, ticks, every=1):
    """Return the initial state and the states after every `every` ticks."""
    states = [state]
    for _ in range(ticks // every):
        states.append(drone.fly(states[-1], goals, every))
    return states


def angles(state):
    """Return roll, pitch and heading in radians. Shape: (num_envs, 3)."""
    w, x, y, z = state.attitude.unbind(-1)
    roll = torch.atan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
    pitch = torch.asin((2 * (w * y - x * z)).clamp(-1, 1))
    return torch.stack([roll, pitch, state.heading], -1)


class StepResponse:
    """The step response of a quantity from 0 to a setpoint, tick by tick."""

    def __init__(self, values, setpoint, tick=0.003):
        self.fraction, self.tick = np.asarray(values) / setpoint, tick

    @property
    def rise(self):
        """Seconds until 0.9 of the setpoint."""
        return int(np.argmax(self.fraction >= 0.9)) * self.tick

    @property
    def overshoot(self):
        """Greatest excess as a fraction of the setpoint."""
        return float(self.fraction.max()) - 1.0

    def settling_time(self, within):
        """Return the seconds after which the error stays below a fraction of the setpoint."""
        away = np.flatnonzero(np.abs(self.fraction - 1.0) > within)
        return (int(away[-1]) + 1) * self.tick if len(away) else 0.0


def limit(value, most=1.0):
    return max(-most, min(most, value))


def wrap_angle(angle):
    return angle - 2 * math.pi * round(angle / (2 * math.pi))


class ReferenceDrone:
    """An independent implementation of one drone in NumPy and double precision, without gusts.

    It uses rotation matrices and Rodrigues' formula instead of quaternions.
    """

    def __init__(self, settings, position, heading=0.0):
        self.s = settings
        c, s = math.cos(heading), math.sin(heading)
        self.position = np.array(position, float)
        self.velocity, self.rates = np.zeros(3), np.zeros(3)
        self.rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
        self.rotors = np.full(4, settings.hover_throttle)
        self.climb = 2 * settings.hover_throttle - 1
        side = settings.arm_length / math.sqrt(2)
        at = np.array([[side, -side], [-side, side], [side, side], [-side, -side]])
        spins = np.array([-1.0, -1.0, 1.0, 1.0])
        thrust, torque = settings.rotor_thrust, settings.rotor_torque
        self.to_torque = np.stack([at[:, 1] * thrust, -at[:, 0] * thrust, spins * torque])
        self.mixer = np.stack([np.sign(at[:, 1]), -np.sign(at[:, 0]), spins], -1)

    def control(self, modes, goal, drift, seconds):
        """Return the rotor setpoints of the cascaded controller."""
        s, r = self.s, self.rotation
        heading = math.atan2(r[1, 0], r[0, 0])
        c, si = math.cos(heading), math.sin(heading)
        if modes[0] == Mode.ANGLE:
            roll, pitch = goal[0], goal[1]
        else:
            speed = list(goal[:2])
            for i in range(2):
                if modes[0] == Mode.POSITION:
                    away = goal[i] + drift[i] * seconds - self.position[i]
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
        for i, (target, current) in enumerate(zip((roll, pitch), now, strict=True)):
            rates[i] = s.rate_limit[i] * limit(s.angle_gain[i] * wrap_angle(target - current))
        if modes[2] == Mode.ANGLE:
            away = wrap_angle(goal[2] + drift[2] * seconds - heading)
            rates[2] = s.rate_limit[2] * limit(s.angle_gain[2] * away) + drift[2]
        rates[2] = limit(rates[2], s.rate_limit[2])
        climb = goal[3]
        if modes[3] == Mode.POSITION:
            away = goal[3] + drift[3] * seconds - self.position[2]
            climb = drift[3] + s.climb_limit * limit(s.position_gain * away)
            climb = limit(climb, s.climb_limit)
        miss = climb - self.velocity[2]
        throttle = 0.5 + 0.5 * limit(s.climb_gain * miss + self.climb)
        self.climb = limit(self.climb + s.climb_integral * miss * s.tick)
        return self.mix(throttle, np.clip(s.rate_gain * (rates - self.rates), -1, 1))

    def mix(self, throttle, control):
        out = throttle + self.mixer @ control
        out += max(0.0, -out.min())
        return out / max(1.0, out.max())

    def fly(self, modes, goal, ticks, drift=(0, 0, 0, 0)):
        s, dt = self.s, self.s.tick
        inertia, area = np.array(s.inertia), np.array(s.drag_area)
        pace = 1 - math.exp(-dt / s.rotor_time_constant) if s.rotor_time_constant else 1.0
        for tick in range(ticks):
            setpoint = self.control(modes, goal, drift, tick * dt)
            self.rotors = self.rotors + pace * (setpoint - self.rotors)
            air = self.rotation.T @ (self.velocity - s.wind)
            force = -s.air_density * area * np.abs(air) * air
            force[2] += s.rotor_thrust * self.rotors.sum()
            torque = self.to_torque @ self.rotors
            acceleration = (torque - np.cross(self.rates, inertia * self.rates)) / inertia
            self.velocity = self.velocity + dt * (self.rotation @ force / s.mass - [0, 0, GRAVITY])
            self.rates = self.rates + dt * acceleration
            self.position = self.position + dt * self.velocity
            self.rotation = self.rotation @ rotation(dt * self.rates)
        return self


def rotation(angle):
    """Return the matrix of a rotation vector by Rodrigues' formula. Shape: (3, 3)."""
    x, y, z = angle
    size = math.sqrt(x * x + y * y + z * z)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    if size < 1e-12:
        return np.eye(3) + cross
    return (
        np.eye(3) + math.sin(size) / size * cross + (1 - math.cos(size)) / size**2 * (cross @ cross)
    )


def matrix(attitude):
    """Return the rotation matrix of one quaternion. Shape: (3, 3)."""
    w, x, y, z = (float(v) for v in attitude)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def degrees_between(one, other):
    """Return the angle in degrees between two rotation matrices."""
    difference = one.T @ other
    sine = np.array([difference[2, 1] - difference[1, 2], difference[0, 2] - difference[2, 0],
                     difference[1, 0] - difference[0, 1]])  # fmt: skip
    return math.degrees(math.atan2(np.linalg.norm(sine), np.trace(difference) - 1.0))
