"""Mesh files as scenes: sizes, axes, colors and images."""

import mujoco
import numpy as np
import pytest
import trimesh
from PIL import Image

from drone_rl.sim.scenes import load_scene
from drone_rl.utils.errors import InputError


@pytest.fixture
def scene():
    """A red box of 4 x 3 x 2, and above it a square with an image whose upper left is blue."""
    box = trimesh.creation.box((4, 3, 2))
    box.visual.face_colors = [255, 0, 0, 255]
    image = Image.new("RGB", (64, 64), (255, 255, 0))
    image.paste((0, 0, 255), (0, 0, 32, 32))
    corners = [[0, 0, 3], [2, 0, 3], [2, 2, 3], [0, 2, 3]]
    square = trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=image)
    uv = [[0, 0], [1, 0], [1, 1], [0, 1]]
    square.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    return trimesh.Scene({"box": box, "square": square})


def test_reads_parts_colors_and_images(scene, tmp_path):
    scene.export(tmp_path / "s.glb")
    made = load_scene(tmp_path / "s.glb")
    model = made.model
    assert [model.geom(i).name for i in range(2)] == ["box", "square"] and all(made.solid)
    np.testing.assert_allclose(np.stack(made.bounds), [[-2, -1.5, -1], [2, 2, 3]], atol=1e-5)
    red, white = (model.mat_rgba[model.geom_matid[i]] for i in range(2))
    np.testing.assert_allclose([red, white], [(1, 0, 0, 1), (1, 1, 1, 1)], atol=1e-3)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    first = model.mesh_vertadr[1]
    corners = model.mesh_vert[first:] @ data.geom_xmat[1].reshape(3, 3).T + data.geom_xpos[1]
    texture = int(np.flatnonzero(model.tex_type == mujoco.mjtTexture.mjTEXTURE_2D)[0])
    pixels = model.tex_data[model.tex_adr[texture] :][: 64 * 64 * 3].reshape(64, 64, 3)
    upper_left = model.mesh_texcoord[int((corners[:, 0] - corners[:, 1]).argmin())]
    row, column = (63 * upper_left[::-1]).astype(int)
    assert pixels[row, column].tolist() == [0, 0, 255]


def test_turns_and_scales_and_names_what_is_wrong(scene, tmp_path):
    scene.geometry["box"].export(tmp_path / "box.stl")
    low, high = load_scene(tmp_path / "box.stl", up="y", scale=0.5).bounds
    np.testing.assert_allclose(high - low, (2, 1, 1.5), atol=1e-5)
    with pytest.raises(InputError, match=r"4e-05 m.*task\.scene_scale"):
        load_scene(tmp_path / "box.stl", scale=1e-5)
    (tmp_path / "none.ply").write_bytes(b"ply\n")
    with pytest.raises(InputError, match=r"scene=.*none\.ply: it is damaged"):
        load_scene(tmp_path / "none.ply")
