"""Reach of shadows, their search area in the image, and occlusion."""

import numpy as np
import pytest
import warp as wp

from drone_rl.sim.rendering.raytrace import structs_kernel
from drone_rl.sim.rendering.raytrace.effects_kernel import (
    cast_box_shadow,
    find_ground,
    is_shadowed,
    mark_candidates,
    shadow_length,
)
from drone_rl.sim.rendering.raytrace.intersection_kernel import (
    BOX,
    CYLINDER,
    ELLIPSOID,
    PLANE,
    SPHERE,
)
from drone_rl.sim.rendering.raytrace.projection_kernel import (
    bounding_rectangle,
    start_job,
    view_geom,
)
from tests.box_ahead import SIZE, array, geoms, poses, scratch, view


@wp.kernel(enable_backward=False)
def look(
    seen: structs_kernel.View,
    scene: structs_kernel.Geoms,
    placed: structs_kernel.Poses,
    sun: wp.vec3,
    buffers: structs_kernel.Scratch,
    length: wp.array[float],
    parts: wp.array[wp.vec4i],
):
    job = start_job(seen, placed, buffers, 0, 0, 0, 0)
    for geom in range(job.geom_views.shape[0]):
        job.geom_views[geom] = view_geom(job, scene, geom, placed)
    box = job.geom_views[0]
    length[0] = shadow_length(job, box, find_ground(job, sun), sun)
    parts[0] = bounding_rectangle(job, box, sun * length[0])


def find_shadow(sun, box=(0.0, 0.0, -6.0), *, size=(0.0, 0.0, 1.0), floor=True):
    """Return reach and search area of a box above a floor at z = -20; the far limit is 50 m."""
    scene = geoms(-6.0, -20.0, numbers=(0, 1)) if floor else geoms(-6.0)
    kinds, places = [int(BOX), int(PLANE)], [box, (0.0, 0.0, -20.0)]
    count = len(scene.kind)
    scene.kind, scene.position = array(kinds[:count], int), array(places[:count], wp.vec3)
    scene.size = array([(1.0, 1.0, 1.0), size][:count], wp.vec3)
    length, parts = (wp.zeros(1, dtype=of, device="cpu") for of in (float, wp.vec4i))
    given = [
        view(int(structs_kernel.DEPTH)),
        scene,
        poses(),
        wp.vec3(*sun),
        scratch(1, count),
        length,
        parts,
    ]
    wp.launch(look, 1, inputs=given, device="cpu")
    return length.numpy()[0], parts.numpy()[0].tolist()


def test_shadow_reach_ends_on_the_ground():
    """The box is 15 m above the ground; along a slope of 0.8 that is 15 / 0.8 m."""
    assert find_shadow((0.0, 0.0, -1.0))[0] == pytest.approx(15.0)
    assert find_shadow((0.6, 0.0, -0.8))[0] == pytest.approx(15.0 / 0.8)


@pytest.mark.parametrize(
    "given", [{"floor": False}, {"size": (3.0, 3.0, 1.0)}, {"sun": (0.0, 0.6, 0.8)}]
)
def test_shadow_reach_without_a_sunlit_plane_is_the_far_limit(given):
    assert find_shadow(**{"sun": (0.0, 0.0, -1.0), **given})[0] == 50.0


def test_vertical_shadow_is_behind_the_box():
    """A square of a fifth of the image, as in test_projection_kernel."""
    assert find_shadow((0.0, 0.0, -1.0))[1] == [14, 25, 14, 25]


def test_search_area_includes_the_end_of_the_shadow():
    """The shadow moves 15 m / 0.8 * 0.6 to the right at a depth of 20 m."""
    first, last, top, bottom = find_shadow((0.6, 0.0, -0.8))[1]
    assert first == 14 and (top, bottom) == (14, 25)
    end = (1.0 + 15.0 * 0.75) / 19.0  # end of the shadow of the lower side
    assert abs(last - (20 + 20 * end)) <= 3


def test_search_area_includes_shadows_from_behind_the_camera():
    """A box above the camera casts a shadow into the image."""
    first, last, top, bottom = find_shadow((0.0, 0.0, -1.0), box=(4.0, 0.0, 6.0))[1]
    assert first >= 20 and last == SIZE and top < 20 < bottom


def test_search_area_excludes_shadows_behind_the_camera():
    first, last, _, _ = find_shadow((0.0, 0.0, 1.0), box=(0.0, 0.0, 6.0))[1]
    assert first >= last


@wp.kernel(enable_backward=False)
def hide(
    job: structs_kernel.Job,
    geom_view: structs_kernel.GeomView,
    sun: wp.vec3,
    behind: wp.array[int],
):
    cast_box_shadow(job, 0, behind.shape[0], 0, geom_view, sun)
    for i in range(behind.shape[0]):
        behind[i] = int(is_shadowed(geom_view, job.rays[i], job.nearest[i], sun))


def test_box_shadows_equal_those_of_the_generic_function():
    """Compare 20,000 positions around a box with the generic function for solids."""
    source = np.random.RandomState(0)
    rays = source.normal(size=(20_000, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    nearest = source.uniform(0.0, 8.0, 20_000)
    owners = source.choice([-1, 5, 8, 16], 20_000)  # the sky, the box itself, two others
    geom_view = structs_kernel.GeomView()
    geom_view.kind, geom_view.size = int(BOX), wp.vec3(1.0, 2.0, 0.5)
    geom_view.eye, geom_view.into = wp.vec3(0.5, 1.0, 2.0), wp.mat33(*np.eye(3).flatten())
    dark, behind = (wp.zeros(20_000, dtype=int, device="cpu") for _ in range(2))
    sun = np.array([0.0, 0.6, -0.8])
    job = surfaces(rays, nearest, owners, dark)
    wp.launch(hide, 1, inputs=[job, geom_view, wp.vec3(*sun), behind], device="cpu")
    others = owners >= 8
    assert np.array_equal(dark.numpy()[others], behind.numpy()[others])
    assert 50 < dark.numpy().sum() < 5000 and not dark.numpy()[~others].any()
    place = np.array([0.5, 1.0, 2.0]) + nearest[:, None] * rays
    beneath = place - sun / sun[2] * (place[:, 2:] + 0.5)  # back to the lower side of the box
    is_under = (place[:, 2] < -0.5) & (np.abs(beneath[:, :2]) <= [1.0, 2.0]).all(1)
    assert dark.numpy()[others & is_under].all()


@wp.kernel(enable_backward=False)
def near(
    job: structs_kernel.Job,
    geom_view: structs_kernel.GeomView,
    sun: wp.vec3,
    behind: wp.array[int],
):
    mark_candidates(job, 0, behind.shape[0], 0, geom_view, sun)
    for i in range(behind.shape[0]):
        behind[i] = int(is_shadowed(geom_view, job.rays[i], job.nearest[i], sun))


def surfaces(rays, nearest, owners, dark):
    job = structs_kernel.Job()
    job.rays, job.nearest = array(rays, wp.vec3), array(nearest, float)
    job.owner, job.dark = array(owners, int), dark
    return job


@pytest.mark.parametrize(
    ("kind", "reach"),
    [(SPHERE, (1.0, 1.0, 1.0)), (CYLINDER, (0.5, 0.5, 2.0)), (ELLIPSOID, (1.0, 2.0, 0.5))],
)
def test_shadow_candidates_include_all_shadowed_positions(kind, reach):
    """Candidates are those of 20,000 positions whose ray to the sun passes the bounding ball."""
    source = np.random.RandomState(0)
    rays = source.normal(size=(20_000, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    nearest = source.uniform(0.0, 8.0, 20_000)
    owners = source.choice([-1, 5, 8, 16], 20_000)  # the sky, the geom itself, two others
    before = source.choice([0, 1], 20_000)
    geom_view = structs_kernel.GeomView()
    geom_view.kind, geom_view.size, geom_view.reach = (
        int(kind),
        wp.vec3(reach[0], reach[2], 0.0),
        wp.vec3(reach),
    )
    if kind == ELLIPSOID:
        geom_view.size = wp.vec3(reach)
    geom_view.eye, geom_view.into = wp.vec3(0.5, 1.0, 2.0), wp.mat33(*np.eye(3).flatten())
    dark, behind = array(before, int), wp.zeros(20_000, dtype=int, device="cpu")
    sun = np.array([0.0, 0.6, -0.8])
    job = surfaces(rays, nearest, owners, dark)
    wp.launch(near, 1, inputs=[job, geom_view, wp.vec3(*sun), behind], device="cpu")
    marked = dark.numpy() == 2
    is_open = (owners >= 8) & (before == 0)
    assert (dark.numpy() == before)[~is_open].all()
    assert marked[is_open & (behind.numpy() == 1)].all() and behind.numpy()[is_open].sum() > 20
    place = np.array([0.5, 1.0, 2.0]) + nearest[:, None] * rays
    away = np.linalg.norm(np.cross(place, sun), axis=1) / np.linalg.norm(reach)
    assert marked[is_open & (away < 0.999)].all() and not marked[away > 1.01].any()
