"""What the ray tracer's kernels are given, by hand: a box of 2 m, 5 m before the camera."""

import numpy as np
import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel
from drone_rl.sim.rendering.raytrace.intersection_kernel import BOX
from drone_rl.sim.rendering.raytrace.renderer import Launch, make_scratch
from drone_rl.sim.rendering.raytrace.scene import make_rays

SIZE = 40


def array(values, dtype):
    return wp.array(values, dtype=dtype, device="cpu")


def view(what):
    """One camera at the origin that looks along -z."""
    camera = structs_kernel.Camera()
    camera.attitude = wp.vec4(1.0, 0.0, 0.0, 0.0)
    camera.half_width = camera.half_height = 1.0
    made = structs_kernel.View()
    made.count = 1
    rays = make_rays(camera, SIZE, SIZE).reshape(1, -1, 3)
    made.cameras = array([camera], structs_kernel.Camera)
    made.rays, made.cosines = array(rays, wp.vec3), array(-rays[..., 2], float)
    made.width = made.height = SIZE
    made.far, made.what = 50.0, what
    return made


def geoms(*depths, numbers=(3,)):
    count, made = len(numbers), structs_kernel.Geoms()
    made.kind, made.frame = array([int(BOX)] * count, int), array([0] * count, int)
    made.number = array(numbers, int)
    made.position = array([[0.0, 0.0, z] for z in depths or (-6.0,)], wp.vec3)
    made.attitude = array([[1.0, 0.0, 0.0, 0.0]] * count, wp.vec4)
    made.size = made.reach = array([[1.0, 1.0, 1.0]] * count, wp.vec3)
    return made


def poses():
    made = structs_kernel.Poses()
    made.positions = array([[[0.0, 0.0, 0.0]]], wp.vec3)
    made.attitudes = array([[1.0, 0.0, 0.0, 0.0]], wp.vec4)
    return made


def materials():
    made = structs_kernel.Materials()
    made.colors = array([[[0.0] * 3] * 3 + [[1.0, 0.5, 0.0]]], wp.vec3)
    made.ambient = array([[[0.2, 0.2, 0.2]]], wp.vec3)
    made.diffuse = array([[[0.6, 0.6, 0.6]]], wp.vec3)
    made.direction = array([[[0.0, -0.6, -0.8]]], wp.vec3)
    made.sky = array([[10.0, 20.0, 30.0]], wp.vec3)
    return made


def images(**dtypes):
    """Empty ones, by name."""
    made = structs_kernel.Images()
    for name, dtype in dtypes.items():
        setattr(made, name, wp.full((1, SIZE * SIZE), dtype(), dtype=dtype, device="cpu"))
    return made


def scratch(count=1, geoms=1):
    """Buffers of images of `view`."""
    return make_scratch(count, SIZE * SIZE, geoms)


def drawn(launcher, name, what, dtype, scene=None):
    """Render one image with a launcher. Shape: (SIZE, SIZE, *)."""
    out = images(**{name: dtype})
    launcher.launch(Launch(1, view(int(what)), scene or geoms(), poses(), materials(), out))
    return np.squeeze(getattr(out, name).numpy()).reshape(SIZE, SIZE, -1)
