import itertools

import pytest
import torch

from drone_rl.trust.perturbations import DRIFT, Mode, reflect, variations


def first(mode, steps, count=1000, dimensions=(1, 2)):
    generator = torch.Generator().manual_seed(0)
    return [*itertools.islice(variations(mode, dimensions, count, generator), steps)]


@pytest.mark.parametrize("mode", [Mode.CONSTANT, Mode.ONSET])
def test_what_is_constant_is_extreme_and_stays(mode):
    one, two = first(mode, 2)
    assert [part.shape for part in one] == [(1000, 1), (1000, 2)]
    assert all(torch.equal(a, b) for a, b in zip(one, two, strict=True))
    ways = torch.cat(one, -1)
    assert set(ways.unique().tolist()) == {-1.0, 1.0}
    assert abs(ways.mean()) < 0.1  # half of the worlds either way


def test_what_drifts_begins_with_no_difference_and_stays_within_the_strength():
    walk = torch.stack([part[1] for part in first(Mode.DRIFTING, 400, 300)])
    assert walk[0].abs().max() == 0
    assert walk.abs().max() <= 1
    assert (walk[1] - walk[0]).std() == pytest.approx(DRIFT, rel=0.1)
    assert walk[-1].std() == pytest.approx(3**-0.5, rel=0.1)  # anywhere alike, in the end


def test_mirrors():
    away = torch.tensor([0.3, 1.0, 1.2, -1.3, 3.0, -5.0])
    torch.testing.assert_close(reflect(away), torch.tensor([0.3, 1.0, 0.8, -0.7, -1.0, -1.0]))


def test_worlds_go_the_same_ways_at_every_strength():
    for one, two in zip(first(Mode.DRIFTING, 5), first(Mode.DRIFTING, 5), strict=True):
        assert all(torch.equal(a, b) for a, b in zip(one, two, strict=True))
