"""Hand-made inputs of the ray tracer's kernels: a box of 2 m, 5 m in front of the camera."""

import numpy as np
import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel
from drone_rl.sim.rendering.raytrace.intersection_kernel import BOX
from drone_rl.sim.rendering.raytrace.renderer import Launch, make_scratch
from drone_rl.sim.rendering.raytrace.scene import make_rays

SIZE = 40


def array(values, dtype):
    return wp.array(values, dtype=dtype, device="cpu")


def view(outputs):
    """Return the view of one camera at the origin that looks along -z."""
    camera = structs_kernel.Camera()
    camera.attitude = wp.vec4(1.0, 0.0, 0.0, 0.0)
    camera.half_width = camera.half_height = 1.0
    result = structs_kernel.ViewArrays()
    result.count = 1
    rays = make_rays(camera, SIZE, SIZE).reshape(1, -1, 3)
    result.cameras = array([camera], structs_kernel.Camera)
    result.rays, result.cosines = array(rays, wp.vec3), array(-rays[..., 2], float)
    result.width = result.height = SIZE
    result.far, result.what = 50.0, outputs
    return result


def geoms(*depths, numbers=(3,)):
    count, result = len(numbers), structs_kernel.Geoms()
    result.kind, result.frame = array([int(BOX)] * count, int), array([0] * count, int)
    result.number = array(numbers, int)
    result.position = array([[0.0, 0.0, z] for z in depths or (-6.0,)], wp.vec3)
    result.attitude = array([[1.0, 0.0, 0.0, 0.0]] * count, wp.vec4)
    result.size = result.reach = array([[1.0, 1.0, 1.0]] * count, wp.vec3)
    return result


def poses():
    result = structs_kernel.PoseArrays()
    result.positions = array([[[0.0, 0.0, 0.0]]], wp.vec3)
    result.attitudes = array([[1.0, 0.0, 0.0, 0.0]], wp.vec4)
    return result


def materials():
    result = structs_kernel.Materials()
    result.colors = array([[[0.0] * 3] * 3 + [[1.0, 0.5, 0.0]]], wp.vec3)
    result.ambient = array([[[0.2, 0.2, 0.2]]], wp.vec3)
    result.diffuse = array([[[0.6, 0.6, 0.6]]], wp.vec3)
    result.direction = array([[[0.0, -0.6, -0.8]]], wp.vec3)
    result.sky = array([[10.0, 20.0, 30.0]], wp.vec3)
    return result


def images(**dtypes):
    """Return empty images of the given names."""
    result = structs_kernel.Images()
    for name, dtype in dtypes.items():
        setattr(result, name, wp.full((1, SIZE * SIZE), dtype(), dtype=dtype, device="cpu"))
    return result


def scratch(count=1, geoms=1):
    """Return buffers for images of `view`."""
    return make_scratch(count, SIZE * SIZE, geoms)


def render(launcher, name, outputs, dtype, scene=None):
    """Render one image with a launcher. Shape: (SIZE, SIZE, *)."""
    out = images(**{name: dtype})
    launcher.launch(Launch(1, view(int(outputs)), scene or geoms(), poses(), materials(), out))
    return np.squeeze(getattr(out, name).numpy()).reshape(SIZE, SIZE, -1)
