import json
import sys

import pytest

from drone_rl.utils.errors import InputError, did_you_mean, extra


@pytest.mark.parametrize(
    ("name", "names", "meant"),
    [
        ("GOOD", ["good", "proved"], "good"),
        ("grid_snaped", ["rgb", "Grid_Snapped"], "Grid_Snapped"),
        ("fov", ["width", "horizontal_fov"], "horizontal_fov"),
        ("x", ["good", "proved"], None),
        ("fov", ["vertical_fov", "horizontal_fov"], None),
    ],
)
def test_similar_names(name, names, meant):
    assert did_you_mean(name, names) == (f"; did you mean {meant}?" if meant else "")


def test_extras(monkeypatch):
    assert extra("json", "x", "y") is json
    monkeypatch.setitem(sys.modules, "submitit", None)
    with pytest.raises(InputError, match=r"launcher=slurm.*pip install -e '.\[slurm\]'"):
        extra("submitit", "slurm", "hydra/launcher=slurm")
