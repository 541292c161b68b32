"""One call of the kernel for CPUs: it draws the pictures that it is told to, and no others."""

import numpy as np
import warp as wp

from drone_rl.sim.rendering.raytrace import plain_kernel, structs_kernel
from tests.box_ahead import SIZE, geoms, looks, view


def test_it_draws_from_the_first_to_the_last_at_its_place_at_the_desk():
    poses = structs_kernel.Poses()
    aside = np.zeros((3, 1, 3), np.float32)
    aside[:, 0, 0] = [0.0, 1.0, 2.0]  # the world's frame itself, moved: the camera sees the same
    poses.places = wp.array(aside, dtype=wp.vec3, device="cpu")
    poses.attitudes = wp.array([[1.0, 0.0, 0.0, 0.0]] * 3, dtype=wp.vec4, device="cpu")
    pictures = structs_kernel.Pictures()
    pictures.segmentation = wp.full((3, SIZE * SIZE), 7, dtype=int, device="cpu")
    desk = plain_kernel.Desk()
    desk.nearest = wp.zeros((2, SIZE * SIZE), dtype=float, device="cpu")
    desk.owner = wp.zeros((2, SIZE * SIZE), dtype=int, device="cpu")
    desk.sights = wp.zeros((2, 1), dtype=structs_kernel.Sight, device="cpu")
    given = [view(int(structs_kernel.SEGMENTATION)), geoms(), poses, looks(), desk, pictures]
    wp.launch(plain_kernel.draw, 1, inputs=[1, 3, 1, *given], device="cpu")
    drawn = pictures.segmentation.numpy()
    assert (drawn[0] == 7).all()
    assert [(drawn[i] == 3).sum() for i in (1, 2)] == [64, 64]
    assert not desk.nearest.numpy()[0].any() and desk.nearest.numpy()[1].any()
