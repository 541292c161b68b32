"""Sampling at a rate with latency, and noise processes."""

import math

import pytest
import torch

from drone_rl.sim.sensors.sensor import Sampling, gauss_markov_step, normal, random_walk_step

TICK = 0.003


def clock(ticks, start=0.0):
    """Yield times summed tick by tick, as the physics does."""
    time = torch.tensor([start], dtype=torch.float64)
    for _ in range(ticks + 1):
        yield time.clone()
        time += TICK


def follow(sampling, ticks):
    """Yield time, number and time of samples, and reading at each tick; a reading is its time."""
    samples = sampling.start(torch.zeros(1, dtype=torch.float64), 1)
    for time in clock(ticks):
        samples = sampling.take(samples, time, time[:, None])
        taken, row = sampling.read(samples, time)
        yield time.item(), int(samples.count), taken.item(), row.item()


def test_reading_rate_does_not_depend_on_ticks():
    """50 Hz for 3 s gives 151 readings, each at the first tick after its due time."""
    seen = list(follow(Sampling(rate=50.0), 1000))
    assert seen[-1][1] == 151
    times = sorted({taken for _, _, taken, _ in seen})
    marks = [math.ceil(k * 20 / 3) * TICK for k in range(151)]
    assert times == pytest.approx(marks, abs=1e-9)


def test_delayed_readings_appear_after_their_latency():
    """A reading of each 3 ms tick is returned 200 ms later, at the 67th tick (201 ms)."""
    for time, _, taken, row in follow(Sampling(rate=1000.0, latency=0.2), 300):
        tick = round(time / TICK)
        if tick < 67:
            assert (taken, row) == (-math.inf, 0.0)
        else:
            assert taken == row == pytest.approx((tick - 67) * TICK, abs=1e-9)


def test_first_reading_follows_the_startup():
    readings = [
        (round(time, 3), round(taken, 3))
        for time, _, taken, _ in follow(Sampling(rate=10.0, startup=0.3, latency=0.03), 200)
        if taken > -math.inf
    ]
    assert readings[0] == (0.33, 0.3)
    assert sorted({taken for _, taken in readings}) == [0.3, 0.402, 0.501]


def test_due_reading_is_not_missed_because_of_rounding():
    sampling = Sampling(rate=10.0, latency=0.1)
    samples = sampling.start(torch.zeros(1, dtype=torch.float64), 1)
    time = torch.zeros(1, dtype=torch.float64)
    for step in range(100):
        samples = sampling.take(samples, time, time[:, None])
        assert samples.count.item() == step + 1
        assert sampling.read(samples, time)[0].item() == pytest.approx(
            (step - 1) * 0.1 if step else -math.inf
        )
        time = time + 0.1


def test_each_drone_has_its_own_clock():
    sampling = Sampling(rate=10.0)
    begin = torch.tensor([0.0, 5.0], dtype=torch.float64)
    samples = sampling.start(begin, 1)
    assert sampling.due(samples, begin).tolist() == [True, True]
    samples = sampling.take(samples, begin, begin[:, None])
    later = torch.tensor([0.1, 5.05], dtype=torch.float64)
    assert sampling.due(samples, later).tolist() == [True, False]
    before = samples.rows.clone()
    after = sampling.take(samples, later, later[:, None])
    assert torch.equal(samples.rows, before)
    assert sampling.read(after, later)[0].tolist() == [0.1, 5.0]
    after[torch.tensor([0])] = sampling.start(torch.tensor([7.0], dtype=torch.float64), 1)
    assert sampling.read(after, torch.tensor([7.0, 5.05]).double())[0].tolist() == [-math.inf, 5.0]


def generator():
    return torch.Generator().manual_seed(3)


def test_white_noise_has_mean_0_and_deviation_1():
    drawn = normal(torch.zeros(10_000, 2, dtype=torch.float64), generator())
    assert drawn.dtype == torch.float64
    assert abs(drawn.mean().item()) < 0.03 and drawn.std().item() == pytest.approx(1.0, abs=0.02)
    again = normal(torch.zeros(10_000, 2, dtype=torch.float64), generator())
    assert torch.equal(drawn, again)


@pytest.mark.parametrize("steps", [1, 40])
def test_random_walk_does_not_depend_on_the_step_size(steps):
    """The deviation is 2 after 5 s, and twice that after 20 s."""
    value, stream = torch.zeros(20_000, 1, dtype=torch.float64), generator()
    seconds = torch.full((20_000,), 20.0 / steps, dtype=torch.float64)
    for _ in range(steps):
        value = random_walk_step(value, 2.0, 5.0, seconds, stream)
    assert value.std().item() == pytest.approx(4.0, rel=0.02)


@pytest.mark.parametrize("steps", [1, 40])
def test_gauss_markov_process_does_not_depend_on_the_step_size(steps):
    """After one time constant, 37% of the initial 3 and 1 - e^-2 of the variance remain."""
    value, stream = torch.full((20_000, 1), 3.0, dtype=torch.float64), generator()
    seconds = torch.full((20_000,), 60.0 / steps, dtype=torch.float64)
    for _ in range(steps):
        value = gauss_markov_step(value, 0.5, 60.0, seconds, stream)
    assert value.mean().item() == pytest.approx(3.0 * 0.36788, abs=0.02)
    assert value.std().item() == pytest.approx(0.5 * 0.92987, rel=0.02)
