"""Hand-computed intersections of rays and geoms."""

import math

import numpy as np
import pytest
import warp as wp

from drone_rl.sim.rendering.raytrace.intersection_kernel import (
    BOX,
    CAPSULE,
    CYLINDER,
    ELLIPSOID,
    SPHERE,
    intersect_solid,
    surface_normal,
)


@wp.kernel(enable_backward=False)
def try_solid(
    kind: int,
    size: wp.vec3,
    point: wp.vec3,
    ray: wp.vec3,
    along: wp.array[float],
    normal: wp.array[wp.vec3],
):
    distance, face = intersect_solid(kind, size, point, ray)
    along[0] = distance
    normal[0] = surface_normal(kind, size, face, point, ray, distance)


def entered(kind, size, point, ray):
    """Return the distance along the ray and the normal."""
    along = wp.zeros(1, dtype=float, device="cpu")
    normal = wp.zeros(1, dtype=wp.vec3, device="cpu")
    given = [int(kind), wp.vec3(*size), wp.vec3(*point), wp.vec3(*ray), along, normal]
    wp.launch(try_solid, 1, inputs=given, device="cpu")
    return float(along.numpy()[0]), normal.numpy()[0]


ROOT = math.sqrt(0.5)


@pytest.mark.parametrize(
    ("kind", "size", "point", "ray", "along", "normal"),
    [
        (BOX, (1, 2, 3), (-5, 0, 0), (1, 0, 0), 4, (-1, 0, 0)),
        (BOX, (1, 2, 3), (0, 6, 1), (0, -1, 0), 4, (0, 1, 0)),
        (BOX, (1, 2, 3), (-3, 0, 5), (ROOT, 0, -ROOT), math.sqrt(8), (-1, 0, 0)),
        (SPHERE, (2, 0, 0), (0, 0, 5), (0, 0, -1), 3, (0, 0, 1)),
        (ELLIPSOID, (1, 2, 3), (0, -6, 0), (0, 1, 0), 4, (0, -1, 0)),
        (CYLINDER, (1, 2, 0), (0, 0, 7), (0, 0, -1), 5, (0, 0, 1)),
        (CYLINDER, (1, 2, 0), (-4, 0, 1.5), (1, 0, 0), 3, (-1, 0, 0)),
        (CYLINDER, (1, 2, 0), (-2, 0, 3), (ROOT, 0, -ROOT), math.sqrt(2), (-1, 0, 0)),
        (CAPSULE, (1, 2, 0), (0, 0, 7), (0, 0, -1), 4, (0, 0, 1)),
        (CAPSULE, (1, 2, 0), (0, 5, 0.5), (0, -1, 0), 4, (0, 1, 0)),
        (CAPSULE, (1, 2, 0), (5, 0, -2.6), (-1, 0, 0), 5 - 0.8, (0.8, 0, -0.6)),
    ],
)
def test_entry_of_a_ray(kind, size, point, ray, along, normal):
    found, direction = entered(kind, size, point, ray)
    assert found == pytest.approx(along, abs=1e-5)
    np.testing.assert_allclose(direction, normal, atol=1e-5)


@pytest.mark.parametrize("kind", [BOX, SPHERE, ELLIPSOID, CYLINDER, CAPSULE])
def test_rays_that_miss_or_start_inside_have_no_entry(kind):
    size = (1.0, 1.0, 1.0)
    assert entered(kind, size, (-5, 0, 3), (1, 0, 0))[0] < 0  # above
    assert entered(kind, size, (-5, 3, 0), (1, 0, 0))[0] < 0  # to the side
    assert entered(kind, size, (-5, 0, 0), (-1, 0, 0))[0] < 0  # pointing away
    assert entered(kind, size, (0.1, 0.1, 0.1), (1, 0, 0))[0] < 0  # from inside
    assert entered(kind, size, (-5, 0, 0), (1, 0, 0))[0] == pytest.approx(4.0)


def test_ray_parallel_to_a_cylinder():
    """The ray is parallel to the round side, so only the ends matter."""
    assert entered(CYLINDER, (1, 2, 0), (0.5, 0, 9), (0, 0, -1))[0] == pytest.approx(7.0)
    assert entered(CYLINDER, (1, 2, 0), (1.5, 0, 9), (0, 0, -1))[0] < 0
    assert entered(CYLINDER, (1, 2, 0), (-3, 0, 2.5), (1, 0, 0))[0] < 0
