import pytest

from drone_rl.config import PillarsSettings, TaskSettings
from drone_rl.utils.errors import InputError
from drone_rl.verification.requirements import require_cubes


def test_only_cube_collection_passes():
    task = TaskSettings(num_cubes=2)
    assert require_cubes(task, "proofs") is task
    with pytest.raises(InputError, match="only task=collect_cubes, got task=pillars"):
        require_cubes(PillarsSettings(), "proofs")
