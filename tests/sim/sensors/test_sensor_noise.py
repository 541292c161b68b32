import pytest
import torch

from drone_rl.sim.sensors.sensor import gauss_markov_step, normal, random_walk_step


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


def test_zero_time_step_changes_nothing():
    value = torch.tensor([[1.0], [2.0]], dtype=torch.float64)
    still = torch.zeros(2, dtype=torch.float64)
    assert torch.equal(random_walk_step(value, 1.0, 1.0, still, generator()), value)
    assert torch.equal(gauss_markov_step(value, 1.0, 1.0, still, generator()), value)
