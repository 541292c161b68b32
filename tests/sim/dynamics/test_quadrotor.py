"""The quadrotor: moves, presets; the single drone and the fused moves, bit for bit."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import torch
import yaml

from drone_rl.config import DynamicsSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.dynamics import FlightState, Obstacles, Quadrotor, SingleQuadrotor
from drone_rl.sim.rendering.devices import start_warp
from tests.flying import (
    POSITIONS,
    VELOCITIES,
    angles,
    doubles,
    hovering,
    make_goals,
    quadrotor,
    trajectory,
)

CONF = Path(__file__).parents[3] / "conf" / "dynamics"


def test_quadrotor_starts_hovering():
    drone = quadrotor(mass=1.2)
    state = drone.start(doubles((1.0, 2.0, 3.0)), torch.tensor([9]))
    after = drone.fly(state, make_goals(POSITIONS, 1.0, 2.0, 0.0, 3.0), 333)
    torch.testing.assert_close(after.position, state.position, atol=1e-6, rtol=0)
    torch.testing.assert_close(after.rotors, state.rotors, atol=1e-5, rtol=0)
    assert state.rotors[0, 0].item() == pytest.approx(1.2 * 9.81 / (4 * 4.179446268))


def test_moves_shift_the_reference():
    """A move shifts it by 0.4 m in 0.1 s, at 4 m/s."""
    drone = quadrotor()
    state = hovering(drone, count=3)
    moved = drone.step(state, torch.tensor([Move.FORWARD, Move.LEFT, Move.RIGHT]))
    expected = [[0.396, 0, 0, 100], [0, 0.396, 0, 100], [0, -0.396, 0, 100]]
    torch.testing.assert_close(moved.reference, doubles(*expected))
    assert moved.position[0, 0] > 0 and moved.position[1, 1] > 0 > moved.position[2, 1]
    assert not state.position[:, :2].any() and moved.ticks.tolist() == [33] * 3


def test_empty_batch_is_supported():
    drone = quadrotor()
    empty = drone.start(torch.zeros(0, 3, dtype=torch.float64))
    assert len(drone.step(empty, torch.zeros(0, dtype=torch.int64)).position) == 0


@pytest.mark.parametrize("name", ["quadrotor", "crazyflie"])
def test_preset_drone_hovers_and_executes_moves(name):
    """Responses of drones from preset files are bounded and damped."""
    values = yaml.safe_load((CONF / f"{name}.yaml").read_text())
    del values["defaults"]
    drone = Quadrotor(DynamicsSettings(**values))
    hover = drone.fly(hovering(drone), make_goals(POSITIONS, 0.0, 0.0, 0.0, 100.0), 3300)
    assert float((hover.position - hovering(drone).position).norm()) < 1e-3
    states = trajectory(
        drone, hovering(drone), make_goals(POSITIONS, 2.0, -1.0, 1.0, 101.0), 3630, 33
    )
    path = torch.cat([state.position for state in states])
    assert path[:, 0].max() < 2.0 * 1.35 and path[:, 1].min() > -1.0 * 1.35
    assert path[:, 2].max() < 101.1
    last = states[-1]
    np.testing.assert_allclose(last.position[0], (2.0, -1.0, 101.0), atol=0.02)
    assert last.heading.item() == pytest.approx(1.0, abs=0.01)
    assert float(last.velocity.norm()) < 0.02 and float(last.angular_velocity.norm()) < 0.02
    state = hovering(drone)
    for action in [Move.FORWARD] * 20 + [Move.LEFT] * 10 + [Move.RIGHT] * 10:
        state = drone.step(state, torch.tensor([action]))
        assert not state.is_lost.item() and float(angles(state)[0, :2].abs().max()) < 0.7
        assert float((state.position[0, 2] - 100.0).abs()) < 0.2


@pytest.mark.gpu
@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a CUDA GPU")
def test_gpu_equals_cpu():
    drone = quadrotor(gusts=1.0)
    state, goals = hovering(drone, count=8), make_goals(POSITIONS, 3.0, 1.0, 1.0, 101.0, count=8)
    here = drone.fly(state, goals, 330)
    moved = make_goals(POSITIONS, 3.0, 1.0, 1.0, 101.0, count=8)
    there = type(goals)(moved.modes, moved.values.cuda())
    away = drone.fly(type(state)(state.numbers.cuda()), there, 330)
    torch.testing.assert_close(away.numbers.cpu(), here.numbers, atol=1e-3, rtol=0)


WINDY = DynamicsSettings(mode="simple_flight", wind=(3.0, -1.0, 0.0), gusts=1.0)


def boxes(x, y=0.0, z=1.0):
    return Obstacles(doubles((x, y, z), (0.0, 90.0, 1.0))[None], (1.0, 1.0, 1.0))


def test_states_are_those_of_a_quadrotor():
    """Goals, ticks and obstacles change on the way; a box is then put where the drone is."""
    plain, single = Quadrotor(WINDY), SingleQuadrotor(WINDY)
    one = plain.start(doubles((0.0, 0.0, 1.0)), torch.tensor([5]))
    other = FlightState(one.numbers.clone())
    hold = make_goals(POSITIONS, 0.0, 1.0, 0.0, 3.0)
    script = [
        (make_goals(POSITIONS, 1.0, 2.0, 0.5, 3.0), 7, None),
        (make_goals(POSITIONS, -1.0, 2.0, 0.5, 3.0), 7, None),
        (make_goals(VELOCITIES, 3.0, 0.0, 0.1, 0.0), 7, boxes(50.0)),
        (make_goals(VELOCITIES, 3.0, 0.0, 0.1, 0.0), 7, "here"),
        (make_goals(VELOCITIES, 3.0, 0.0, 0.1, 0.0), 3, "here"),
        (make_goals(VELOCITIES, 0.0, 1.0, 0.0, 0.0), 7, None),
        (dataclasses.replace(hold, drift=doubles((1.0, 0.0, 0.0, 0.0))), 7, None),
        (dataclasses.replace(hold, drift=doubles((-2.0, 0.0, 0.5, 0.0))), 7, None),
    ]
    touched = False
    for goals, ticks, place in script:
        around = boxes(*one.position[0].tolist()) if place == "here" else place
        for _ in range(40):
            one = plain.fly(one, goals, ticks, around)
            other = single.fly(other, goals, ticks, around)
            touched |= int(one.contact.thing[0]) == 0
        assert torch.equal(one.numbers, other.numbers)
    assert touched


def test_states_that_were_returned_stay_as_they_are():
    single = SingleQuadrotor(WINDY)
    state = single.start(doubles((0.0, 0.0, 1.0)))
    goals = make_goals(POSITIONS, 5.0, 0.0, 0.0, 1.0)
    first = single.fly(state, goals, 7)
    kept = first.numbers.clone()
    single.fly(first, goals, 7)
    assert torch.equal(first.numbers, kept)


start_warp("cpu")
