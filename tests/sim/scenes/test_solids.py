"""Distances to the solids of scenes, and paths that they stop, by numbers computed by hand."""

import math
import pickle
from pathlib import Path
from typing import Any

import mujoco as _mujoco
import numpy as np
import pytest
import torch

from drone_rl.sim.scenes.scene_file import load_scene
from drone_rl.sim.scenes.solids import Solids, Triangles, closed_parts
from drone_rl.utils.errors import InputError

mujoco: Any = _mujoco
_HALF = math.sqrt(0.5)
_CORNERS = "0 0 0  2 0 0  2 1 0  1 1 0  1 2 0  0 2 0"
_FLOOR = ((0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5))


def solids(folder: Path, *scenes: str) -> Solids:
    """Return the solids of scenes, given the content of their MJCF files."""
    files = []
    for number, content in enumerate(scenes):
        file = folder / f"{number}.xml"
        file.write_text(f"<mujoco>{content}</mujoco>")
        files.append(load_scene(file))
    return Solids(files)


def world(*geoms: str, before: str = "") -> str:
    """Return the content of an MJCF file with geoms."""
    return before + f"<worldbody>{''.join(f'<geom {of}/>' for of in geoms)}</worldbody>"


def points(*rows: tuple[float, float, float]) -> torch.Tensor:
    """Return points. Shape: (N, 3)."""
    return torch.tensor(rows, dtype=torch.float64)


def l_shape() -> str:
    """Return a prism of height 1 over an L of three unit squares, whose concave edge is (1, 1)."""
    above = " ".join(f"{x} {y} 1" for x, y in ((0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)))
    faces = [(c, b, a) for a, b, c in _FLOOR] + [(a + 6, b + 6, c + 6) for a, b, c in _FLOOR]
    for i in range(6):
        after = (i + 1) % 6
        faces += [(i, after, after + 6), (i, after + 6, i + 6)]
    numbers = " ".join(str(i) for face in faces for i in face)
    mesh = f'<asset><mesh name="l" vertex="{_CORNERS} {above}" face="{numbers}"/></asset>'
    return world('type="mesh" mesh="l"', before=mesh)


def room(*, is_whole: bool = False) -> str:
    """Return four single walls of a room of 4 x 4 m and height 2 around the origin, as one mesh.

    With floor and ceiling if it is whole; all face the inside.
    """
    corners = ((-2, -2), (2, -2), (2, 2), (-2, 2))
    vertices = " ".join(f"{x} {y} {z}" for z in (0, 2) for x, y in corners)
    faces = [
        f
        for i in range(4)
        for f in ((i, (i + 1) % 4, i + 4), ((i + 1) % 4, (i + 1) % 4 + 4, i + 4))
    ]
    if is_whole:
        faces += [(0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7)]
    faces = [(c, b, a) for a, b, c in faces]
    numbers = " ".join(str(i) for face in faces for i in face)
    mesh = f'<asset><mesh name="r" vertex="{vertices}" face="{numbers}" inertia="shell"/></asset>'
    return world('type="mesh" mesh="r"', before=mesh)


def test_primitives_in_any_attitude_have_exact_distances(tmp_path: Path) -> None:
    """A box turned by 45 degrees, a tilted capsule, a lying cylinder, an ellipsoid, a slope."""
    known = [
        ('type="box" size="1 1 1" euler="0 0 45"', (2.0, 0.0, 0.0), 2.0 - math.sqrt(2.0)),
        ('type="box" size="1 1 1" euler="0 0 45"', (_HALF, _HALF, 0.0), 0.0),
        ('type="box" size="1 2 3"', (0.9, 0.0, 0.0), -0.1),
        ('type="box" size="1 2 3"', (4.0, 6.0, 3.0), 5.0),
        ('type="capsule" size="0.5 1" euler="0 90 0"', (3.0, 0.0, 0.0), 1.5),
        ('type="capsule" size="0.5 1" euler="0 90 0"', (0.5, 0.0, 2.0), 1.5),
        ('type="cylinder" size="1 2" euler="90 0 0"', (4.0, 6.0, 0.0), 5.0),
        ('type="cylinder" size="1 2" euler="90 0 0"', (0.5, 0.0, 0.0), -0.5),
        ('type="ellipsoid" size="1 2 3"', (0.0, 0.0, 5.0), 2.0),
        ('type="ellipsoid" size="1 2 3"', (0.0, 0.0, 0.0), -1.0),
        ('type="sphere" size="2" pos="1 0 0"', (1.0, 3.0, 4.0), 3.0),
        ('type="plane" size="1 1 1" euler="0 90 0"', (3.0, 5.0, 7.0), 3.0),
    ]
    for geom, place, distance in known:
        found = solids(tmp_path, world(geom)).nearest(points(place))
        assert float(found.distance) == pytest.approx(distance, abs=1e-9), geom
        assert float(found.normal.norm()) == pytest.approx(1.0), geom


def test_a_mesh_is_solid_in_its_concave_shape_not_in_its_hull(tmp_path: Path) -> None:
    """The notch of an L is free; its inside is not."""
    shape = solids(tmp_path, l_shape())
    places = points((1.25, 1.5, 0.5), (1.5, 1.5, 0.5), (0.5, 0.5, 0.6), (1.5, 0.9, 0.5), (0, 0, 3))
    wanted = (0.25, 0.5, -0.4, -0.1, 2.0)
    assert shape.distances(places).tolist() == pytest.approx(wanted, abs=1e-5)
    assert shape.nearest(places).normal[0].tolist() == pytest.approx((1.0, 0.0, 0.0), abs=1e-5)


def test_single_walls_are_solid_at_their_surface_alone(tmp_path: Path) -> None:
    """The inside of a room as one open mesh is free, and its walls stop a ball from both sides."""
    walls = solids(tmp_path, room())
    found = walls.distances(points((0, 0, 0), (1.5, 0, 0), (2.5, 0, 0)))
    assert found.tolist() == pytest.approx((2.0, 0.5, 0.5), abs=1e-5)
    way = walls.sweep(points((0, 0, 0), (4, 0, 0)), points((4, 0, 0), (0, 0, 0)), 0.25)
    assert way.fraction.tolist() == pytest.approx((1.75 / 4, 1.75 / 4), abs=1e-5)


def test_a_room_that_faces_its_inside_is_free(tmp_path: Path) -> None:
    """Although its walls, floor and ceiling enclose a volume."""
    walls = solids(tmp_path, room(is_whole=True))
    assert walls.distances(points((0, 0, 1), (1.5, 0, 1))).tolist() == pytest.approx((1.0, 0.5))


def test_all_that_is_below_a_height_field_is_inside(tmp_path: Path) -> None:
    """A ramp that rises by 2 m over 4 m; its surface is 1 m high in the middle."""
    field = (
        '<asset><hfield name="h" nrow="2" ncol="2" size="2 2 2 0.1" elevation="0 1 0 1"/></asset>'
    )
    ramp = solids(tmp_path, world('type="hfield" hfield="h"', before=field))
    steep = 2.0 / math.sqrt(5.0)  # of the slope's normal, upwards
    heights = points((0, 0, 2), (0, 0, 0.5), (0, 0, -5))
    wanted = (steep, -0.5 * steep, -2.0)
    assert ramp.distances(heights).tolist() == pytest.approx(wanted, abs=1e-5)


def test_a_height_field_is_where_mujoco_casts_its_rays(tmp_path: Path) -> None:
    """Cells are split into triangles along the same diagonal."""
    field = '<asset><hfield name="h" nrow="3" ncol="3" size="2 3 1 1" elevation="{}"/></asset>'
    bumpy = world('type="hfield" hfield="h"', before=field.format("0 0 0 0 1 0 0 0 0.5"))
    ground = solids(tmp_path, bumpy)
    model = load_scene(tmp_path / "0.xml").model
    data, down = mujoco.MjData(model), np.array([0.0, 0.0, -1.0])
    mujoco.mj_kinematics(model, data)
    for x, y in np.random.default_rng(0).uniform((-2, -3), (2, 3), (50, 2)):
        start = np.array([x, y, 5.0])
        length = mujoco.mj_rayHfield(model, data, 0, start, down, None)
        begin = torch.from_numpy(start)[None]
        found = ground.sweep(begin, begin + torch.from_numpy(down) * 10.0)
        assert 10.0 * float(found.fraction) == pytest.approx(length, abs=1e-6)


def test_a_wall_thinner_than_a_step_stops_a_ball(tmp_path: Path) -> None:
    """A wall of 2 mm, head on, obliquely and just missed; its name is known."""
    wall = solids(tmp_path, world('name="wall" type="box" size="0.001 1 1" pos="5 0 0"'))
    before, radius = points((0, 0, 0), (3, -2, 0), (0, 1.3, 0), (0, 1.2, 0)), 0.25
    ends = points((10, 0, 0), (7, 2, 0), (10, 1.3, 0), (10, 1.2, 0))
    found = wall.sweep(before, ends, radius)
    oblique = (2.0 - 0.001 - radius) / 4.0
    edge = (5.0 - 0.001 - math.sqrt(radius**2 - 0.2**2)) / 10.0
    wanted = ((5 - 0.001 - radius) / 10, oblique, math.inf, edge)
    assert found.fraction.tolist() == pytest.approx(wanted, abs=1e-8)
    assert wall.name(int(found.solid[0])) == "wall"


def test_a_ball_that_touches_may_move_along_and_away(tmp_path: Path) -> None:
    """From the place where a wall stopped it; into the wall it does not move at all."""
    for wall in (
        'type="box" size="1 5 5" pos="2 0 0" euler="0 0 0"',
        'type="plane" size="1 1 1" pos="1 0 0" euler="0 -90 0"',
    ):
        scene = solids(tmp_path, world(wall))
        here = points((0.75, 0, 0)).repeat(4, 1)
        ways = points((1, 0, 0), (0, 1, 0), (-1, 0, 0), (0.5, 1, 0))
        found = scene.sweep(here, here + ways, 0.25).fraction
        assert found.tolist() == pytest.approx((0.0, math.inf, math.inf, 0.0))


@pytest.mark.parametrize("height", [0.0, 0.123456789])
def test_a_point_on_a_wall_does_not_pass_it(tmp_path: Path, height: float) -> None:
    """Of a closed mesh: on its top, away and along, not in. Of a single wall: from both sides."""
    top = solids(tmp_path, l_shape().replace('mesh="l"', f'mesh="l" pos="0 0 {height}"'))
    here = points((0.5, 0.5, 1 + height)).repeat(3, 1)
    found = top.sweep(here, here + points((0, 0.1, -3), (0, 0, 3), (0.3, 0, 0))).fraction
    assert found.tolist() == pytest.approx((0.0, math.inf, math.inf), abs=1e-6)
    wall = solids(tmp_path, room())
    for start in ((0.2, 0.3, 1.1), (4.2, 0.3, 1.1)):
        before, way = points(start), points((2, 0.1, 0)) - points((0.3, 0.1, 0))
        way = way if start[0] < 2 else -way
        there = before + wall.sweep(before, before + 2 * way).fraction[:, None] * 2 * way
        assert float(there[0, 0]) == pytest.approx(2.0, abs=1e-8)
        ways = torch.cat([way, -way])
        again = wall.sweep(there.repeat(2, 1), there + ways).fraction
        assert again.tolist() == pytest.approx((0.0, math.inf), abs=1e-8)


def test_a_path_without_a_place_meets_nothing(tmp_path: Path) -> None:
    """NaN is no contact, of primitives or meshes."""
    scene = solids(tmp_path, l_shape().replace("</worldbody>", '<geom size="1"/></worldbody>'))
    before, now = points((math.nan, 0, 0), (5, 0, 0)), points((5, 0, 0), (math.nan, 0, 0))
    assert scene.sweep(before, now, 0.3).fraction.tolist() == [math.inf, math.inf]


def test_each_environment_has_its_own_scene(tmp_path: Path) -> None:
    """A group below the world is absent, also where it has a plane without bounds."""
    two = solids(tmp_path, world('type="sphere" size="1"'), world('type="plane" size="1 1 1"'))
    place = points((0, 0, 3), (0, 0, 3))
    assert two.distances(place, torch.tensor([0, 1])).tolist() == [2.0, 3.0]
    moved = torch.tensor([[[0.0, 0.0, 1.0], [0.0, 0.0, -10_000.0]]], dtype=torch.float64)
    assert two.nearest_at(place[:1], moved).distance.tolist() == [1.0]
    assert two.nearest(place[:1], 0, within=1.5).solid.tolist() == [-1]
    assert len(pickle.loads(pickle.dumps(two))) == 2
    with pytest.raises(InputError, match="there are 2 scenes"):
        two.distances(place, 2)


def test_many_solids_agree_with_each_one_alone(tmp_path: Path) -> None:
    """A tree of 300 balls finds what a search of all of them finds."""
    random = np.random.default_rng(0)
    places, sizes = random.uniform(-10, 10, (300, 3)).round(2), random.uniform(0.1, 1, 300).round(2)
    geoms = [
        f'type="sphere" size="{size}" pos="{x} {y} {z}"'
        for (x, y, z), size in zip(places, sizes, strict=True)
    ]
    scene = solids(tmp_path, world(*geoms))
    where = random.uniform(-12, 12, (200, 3))
    each = np.linalg.norm(where[:, None] - places, axis=2) - sizes
    found = scene.nearest(torch.from_numpy(where))
    assert found.distance.numpy() == pytest.approx(each.min(1), abs=1e-6)
    assert scene.geoms[found.solid.numpy(), 1].tolist() == each.argmin(1).tolist()


def test_closed_parts_of_a_mesh_are_found() -> None:
    """A tetrahedron is closed, a single triangle next to it is not."""
    corners = np.array(
        [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (5, 0, 0), (6, 0, 0), (5, 1, 0)]
    )
    faces = np.array([(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3), (4, 5, 6)])
    closed = closed_parts(Triangles(corners.astype(float), faces.astype(np.int32)))
    assert closed.tolist() == [True] * 4 + [False]
