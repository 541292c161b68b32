"""Steps of a world whose drone has a firmware on board: the stub, and one of three lines."""

import copy
import shlex
import time

import numpy as np
import pytest
import torch

from drone_rl.config import DynamicsSettings
from drone_rl.flight.betaflight.sitl import betaflight_drone
from drone_rl.flight.in_the_loop import drone as drone_module
from drone_rl.flight.in_the_loop import dynamics as module
from drone_rl.flight.in_the_loop.drone import DroneInTheLoop, NotReadyError
from drone_rl.flight.in_the_loop.dynamics import InTheLoopDynamics
from drone_rl.sim.dynamics import FlightState, Obstacles, Quadrotor
from tests.flight.arming import arm_at_once

SETTINGS = DynamicsSettings(mode="simple_flight", camera_mount="body")
FAST = SETTINGS.replace(tick=0.001)
PLACE = torch.tensor([[0.0, 0.0, 2.0]], dtype=torch.float64)


class Even:
    """Turns all rotors as much: a drone that goes up or down alone."""

    def __init__(self, arms=True):
        self.arms = arms

    def step(self, readings, sticks):
        return np.full(4, max(sticks.throttle, 0.05) if sticks.armed and self.arms else 0.0)


def drone(controller=None):
    ground = torch.tensor([[0.0, 0.0, SETTINGS.radius]], dtype=torch.float64)
    body = FlightState.at_rest(ground)
    return DroneInTheLoop(Quadrotor(FAST), body, controller or Even(), FAST)


@pytest.fixture(scope="module")
def hovering():
    """Dynamics whose episode has begun, with gusts of seed 7, and its first state."""
    dynamics = InTheLoopDynamics(drone(), SETTINGS)
    start = dynamics.start(PLACE, torch.tensor([7]))
    assert dynamics.drone.time == 0.0  # `start` moves nothing
    with pytest.MonkeyPatch.context() as patch:
        arm_at_once(patch)
        dynamics.begin(start)
    return dynamics, start


@pytest.fixture
def begun(hovering, monkeypatch):
    """A copy of `hovering`, with a limit of a minute for decisions: this machine may be busy."""
    for part in (module, drone_module):
        monkeypatch.setattr(part, "LONGEST_DECISION", 60.0)
    dynamics, start = copy.copy(hovering[0]), FlightState(hovering[1].numbers.clone())
    dynamics.drone, dynamics._last = copy.copy(dynamics.drone), time.monotonic()
    return dynamics, start


def test_an_episode_begins_where_it_is_to(begun):
    """`begin` brings the drone there, with the gusts of the episode."""
    dynamics, _ = begun
    assert np.linalg.norm(dynamics.drone.readings.position - [0.0, 0.0, 2.0]) < 0.1
    assert dynamics.drone.body.numbers[0, 25] == 7.0


def test_a_step_lasts_as_long_as_an_action(begun):
    """33 ticks of 3 ms are 99 of 1 ms. It keeps its height, and is wanted ahead of where it is."""
    dynamics, body = begun
    first = dynamics.drone.time
    for _ in range(2):
        body = dynamics.step(body, torch.tensor([0]))
    assert dynamics.drone.time - first == pytest.approx(0.198)
    assert abs(float(body.position[0, 2]) - 2.0) < 0.1
    assert body.reference[0].tolist() == pytest.approx([0.792, 0.0, 0.0, 2.0])
    assert body.position is not dynamics.drone.body.position


def test_obstacles_are_felt(begun):
    """A box right above: the drone, told to be higher, stays below it."""
    dynamics, body = begun
    body.reference[:, 3] = 4.0
    above = Obstacles(torch.tensor([[[0.0, 0.0, 3.5]]], dtype=torch.float64), (1.0, 1.0, 1.0))
    for _ in range(10):
        body = dynamics.step(body, torch.tensor([0]), above)
        body.reference[:, 3] = 4.0
    assert float(body.position[0, 2]) < 2.25  # 3.5 - 1 - 0.3, and a little
    assert int(body.contact.thing[0]) == 0


def test_a_firmware_that_never_arms(monkeypatch):
    monkeypatch.setattr(module, "_ARM_TRIES", 2)
    arm_at_once(monkeypatch, within=0.2)
    dynamics = InTheLoopDynamics(drone(Even(arms=False)), SETTINGS)
    with pytest.raises(NotReadyError, match="refuses to arm"):
        dynamics.begin(dynamics.start(PLACE))


def test_it_goes_where_actions_lead(stub, tmp_path, monkeypatch):
    """The stub flies it forward, then to the left."""
    arm_at_once(monkeypatch)
    program = tmp_path / "stub"
    program.write_text(f"#!/bin/sh\nexec {shlex.join(stub())}\n")
    program.chmod(0o755)
    with betaflight_drone(SETTINGS, firmware=program) as flown:
        dynamics = InTheLoopDynamics(flown, SETTINGS)
        body = dynamics.start(PLACE)
        dynamics.begin(body)
        for action in (0, 0, 0, 0, 0, 1, 1, 1, 1, 1):
            body = dynamics.step(body, torch.tensor([action]))
    x, y, z = body.position[0].tolist()
    assert x > 0.4
    assert y > 0.1
    assert abs(z - 2.0) < 0.3
