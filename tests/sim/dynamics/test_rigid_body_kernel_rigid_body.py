"""Forces and motion by closed forms: free fall, terminal speed, spin-up, spin, drag."""

import math

import numpy as np
import pytest
import torch

from drone_rl.sim.dynamics.control import rotor_goals
from tests.flying import (
    GRAVITY,
    doubles,
    falling,
    hovering,
    matrix,
    quadrotor,
    rotation,
    trajectory,
)

VACUUM = {"air_density": 0.0}
AT_ONCE = {"rotor_time_constant": 0.0}
THRUST, LEVER, TWIST = 4.179446268, 4.179446268 * 0.2275 / math.sqrt(2), 0.055562
NONE = doubles((0.0, 0.0, 0.0, 0.0))


def test_what_falls_without_air_gains_speed_by_gravity_alone():
    """Velocities first: after n ticks g t^2 (n + 1) / (2 n) have been fallen."""
    drone = quadrotor(**VACUUM)
    after = drone.push(falling(velocity=(1.0, -2.0, 3.0)), NONE, 1000)
    np.testing.assert_allclose(after.velocity[0], (1, -2, 3 - 3 * GRAVITY), rtol=1e-5)
    fallen = GRAVITY * 9.0 / 2 * 1.001
    np.testing.assert_allclose(after.position[0], (3, -6, 109 - fallen), rtol=1e-5)
    assert after.attitude[0].tolist() == [1, 0, 0, 0]


def test_energy_is_kept_in_free_fall_but_for_the_length_of_a_tick():
    drone = quadrotor(**VACUUM)
    states = trajectory(drone, falling(velocity=(2.0, 0.0, 10.0)), rotor_goals(NONE), 1000, 100)
    energy = [0.5 * s.velocity.square().sum() + GRAVITY * s.position[0, 2] for s in states]
    most_speed = max(float(s.velocity.norm()) for s in states)
    assert max(abs(float(e - energy[0])) for e in energy) < 0.5 * GRAVITY * 0.003 * 2 * most_speed


@pytest.mark.parametrize("mass", [1.0, 0.5])
def test_terminal_speed_is_where_drag_carries_the_weight(mass):
    after = quadrotor(mass=mass).push(falling(1000.0), NONE, 4000)
    speed = math.sqrt(mass * GRAVITY / (1.225 * 0.02989))
    np.testing.assert_allclose(after.velocity[0], (0, 0, -speed), rtol=1e-4)


@pytest.mark.parametrize(("axis", "area"), enumerate((0.00538, 0.00611, 0.02989)))
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_each_side_drags_by_its_area_against_the_motion(axis, area, sign):
    state = falling()
    state.velocity[0, axis] = 10.0 * sign
    after = quadrotor().push(state, NONE)
    expected = state.velocity[0].clone()
    expected[axis] -= sign * 0.003 * 1.225 * area * 100.0
    expected[2] -= 0.003 * GRAVITY
    np.testing.assert_allclose(after.velocity[0], expected, atol=2e-6)


def test_drag_turns_with_the_body():
    """Yawed by 90 degrees, the left side faces the world's -x; rolled to the right, the top +y."""
    root = math.sqrt(0.5)
    for attitude, axis, area in (
        ((root, 0, 0, root), 0, 0.00611),
        ((root, 0, 0, root), 1, 0.00538),
        ((root, root, 0, 0), 1, 0.02989),
        ((root, 0, root, 0), 0, 0.02989),
    ):
        state = falling()
        state.attitude[:], state.velocity[0, axis] = doubles(attitude), -5.0
        after = quadrotor().push(state, NONE)
        gained = float(after.velocity[0, axis]) + 5.0
        assert gained == pytest.approx(0.003 * 1.225 * area * 25.0, abs=1e-6)


def test_rotors_spin_up_and_down_like_a_filter_of_first_order():
    drone = quadrotor(rotor_time_constant=0.05)
    up = drone.push(falling(), doubles((1.0, 0.5, 0.0, 0.2)), 20)
    gained = 1 - math.exp(-20 * 0.003 / 0.05)
    np.testing.assert_allclose(up.rotors[0], np.array([1, 0.5, 0, 0.2]) * gained, rtol=1e-6)
    down = drone.push(up, NONE, 20)
    np.testing.assert_allclose(down.rotors[0], up.rotors[0] * math.exp(-1.2), rtol=1e-5)


def test_thrust_is_along_the_bodys_z():
    """Pitched by 30 degrees, nose down: half of it pushes forward; rolled right: to the right."""
    whole, angle = 4 * THRUST, math.radians(15)
    for attitude, axis, sign in (
        ((math.cos(angle), 0, math.sin(angle), 0), 0, 1),
        ((math.cos(angle), math.sin(angle), 0, 0), 1, -1),
    ):
        state = falling()
        state.attitude[:] = doubles(attitude)
        gained = quadrotor(**AT_ONCE, **VACUUM).push(state, doubles((1.0,) * 4)).velocity[0]
        expected = np.array([0, 0, whole * math.cos(2 * angle) - GRAVITY])
        expected[axis] = sign * whole * 0.5
        np.testing.assert_allclose(gained, 0.003 * expected, atol=2e-6)


@pytest.mark.parametrize(
    ("shares", "torque"),
    [
        ((0.0, 0.1, 0.1, 0.0), (0.2 * LEVER, 0, 0)),  # both at the left: it rolls to the right
        ((0.1, 0.0, 0.0, 0.1), (-0.2 * LEVER, 0, 0)),
        ((0.0, 0.1, 0.0, 0.1), (0, 0.2 * LEVER, 0)),  # both in the rear: the nose goes down
        ((0.1, 0.0, 0.1, 0.0), (0, -0.2 * LEVER, 0)),
        ((0.0, 0.0, 0.1, 0.1), (0, 0, 0.2 * TWIST)),  # both that turn clockwise: to the left
        ((0.1, 0.1, 0.0, 0.0), (0, 0, -0.2 * TWIST)),
        ((0.1, 0.0, 0.0, 0.0), (-0.1 * LEVER, -0.1 * LEVER, -0.1 * TWIST)),
    ],
)
def test_each_rotor_turns_the_body_by_its_place_and_its_spin(shares, torque):
    after = quadrotor(**AT_ONCE).push(falling(), doubles(shares))
    gained = 0.003 * np.array(torque) / (0.00672, 0.00804, 0.01428)
    np.testing.assert_allclose(after.angular_velocity[0], gained, rtol=1e-5, atol=1e-8)


def test_a_constant_torque_turns_faster_and_faster():
    """The rate grows with time, the angle with its square."""
    drone = quadrotor(**AT_ONCE, **VACUUM)
    after = drone.push(falling(), doubles((0.0, 0.005, 0.005, 0.0)), 100)
    rate = 0.3 * 0.01 * LEVER / 0.00672
    assert float(after.angular_velocity[0, 0]) == pytest.approx(rate, rel=1e-5)
    w, x = after.attitude[0, :2].tolist()
    assert 2 * math.atan2(x, w) == pytest.approx(rate * 0.3 / 2 * 1.01, rel=1e-5)


@pytest.mark.parametrize("axis", range(3))
def test_a_spin_about_a_principal_axis_stays(axis):
    rates = np.zeros(3)
    rates[axis] = 4.0
    after = quadrotor(**VACUUM).push(falling(rates=tuple(rates)), NONE, 1000)
    np.testing.assert_allclose(after.angular_velocity[0], rates, atol=1e-6)
    np.testing.assert_allclose(matrix(after.attitude[0]), rotation(rates * 3.0), atol=2e-5)


def test_a_symmetric_body_nutates_as_euler_says():
    """(I3 - I1) / I1 of the spin: half of 2 rad/s, so a quarter turn in 1.5708 s."""
    drone = quadrotor(inertia=(0.01, 0.01, 0.015), tick=0.0005, **VACUUM)
    after = drone.push(falling(rates=(0.1, 0.0, 2.0)), NONE, 3142)
    np.testing.assert_allclose(after.angular_velocity[0], (0.0, 0.1, 2.0), atol=2e-4)


def test_spin_keeps_its_momentum_and_energy():
    """About no axis of symmetry, for 3 s, within what a tick of 0.5 ms costs."""
    inertia = np.array([0.00672, 0.00804, 0.01428])
    drone, state = quadrotor(tick=0.0005, **VACUUM), falling(rates=(2.0, -1.0, 1.5))

    def of(state):
        rates = state.angular_velocity[0].numpy()
        return matrix(state.attitude[0]) @ (inertia * rates), 0.5 * rates @ (inertia * rates)

    (before, energy), (after, left) = of(state), of(drone.push(state, NONE, 6000))
    np.testing.assert_allclose(after, before, atol=0.01 * np.linalg.norm(before))
    assert left == pytest.approx(energy, rel=0.01)


def test_attitudes_stay_of_length_one():
    rates = torch.tensor(np.random.default_rng(0).normal(size=(20, 3)) * 5)
    state = falling()
    state = type(state)(state.numbers.repeat(20, 1))
    state.angular_velocity[:] = rates
    states = trajectory(quadrotor(), state, rotor_goals(torch.full((20, 4), 0.2).double()), 990, 33)
    lengths = torch.stack([s.attitude.norm(dim=-1) for s in states])
    assert float((lengths - 1).abs().max()) < 1e-6


MASS, ARM, MOST, RATIO = 0.0319, 0.03253, 0.12, 0.00735
INERTIA = np.diag((16.8e-6, 16.8e-6, 29.8e-6))
CURVE = np.array([0.0, -5.382196214637237e-7, 2.4582929831265485e-10])


def theirs(models, attitude, velocity, rates, speeds):
    """Accelerations, metres and radians a second squared. Shapes: (count, 3) both."""
    mixing = np.array([[-1, -1, 1, 1], [-1, 1, 1, -1], [-1, 1, -1, 1]], float)
    _, _, linear, angular, _ = models.dynamics(
        np.zeros_like(velocity),
        attitude[:, [1, 2, 3, 0]],
        velocity,
        rates,
        speeds,
        mass=MASS,
        L=ARM,
        prop_inertia=0.0,
        gravity_vec=np.array([0.0, 0.0, -9.81]),
        J=INERTIA,
        J_inv=np.linalg.inv(INERTIA),
        rpm2thrust=CURVE,
        rpm2torque=CURVE * RATIO,
        mixing_matrix=mixing,
        drag_matrix=np.zeros((3, 3)),
        rotor_dyn_coef=np.ones(4),
    )
    return linear, angular


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_rotors_accelerate_a_crazyflie_as_they_do_there():
    """Beside the package drone-models. Drag, which is linear there, is left out, as is what this
    drone has not: the spin of its propellers, and curves of their torques of their own."""
    models = pytest.importorskip(
        "drone_models.first_principles", reason="needs drone-models", exc_type=ImportError
    )
    source, count = np.random.default_rng(0), 50
    drone = quadrotor(
        mass=MASS,
        inertia=tuple(np.diag(INERTIA).tolist()),
        arm_length=ARM * 2**0.5,
        rotor_thrust=MOST,
        rotor_torque=MOST * RATIO,
        rotor_time_constant=0.0,
        air_density=0.0,
    )
    state = hovering(drone, count=count)
    attitude, speeds = source.normal(size=(count, 4)), source.uniform(5000, 23000, (count, 4))
    attitude /= np.linalg.norm(attitude, axis=1, keepdims=True)
    velocity, rates = source.normal(size=(2, count, 3))
    state.attitude[:], state.velocity[:] = doubles(*attitude), doubles(*velocity)
    state.angular_velocity[:] = doubles(*rates)
    shares = (CURVE[1] * speeds + CURVE[2] * speeds**2) / MOST
    ours = [0, 2, 3, 1]  # theirs: front right, rear right, rear left, front left
    after = drone.push(state, torch.tensor(shares[:, ours]))
    linear, angular = theirs(models, attitude, velocity, rates, speeds)
    tick = drone.settings.tick
    np.testing.assert_allclose((after.velocity - state.velocity) / tick, linear, atol=2e-3)
    turned = (after.angular_velocity - state.angular_velocity) / tick
    np.testing.assert_allclose(turned, angular, rtol=1e-4, atol=1e-2)
