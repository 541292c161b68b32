"""One drone with a kept launch has the states of a `Quadrotor`, bit for bit."""

import torch

from drone_rl.config import DynamicsSettings
from drone_rl.sim.dynamics import FlightState, Mode, Obstacles, Quadrotor, SingleQuadrotor
from tests.flying import POSITIONS, doubles, make_goals

WINDY = DynamicsSettings(mode="simple_flight", wind=(3.0, -1.0, 0.0), gusts=1.0)
VELOCITIES = (Mode.VELOCITY, Mode.VELOCITY, Mode.RATE, Mode.VELOCITY)


def boxes(x, y=0.0, z=1.0):
    return Obstacles(doubles((x, y, z), (0.0, 90.0, 1.0))[None], (1.0, 1.0, 1.0))


def test_states_are_those_of_a_quadrotor():
    """Goals, ticks and obstacles change on the way; a box is then put where the drone is."""
    plain, single = Quadrotor(WINDY), SingleQuadrotor(WINDY)
    one = plain.start(doubles((0.0, 0.0, 1.0)), torch.tensor([5]))
    other = FlightState(one.numbers.clone())
    script = [
        (make_goals(POSITIONS, 1.0, 2.0, 0.5, 3.0), 7, None),
        (make_goals(POSITIONS, -1.0, 2.0, 0.5, 3.0), 7, None),
        (make_goals(VELOCITIES, 3.0, 0.0, 0.1, 0.0), 7, boxes(50.0)),
        (make_goals(VELOCITIES, 3.0, 0.0, 0.1, 0.0), 7, "here"),
        (make_goals(VELOCITIES, 3.0, 0.0, 0.1, 0.0), 3, "here"),
        (make_goals(VELOCITIES, 0.0, 1.0, 0.0, 0.0), 7, None),
    ]
    touched = False
    for goals, ticks, given in script:
        around = boxes(*one.position[0].tolist()) if given == "here" else given
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


def test_batches_are_flown_as_by_a_quadrotor():
    plain, single = Quadrotor(WINDY), SingleQuadrotor(WINDY)
    state = plain.start(doubles((0.0, 0.0, 1.0), (4.0, 0.0, 1.0)), torch.tensor([1, 2]))
    goals = make_goals(POSITIONS, 1.0, 2.0, 0.5, 3.0, count=2)
    torch.testing.assert_close(
        plain.fly(state, goals, 50).numbers, single.fly(state, goals, 50).numbers, rtol=0, atol=0
    )
