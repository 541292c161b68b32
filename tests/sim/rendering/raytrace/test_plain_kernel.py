"""One call of the kernel for CPUs: it draws the images that it is told to, and no others."""

import numpy as np
import warp as wp

from drone_rl.sim.rendering.raytrace import plain_kernel, structs_kernel
from tests.box_ahead import SIZE, geoms, materials, view


def test_it_draws_from_the_first_to_the_last_at_its_place_at_the_desk():
    poses = structs_kernel.Poses()
    aside = np.zeros((3, 1, 3), np.float32)
    aside[:, 0, 0] = [0.0, 1.0, 2.0]  # the world's frame itself, moved: the camera sees the same
    poses.positions = wp.array(aside, dtype=wp.vec3, device="cpu")
    poses.attitudes = wp.array([[1.0, 0.0, 0.0, 0.0]] * 3, dtype=wp.vec4, device="cpu")
    images = structs_kernel.Images()
    images.segmentation = wp.full((3, SIZE * SIZE), 7, dtype=int, device="cpu")
    scratch = structs_kernel.Scratch()
    scratch.nearest = wp.zeros((2, SIZE * SIZE), dtype=float, device="cpu")
    scratch.owner = wp.zeros((2, SIZE * SIZE), dtype=int, device="cpu")
    scratch.geom_views = wp.zeros((2, 1), dtype=structs_kernel.GeomView, device="cpu")
    given = [view(int(structs_kernel.SEGMENTATION)), geoms(), poses, materials(), scratch, images]
    wp.launch(plain_kernel.render_images, 1, inputs=[1, 3, 1, *given], device="cpu")
    drawn = images.segmentation.numpy()
    assert (drawn[0] == 7).all()
    assert [(drawn[i] == 3).sum() for i in (1, 2)] == [64, 64]
    assert not scratch.nearest.numpy()[0].any() and scratch.nearest.numpy()[1].any()
