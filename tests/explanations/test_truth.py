import numpy as np
import pytest

from drone_rl.explanations.scenes import Region
from drone_rl.explanations.truth import heat_shares, pointing_game

REGIONS = np.array([[[Region.NEXT_TARGET, Region.GROUND], [Region.SKY, Region.SKY]]] * 3)


def test_pointing_game_by_hand():
    maps = np.array([[[9, 1], [0, 0]], [[1, 9], [0, 0]], [[0, 0], [0, 0]]], float)
    found = pointing_game(maps, REGIONS, np.array([0, 1, 2]))
    assert found["hit"]["mean"] == pytest.approx(1 / 3)  # a map without heat misses
    assert found["chance"]["mean"] == 0.25
    assert found["maps_without_heat"] == 1


@pytest.mark.parametrize("unit", [0.01, 1.0, 100.0])
def test_pointing_has_no_unit(unit):
    maps = unit * np.array([[[9, 1], [0, 0]], [[9, 9], [1, 0]], [[0, 0], [0, 0]]], float)
    found = pointing_game(maps, REGIONS, np.array([0, 1, 2]))
    assert found["hit"]["mean"] == pytest.approx(2 / 3)
    assert found["maps_without_heat"] == 1


def test_frames_without_the_cube_do_not_count():
    regions = REGIONS.copy()
    regions[1:] = Region.SKY
    found = pointing_game(np.ones((3, 2, 2)), regions, np.arange(3))
    assert found["hit"]["frames"] == 1
    nothing = pointing_game(np.ones((3, 2, 2)), np.full_like(REGIONS, Region.SKY), np.arange(3))
    assert nothing["hit"]["mean"] is None


def test_heat_shares_by_hand():
    maps = np.array([[[6.0, 1.0], [1.0, 2.0]]])
    found = heat_shares(maps, REGIONS[:1], np.zeros(1))
    shares = {name: region["share"]["mean"] for name, region in found.items()}
    assert shares == pytest.approx(
        {"next_target": 0.6, "other_target": 0, "horizon": 0, "ground": 0.1, "sky": 0.3}
    )
    assert found["sky"]["chance"]["mean"] == 0.5
