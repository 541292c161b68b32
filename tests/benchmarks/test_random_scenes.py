import mujoco
import numpy as np
import pytest

from benchmarks.random_scenes import RandomScenes


def sample(seed, count):
    """Return the sampled numbers of each scene."""
    scenes = RandomScenes(seed)
    found = []
    for _ in range(count):
        model = scenes.sample().model
        names = ("geom_type", "geom_size", "geom_pos", "geom_quat", "cam_pos", "cam_quat")
        found.append(np.concatenate([getattr(model, name).flatten() for name in names]))
    return found


def test_the_same_seed_gives_the_same_scenes():
    first, again, other = sample(0, 3), sample(0, 3), sample(1, 3)
    assert all((a == b).all() for a, b in zip(first, again, strict=True))
    assert (first[0] != first[1]).any() and (first[0] != other[0]).any()


def test_there_are_solids_of_every_kind_and_planes_keep_their_sizes():
    scenes, kinds = RandomScenes(0), set()
    for _ in range(10):
        model = scenes.sample().model
        kinds |= set(model.geom_type[3:].tolist())
        assert model.geom_type[:3].tolist() == [mujoco.mjtGeom.mjGEOM_PLANE] * 3
        assert model.geom_size[:3, 0].tolist() == [25.0, 8.0, 0.9]
    assert kinds == {2, 3, 4, 5, 6}


def test_planes_face_the_camera_and_one_is_near():
    scenes = RandomScenes(0)
    for _ in range(20):
        model = scenes.sample().model
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        normals = data.geom_xmat[:3].reshape(3, 3, 3)[:, :, 2]
        heights = ((data.cam_xpos[0] - data.geom_xpos[:3]) * normals).sum(1)
        assert (heights > 0).all() and 0.03 < heights[1] < 2.72


def test_rotated_cameras_shift_the_image_by_a_fraction_of_its_height():
    """The image has a height of 2 tan(fovy / 2) at distance 1."""
    model = RandomScenes(0, nudge=0.01).sample().model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    axes = data.cam_xmat.reshape(-1, 3, 3)
    assert (model.cam_pos == model.cam_pos[0]).all()
    high = 2 * np.tan(np.radians(model.cam_fovy[0]) / 2)
    seen = axes[0].T @ -axes[1:, :, 2].T  # viewing directions in the frame of the first camera
    aside = 0.01 * high * np.array([[-1, 1, 0, 0], [0, 0, 1, -1]])
    np.testing.assert_allclose(seen[:2] / -seen[2], aside, atol=1e-4)


def test_light_directions_and_quaternions_are_normalized():
    model = RandomScenes(0).sample().model
    assert np.linalg.norm(model.light_dir[0]) == pytest.approx(1.0)
    np.testing.assert_allclose(np.linalg.norm(model.geom_quat, axis=1), 1.0)
