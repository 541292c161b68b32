# pyright: reportAttributeAccessIssue=false
# (MuJoCo's classes are untyped.)
"""How far the batched flight and MuJoCo's own integration of the same forces drift apart."""

import dataclasses
import math
from typing import Any

import mujoco
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.config import DynamicsSettings
from drone_rl.config.dynamics import GRAVITY
from drone_rl.sim.dynamics import FlightState, Goals, Mode, Quadrotor
from drone_rl.sim.dynamics import state as fs
from drone_rl.sim.dynamics.forces_kernel import forces

SECONDS = 10.0
HEIGHT = 1000.0
"""Metres above the ground at which manoeuvres begin, so that none ends there."""
_HOLD = 1.0
"""Seconds for which a drone is told the same."""
_PLACES = (Mode.POSITION, Mode.POSITION, Mode.ANGLE, Mode.POSITION)
_ANGLES = (Mode.ANGLE, Mode.ANGLE, Mode.ANGLE, Mode.POSITION)
_SPEEDS = (Mode.HEADING_VELOCITY, Mode.HEADING_VELOCITY, Mode.RATE, Mode.VELOCITY)
_RATES = (Mode.RATE, Mode.RATE, Mode.RATE, Mode.POSITION)


@dataclasses.dataclass(frozen=True)
class Manoeuvre:
    """What drones are told, a second at a time, and the air in which they are."""

    name: str
    settings: DynamicsSettings
    goals: tuple[Goals, ...]
    """Of as many drones each."""


@dataclasses.dataclass(frozen=True)
class Gap:
    """The greatest differences at any whole second, over the drones of a manoeuvre."""

    name: str
    metres: float
    degrees: float


def measure_parity(count: int = 100, seed: int = 0, seconds: float = SECONDS) -> list[Gap]:
    """Flies random manoeuvres both ways.

    Args:
        count: How many, over all kinds.
        seed: Of what is random about them.
        seconds: How long each is.
    """
    return [gap_of(one) for one in manoeuvres(count, seed, seconds)]


def bench_flight_parity(quick: bool) -> dict[str, Any]:
    """Random manoeuvres of ten seconds, flown by the batch and by MuJoCo.

    Args:
        quick: Whether a few are enough, of a second.

    Returns:
        "flight_parity_m", "flight_parity_deg": the greatest differences of place and attitude over
        all; "flight_parity": by kind of manoeuvre, metres and degrees.
    """
    gaps = measure_parity(15, seconds=1.0) if quick else measure_parity()
    return {
        "flight_parity_m": max(gap.metres for gap in gaps),
        "flight_parity_deg": max(gap.degrees for gap in gaps),
        "flight_parity": {gap.name: [gap.metres, gap.degrees] for gap in gaps},
    }


def manoeuvres(count: int, seed: int, seconds: float = SECONDS) -> list[Manoeuvre]:
    """Hovers, steps, rolls and velocities, in still air, wind and gusts, as many of each."""
    source = np.random.default_rng(seed)
    still = DynamicsSettings(mode="simple_flight")
    airs = {
        "still air": still,
        "wind": still.replace(wind=(4.0, -3.0, 1.0)),
        "gusts": still.replace(wind=(-3.0, 4.0, 0.0), gusts=1.5, gust_length=20.0),
    }
    kinds = {
        "hover": (),
        "steps": _PLACES,
        "rolls": _ANGLES,
        "velocities": _SPEEDS,
        "rates": _RATES,
    }
    pairs = [(kind, air) for air in airs for kind in kinds]
    shares = [len(part) for part in np.array_split(np.arange(count), len(pairs))]
    parts = max(1, round(seconds / _HOLD))
    return [
        Manoeuvre(
            f"{kind} in {air}",
            airs[air],
            tuple(_told(source, kinds[kind], share) for _ in range(parts)),
        )
        for (kind, air), share in zip(pairs, shares, strict=True)
        if share
    ]


def gap_of(manoeuvre: Manoeuvre) -> Gap:
    """Flies one manoeuvre both ways, from a hover at `HEIGHT`."""
    quadrotor, count = Quadrotor(manoeuvre.settings), len(manoeuvre.goals[0].values)
    ticks = round(_HOLD / manoeuvre.settings.tick)
    places = torch.zeros(count, 3, dtype=torch.float64)
    places[:, 2] = HEIGHT
    here = there = quadrotor.start(places, torch.arange(count))
    worlds = _Worlds(manoeuvre.settings, there)
    away, turned = torch.zeros(1), torch.zeros(1)
    for goals in manoeuvre.goals:
        control = manoeuvre.settings.control_ticks
        for first in range(0, ticks, control):
            here = quadrotor.fly(here, goals, min(control, ticks - first))
        there = worlds.fly(quadrotor, there, goals, ticks)
        away = torch.maximum(away, (here.position - there.position).norm(dim=-1).max())
        turned = torch.maximum(turned, _between(here.attitude, there.attitude).max())
    return Gap(manoeuvre.name, float(away), float(turned))


class _Worlds:
    """Drones in worlds of MuJoCo's, one each."""

    def __init__(self, settings: DynamicsSettings, body: FlightState) -> None:
        inertia = " ".join(repr(moment) for moment in settings.inertia)
        self._model = mujoco.MjModel.from_xml_string(f"""<mujoco>
            <option timestep="{settings.tick}" gravity="0 0 {-GRAVITY}" integrator="Euler">
                <flag eulerdamp="disable"/></option>
            <worldbody><body><freejoint/>
                <inertial pos="0 0 0" mass="{settings.mass}" diaginertia="{inertia}"/>
            </body></worldbody></mujoco>""")
        self._worlds = [mujoco.MjData(self._model) for _ in range(len(body))]
        for data, row in zip(self._worlds, body.numbers.numpy(), strict=True):
            data.qpos[:] = row[fs.POSITION : fs.VELOCITY]
            data.qvel[:] = row[fs.VELOCITY : fs.ROTORS]

    def fly(self, quadrotor: Quadrotor, body: FlightState, goals: Goals, ticks: int) -> FlightState:
        """Applies the forces of every tick, and lets MuJoCo do the rest."""
        for tick in range(ticks):
            body, pushes = forces(quadrotor.frame, body, goals, tick)
            rows, given = body.numbers.numpy(), pushes.numpy()
            for data, row, push in zip(self._worlds, rows, given, strict=True):
                data.xfrc_applied[1] = push
                mujoco.mj_step(self._model, data)
                row[fs.POSITION : fs.VELOCITY] = data.qpos
                row[fs.VELOCITY : fs.ROTORS] = data.qvel
        return body


def _told(source: np.random.Generator, modes: tuple[Mode, ...], count: int) -> Goals:
    """Something for each drone to do."""
    values = np.zeros((count, 4))
    if not modes:
        modes, values[:, 3] = _PLACES, HEIGHT
        return _goals(modes, values)
    if modes == _PLACES:
        values[:, :3] = source.uniform((-5, -5, -math.pi), (5, 5, math.pi), (count, 3))
    elif modes == _ANGLES:
        values[:, :3] = source.uniform((-0.7, -0.7, -math.pi), (0.7, 0.7, math.pi), (count, 3))
    elif modes == _SPEEDS:
        values[:] = source.uniform((-4, -3, -1, -2), (4, 3, 1, 2), (count, 4))
    else:
        values[:, :3] = source.uniform((-0.3, -0.3, -1), (0.3, 0.3, 1), (count, 3))
    if modes[3] == Mode.POSITION:
        values[:, 3] = HEIGHT + source.uniform(-3, 3, count)
    return _goals(modes, values)


def _goals(modes: tuple[Mode, ...], values: NDArray) -> Goals:
    return Goals(modes, torch.from_numpy(values))  # pyright: ignore[reportArgumentType] (four)


def _between(one: Tensor, other: Tensor) -> Tensor:
    """Degrees between attitudes; by the sine, as the cosine of small angles says little."""
    w, v = one[:, :1], one[:, 1:]
    aside = w * other[:, 1:] - other[:, :1] * v - torch.linalg.cross(v, other[:, 1:])
    along = (one * other).sum(-1).abs()
    return torch.rad2deg(2.0 * torch.atan2(aside.norm(dim=-1), along))
