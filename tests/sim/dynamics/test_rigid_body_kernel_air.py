"""Wind carries, gusts wander as their spectrum says."""

import numpy as np
import pytest
import torch

from tests.flying import POSITIONS, doubles, falling, hovering, make_goals, quadrotor, trajectory

NONE = doubles((0.0, 0.0, 0.0, 0.0))


def gusts(count=1000, ticks=4000, every=20, *, seeds=None, **changes):
    """Velocities of the air around drones that hover. Shape: (times, drones, axes)."""
    drone = quadrotor(gusts=2.0, **changes)
    seeds = torch.arange(count) if seeds is None else seeds
    state = hovering(drone, count=count, seeds=seeds, height=1000.0)
    states = trajectory(
        drone, state, make_goals(POSITIONS, 0, 0, 0, 1000.0, count=count), ticks, every
    )
    return torch.stack([s.gust for s in states]).numpy()


def test_what_floats_goes_with_the_wind():
    """A hundred square metres on a kilogram: after 3 s it goes with the wind, and down a little."""
    wind = (3.0, -4.0, 0.5)
    drone = quadrotor(wind=wind, drag_area=(3.0, 3.0, 3.0))
    after = drone.push(falling(1000.0), NONE, 1000).velocity[0]
    sinking = (9.81 / (1.225 * 3.0)) ** 0.5
    np.testing.assert_allclose(after, (3.0, -4.0, 0.5 - sinking), atol=0.2)


def test_a_drone_hovers_in_wind_a_little_beside_its_place():
    """The push of the wind, 1.225 * 0.00538 * 25 N, is met by a tilt, and that by a distance."""
    drone = quadrotor(wind=(5.0, 0.0, 0.0))
    after = drone.fly(hovering(drone), make_goals(POSITIONS, 0, 0, 0, 100.0), 6000)
    away = float(after.position[0, 0])
    tilt = 1.225 * 0.00538 * 25 / 9.81
    expected = tilt / (np.pi / 5.5 * 0.2 * 6.0 * 0.25)
    assert away == pytest.approx(expected, rel=0.02) and away < 0.3
    assert after.velocity.abs().max() < 1e-3


def test_gusts_have_the_strength_and_the_length_that_are_told():
    """In wind of 5 m/s, 20 m are gone through in 4 s: after these 1 / e of a gust is left."""
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


def test_a_seed_is_a_gust_and_another_is_another():
    one, again, other = (gusts(1, 300, seeds=torch.tensor([seed])) for seed in (7, 7, 8))
    np.testing.assert_array_equal(one, again)
    assert np.abs(one[1:] - other[1:]).min() > 0.0
    first, second = gusts(2, 3000, 3, seeds=torch.tensor([0, 1])).transpose(1, 0, 2)
    steps = np.diff(first, axis=0).ravel(), np.diff(second, axis=0).ravel()
    assert abs(np.corrcoef(*steps)[0, 1]) < 0.05


def test_gusts_do_not_depend_on_how_time_is_cut_into_commands():
    """But for the rounding of the drone's own motion between commands."""
    whole, cut = (gusts(4, 300, every)[-1] for every in (300, 3))
    np.testing.assert_allclose(cut, whole, atol=1e-4)


def test_without_gusts_the_air_is_even():
    drone = quadrotor(wind=(5.0, 0.0, 0.0))
    assert not drone.is_random and not drone.push(falling(), NONE, 100).gust.any()
    assert quadrotor(gusts=0.5).is_random
