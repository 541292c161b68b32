import copy
import math

import pytest
import torch
from torch.distributions import Independent, Normal, TransformedDistribution
from torch.distributions.transforms import TanhTransform

from drone_rl.policies.actor import MAX_ACTION, RandomSource, SquashedNormal
from drone_rl.sim.continuous_actions import normal_of

OUTPUTS = torch.tensor(
    [[0.0, 0.4, -2.0, 0.0, 1.0, -1.0], [9.0, -9.0, 1.0, 5.0, 9.0, -9.0]], dtype=torch.float64
)


def torchs(outputs):
    mean, deviation = normal_of(outputs)
    squash = [TanhTransform(cache_size=1)]
    return Independent(TransformedDistribution(Normal(mean, deviation), squash), 1)


def test_density_matches_hand_computed_value():
    """With mean 0, deviation exp(-0.5), at tanh(1): log N(1; 0, exp(-1)) - log(1 - tanh(1)^2)."""
    value = math.tanh(1.0)
    by_hand = -0.5 * math.e + 0.5 - 0.5 * math.log(2 * math.pi) - math.log(1 - value**2)
    one = SquashedNormal(torch.zeros(2, dtype=torch.float64))
    assert one.log_prob(torch.tensor([value], dtype=torch.float64)).item() == pytest.approx(by_hand)
    three = SquashedNormal(torch.zeros(6, dtype=torch.float64))
    there = three.log_prob(torch.full((3,), value, dtype=torch.float64))
    assert there.item() == pytest.approx(3 * by_hand)


def test_density_equals_torchs_transformed_distribution():
    values = torch.tensor([[0.0, 0.5, -0.9], [0.999, -0.9999, 0.3]], dtype=torch.float64)
    expected = torchs(OUTPUTS).log_prob(values)
    torch.testing.assert_close(SquashedNormal(OUTPUTS).log_prob(values), expected)
    single = SquashedNormal(OUTPUTS.float()).log_prob(values.float())
    torch.testing.assert_close(single.double(), expected, rtol=2e-3, atol=1e-3)


def test_log_prob_is_finite_at_the_bounds():
    given = SquashedNormal(OUTPUTS.float().requires_grad_())
    for bound in (-1.0, 1.0):
        density = given.log_prob(torch.full((2, 3), bound))
        assert torch.equal(density, given.log_prob(torch.full((2, 3), bound * MAX_ACTION)))
        assert torch.isfinite(density).all()
    far = SquashedNormal(torch.full((10_000, 6), 50.0)).sample()
    assert far.abs().max() <= MAX_ACTION and far.dtype == torch.float32


def test_gradients_equal_the_analytic_ones():
    """At outputs of 0: d log p / d mean = (u - m) / s^2; d log p / d log s = z^2 - 1, times 5 / 12.

    log s ranges from -3 to 0 and is -0.5 at 0: a sigmoid of 5/6 with slope 3 * 5/6 * 1/6.
    """
    outputs = torch.zeros(2, dtype=torch.float64, requires_grad=True)
    SquashedNormal(outputs).log_prob(torch.tensor([0.5], dtype=torch.float64).tanh()).backward()
    expected = [0.5 * math.e, (0.25 * math.e - 1) * 5 / 12]
    assert outputs.grad is not None
    assert outputs.grad.tolist() == pytest.approx(expected)
    free = OUTPUTS.clone().requires_grad_()
    value = torch.tensor([[0.1, -0.5, 0.9]] * 2, dtype=torch.float64)
    assert torch.autograd.gradcheck(lambda o: SquashedNormal(o).log_prob(value), free)
    assert torch.autograd.gradcheck(lambda o: SquashedNormal(o).entropy(), free)


def test_entropy_equals_the_mean_negative_log_density():
    generator = torch.Generator().manual_seed(0)
    given = SquashedNormal(OUTPUTS, RandomSource(generator))
    drawn = given.loc + given.scale * torch.randn(200_000, 2, 3, generator=generator).double()
    values = -torchs(OUTPUTS).log_prob(drawn.tanh().clamp(-1 + 1e-15, 1 - 1e-15))
    error = values.std(0) / 200_000**0.5
    assert ((values.mean(0) - given.entropy()).abs() < 4 * error + 1e-3).all()


def test_samples_use_an_own_stream_shared_by_copies():
    torch.manual_seed(0)
    before = torch.get_rng_state()
    source = RandomSource(torch.Generator().manual_seed(1))
    one = SquashedNormal(torch.zeros(50, 6), source).sample()
    two = SquashedNormal(torch.zeros(50, 6), copy.deepcopy(source)).sample()
    assert not torch.equal(one, two)
    same = SquashedNormal(torch.zeros(50, 6), RandomSource(torch.Generator().manual_seed(1)))
    assert torch.equal(same.sample(), one)
    assert torch.equal(torch.get_rng_state(), before)
    assert same.sample((7,)).shape == (7, 50, 3)
    assert (same.batch_shape, same.event_shape) == ((50,), (3,))
    assert SquashedNormal(torch.zeros(2, 50, 6)).batch_shape == (2, 50)
    assert torch.equal(SquashedNormal(torch.zeros(50, 6)).deterministic_sample, torch.zeros(50, 3))
