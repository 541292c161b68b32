import math

import pytest
import torch

from drone_rl.explanations.patches import (
    band,
    blob,
    difference,
    horizon_row,
    placebo_maps,
    smoothed,
)


def test_placebos_by_hand():
    absent = torch.zeros(1, 6, 10)
    absent[:, :2] = 1.0  # sky above the third row
    x = absent.repeat(2, 1, 1, 1)
    x[1, 0, 4, 7] = 3.0
    maps = placebo_maps(x, absent, [x + 1, x + 2])
    assert all(m.shape == (2, 6, 10) and (m >= 0).all() for m in maps.values())
    assert maps["ones"].unique().tolist() == [1.0]
    assert maps["difference to the empty scene"].nonzero().tolist() == [[1, 4, 7]]
    assert maps["difference to the empty scene"].max() == 3.0
    assert maps["difference to the empty scene, smoothed"][1].argmax() == 47
    assert maps["mean difference to re-rendered patches"].unique().tolist() == [1.5]
    assert horizon_row(absent) == 1.5
    assert maps["horizon"][0, :, 3].argsort(descending=True)[:2].sort().values.tolist() == [1, 2]
    torch.testing.assert_close(maps["blob in the middle"], maps["blob in the middle"].flip(1, 2))
    assert maps["blob in the middle"][0].argmax() in (24, 25, 34, 35)
    assert not torch.equal(maps["noise"][0], maps["noise"][1])


def test_a_blob_stands_where_it_is_put():
    made = blob(10, 20, 0.25, 0.6)
    assert divmod(int(made.argmax()), 20) == (2, 11) or divmod(int(made.argmax()), 20) == (2, 12)
    assert blob(10, 20, 0.5, 0.5, 0.1).mean() < blob(10, 20, 0.5, 0.5, 0.3).mean()
    assert band(10, 4, 3.0)[:, 0].argmax() == 3


def test_smoothing_keeps_an_even_map_and_spreads_a_point():
    assert torch.allclose(smoothed(torch.ones(1, 8, 40)), torch.ones(1, 8, 40))
    point = torch.zeros(1, 9, 40)
    point[0, 4, 20] = 1.0
    assert torch.isclose(smoothed(point).sum(), torch.tensor(1.0))
    assert 0 < smoothed(point).max() < 0.5


def test_a_blob_by_hand():
    """Pixels are at (0.25, 0.75) of the height and (0.125, 0.375, ...) of the width."""
    made = blob(2, 4, 0.5, 0.25)
    assert made[0, 0].item() == pytest.approx(math.exp(-(0.25**2 + 0.125**2) / (2 * 0.2**2)))
    assert made[1, 3].item() == pytest.approx(math.exp(-(0.25**2 + 0.625**2) / (2 * 0.2**2)))
    assert blob(1, 1, 0.0, 0.5, 0.5).item() == pytest.approx(math.exp(-0.5))


def test_a_band_by_hand():
    made = band(20, 3, 4.5)
    assert made.shape == (20, 3) and (made == made[:, :1]).all()
    # a tenth of the height, two rows, is the deviation
    assert made[6, 0].item() == pytest.approx(math.exp(-(0.75**2) / 2))
    assert band(10, 3, 4.0, 0.2)[8, 0].item() == pytest.approx(math.exp(-2))


def test_the_horizon_is_the_greatest_change_whatever_its_sign():
    absent = torch.zeros(2, 6, 4)
    absent[0, 4:], absent[1, 4:] = 1.0, -1.0  # darker in one channel, brighter in the other
    absent[0, 1:4] = 0.3
    assert horizon_row(absent) == 3.5


def test_differences_add_up_over_channels():
    x, absent = torch.tensor([[[[1.0]], [[-2.0]]]]), torch.tensor([[[0.5]], [[1.0]]])
    assert difference(x, absent).tolist() == [[[3.5]]]


@pytest.mark.parametrize(("width", "box"), [(10, 3), (39, 3), (40, 5), (64, 7)])
def test_smoothing_by_hand(width, box):
    point = torch.zeros(1, 25, width)
    point[0, 12, width // 2] = 1.0
    once, twice = smoothed(point, 1)[0], smoothed(point)[0]
    assert int((once > 0).sum()) == box**2
    assert once.max().item() == pytest.approx(1 / box**2)
    assert twice[12, width // 2].item() == pytest.approx(1 / box**2)  # box of 1 / box each way
    assert int((twice[12] > 1e-9).sum()) == min(2 * box - 1, width)
    corner = torch.zeros(1, 25, width)
    corner[0, 0, 0] = 1.0  # beyond the border goes on what is at the border
    assert smoothed(corner, 1)[0, 0, 0].item() == pytest.approx((box // 2 + 1) ** 2 / box**2)


def test_noise_repeats_with_its_seed():
    x = torch.zeros(2, 1, 6, 10)
    noise = [placebo_maps(x, x[0], [x], seed)["noise"] for seed in (0, 0, 1)]
    assert torch.equal(noise[0], noise[1]) and not torch.equal(noise[0], noise[2])
    assert torch.equal(placebo_maps(x, x[0], [x])["noise"], noise[0])
