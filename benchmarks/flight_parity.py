# pyright: reportAttributeAccessIssue=false
# (MuJoCo's classes are untyped.)
"""Drift between the batched quadrotor dynamics and MuJoCo's integration of the same forces."""

import dataclasses
import math
from typing import Any

import mujoco
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from benchmarks.benchmark import Setup
from benchmarks.forces_kernel import forces
from drone_rl.config import DynamicsSettings
from drone_rl.config.dynamics import GRAVITY
from drone_rl.sim.dynamics import FlightGoals, FlightState, Mode, Quadrotor
from drone_rl.sim.dynamics import state as fs

SECONDS = 10.0
HEIGHT = 1000.0
"""Initial height in metres, so that no manoeuvre reaches the ground."""
_HOLD = 1.0
"""Duration of each command in seconds."""
_PLACES = (Mode.POSITION, Mode.POSITION, Mode.ANGLE, Mode.POSITION)
_ANGLES = (Mode.ANGLE, Mode.ANGLE, Mode.ANGLE, Mode.POSITION)
_SPEEDS = (Mode.HEADING_VELOCITY, Mode.HEADING_VELOCITY, Mode.RATE, Mode.VELOCITY)
_RATES = (Mode.RATE, Mode.RATE, Mode.RATE, Mode.POSITION)


@dataclasses.dataclass(frozen=True)
class Manoeuvre:
    """Commands of several drones and the air in which they fly."""

    name: str
    settings: DynamicsSettings
    goals: tuple[FlightGoals, ...]
    """Goals of all drones, one entry for each second."""


@dataclasses.dataclass(frozen=True)
class Gap:
    """Largest differences over all drones of a manoeuvre, at whole seconds."""

    name: str
    metres: float
    degrees: float


def measure_parity(count: int = 100, seed: int = 0, seconds: float = SECONDS) -> list[Gap]:
    """Fly random manoeuvres with both simulators.

    Args:
        count: Number of drones over all kinds of manoeuvres.
        seed: Seed of the manoeuvres.
        seconds: Duration of each manoeuvre.
    """
    return [gap_of(manoeuvre) for manoeuvre in manoeuvres(count, seed, seconds)]


def bench_flight_parity(setup: Setup) -> dict[str, Any]:
    """Compare random manoeuvres of ten seconds in the batched dynamics and in MuJoCo.

    Returns:
        "flight_parity_m", "flight_parity_deg": largest differences of position and attitude;
        "flight_parity": metres and degrees by kind of manoeuvre.
    """
    gaps = measure_parity(15, seconds=1.0) if setup.quick else measure_parity()
    return {
        "flight_parity_m": max(gap.metres for gap in gaps),
        "flight_parity_deg": max(gap.degrees for gap in gaps),
        "flight_parity": {gap.name: [gap.metres, gap.degrees] for gap in gaps},
    }


def manoeuvres(count: int, seed: int, seconds: float = SECONDS) -> list[Manoeuvre]:
    """Return random manoeuvres of each kind, in still air, wind and gusts."""
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
            tuple(_random_goals(source, kinds[kind], share) for _ in range(parts)),
        )
        for (kind, air), share in zip(pairs, shares, strict=True)
        if share
    ]


def gap_of(manoeuvre: Manoeuvre) -> Gap:
    """Fly one manoeuvre with both simulators, starting from a hover at `HEIGHT`."""
    quadrotor, count = Quadrotor(manoeuvre.settings), len(manoeuvre.goals[0].values)
    ticks = round(_HOLD / manoeuvre.settings.tick)
    places = torch.zeros(count, 3, dtype=torch.float64)
    places[:, 2] = HEIGHT
    ours = theirs = quadrotor.start(places, torch.arange(count))
    simulation = _MuJoCo(manoeuvre.settings, theirs)
    metres, degrees = torch.zeros(1), torch.zeros(1)
    for goals in manoeuvre.goals:
        control = manoeuvre.settings.control_ticks
        for first in range(0, ticks, control):
            ours = quadrotor.fly(ours, goals, min(control, ticks - first))
        theirs = simulation.fly(quadrotor, theirs, goals, ticks)
        metres = torch.maximum(metres, (ours.position - theirs.position).norm(dim=-1).max())
        degrees = torch.maximum(degrees, _angle(ours.attitude, theirs.attitude).max())
    return Gap(manoeuvre.name, float(metres), float(degrees))


class _MuJoCo:
    """Free rigid bodies in MuJoCo, one simulation for each drone."""

    def __init__(self, settings: DynamicsSettings, body: FlightState) -> None:
        inertia = " ".join(repr(moment) for moment in settings.inertia)
        self._model = mujoco.MjModel.from_xml_string(f"""<mujoco>
            <option timestep="{settings.tick}" gravity="0 0 {-GRAVITY}" integrator="Euler">
                <flag eulerdamp="disable"/></option>
            <worldbody><body><freejoint/>
                <inertial pos="0 0 0" mass="{settings.mass}" diaginertia="{inertia}"/>
            </body></worldbody></mujoco>""")
        self._data = [mujoco.MjData(self._model) for _ in range(len(body))]
        for data, row in zip(self._data, body.numbers.numpy(), strict=True):
            data.qpos[:] = row[fs.POSITION : fs.VELOCITY]
            data.qvel[:] = row[fs.VELOCITY : fs.ROTORS]

    def fly(
        self, quadrotor: Quadrotor, body: FlightState, goals: FlightGoals, ticks: int
    ) -> FlightState:
        """Apply the forces of every tick and integrate with MuJoCo."""
        for tick in range(ticks):
            body, wrenches = forces(quadrotor.frame, body, goals, tick)
            rows, applied = body.numbers.numpy(), wrenches.numpy()
            for data, row, wrench in zip(self._data, rows, applied, strict=True):
                data.xfrc_applied[1] = wrench
                mujoco.mj_step(self._model, data)
                row[fs.POSITION : fs.VELOCITY] = data.qpos
                row[fs.VELOCITY : fs.ROTORS] = data.qvel
        return body


def _random_goals(source: np.random.Generator, modes: tuple[Mode, ...], count: int) -> FlightGoals:
    """Sample a goal for each drone."""
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


def _goals(modes: tuple[Mode, ...], values: NDArray) -> FlightGoals:
    return FlightGoals(modes, torch.from_numpy(values))  # pyright: ignore[reportArgumentType] (four)


def _angle(one: Tensor, other: Tensor) -> Tensor:
    """Return the angle between attitudes in degrees, by the sine for precision at small angles."""
    w, v = one[:, :1], one[:, 1:]
    sine = w * other[:, 1:] - other[:, :1] * v - torch.linalg.cross(v, other[:, 1:])
    cosine = (one * other).sum(-1).abs()
    return torch.rad2deg(2.0 * torch.atan2(sine.norm(dim=-1), cosine))
