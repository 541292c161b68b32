"""Colors of single pixels and spans; test_effects tests whole images."""

import numpy as np
import pytest
import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel
from drone_rl.sim.rendering.raytrace.intersection_kernel import ROUND
from drone_rl.sim.rendering.raytrace.shading_kernel import light_surface, map_texture
from drone_rl.sim.rendering.raytrace.spans_kernel import shade_textured
from drone_rl.sim.rendering.raytrace.structs_kernel import Job, SurfaceLight, TextureMap
from drone_rl.sim.rendering.textures import levels
from tests.box_ahead import array, materials


@wp.kernel(enable_backward=False)
def light(material: structs_kernel.Materials, out: wp.array[wp.vec3]):
    lit, dark = light_surface(material, 0, wp.vec3(0.0, 0.0, 1.0))
    out[0] = lit
    out[1] = dark


def test_shadow_blocks_only_the_first_light():
    material = materials()
    material.ambient = array([[[0.1] * 3, [0.05] * 3]], wp.vec3)
    material.diffuse = array([[[0.5] * 3, [0.2, 0.0, 0.0]]], wp.vec3)
    material.direction = array([[[0.0, -0.6, -0.8], [0.0, 0.0, -1.0]]], wp.vec3)
    out = wp.zeros(2, dtype=wp.vec3, device="cpu")
    wp.launch(light, 1, inputs=[material, out], device="cpu")
    np.testing.assert_allclose(out.numpy()[0], [0.75, 0.55, 0.55], atol=1e-6)
    np.testing.assert_allclose(out.numpy()[1], [0.35, 0.15, 0.15], atol=1e-6)


def test_a_light_behind_a_surface_does_not_darken_it():
    material = materials()
    material.ambient = array([[[0.1] * 3, [0.05] * 3]], wp.vec3)
    material.diffuse = array([[[0.5] * 3, [0.2] * 3]], wp.vec3)
    material.direction = array([[[0.0, -0.6, -0.8], [0.0, 0.0, 1.0]]], wp.vec3)
    out = wp.zeros(2, dtype=wp.vec3, device="cpu")
    wp.launch(light, 1, inputs=[material, out], device="cpu")
    np.testing.assert_allclose(out.numpy(), [[0.55] * 3, [0.15] * 3], atol=1e-6)
    material.direction = array([[[0.0, 0.6, 0.8], [0.0, 0.0, 1.0]]], wp.vec3)
    wp.launch(light, 1, inputs=[material, out], device="cpu")
    np.testing.assert_allclose(out.numpy(), [[0.15] * 3] * 2, atol=1e-6)


@wp.kernel(enable_backward=False)
def cover(
    geom_view: structs_kernel.GeomView, face: int, normal: wp.vec3, out: wp.array[TextureMap]
):
    out[0] = map_texture(2.0, geom_view, face, normal)


@pytest.mark.parametrize(
    "face, normal, corner",
    [
        (1, (1, 0, 0), (4, -6)),  # a face along x shows y to the right, z up
        (2, (0, -1, 0), (2, -6)),
        (5, (0, 0, 1), (2, -4)),
        (int(ROUND), (0.1, 0.8, -0.5), (2, -6)),
        (int(ROUND), (0.1, 0.2, -0.9), (2, -4)),
    ],
)
def test_texture_axes_of_each_face(face, normal, corner):
    geom_view = structs_kernel.GeomView()
    geom_view.eye, geom_view.into = wp.vec3(1.0, 2.0, 3.0), wp.mat33(*np.eye(3).flatten())
    out = wp.zeros(1, dtype=TextureMap, device="cpu")
    wp.launch(cover, 1, inputs=[geom_view, face, wp.vec3(*normal), out], device="cpu")
    laid = out.numpy()[0]
    assert laid["corner"].tolist() == list(corner)
    # 1 m along its axis is two tiles across or down
    assert np.abs(laid["across"]).sum() == 2.0 and np.abs(laid["down"]).sum() == 2.0
    np.testing.assert_allclose(laid["facing"], -np.array(normal), atol=1e-6)


@wp.kernel(enable_backward=False)
def shade(job: Job, light: SurfaceLight, cover: TextureMap, texels: wp.array[wp.uint32]):
    shade_textured(job, 0, 1, light, cover, texels)


def covered(place):
    """Return the color of a texture with 2x2 texels (black, red; green, blue) and tiles of 1 m."""
    colors = np.array([[[0, 0, 0], [255, 0, 0]], [[0, 255, 0], [0, 0, 255]]], np.uint8)
    texels = levels(colors).astype(np.uint32) @ np.array([1, 256, 65536], np.uint32)
    cover, job, light = TextureMap(), Job(), SurfaceLight()
    cover.start, cover.side = 1, 2
    cover.facing, cover.corner = wp.vec3(0.0, 0.0, -1.0), wp.vec2(*place)
    job.colors = wp.zeros(1, dtype=wp.vec3ub, device="cpu")
    job.rays, job.nearest = array([(0, 0, -1)], wp.vec3), array([1.0], float)
    job.dark, light.lit = array([0], int), wp.vec3(200.0, 100.0, 300.0)
    given = [job, light, cover, array([7, *texels], wp.uint32)]
    wp.launch(shade, 1, inputs=given, device="cpu")
    return job.colors.numpy().tolist()[0]


@pytest.mark.parametrize("tile", [-3, 0, 5])
def test_texel_center_has_its_color(tile):
    assert covered((tile + 0.25, tile + 0.25)) == [0, 0, 0]
    assert covered((tile + 0.75, tile + 0.25)) == pytest.approx([200, 0, 0], abs=1)
    assert covered((tile + 0.25, tile + 0.75)) == pytest.approx([0, 100, 0], abs=1)
    assert covered((tile + 0.75, tile + 0.75)) == pytest.approx([0, 0, 255], abs=1)


def test_colors_between_texels_are_interpolated():
    assert covered((0.5, 0.25)) == pytest.approx([100, 0, 0], abs=1)
    assert covered((0.0, 0.25)) == pytest.approx([100, 0, 0], abs=1)  # across the edge of the tile
    assert covered((0.5, 0.5)) == pytest.approx([50, 25, 75], abs=1)
