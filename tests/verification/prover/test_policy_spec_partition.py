"""How placements are cut where there are too many images, counted by hand."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest

from drone_rl.config import TaskSettings
from drone_rl.utils.errors import InputError
from drone_rl.verification.prover.boxes import volumes
from drone_rl.verification.prover.lattice import Lattice
from drone_rl.verification.prover.policy_spec import images_per_cube, partition_placements


def spec(num_cubes, borders=(-7.0, -5.0, 0.0, 5.0, 6.5)):
    task = dataclasses.replace(TaskSettings(), num_cubes=num_cubes)
    camera = SimpleNamespace(borders=lambda ahead: (np.array(borders), None))
    return SimpleNamespace(lattice=Lattice(task), camera=camera)


def test_borders_beyond_the_placements_do_not_count():
    assert images_per_cube(spec(2)) == [1 + 3 * 3] * 2


@pytest.mark.parametrize(
    ("most", "strips"), [(1000, [1, 1, 1]), (999, [1, 1, 2]), (100, [1, 1, 10]), (40, [1, 3, 10])]
)
def test_the_farthest_cubes_are_cut_first(most, strips):
    boxes = partition_placements(spec(3), most)
    assert len(boxes) == math.prod(strips)
    assert [len(np.unique(boxes[:, k, 0])) for k in range(3)] == strips
    assert volumes(boxes).sum() == pytest.approx(12**3)
    lower, upper = boxes[:, None, :, 0], boxes[None, :, :, 1]
    meets = (lower < upper).all(-1)
    assert (meets & meets.T).sum() == len(boxes)  # each only itself
    assert np.abs(boxes).max() == 6.0


def test_what_would_take_days_is_refused_with_an_estimate():
    with pytest.raises(InputError, match=r"task.num_cubes=9 .* 1e\+09 .* fewer cubes"):
        partition_placements(spec(9), 100)
