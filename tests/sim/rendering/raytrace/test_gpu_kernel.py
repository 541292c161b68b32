"""The GPU kernels, run on a CPU; test_renderer_launchers tests their images."""

import numpy as np
import warp as wp

from drone_rl.sim.rendering.raytrace import gpu_kernel as kernels
from drone_rl.sim.rendering.raytrace import structs_kernel
from tests.box_ahead import geoms, poses, scratch, view


def test_rays_are_transformed_to_every_geom():
    buffers = scratch(1, 2)
    scene = geoms(-6.0, -9.0, numbers=(1, 2))
    given = [view(int(structs_kernel.DEPTH)), scene, poses(), buffers]
    wp.launch(kernels.view_geoms, (1, 2), inputs=given, device="cpu")
    found = buffers.geom_views.numpy()[0]
    assert found["number"].tolist() == [1, 2]
    np.testing.assert_allclose(found["eye"], [[0, 0, 6], [0, 0, 9]])
    np.testing.assert_allclose(found["into"], [np.eye(3)] * 2)
