import torch

from drone_rl.explain.placebos import band, blob, horizon_row, placebo_maps, smoothed


def test_placebos_by_hand():
    absent = torch.zeros(1, 6, 10)
    absent[:, :2] = 1.0  # sky above the third row
    x = absent.repeat(2, 1, 1, 1)
    x[1, 0, 4, 7] = 3.0
    maps = placebo_maps(x, absent, [x + 1, x + 2])
    assert all(m.shape == (2, 6, 10) and (m >= 0).all() for m in maps.values())
    assert maps["ones"].unique().tolist() == [1.0]
    assert maps["picture - empty scene"].nonzero().tolist() == [[1, 4, 7]]
    assert maps["picture - empty scene"].max() == 3.0
    assert maps["picture - empty scene, smoothed"][1].argmax() == 47
    assert maps["size of the change"].unique().tolist() == [1.5]
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
