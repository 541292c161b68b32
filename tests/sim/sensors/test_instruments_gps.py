import dataclasses
import math

import pytest
import torch

from drone_rl.config.sensors import GpsSettings
from drone_rl.sim.coordinates import HOME, world_from_geo
from drone_rl.sim.dynamics.state import BodyState
from drone_rl.sim.sensors.instruments import Fix, Gps

TICK = 0.003


def generator():
    return torch.Generator().manual_seed(13)


def flying(count=1, x=0.0):
    """Return drones that fly north at 2 m/s."""
    position = torch.zeros(count, 3, dtype=torch.float64)
    position[:, 0] = x
    body = BodyState.at_rest(position)
    velocity = torch.tensor([2.0, 0.0, 0.0], dtype=torch.float64).expand(count, 3)
    return dataclasses.replace(body, velocity=velocity)


def follow(settings, ticks):
    """Yield the readings of a drone that flies north at 2 m/s, tick by tick."""
    gps, time, stream = Gps(settings), torch.zeros(1, dtype=torch.float64), generator()
    state = gps.start(flying(), time, stream)
    yield 0.0, gps.read(state, time)
    for _ in range(ticks):
        time = time + TICK
        state = gps.update(state, flying(x=2 * time.item()), time, stream)
        yield time.item(), gps.read(state, time)


def test_first_reading_is_preceded_by_invalid_ones():
    (_, reading), *_ = follow(GpsSettings(), 0)
    assert (reading.is_valid.item(), reading.fix.item(), reading.time.item()) == (
        False,
        0,
        -math.inf,
    )


def test_readings_are_delayed_by_200_ms():
    """The first reading is taken at 1 s and returned at 1.2 s; then 50 follow per second.

    By 2.1 s, 45 readings up to 1.9 s are returned; the one due at 1.9 s is taken at 1.902 s.
    """
    times = []
    for time, reading in follow(GpsSettings(), 700):
        assert reading.is_valid.item() == (time > 1.2)
        if not reading.is_valid.item():
            continue
        age = time - reading.time.item()
        assert 0.2 - 1e-9 < age < 0.2 + 0.02 + TICK
        place = world_from_geo(reading.place)[0]
        assert place[0].item() == pytest.approx(2 * reading.time.item(), abs=1e-6)
        assert reading.velocity[0].tolist() == [2.0, 0.0, 0.0]
        times.append(reading.time.item())
    steps = torch.tensor(sorted(set(times))).diff()
    assert min(times) == pytest.approx(1.002)
    assert len(steps) == 44 and steps.mean().item() == pytest.approx(0.02, abs=1e-4)


def test_rate_of_ten_readings_per_second():
    settings = GpsSettings(rate=10.0, latency=0.0, startup=0.0)
    times = {round(reading.time.item(), 3) for _, reading in follow(settings, 400)}
    assert len(times) == 13


def test_estimated_error_decreases_until_a_fix():
    """0.1 + 99.9 exp(-t / 0.9): 4 m at 2.9189 s, 3 m at 3.1856 s, 0.1 m in the limit."""
    gps = Gps()
    seconds = torch.tensor([0.0, 0.9, 2.9189, 3.1856, 60.0], dtype=torch.float64)
    expected = torch.tensor([100.0, 0.1 + 99.9 * math.exp(-1), 4.0, 3.0, 0.1]).double()
    torch.testing.assert_close(gps.stated_error(seconds), expected, rtol=0.0, atol=2e-3)
    settings = GpsSettings(latency=0.0, rate=1000.0)
    fixes = [(reading.time.item(), reading.fix.item()) for _, reading in follow(settings, 1100)]
    firsts = {fix: min(time for time, found in fixes if found == fix) for fix in (2, 3)}
    assert firsts[Fix.TWO_D] == pytest.approx(2.9189, abs=0.0031)
    assert firsts[Fix.THREE_D] == pytest.approx(3.1856, abs=0.0031)


def test_positions_are_exact_up_to_the_noise():
    count = 20_000
    settings = GpsSettings(
        startup=0.0, latency=0.0, horizontal_noise=1.5, vertical_noise=4.0, velocity_noise=0.1
    )
    time = torch.zeros(count, dtype=torch.float64)
    gps = Gps(settings)
    reading = gps.read(gps.start(flying(count), time, generator()), time)
    deviation = world_from_geo(reading.place).std(0)
    assert deviation.tolist() == pytest.approx([1.5, 1.5, 4.0], rel=0.02)
    assert reading.velocity.std(0).tolist() == pytest.approx([0.1] * 3, rel=0.02)
    gps = Gps(settings.replace(noise=0.0))
    reading = gps.read(gps.start(flying(count), time, generator()), time)
    assert (reading.place == torch.tensor(HOME, dtype=torch.float64)).all()
