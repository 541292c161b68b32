"""Error of the contact query: distances to solids, against MuJoCo and sums over triangles."""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import mujoco as _mujoco
import numpy as np
import torch
from numpy.typing import NDArray

from benchmarks.benchmark import Setup
from drone_rl.sim.scenes.scene_file import SceneFile, load_scene
from drone_rl.sim.scenes.solids import Solids

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""
Floats = NDArray[np.float64]
_GEOM = mujoco.mjtGeom
POINTS = 1000
"""In each scene."""
_PROBE = 1e-3
"""Radius of the ball for which MuJoCo computes distances, metres."""
_AROUND = 0.5
"""Metres around a scene in which points are."""
_HIGH = 100.0
"""Metres above a height field from which rays are cast down."""


def bench_contacts(setup: Setup) -> dict[str, Any]:
    """Compare distances of random points in six scenes with independent ones.

    Returns:
        "contact_error_mm", the largest error; "contact_errors_mm", that of each scene.
    """
    count = 100 if setup.quick else POINTS
    with tempfile.TemporaryDirectory() as folder:
        errors = {scene.name: 1e3 * _largest_error(scene, count) for scene in _scenes(Path(folder))}
    return {"contact_error_mm": max(errors.values()), "contact_errors_mm": errors}


def _largest_error(scene: SceneFile, count: int) -> float:
    low, high = scene.bounds
    rng = np.random.default_rng(0)
    points = rng.uniform(low - _AROUND, high + _AROUND, (count, 3))
    found = Solids([scene]).distances(torch.from_numpy(points)).numpy()
    wanted, is_known = true_distances(scene, points)
    return float(np.abs(found - wanted)[is_known].max())


def true_distances(scene: SceneFile, points: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Return distances to the nearest solid, and which are known; points are (N, 3).

    Those of primitives and of convex meshes are MuJoCo's, those of others from all triangles.
    """
    nearest, is_known = np.full(len(points), np.inf), np.full(len(points), True)
    model = scene.model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for geom in np.flatnonzero(scene.solid).tolist():
        turn, center = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
        local = (points - center) @ turn
        if model.geom_type[geom] == _GEOM.mjGEOM_HFIELD:
            distance, is_sure = _to_field(model, data, geom, points, local)
            is_known &= is_sure
        elif model.geom_type[geom] == _GEOM.mjGEOM_MESH and scene.name != "convex":
            distance = _to_mesh(_corners(model, geom), local)
        else:
            continue
        nearest = np.minimum(nearest, distance)
    return np.minimum(nearest, _by_mujoco(scene, points)), is_known


def _by_mujoco(scene: SceneFile, points: Floats) -> Floats:
    """Return distances to primitives, and to convex meshes."""
    spec = mujoco.MjSpec.from_string(scene.mjcf, assets=dict(scene.assets))
    spec.worldbody.add_body(name="probe", mocap=True).add_geom(
        name="probe", type=_GEOM.mjGEOM_SPHERE, size=[_PROBE, 0.0, 0.0]
    )
    model = spec.compile()
    data, probe = mujoco.MjData(model), model.geom("probe").id
    refused = [int(_GEOM.mjGEOM_HFIELD)]
    if scene.name != "convex":
        refused.append(int(_GEOM.mjGEOM_MESH))
    geoms = [i for i in np.flatnonzero(scene.solid) if int(model.geom_type[i]) not in refused]
    found = np.full(len(points), np.inf)
    for i, point in enumerate(points):
        data.mocap_pos[:] = point
        mujoco.mj_kinematics(model, data)
        for geom in geoms:
            distance = mujoco.mj_geomDistance(model, data, geom, probe, 1000.0, None)
            found[i] = min(found[i], distance + _PROBE)
    return found


def _corners(model: Any, geom: int) -> Floats:
    """Return the corners of a mesh's triangles in its geom's frame. Shape: (F, 3, 3)."""
    mesh = model.mesh(int(model.geom_dataid[geom]))
    first, count = int(mesh.vertadr[0]), int(mesh.vertnum[0])
    faces = model.mesh_face[int(mesh.faceadr[0]) : int(mesh.faceadr[0]) + int(mesh.facenum[0])]
    return model.mesh_vert[first : first + count].astype(float)[faces]


def _to_mesh(corners: Floats, points: Floats) -> Floats:
    """Return distances to a mesh, negative where its triangles fill all directions."""
    found = np.empty(len(points))
    for i, point in enumerate(points):
        found[i] = _to_triangles(point, corners)
        if _winding(point, corners) > 0.99:
            found[i] = -found[i]
    return found


def _to_field(
    model: Any, data: Any, geom: int, points: Floats, local: Floats
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return distances to a height field, and where no edge of it is nearer."""
    field = model.hfield(int(model.geom_dataid[geom]))
    rows, columns = int(field.nrow[0]), int(field.ncol[0])
    x, y, high, _ = np.ravel(field.size).tolist()
    first = int(model.hfield_adr[int(model.geom_dataid[geom])])
    heights = model.hfield_data[first : first + rows * columns].reshape(rows, columns) * high
    axes = np.meshgrid(np.linspace(-x, x, columns), np.linspace(-y, y, rows))
    grid = np.stack([*axes, heights], -1)
    a, b, c, d = (grid[i : rows - 1 + i, j : columns - 1 + j] for i in (0, 1) for j in (0, 1))
    corners = np.concatenate([np.stack(of, 2).reshape(-1, 3, 3) for of in ((a, b, d), (a, d, c))])
    inside = np.minimum(x - np.abs(local[:, 0]), y - np.abs(local[:, 1]))
    found = np.full(len(points), np.inf)
    down = -data.geom_xmat[geom].reshape(3, 3)[:, 2]
    for i in np.flatnonzero(inside > 0.0):
        found[i] = _to_triangles(local[i], corners)
        start = points[i] - _HIGH * down
        if mujoco.mj_rayHfield(model, data, geom, start, down, None) < _HIGH:
            found[i] = -found[i]
    return found, np.abs(found) < inside


def _to_triangles(point: Floats, corners: Floats) -> float:
    """Return the distance of a point to the nearest of triangles: inside of it, or to an edge."""
    away, ends = point - corners, np.roll(corners, -1, axis=1)
    edges = ends - corners
    length = (edges**2).sum(-1)
    share = ((away * edges).sum(-1) / np.where(length > 0.0, length, 1.0)).clip(0.0, 1.0)
    least = np.linalg.norm(away - share[..., None] * edges, axis=-1).min(1)
    normal = np.cross(edges[:, 0], edges[:, 1])
    size = np.linalg.norm(normal, axis=-1)
    sides = (np.cross(edges, away) * normal[:, None]).sum(-1)
    is_over = (sides >= 0.0).all(1) & (size > 0.0)
    height = np.abs((away[:, 0] * normal).sum(-1)) / np.where(size > 0.0, size, 1.0)
    return float(np.where(is_over, height, least).min())


def _winding(point: Floats, corners: Floats) -> float:
    """Return the solid angle that triangles fill around a point, over 4 pi (van Oosterom)."""
    a, b, c = np.moveaxis(corners - point, 1, 0)
    la, lb, lc = (np.linalg.norm(of, axis=-1) for of in (a, b, c))
    over = (a * np.cross(b, c)).sum(-1)
    under = la * lb * lc + (a * b).sum(-1) * lc + (b * c).sum(-1) * la + (c * a).sum(-1) * lb
    return float(np.arctan2(over, under).sum() / (2.0 * np.pi))


def _scenes(folder: Path) -> Iterator[SceneFile]:
    """Yield scenes of primitives, convex and concave meshes and a height field; shipped ones."""
    rng = np.random.default_rng(1)
    kinds = ("box", "sphere", "capsule", "cylinder", "ellipsoid")
    primitives = "".join(
        f'<geom type="{kinds[i % 5]}" size="{_numbers(rng.uniform(0.1, 0.8, 3))}" {_pose(rng)}/>'
        for i in range(40)
    )
    yield _scene(
        folder, "primitives", primitives + '<geom type="plane" size="1 1 1" pos="0 0 -4"/>'
    )
    hulls = [f'vertex="{_numbers(rng.normal(size=(30, 3)) * 0.5)}"' for _ in range(6)]
    yield _scene(folder, "convex", *_meshes(hulls, rng))
    yield _scene(folder, "concave", *_meshes([_torus(), _bowl()], rng, repeat=3))
    heights = _numbers(rng.uniform(size=24 * 24))
    field = f'<hfield name="h" nrow="24" ncol="24" size="4 3 1.5 0.2" elevation="{heights}"/>'
    yield _scene(folder, "field", '<geom type="hfield" hfield="h" euler="0 0 30"/>', field)
    for name in ("indoor", "outdoor"):
        yield load_scene(name)


def _scene(folder: Path, name: str, geoms: str, assets: str = "") -> SceneFile:
    file = folder / f"{name}.xml"
    content = f"<asset>{assets}</asset><worldbody>{geoms}</worldbody>"
    file.write_text(f'<mujoco><compiler autolimits="true"/>{content}</mujoco>')
    return load_scene(file)


def _meshes(shapes: list[str], rng: np.random.Generator, repeat: int = 1) -> tuple[str, str]:
    """Return geoms of meshes at random places, and the meshes."""
    assets = "".join(
        f'<mesh name="m{i}" inertia="shell" {shape}/>' for i, shape in enumerate(shapes)
    )
    each = [i for i in range(len(shapes)) for _ in range(repeat)]
    return "".join(f'<geom type="mesh" mesh="m{i}" {_pose(rng)}/>' for i in each), assets


def _torus(around: int = 24, across: int = 12) -> str:
    """Return a closed ring of radius 1 and thickness 0.6."""
    u, v = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    a, b = 2 * np.pi * u / around, 2 * np.pi * v / across
    wide = 1.0 + 0.3 * np.cos(b)
    vertices = np.stack([wide * np.cos(a), wide * np.sin(a), 0.3 * np.sin(b)], -1).reshape(-1, 3)
    here, there = (u + 1) % around, (v + 1) % across
    w, x, y, z = u * across + v, here * across + v, here * across + there, u * across + there
    return _mesh(vertices, np.concatenate([np.stack(of, -1) for of in ((w, x, y), (w, y, z))]))


def _bowl(around: int = 24, up: int = 6) -> str:
    """Return the lower half of a sphere of radius 1, open above."""
    u, v = np.meshgrid(np.arange(around), np.arange(up + 1), indexing="ij")
    a, b = 2 * np.pi * u / around, 0.5 * np.pi * (v + 0.2) / (up + 0.2)
    flat = np.sin(b)
    vertices = np.stack([flat * np.cos(a), flat * np.sin(a), -np.cos(b)], -1).reshape(-1, 3)
    u, v = u[:, :-1], v[:, :-1]
    here, wide = (u + 1) % around, up + 1
    w, x, y, z = u * wide + v, here * wide + v, here * wide + v + 1, u * wide + v + 1
    return _mesh(vertices, np.concatenate([np.stack(of, -1) for of in ((w, x, y), (w, y, z))]))


def _mesh(vertices: Floats, faces: NDArray[np.int64]) -> str:
    return f'vertex="{_numbers(vertices)}" face="{" ".join(map(str, faces.reshape(-1)))}"'


def _pose(rng: np.random.Generator) -> str:
    place, turn = rng.uniform(-2.5, 2.5, 3), rng.normal(size=4)
    return f'pos="{_numbers(place)}" quat="{_numbers(turn)}"'


def _numbers(values: Floats) -> str:
    return " ".join(f"{value:.6g}" for value in values.reshape(-1))
