"""The cascaded controller for ideal rotors, its step responses, and the goals of actions."""

import math

import numpy as np
import pytest
import torch

from drone_rl.config import ActionSettings, DynamicsSettings
from drone_rl.sim.actions import Move
from drone_rl.sim.dynamics import FlightState, Mode, Quadrotor
from drone_rl.sim.dynamics.control import Moves, Velocities
from tests.flying import (
    ANGLES,
    POSITIONS,
    VELOCITIES,
    StepResponse,
    angles,
    doubles,
    hovering,
    make_goals,
    quadrotor,
    trajectory,
)

RATES = (Mode.RATE, Mode.RATE, Mode.RATE, Mode.POSITION)


BARE = (Mode.RATE, Mode.RATE, Mode.RATE, Mode.THROTTLE)


HEADS = (Mode.HEADING_VELOCITY, Mode.HEADING_VELOCITY, Mode.RATE, Mode.VELOCITY)


def setpoints(modes, *values, yaw=0.0, drift=None, change=None):
    """Return the rotor setpoints of a drone hovering at (0, 0, 100) in the first tick."""
    drone = quadrotor(rotor_time_constant=0.0)
    state = hovering(drone)
    state.attitude[:] = doubles((math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)))
    for name, value in (change or {}).items():
        getattr(state, name)[:] = doubles(value)
    return drone.fly(state, make_goals(modes, *values, drift=drift), 1).rotors[0].numpy()


def control(rotors):
    """Return the throttle and the control about each axis."""
    rows = np.array([[1, 1, 1, 1], [-1, 1, 1, -1], [-1, 1, -1, 1], [-1, -1, 1, 1]])
    return rows @ rotors / 4


HOVER = 9.81 / (4 * 4.179446268)


def test_rate_goals_are_followed_and_limited():
    """The gain is 0.25 of the control per rad/s."""
    np.testing.assert_allclose(
        control(setpoints(BARE, 0.2, 0.4, 0.6, 0.5)), (0.5, 0.05, 0.1, 0.15), atol=1e-6
    )
    spinning = setpoints(BARE, 0.2, 0.4, 0.6, 0.5, change={"angular_velocity": (0.2, 0.4, 0.2)})
    np.testing.assert_allclose(control(spinning), (0.5, 0.0, 0.0, 0.1), atol=1e-6)
    np.testing.assert_allclose(
        control(setpoints(BARE, 90.0, 0.0, 0.0, 0.5))[1]
        / control(setpoints(BARE, 2.5, 0, 0, 0.5))[1],
        1.0,
    )
    assert control(setpoints(BARE, 0.0, 0.0, -90.0, 0.2))[3] < 0


@pytest.mark.parametrize(
    ("goal", "rotors"),
    [
        ((0.4, 0.0, 0.0, 0.5), (0.4, 0.6, 0.6, 0.4)),
        ((0.0, 0.4, 0.0, 0.5), (0.4, 0.6, 0.4, 0.6)),
        ((0.0, 0.0, 0.4, 0.5), (0.4, 0.4, 0.6, 0.6)),
        ((0.04, 0.08, 0.16, 0.5), (0.43, 0.49, 0.53, 0.55)),
        ((0.8, 0.0, 0.0, 0.0), (0.0, 0.4, 0.4, 0.0)),  # torque without thrust adds thrust
        ((0.8, 0.0, 0.0, 0.1), (0.0, 0.4, 0.4, 0.0)),
        ((0.8, 0.0, 0.0, 1.0), (2 / 3, 1.0, 1.0, 2 / 3)),  # 0.8 and 1.2, divided by 1.2
        ((2.4, 2.4, 2.4, 0.5), (0.0, 1.0, 1.0, 1.0)),  # -1.3, 1.1, ... are shifted and scaled
    ],
)
def test_mixer_assigns_torques_to_rotors(goal, rotors):
    """Front right, rear left, front left, rear right; a rate of 0.4 sets a torque of 0.1."""
    np.testing.assert_allclose(setpoints(BARE, *goal), rotors, atol=1e-6)


def test_heading_takes_the_shorter_turn():
    modes = (*ANGLES[:3], Mode.THROTTLE)
    assert control(setpoints(modes, 0, 0, -3.0, 0.5, yaw=3.0))[3] > 0.1
    assert control(setpoints(modes, 0, 0, 3.0, 0.5, yaw=-3.0))[3] < -0.1
    np.testing.assert_allclose(control(setpoints(modes, 0, 0, 3.0, 0.5, yaw=3.0))[3], 0, atol=1e-6)


SHARE = 0.2 * math.pi / 5.5 * 2.5 * 2.5 * 0.25
"""Control per m/s: product of the gains of velocity, angle and rate."""


@pytest.mark.parametrize("yaw", [0.0, 1.0, -2.5, math.pi])
def test_velocity_goals_are_in_world_or_heading_frame(yaw):
    x, y, c, s = 0.3, -0.2, math.cos(yaw), math.sin(yaw)
    world = control(setpoints(VELOCITIES, x, y, 0.0, 0.0, yaw=yaw))
    forward, left = c * x + s * y, c * y - s * x
    np.testing.assert_allclose(world, (HOVER, -SHARE * left, SHARE * forward, 0), atol=1e-6)
    same = control(setpoints(HEADS, forward, left, 0.0, 0.0, yaw=yaw))
    np.testing.assert_allclose(same, world, atol=1e-6)
    moving = {"velocity": (x, y, 0.0)}
    for modes, goal in ((VELOCITIES, (x, y)), (HEADS, (forward, left))):
        at_it = control(setpoints(modes, *goal, 0.0, 0.0, yaw=yaw, change=moving))
        np.testing.assert_allclose(at_it, (HOVER, 0, 0, 0), atol=1e-6)


def test_position_goals_set_velocities():
    """0.5 m ahead sets 0.75 m/s; 1 m up sets 1 m/s, which needs full thrust."""
    found = control(setpoints(POSITIONS, 0.5, -0.5, 0.0, 100.0))
    np.testing.assert_allclose(found, (HOVER, 0.75 * SHARE, 0.75 * SHARE, 0), atol=1e-6)
    found = control(setpoints(POSITIONS, 0.0, 0.0, 0.0, 100.1))
    np.testing.assert_allclose(found[0], HOVER + 0.5 * 2.0 * 0.1, atol=1e-6)
    assert control(setpoints(POSITIONS, 0.0, 0.0, 0.0, 101.0))[0] == pytest.approx(1.0)


def test_rotor_goals_bypass_controllers():
    every = (Mode.ROTOR,) * 4
    np.testing.assert_allclose(
        setpoints(every, 0.1, 0.2, 0.3, 0.4), (0.1, 0.2, 0.3, 0.4), atol=1e-7
    )


STEPS = {  # modes, goal, axis, quantity, rise time, overshoot
    "rate": (RATES, (0, 0, 1.0, 100.0), 2, "rates", 0.6, 0.01),
    "angle": (ANGLES, (0.3, 0, 0, 100.0), 0, "angles", 0.6, 0.02),
    "velocity": (VELOCITIES, (2.0, 0, 0, 0), 0, "speed", 3.0, 0.05),
    "climb": (VELOCITIES, (0, 0, 0, 1.0), 2, "speed", 1.0, 0.2),
    "position": (POSITIONS, (2.0, 0, 0, 100.0), 0, "place", 3.5, 0.33),
    "height": (POSITIONS, (0, 0, 0, 101.0), 2, "place", 3.5, 0.1),
}


@pytest.mark.parametrize("name", STEPS)
def test_step_responses(name):
    modes, goal, axis, what, rise, overshoot = STEPS[name]
    drone = quadrotor()
    states = trajectory(drone, hovering(drone), make_goals(modes, *goal), 3300, 3)
    read = {
        "rates": lambda s: s.angular_velocity,
        "angles": angles,
        "speed": lambda s: s.velocity,
        "place": lambda s: s.position,
    }[what]
    values = torch.cat([read(s) for s in states]).numpy()[:, axis]
    start = 100.0 if name == "height" else 0.0
    wanted = 1.0 if name in ("rate", "climb", "height") else max(goal[:3])
    response = StepResponse(values - start, wanted, tick=0.009)
    assert 0.0 < response.rise < rise
    assert response.overshoot < overshoot
    assert response.settling_time(0.05) < 2.0 * rise


def test_limits_hold_for_random_goals():
    """60 drones with random goals stay near the limits of the controllers."""
    drone, source = quadrotor(), np.random.default_rng(0)
    state = hovering(drone, count=60)
    most = np.zeros(4)
    for _ in range(10):
        values = torch.tensor(source.uniform(-20, 20, (60, 4)))
        values[:, 2] /= 7
        values[:, 3] += 100
        goals = make_goals(POSITIONS, 0, 0, 0, 0, count=60)
        goals.values[:] = values
        for _ in range(10):
            state = drone.fly(state, goals, 33)
            tilt = angles(state)[:, :2].abs().max()
            speed = state.velocity.abs()
            spin = state.angular_velocity.abs().max()
            now = [speed[:, :2].max(), speed[:, 2].max(), tilt, spin]
            most = np.maximum(most, [float(v) for v in now])
            assert float(state.rotors.min()) >= 0.0 and float(state.rotors.max()) <= 1.0
    assert not state.is_lost.any()
    assert most[0] < 6.0 * 1.2 and most[1] < 4.0 * 1.6
    assert most[2] < math.pi / 5.5 * 1.3 and most[3] < 2.5 * 2**0.5 * 1.1


MOVES_SETTINGS = ActionSettings(move_speed=4.0, move_lead=0.5)


VELOCITY_SETTINGS = ActionSettings(kind="velocity", forward_speed=4, sideways_speed=3, yaw_rate=90)


def drones():
    place = torch.tensor([[1.0, 2.0, 2.5]] * 3, dtype=torch.float64)
    return FlightState.at_rest(place)


def test_move_shifts_the_position_goal():
    goals = Moves(MOVES_SETTINGS).goals(
        drones(), torch.tensor([Move.FORWARD, Move.LEFT, Move.RIGHT])
    )
    assert goals.modes == Moves.modes
    assert goals.values.tolist() == [[1.0, 2.0, 0.0, 2.5]] * 3
    assert goals.drifts.tolist() == [[4, 0, 0, 0], [0, 4, 0, 0], [0, -4, 0, 0]]


def test_position_goal_stays_within_its_lead():
    body = drones()
    body.reference[:] = torch.tensor([[1.3, 9.0, 0.1, 2.5], [-7.0, 1.8, 0.1, 2.5], [1, 2, 0.1, 3]])
    goals = Moves(MOVES_SETTINGS).goals(body, torch.zeros(3, dtype=torch.int64))
    expected = [[1.3, 2.5, 0.1, 2.5], [0.5, 1.8, 0.1, 2.5], [1.0, 2.0, 0.1, 3.0]]
    assert goals.values.tolist() == [pytest.approx(row) for row in expected]
    assert body.reference[0, 1] == 9.0


def test_moves_drift_along_the_goals_heading():
    """At a heading of 90 degrees forward is +y and left -x; a turn drifts by the yaw rate."""
    body, quarter = drones(), math.pi / 2
    body.reference[:, 2] = quarter
    body.reference[:, 3] = 9.0
    steering = Moves(ActionSettings(kind="moves_full", yaw_rate=90.0))
    actions = torch.tensor([steering.actions.names.index(n) for n in ("back", "left", "turn left")])
    goals = steering.goals(body, actions)
    expected = torch.tensor([[0, -4, 0, 0], [-4, 0, 0, 0], [0, 0, quarter, 0]]).double()
    torch.testing.assert_close(goals.world_drifts, expected)
    assert goals.values[0].tolist() == [1.0, 2.0, quarter, 3.0]  # the lead upwards is 0.5 m
    after = goals.reference_after(0.5, body)
    torch.testing.assert_close(after[1], torch.tensor([-1.0, 2.0, quarter, 3.0]).double())
    torch.testing.assert_close(after[2, 2], torch.tensor(1.5 * quarter).double())
    assert Moves(ActionSettings(kind="moves_full"), 0.5).drifts[6].tolist() == [0, 0, 0.5, 0]


def test_a_quadrotor_flies_moves_along_its_heading():
    """20 turns of 4.455 degrees (45 degrees/s for 0.099 s), then forward at 4 m/s, then up."""
    drone = Quadrotor(DynamicsSettings(mode="simple_flight"), ActionSettings(kind="moves_full"))
    body, names = hovering(drone), drone.actions.names

    def fly(body, name, count):
        for _ in range(count):
            body = drone.step(body, torch.tensor([names.index(name)]))
        return body

    body = fly(body, "turn left", 20)
    assert math.degrees(body.heading.item()) == pytest.approx(20 * 4.455, abs=2)
    torch.testing.assert_close(body.position, doubles((0, 0, 100)), atol=0.05, rtol=0)
    x, y, z = fly(body, "forward", 20).position[0].tolist()
    assert (x, z) == pytest.approx((0.0, 100.0), abs=0.2) and 5.0 < y < 8.0
    x, y, z = fly(body, "up", 20).position[0].tolist()
    assert (x, y) == pytest.approx((0.0, 0.0), abs=0.1) and 105.0 < z < 108.0
    x, y, z = fly(body, "back", 20).position[0].tolist()
    assert (x, z) == pytest.approx((0.0, 100.0), abs=0.2) and -8.0 < y < -5.0


def test_velocity_actions_use_the_heading_frame_and_keep_height():
    body = drones()
    body.reference[:, 3] = 2.0
    action = torch.tensor([[-1.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.0, -0.5, -2.0]])
    goals = Velocities(VELOCITY_SETTINGS).goals(body, action)
    assert goals.modes == (
        Mode.HEADING_VELOCITY,
        Mode.HEADING_VELOCITY,
        Mode.RATE,
        Mode.POSITION,
    )
    turn = math.pi / 2
    expected = [[0, 0, 0, 2.0], [4, 3, turn, 2.0], [2, -1.5, -turn, 2.0]]
    assert goals.values.tolist() == [pytest.approx(row) for row in expected]
    assert goals.drift is None
