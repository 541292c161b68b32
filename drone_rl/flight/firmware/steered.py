"""What our own controllers would be told, as a pilot's wish for controllers that aren't ours.

Places and velocities become a velocity, as the cascade of `DynamicsSettings` does it; a heading and
a rate of turning stay what they are.
"""

import math

import torch
from torch import Tensor

from drone_rl.config import DynamicsSettings
from drone_rl.flight.firmware.senses import Senses, Vector
from drone_rl.flight.firmware.sticks import Wish, velocity_to
from drone_rl.sim.dynamics import FlightState, Goals, Mode
from drone_rl.sim.dynamics.control import HEADING, Y, Z
from drone_rl.utils.errors import InputError

_SIDEWAYS = (Mode.POSITION, Mode.VELOCITY, Mode.HEADING_VELOCITY)
_HEADINGS = (Mode.ANGLE, Mode.RATE)
_HEIGHTS = (Mode.POSITION, Mode.VELOCITY)


def wish_of(goals: Goals, since: float, senses: Senses, settings: DynamicsSettings) -> Wish:
    """Where a drone is to go now.

    Args:
        goals: What it was told; the first, of several drones.
        since: Seconds ago, in which places and headings drifted.
        senses: Of the drone now.
        settings: Gains and limits.

    Returns:
        A wish to be renewed often, as drifting places and turning headings move on.

    Raises:
        InputError: No wish says that, such as an angle of roll.
    """
    sideways, _, heading, height = goals.modes
    fits = sideways in _SIDEWAYS and heading in _HEADINGS and height in _HEIGHTS
    if not fits:
        names = ", ".join(mode.name.lower() for mode in goals.modes)
        raise InputError(f"modes={names} are no wish of a pilot; give velocities or places")
    values, drifts = _first(goals.values), _first(goals.drifts)
    told = values + drifts * since
    to_place = velocity_to(_place(told, senses, goals), senses, settings)
    x, y = float(values[0]), float(values[Y])
    if sideways is Mode.POSITION:
        x, y = (_within(to_place[i] + float(drifts[i]), settings.velocity_limit) for i in (0, Y))
    elif sideways is Mode.HEADING_VELOCITY:
        cosine, sine = math.cos(senses.heading), math.sin(senses.heading)
        x, y = cosine * x - sine * y, sine * x + cosine * y
    up = to_place[2] + float(drifts[Z]) if height is Mode.POSITION else float(values[Z])
    velocity = (x, y, _within(up, settings.climb_limit))
    if heading is Mode.RATE:
        return Wish(velocity, senses.heading, yaw_rate=float(told[HEADING]))
    return Wish(velocity, float(told[HEADING]))


def told_after(goals: Goals, seconds: float, body: FlightState) -> Tensor:
    """Where drones are wanted after a command: where they are, of axes on which nothing was wanted.

    Args:
        goals: The command.
        seconds: How long it lasted.
        body: The drones after it.

    Returns:
        See `FlightState.reference`. Shape: (num_worlds, 4).
    """
    here = body.settled().reference
    there = goals.values + seconds * goals.drifts
    wanted = [mode is Mode.POSITION for mode in goals.modes]
    wanted[HEADING] = goals.modes[HEADING] is Mode.ANGLE
    return torch.where(torch.tensor(wanted), there, here)


def _place(told: Vector, senses: Senses, goals: Goals) -> Vector:
    """Where it is told to be; where it is, along axes of which no place is told."""
    place = senses.position.copy()
    for axis, number in ((0, 0), (1, Y), (2, Z)):
        if goals.modes[number] is Mode.POSITION:
            place[axis] = told[number]
    return place


def _first(values: Tensor) -> Vector:
    return values[0].detach().cpu().double().numpy()


def _within(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))
