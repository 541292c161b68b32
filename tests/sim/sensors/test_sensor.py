"""Sampling at a rate with latency, and noise processes."""

import dataclasses
import math

import pytest
import torch

from drone_rl.sim.sensors.sensor import Sensor, gauss_markov_step, normal, random_walk_step

TICK = 0.003


@dataclasses.dataclass
class Clock:
    """A reading that is its time."""

    time: float = -math.inf


class Stamped(Sensor[Clock]):
    def _sample(self, body, time):
        return Clock(time)


def follow(ticks, **choice):
    """Return the reading at each tick."""
    sensor, time, readings = Stamped(Clock(), **choice), 0.0, []
    for _ in range(ticks + 1):
        sensor.update(None, time)
        readings.append(sensor.read().time)
        time += TICK
    return readings


def test_reading_rate_does_not_depend_on_ticks():
    """50 Hz for 3 s gives 151 readings, each at the first tick after its due time."""
    times = sorted(set(follow(1000, rate=50.0)))
    assert times == pytest.approx([math.ceil(k * 20 / 3) * TICK for k in range(151)], abs=1e-9)


def test_delayed_readings_appear_after_their_latency():
    """A reading of each 3 ms tick is returned 200 ms later, at the 67th tick (201 ms)."""
    readings = follow(300, rate=1000.0, latency=0.2)
    assert readings[:67] == [-math.inf] * 67
    assert readings[67:] == pytest.approx([tick * TICK for tick in range(234)], abs=1e-9)


def test_first_reading_follows_the_startup():
    readings = [round(time, 3) for time in follow(200, rate=10.0, startup=0.3, latency=0.03)]
    assert readings.index(0.3) == 110  # at 0.33 s
    assert sorted(set(readings)) == [-math.inf, 0.3, 0.402, 0.501]


def test_due_reading_is_not_missed_because_of_rounding():
    sensor, time = Stamped(Clock(), 10.0, latency=0.1), 0.0
    for step in range(100):
        sensor.update(None, time)
        assert sensor.read().time == pytest.approx((step - 1) * 0.1 if step else -math.inf)
        time += 0.1


def generator():
    return torch.Generator().manual_seed(3)


def test_white_noise_has_mean_0_and_deviation_1():
    drawn = normal(torch.zeros(10_000, 2, dtype=torch.float64), generator())
    assert drawn.dtype == torch.float64
    assert abs(drawn.mean().item()) < 0.03 and drawn.std().item() == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("steps", [1, 40])
def test_noise_processes_do_not_depend_on_the_step_size(steps):
    """The walk's deviation is 2 after 5 s, and twice that after 20 s. Of the other process 37% of
    the initial 3 and 1 - e^-2 of the variance remain after one time constant.
    """
    stream = generator()
    walk = torch.zeros(20_000, dtype=torch.float64)
    kept = torch.full_like(walk, 3.0)
    for _ in range(steps):
        walk = random_walk_step(walk, 2.0, 5.0, 20.0 / steps, stream)
        kept = gauss_markov_step(kept, 0.5, 60.0, 60.0 / steps, stream)
    assert walk.std().item() == pytest.approx(4.0, rel=0.02)
    assert kept.mean().item() == pytest.approx(3.0 * 0.36788, abs=0.02)
    assert kept.std().item() == pytest.approx(0.5 * 0.92987, rel=0.02)
