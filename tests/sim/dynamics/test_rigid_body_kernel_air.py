"""Wind moves bodies, and gusts follow their spectrum."""

import numpy as np
import pytest
import torch

from tests.flying import POSITIONS, doubles, falling, hovering, make_goals, quadrotor, trajectory

NONE = doubles((0.0, 0.0, 0.0, 0.0))


def gusts(count=1000, ticks=4000, every=20, *, seeds=None, **changes):
    """Return air velocities at hovering drones. Shape: (times, drones, axes)."""
    drone = quadrotor(gusts=2.0, **changes)
    seeds = torch.arange(count) if seeds is None else seeds
    state = hovering(drone, count=count, seeds=seeds, height=1000.0)
    states = trajectory(
        drone, state, make_goals(POSITIONS, 0, 0, 0, 1000.0, count=count), ticks, every
    )
    return torch.stack([s.gust for s in states]).numpy()


def test_light_body_drifts_with_the_wind():
    """100 m2 and 1 kg: after 3 s it moves with the wind and sinks slowly."""
    wind = (3.0, -4.0, 0.5)
    drone = quadrotor(wind=wind, drag_area=(3.0, 3.0, 3.0))
    after = drone.push(falling(1000.0), NONE, 1000).velocity[0]
    sinking = (9.81 / (1.225 * 3.0)) ** 0.5
    np.testing.assert_allclose(after, (3.0, -4.0, 0.5 - sinking), atol=0.2)


def test_wind_causes_a_steady_position_error():
    """The wind force, 1.225 * 0.00538 * 25 N, needs a tilt, and that a position error."""
    drone = quadrotor(wind=(5.0, 0.0, 0.0))
    after = drone.fly(hovering(drone), make_goals(POSITIONS, 0, 0, 0, 100.0), 6000)
    away = float(after.position[0, 0])
    tilt = 1.225 * 0.00538 * 25 / 9.81
    expected = tilt / (np.pi / 5.5 * 0.2 * 6.0 * 0.25)
    assert away == pytest.approx(expected, rel=0.02) and away < 0.3
    assert after.velocity.abs().max() < 1e-3


def test_gusts_have_the_configured_strength_and_length():
    """At 5 m/s, the length of 20 m is 4 s, after which the correlation is 1 / e."""
    found = gusts(gust_length=20.0, wind=(5.0, 0.0, 0.0))[100:]
    assert found.std() == pytest.approx(2.0, rel=0.05)
    assert np.abs(found.mean((0, 1))).max() < 0.2
    seconds = 0.06
    for later in (10, 20, 40):
        alike = (found[later:] * found[:-later]).mean() / 4.0
        expected = np.exp(-later * seconds * 5.0 / 20.0)
        assert alike == pytest.approx(expected, abs=0.03)
    crossed = np.corrcoef(found.reshape(-1, 3).T)
    assert np.abs(crossed - np.eye(3)).max() < 0.05


def test_seed_determines_gusts():
    one, again, other = (gusts(1, 300, seeds=torch.tensor([seed])) for seed in (7, 7, 8))
    np.testing.assert_array_equal(one, again)
    assert np.abs(one[1:] - other[1:]).min() > 0.0
    first, second = gusts(2, 3000, 3, seeds=torch.tensor([0, 1])).transpose(1, 0, 2)
    steps = np.diff(first, axis=0).ravel(), np.diff(second, axis=0).ravel()
    assert abs(np.corrcoef(*steps)[0, 1]) < 0.05


def test_gusts_do_not_depend_on_the_command_length():
    """They agree up to rounding of the motion between commands."""
    whole, cut = (gusts(4, 300, every)[-1] for every in (300, 3))
    np.testing.assert_allclose(cut, whole, atol=1e-4)


def test_air_is_uniform_without_gusts():
    drone = quadrotor(wind=(5.0, 0.0, 0.0))
    assert not drone.is_random and not drone.push(falling(), NONE, 100).gust.any()
    assert quadrotor(gusts=0.5).is_random
