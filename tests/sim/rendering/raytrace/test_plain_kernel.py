"""One call of the kernel for CPUs renders the requested images and no others."""

import numpy as np
import warp as wp

from drone_rl.sim.rendering.raytrace import plain_kernel, structs_kernel
from tests.box_ahead import SIZE, geoms, materials, scratch, view


def test_only_requested_images_are_rendered():
    poses = structs_kernel.Poses()
    aside = np.zeros((3, 1, 3), np.float32)
    aside[:, 0, 0] = [0.0, 1.0, 2.0]  # moving the world frame itself changes nothing
    poses.positions = wp.array(aside, dtype=wp.vec3, device="cpu")
    poses.attitudes = wp.array([[1.0, 0.0, 0.0, 0.0]] * 3, dtype=wp.vec4, device="cpu")
    images = structs_kernel.Images()
    images.segmentation = wp.full((3, SIZE * SIZE), 7, dtype=int, device="cpu")
    buffers = scratch(2)
    buffers.nearest.zero_()
    given = [view(int(structs_kernel.SEGMENTATION)), geoms(), poses, materials(), buffers, images]
    wp.launch(plain_kernel.render_images, 1, inputs=[1, 3, 1, *given], device="cpu")
    drawn = images.segmentation.numpy()
    assert (drawn[0] == 7).all()
    assert [(drawn[i] == 3).sum() for i in (1, 2)] == [64, 64]
    assert not buffers.nearest.numpy()[0].any() and buffers.nearest.numpy()[1].any()
