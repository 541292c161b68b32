"""Each controller separately, as a function of the control error."""

import math

import numpy as np
import pytest
import warp as wp

from drone_rl.sim.dynamics import control_kernel
from drone_rl.sim.dynamics.control_kernel import mix, turned
from drone_rl.sim.dynamics.rigid_body_kernel import Airframe
from tests.flying import frame

PARTS = {"position": 3, "velocity": 2, "climb": 1, "memory": 1, "attitude": 3, "rate": 3, "mix": 4}
ENDS = np.cumsum([0, *PARTS.values()])


@wp.kernel(enable_backward=False)
def control(drone: Airframe, given: wp.array[wp.vec4], found: wp.array2d[float]):
    i = wp.tid()
    three = wp.vec3(given[i][0], given[i][1], given[i][2])
    position = control_kernel.position_control(drone, three)
    velocity = control_kernel.velocity_control(drone, wp.vec2(three[0], three[1]))
    attitude = control_kernel.attitude_control(drone, three)
    rate = control_kernel.rate_control(drone, three)
    mixed = mix(given[i][3], three)
    for k in range(3):
        found[i, k] = position[k]
        found[i, 7 + k] = attitude[k]
        found[i, 10 + k] = rate[k]
    found[i, 3] = velocity[0]
    found[i, 4] = velocity[1]
    found[i, 5] = control_kernel.climb_control(drone, three[0], three[1])
    found[i, 6] = control_kernel.climb_memory(drone, three[0], three[1])
    for k in range(4):
        found[i, 13 + k] = mixed[k]
    found[i, 17] = turned(three[0])


def controlled(part, *rows, **changes):
    given = np.zeros((len(rows), 4), np.float32)
    for row, values in zip(given, rows, strict=True):
        row[: len(values)] = values
    found = wp.zeros((len(rows), 18), dtype=float, device="cpu")
    drone = frame(**changes)
    inputs = [drone, wp.array(given, dtype=wp.vec4, device="cpu"), found]
    wp.launch(control, len(rows), inputs=inputs, device="cpu")
    first = 17 if part == "turned" else ENDS[list(PARTS).index(part)]
    return found.numpy()[:, first : first + PARTS.get(part, 1)].squeeze()


def test_position_controller_sets_velocity():
    """The gains are 1.5 and 1 m/s per meter up to the limits of 6 m/s and, for climb, 4 m/s."""
    found = controlled("position", (1.0, -2.0, 3.0), (100.0, -100.0, -100.0), (0.0, 0.0, 0.0))
    np.testing.assert_allclose(found[0], (1.5, -3.0, 3.0))
    np.testing.assert_allclose(found[1], (6.0, -6.0, -4.0))
    np.testing.assert_array_equal(found[2], 0.0)


def test_velocity_controller_sets_pitch_and_roll():
    """Forward needs a positive pitch (nose down); left needs a negative roll."""
    found = controlled("velocity", (1.0, 0.0), (0.0, 2.0), (-50.0, -50.0))
    most = math.pi / 5.5
    np.testing.assert_allclose(found[0], (0.0, 0.2 * most), rtol=1e-6)
    np.testing.assert_allclose(found[1], (-0.4 * most, 0.0), rtol=1e-6)
    np.testing.assert_allclose(found[2], (most, -most), rtol=1e-6)


def test_climb_controller_sets_thrust_around_one_half():
    found = controlled("climb", (0.0, 0.0), (0.1, 0.0), (0.1, 0.2), (-9.0, 0.5), (9.0, 0.0))
    np.testing.assert_allclose(found, (0.5, 0.6, 0.7, 0.0, 1.0), rtol=1e-6)


def test_climb_integral_is_limited():
    """0.5 m/s for 3 ms with a gain of 2 gives 0.003."""
    found = controlled("memory", (0.5, 0.1), (-0.5, 0.1), (500.0, 0.1), (-500.0, 0.1))
    np.testing.assert_allclose(found, (0.103, 0.097, 1.0, -1.0), rtol=1e-6)


def test_attitude_controller_sets_rates():
    """The limit of 2.5 rad/s is reached at 0.4 rad."""
    found = controlled("attitude", (0.1, -0.2, 0.3), (1.0, -1.0, 3.0))
    np.testing.assert_allclose(found[0], (0.625, -1.25, 1.875), rtol=1e-6)
    np.testing.assert_allclose(found[1], (2.5, -2.5, 2.5))
    gains = {"angle_gain": (1.0, 2.0, 3.0), "rate_limit": (1.0, 10.0, 100.0)}
    np.testing.assert_allclose(
        controlled("attitude", (0.1, 0.1, 0.1), **gains), (0.1, 2.0, 30.0), rtol=1e-6
    )


def test_rate_controller_sets_torques():
    found = controlled("rate", (1.0, -2.0, 3.0), (9.0, -9.0, 9.0))
    np.testing.assert_allclose(found[0], (0.25, -0.5, 0.75))
    np.testing.assert_allclose(found[1], (1.0, -1.0, 1.0))
    gains = controlled("rate", (1.0, 1.0, 1.0), rate_gain=(0.1, 0.2, 0.3))
    np.testing.assert_allclose(gains, (0.1, 0.2, 0.3), rtol=1e-6)


def test_outputs_reach_but_do_not_exceed_limits():
    rows = np.random.default_rng(0).normal(size=(1000, 4)) * 10.0 ** np.arange(-1, 3)[
        :, None
    ].repeat(250, 0).reshape(1000, 1)
    most = {"position": (6.0, 6.0, 4.0), "velocity": math.pi / 5.5, "attitude": 2.5, "rate": 1.0}
    for part, limit in most.items():
        assert (np.abs(controlled(part, *rows)) <= np.asarray(limit) * (1 + 1e-6)).all()
        assert (np.abs(controlled(part, *rows)) >= np.asarray(limit) * (1 - 1e-6)).any()
    assert controlled("climb", *rows).min() >= 0 and controlled("climb", *rows).max() <= 1
    assert np.abs(controlled("memory", *rows)).max() <= 1
    mixed = controlled("mix", *rows)
    assert mixed.min() >= 0.0 and mixed.max() <= 1.0


def test_mixer_assigns_torques_to_rotors():
    """Rotors: front right, rear left, front left, rear right."""
    throttle = 0.5
    found = controlled("mix", (0.1, 0, 0, throttle), (0, 0.1, 0, throttle), (0, 0, 0.1, throttle))
    np.testing.assert_allclose(found[0], (0.4, 0.6, 0.6, 0.4), rtol=1e-6)
    np.testing.assert_allclose(found[1], (0.4, 0.6, 0.4, 0.6), rtol=1e-6)
    np.testing.assert_allclose(found[2], (0.4, 0.4, 0.6, 0.6), rtol=1e-6)
    both = controlled("mix", (0.01, 0.02, 0.04, throttle))
    np.testing.assert_allclose(both, (0.43, 0.49, 0.53, 0.55), rtol=1e-6)


def test_mixer_raises_negative_thrust_to_zero():
    """Torque without thrust adds thrust."""
    np.testing.assert_allclose(controlled("mix", (0.2, 0, 0, 0)), (0, 0.4, 0.4, 0), atol=1e-7)
    np.testing.assert_allclose(controlled("mix", (0.2, 0, 0, 0.1)), (0, 0.4, 0.4, 0), atol=1e-7)


def test_mixer_scales_excess_thrust():
    """Full thrust and a torque give 0.8 and 1.2, which are divided by 1.2."""
    np.testing.assert_allclose(
        controlled("mix", (0.2, 0, 0, 1.0)), (2 / 3, 1.0, 1.0, 2 / 3), rtol=1e-6
    )
    found = controlled("mix", (1.0, 1.0, 1.0, 0.5))  # -2.5, 1.5, 1.5, 1.5 are shifted to 0 and 4
    np.testing.assert_allclose(found, (0.0, 1.0, 1.0, 1.0), atol=1e-6)


@pytest.mark.parametrize(
    ("angle", "same"),
    [(1.0, 1.0), (4.0, 4.0 - 2 * math.pi), (-4.0, 2 * math.pi - 4.0), (20.0, 20.0 - 6 * math.pi)],
)
def test_angles_are_wrapped(angle, same):
    assert controlled("turned", (angle,)) == pytest.approx(same, abs=2e-6)
