"""Single rays against MuJoCo's ray casts, and hits that are computed by hand."""

import numpy as np
import pytest

from tests.any_scene import are_blocked, cast, make_scene, mujoco_rays, random_scene


def directions(count, seed=0):
    rays = np.random.RandomState(seed).normal(size=(count, 3))
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)


@pytest.mark.parametrize("seed", range(3))
def test_rays_hit_what_mujoco_says(seed):
    scene, rays = random_scene(seed), directions(2000, seed)
    origin = np.array([0.1, 0.2, 6.0])
    geoms, distances = mujoco_rays(scene, origin, rays)
    hits = cast(scene, origin, rays)
    is_same = hits["geom"] == geoms
    assert is_same.mean() > 0.999
    assert (geoms[is_same] >= 0).mean() > 0.25
    known = is_same & (geoms >= 0)
    np.testing.assert_allclose(hits["distance"][known], distances[known], rtol=1e-4, atol=1e-4)
    blocked = are_blocked(scene, origin, rays, np.full(len(rays), 5.0))
    is_near = (geoms >= 0) & (distances < 5.0)
    assert (blocked == is_near).mean() > 0.999


def test_mesh_has_smooth_normals_and_hides_its_inside():
    ball = '<mesh name="m" builtin="sphere" params="4"/>'
    scene = make_scene('<geom type="mesh" mesh="m" pos="4 0 0"/>', ball)
    far = cast(scene, np.zeros(3), np.array([[1.0, 0.0, 0.1], [1.0, 0.0, 0.0]]) / [[1.00499], [1]])
    up = far["point"] - [4.0, 0.0, 0.0]
    np.testing.assert_allclose(far["normal"], up / np.linalg.norm(up, axis=1)[:, None], atol=0.01)
    assert np.abs(far["face_normal"] - far["normal"]).max() > 0.005
    np.testing.assert_allclose(far["local"], up, atol=1e-5)
    inside = cast(scene, np.array([4.0, 0.0, 0.0]), np.array([[1.0, 0.0, 0.0]]))
    assert inside["geom"].tolist() == [-1]


def test_planes_are_seen_from_both_sides():
    scene = make_scene('<geom type="plane" size="1 1 1" pos="0 0 2"/>')
    up = np.array([[0.0, 0.0, 1.0]])
    hit = cast(scene, np.zeros(3), up)
    assert hit["distance"].tolist() == [2.0]
    np.testing.assert_allclose(hit["normal"], [[0.0, 0.0, -1.0]])
    assert cast(scene, np.array([1.5, 0.0, 0.0]), up)["geom"].tolist() == [-1]


def test_geoms_that_mujoco_hides_are_not_hit():
    hidden = ('group="3"', 'rgba="1 1 1 0"', 'material="clear"', 'group="2"')
    geoms = [f'<geom size=".1" pos="2 {i} 0" {h}/>' for i, h in enumerate(hidden)]
    scene = make_scene("".join(geoms), '<material name="clear" rgba="1 1 1 0"/>')
    rays = np.array([[2.0, i, 0.0] for i in range(4)])
    hits = cast(scene, np.zeros(3), rays / np.linalg.norm(rays, axis=1, keepdims=True))
    assert hits["geom"].tolist() == [-1, -1, -1, 3]
