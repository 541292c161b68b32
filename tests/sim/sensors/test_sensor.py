import math

import pytest
import torch

from drone_rl.sim.sensors.sensor import Sampling

TICK = 0.003


def clock(ticks, start=0.0):
    """Times that are summed up tick by tick, as physics does."""
    time = torch.tensor([start], dtype=torch.float64)
    for _ in range(ticks + 1):
        yield time.clone()
        time += TICK


def follow(sampling, ticks):
    """At each tick: when, what was taken until then, and what is told, a reading being its time."""
    samples = sampling.start(torch.zeros(1, dtype=torch.float64), 1)
    for time in clock(ticks):
        samples = sampling.take(samples, time, time[:, None])
        taken, row = sampling.read(samples, time)
        yield time.item(), int(samples.count), taken.item(), row.item()


def test_readings_come_at_their_rate_whatever_the_ticks():
    """50 a second, 3 s: the first, and 150 more; each at the first tick from its mark on."""
    seen = list(follow(Sampling(rate=50.0), 1000))
    assert seen[-1][1] == 151
    times = sorted({taken for _, _, taken, _ in seen})
    marks = [math.ceil(k * 20 / 3) * TICK for k in range(151)]
    assert times == pytest.approx(marks, abs=1e-9)


def test_between_readings_the_last_one_is_held():
    held = [round(taken / TICK) for _, _, taken, _ in follow(Sampling(rate=50.0), 14)]
    assert held == [0] * 7 + [7] * 7 + [14]


def test_a_rate_above_the_ticks_gives_a_reading_a_tick():
    for time, count, taken, row in follow(Sampling(rate=1000.0), 100):
        assert taken == row == time
        assert count == round(time * 1000) + 1


def test_late_readings_are_told_when_they_are_old_enough():
    """Taken at each tick of 3 ms, told 200 ms later: at the 67th tick, which is 201 ms."""
    for time, _, taken, row in follow(Sampling(rate=1000.0, latency=0.2), 300):
        tick = round(time / TICK)
        if tick < 67:
            assert (taken, row) == (-math.inf, 0.0)
        else:
            assert taken == row == pytest.approx((tick - 67) * TICK, abs=1e-9)


def test_the_first_reading_is_taken_after_the_startup():
    told = [
        (round(time, 3), round(taken, 3))
        for time, _, taken, _ in follow(Sampling(rate=10.0, startup=0.3, latency=0.03), 200)
        if taken > -math.inf
    ]
    assert told[0] == (0.33, 0.3)
    assert sorted({taken for _, taken in told}) == [0.3, 0.402, 0.501]


def test_a_time_on_the_mark_is_not_missed_for_its_rounding():
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


def test_drones_have_clocks_of_their_own():
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
