import pytest

from drone_rl.config import PillarsSettings, TaskSettings
from drone_rl.utils.errors import InputError
from drone_rl.verification.requirements import require_cubes


def test_only_cube_collection_passes():
    task = TaskSettings(num_cubes=2)
    assert require_cubes(task, "a proof") is task
    with pytest.raises(InputError, match="a proof is known of collect_cubes alone"):
        require_cubes(PillarsSettings(), "a proof")
