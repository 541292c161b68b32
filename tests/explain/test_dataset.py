import json

import numpy as np
import pytest
import torch

from drone_rl.explain.dataset import FIELDS, RolloutDataset, record
from drone_rl.explain.scenes import Region
from drone_rl.utils.errors import InputError


def test_frames_actions_and_truth_belong_together(dataset, world):
    assert len(dataset) == 60
    assert set(dataset.arrays) == set(FIELDS)
    step = np.where(dataset.actions[:-1] == 0, 1.0, 0.0)  # forward moves the drone 1 m in x
    same = dataset.episode[1:] == dataset.episode[:-1]
    moved = dataset.drone[1:, 0] - dataset.drone[:-1, 0]
    np.testing.assert_allclose(moved[same], step[same])
    assert (dataset.step[1:][same] == dataset.step[:-1][same] + 1).all()
    assert dataset.step[dataset.episode != np.roll(dataset.episode, 1)].sum() == 0


def test_redrawn_frames_are_those_that_the_policy_saw(dataset, scenes):
    again = scenes.transform(torch.from_numpy(dataset.frames))
    np.testing.assert_allclose(again.numpy(), dataset.observations, atol=1e-6)


def test_the_file_loads_without_this_package(dataset, tmp_path):
    dataset.save(tmp_path / "data.npz")
    with np.load(tmp_path / "data.npz", allow_pickle=False) as file:
        meta = json.loads(str(file["meta"]))
        assert meta["fields"]["drone"].startswith("position before the action, metres")
        assert file["features/fc_relu1"].shape == (60, 8)
    again = RolloutDataset.load(tmp_path / "data.npz")
    np.testing.assert_array_equal(again.frames, dataset.frames)
    assert set(again.features) == {"relu1", "fc_relu1"}


def test_a_damaged_file_is_refused(tmp_path):
    (tmp_path / "data.npz").write_bytes(b"PK nothing")
    with pytest.raises(InputError, match=r"data\.npz can't be read"):
        RolloutDataset.load(tmp_path / "data.npz")


def test_offset_is_seen_from_the_drone(dataset):
    t = int(np.flatnonzero(dataset.next_cube == 0)[0])
    expected = dataset.cubes[t, 0, :2] - dataset.drone[t, :2]
    np.testing.assert_allclose(dataset.offset()[t], expected)
    seen = (dataset.regions == Region.NEXT_CUBE).any((1, 2))
    assert seen[:10].all()


def test_no_frames_are_refused(world):
    with pytest.raises(InputError, match="frames=0"):
        record(*world, 0)
