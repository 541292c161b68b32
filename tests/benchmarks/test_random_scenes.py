import mujoco
import numpy as np
import pytest

from benchmarks.random_scenes import RandomScenes


def drawn(seed, count):
    """What was drawn of each scene, as plain numbers."""
    scenes = RandomScenes(seed)
    found = []
    for _ in range(count):
        model = scenes.draw().model
        names = ("geom_type", "geom_size", "geom_pos", "geom_quat", "cam_pos", "cam_quat")
        found.append(np.concatenate([getattr(model, name).flatten() for name in names]))
    return found


def test_a_seed_means_the_same_scenes_each_another():
    first, again, other = drawn(0, 3), drawn(0, 3), drawn(1, 3)
    assert all((a == b).all() for a, b in zip(first, again, strict=True))
    assert (first[0] != first[1]).any() and (first[0] != other[0]).any()


def test_there_are_solids_of_every_kind_and_planes_stay_as_opengl_has_them():
    scenes, kinds = RandomScenes(0), set()
    for _ in range(10):
        model = scenes.draw().model
        kinds |= set(model.geom_type[3:].tolist())
        assert model.geom_type[:3].tolist() == [mujoco.mjtGeom.mjGEOM_PLANE] * 3
        assert model.geom_size[:3, 0].tolist() == [25.0, 8.0, 0.9]
    assert kinds == {2, 3, 4, 5, 6}


def test_planes_are_seen_from_above_and_one_at_arms_length():
    scenes = RandomScenes(0)
    for _ in range(20):
        model = scenes.draw().model
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        normals = data.geom_xmat[:3].reshape(3, 3, 3)[:, :, 2]
        heights = ((data.cam_xpos[0] - data.geom_xpos[:3]) * normals).sum(1)
        assert (heights > 0).all() and 0.03 < heights[1] < 2.72


def test_nudged_cameras_see_the_middle_a_little_aside():
    """From the same place; by so much of the picture's height, which is 2 tan(fovy / 2) high."""
    model = RandomScenes(0, nudge=0.01).draw().model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    axes = data.cam_xmat.reshape(-1, 3, 3)
    assert (model.cam_pos == model.cam_pos[0]).all()
    high = 2 * np.tan(np.radians(model.cam_fovy[0]) / 2)
    seen = axes[0].T @ -axes[1:, :, 2].T  # where the others look, in the first one's frame
    aside = 0.01 * high * np.array([[-1, 1, 0, 0], [0, 0, 1, -1]])
    np.testing.assert_allclose(seen[:2] / -seen[2], aside, atol=1e-4)


def test_light_and_attitudes_have_length_one():
    model = RandomScenes(0).draw().model
    assert np.linalg.norm(model.light_dir[0]) == pytest.approx(1.0)
    np.testing.assert_allclose(np.linalg.norm(model.geom_quat, axis=1), 1.0)
