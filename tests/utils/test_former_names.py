"""Figures of older files get the names that they have now; all others stay."""

from drone_rl.utils.former_names import with_present_names


def test_older_and_present_names():
    older = {"frames": 5, "running_cubes": 2.5, "train/cubes": 1, "train/running_cubes": 2}
    present = {"frames": 5, "running_reward": 2.5, "train/reward": 1, "train/running_reward": 2}
    assert with_present_names(older) == present
    assert list(with_present_names(older)) == list(present)  # columns stay in order
    assert with_present_names(present) == present
