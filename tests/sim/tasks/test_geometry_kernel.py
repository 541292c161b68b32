"""Distances and paths, by hand and against MuJoCo."""

import mujoco
import numpy as np
import pytest
import warp as wp

from drone_rl.sim.rendering.devices import start_warp
from drone_rl.sim.tasks import geometry_kernel as geometry
from drone_rl.sim.tasks.geometry_kernel import BALL, BOX, CYLINDER, OBSTACLE

_GEOMS = {int(BALL): "sphere", int(CYLINDER): "cylinder", int(BOX): "box"}


def one(shape, size, heading=0.0):
    """An obstacle at x = 10."""
    start_warp("cpu")
    objects = geometry.Objects()
    objects.shapes = wp.array([int(shape)], dtype=int, device="cpu")
    objects.roles = wp.array([int(OBSTACLE)], dtype=int, device="cpu")
    objects.sizes = wp.array([size], dtype=wp.vec3d, device="cpu")
    turn = np.cos(np.radians(heading)), np.sin(np.radians(heading))
    objects.turns = wp.array([turn], dtype=wp.vec2d, device="cpu")
    objects.places = wp.array([[(10.0, 0.0, 0.0)]], dtype=wp.vec3d, device="cpu")
    objects.present = wp.array([[True]], dtype=wp.bool, device="cpu")
    objects.touched = wp.array([[False]], dtype=wp.bool, device="cpu")
    return objects


@wp.kernel
def query(objects: geometry.Objects, points: wp.array[wp.vec3d], found: wp.array[geometry.Nearest]):
    i = wp.tid()
    found[i] = geometry.nearest(objects, 0, points[i], OBSTACLE)


def nearest(objects, points):
    found = wp.empty(len(points), dtype=geometry.Nearest, device="cpu")
    places = wp.array(points, dtype=wp.vec3d, device="cpu")
    wp.launch(query, len(points), inputs=[objects, places, found], device="cpu")
    return found.numpy()


@wp.kernel
def paths(
    objects: geometry.Objects,
    before: wp.array[wp.vec3d],
    now: wp.array[wp.vec3d],
    radius: wp.float64,
    when: wp.array[wp.float64],
):
    i = wp.tid()
    when[i] = geometry.sweep(objects, 0, 0, before[i], now[i], radius)


def sweep(objects, before, now, radius):
    when = wp.empty(len(before), dtype=wp.float64, device="cpu")
    ends = [wp.array(e, dtype=wp.vec3d, device="cpu") for e in (before, now)]
    wp.launch(paths, len(before), inputs=[objects, *ends, radius, when], device="cpu")
    return when.numpy()


@pytest.mark.parametrize(
    ("shape", "size", "point", "distance"),
    [
        (BALL, (2.0, 2.0, 2.0), (5.0, 0.0, 0.0), 3.0),
        (BOX, (1.0, 2.0, 3.0), (10.0, 6.0, 6.0), 5.0),
        (BOX, (1.0, 2.0, 3.0), (10.5, 0.0, 0.0), -0.5),
        (CYLINDER, (1.0, 1.0, 2.0), (10.0, 0.0, 2.5), 0.5),
        (CYLINDER, (1.0, 1.0, 2.0), (14.0, 0.0, 6.0), 5.0),
    ],
)
def test_distances(shape, size, point, distance):
    (found,) = nearest(one(shape, size), [point])
    assert found["distance"] == pytest.approx(distance)
    assert found["thing"] == 0


def test_a_box_is_turned_to_the_left():
    box = one(BOX, (3.0, 1.0, 1.0), heading=90.0)  # 2 m along x and 6 m along y
    assert nearest(box, [(6.0, 0.0, 0.0)])[0]["distance"] == pytest.approx(3.0)
    assert nearest(box, [(10.0, 4.0, 0.0)])[0]["distance"] == pytest.approx(1.0)
    box = one(BOX, (2.0, 1.0, 1.0), heading=30.0)
    tip = 10.0 + 2.0 * np.cos(np.pi / 6), 2.0 * np.sin(np.pi / 6), 0.0  # of its own x axis
    assert nearest(box, [tip])[0]["distance"] == pytest.approx(0.0, abs=1e-12)
    # along y at x = 10 the side is 1 m / cos 30 degrees away
    (when,) = sweep(box, [(10.0, 5.0, 0.0)], [(10.0, 0.0, 0.0)], 0.0)
    assert when == pytest.approx((5.0 - 1.0 / np.cos(np.pi / 6)) / 5.0)


@pytest.mark.parametrize("shape", _GEOMS)
def test_distances_are_mujocos(shape):
    size = {int(BALL): (1.5,) * 3, int(CYLINDER): (0.8, 0.8, 2.0), int(BOX): (0.5, 1.5, 2.0)}[shape]
    named = {"sphere": "1.5", "cylinder": "0.8 2.0", "box": "0.5 1.5 2.0"}[_GEOMS[shape]]
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody><geom type="{_GEOMS[shape]}" size="{named}" pos="10 0 0"/>
        <body mocap="true"><geom type="sphere" size="0.001"/></body></worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    points = np.random.default_rng(0).uniform((6, -4, -4), (14, 4, 4), (200, 3))
    found = nearest(one(shape, size), [tuple(p) for p in points])["distance"]
    for point, distance in zip(points, found, strict=True):
        data.mocap_pos[0] = point
        mujoco.mj_forward(model, data)
        stated = mujoco.mj_geomDistance(model, data, 0, 1, 20.0, None) + 0.001
        if distance > 0.0:  # inside, MuJoCo's solver is approximate
            assert distance == pytest.approx(stated, abs=1e-4)


def test_a_path_touches_at_the_ball_around_the_drone():
    ball = one(BALL, (2.0, 2.0, 2.0))
    before = [(0.0, 0.0, 0.0), (0.0, 2.9, 0.0), (0.0, 3.1, 0.0), (8.0, 0.0, 0.0), (0.0, 0.0, 0.0)]
    now = [(20.0, 0.0, 0.0), (20.0, 2.9, 0.0), (20.0, 3.1, 0.0), (9.0, 0.0, 0.0), (6.9, 0.0, 0.0)]
    # the reach is 3 m; beside it, half of the chord is the root of 9 - 2.9 squared
    graze = (10.0 - np.sqrt(9.0 - 2.9**2)) / 20.0
    expected = [7.0 / 20.0, graze, np.inf, 0.0, np.inf]
    assert sweep(ball, before, now, 1.0) == pytest.approx(expected, abs=1e-7)


def test_a_wall_thinner_than_a_step_stops_a_path():
    wall = one(BOX, (0.005, 5.0, 5.0))
    assert sweep(wall, [(9.5, 0.0, 0.0)], [(10.5, 0.0, 0.0)], 0.1) == pytest.approx([0.395])


def test_absent_objects_have_no_distance():
    objects = one(BOX, (1.0, 1.0, 1.0))
    objects.present = wp.array([[False]], dtype=wp.bool, device="cpu")
    (found,) = nearest(objects, [(0.0, 0.0, 0.0)])
    assert found["distance"] == np.inf and found["thing"] == -1
