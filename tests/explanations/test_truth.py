import numpy as np
import pytest

from drone_rl.explanations.scenes import Region
from drone_rl.explanations.truth import heat_shares

REGIONS = np.array([[[Region.NEXT_TARGET, Region.GROUND], [Region.SKY, Region.SKY]]] * 3)


def test_heat_shares_by_hand():
    maps = np.array([[[6.0, 1.0], [1.0, 2.0]]])
    found = heat_shares(maps, REGIONS[:1], np.zeros(1))
    shares = {name: region["share"]["mean"] for name, region in found.items()}
    assert shares == pytest.approx(
        {"next_target": 0.6, "other_target": 0, "horizon": 0, "ground": 0.1, "sky": 0.3}
    )
    assert found["sky"]["chance"]["mean"] == 0.5
