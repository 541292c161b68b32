"""What can be touched in scenes: distances, and paths that it stops."""

import dataclasses
import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import mujoco as _mujoco
import numpy as np
import torch
import warp as wp
from numpy.typing import NDArray
from torch import Tensor

from drone_rl.sim.rendering.devices import WorkerPool, on_torch_stream, start_warp
from drone_rl.sim.scenes import solids_kernel as kernel
from drone_rl.sim.scenes.compiling import UNNAMED
from drone_rl.sim.scenes.scene_file import SceneFile
from drone_rl.utils.errors import InputError

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""

ABSENT = (0.0, 0.0, -10_000.0)
"""Place of a group that is not there."""
_GEOM = mujoco.mjtGeom
_KINDS = {
    int(_GEOM.mjGEOM_PLANE): kernel.PLANE,
    int(_GEOM.mjGEOM_SPHERE): kernel.BALL,
    int(_GEOM.mjGEOM_CAPSULE): kernel.CAPSULE,
    int(_GEOM.mjGEOM_ELLIPSOID): kernel.ELLIPSOID,
    int(_GEOM.mjGEOM_CYLINDER): kernel.CYLINDER,
    int(_GEOM.mjGEOM_BOX): kernel.BOX,
}
_DEEP = 1000.0
"""Metres that a height field reaches down: all that is below its surface is inside."""
_LEAST_WORK = 2000
"""Points from which more threads are faster."""


class Triangles(NamedTuple):
    """Triangles in the frame of their geom, metres."""

    vertices: NDArray[np.float64]
    """Shape: (V, 3)."""
    faces: NDArray[np.int32]
    """Numbers of vertices. Shape: (F, 3)."""


class Nearest(NamedTuple):
    """What is nearest to each of N points."""

    distance: Tensor
    """To its surface, metres; negative inside; infinite if there is nothing. Shape: (N,)."""
    normal: Tensor
    """Unit vectors out of it, world frame. Shape: (N, 3)."""
    solid: Tensor
    """Its number in `Solids.geoms`, or -1. Shape: (N,), int32."""


class Sweep(NamedTuple):
    """Where N paths end."""

    fraction: Tensor
    """Of the path; infinite where nothing is in the way. Shape: (N,)."""
    solid: Tensor
    """Number of what is in the way in `Solids.geoms`, or -1. Shape: (N,), int32."""


class Solids:
    """The solid geoms of scenes: exact primitives, and triangles of meshes and height fields.

    Each scene is a group, which has a place of its own in each environment. A mesh that is closed
    has an inside; one with single walls is solid only at its surface. A plane has no bounds, and
    all that is below a height field is inside.
    """

    def __init__(self, scenes: Sequence[SceneFile], device: str = "cpu") -> None:
        """Collect the solid geoms of scenes.

        Args:
            scenes: The G scenes.
            device: Where queries run, "cpu" or a GPU.
        """
        start_warp(device)
        self.device, self.count = device, len(scenes)
        self._scenes = tuple(scenes)
        self._meshes: list[Any] = []
        rows: list[tuple[Any, ...]] = []
        nodes: list[tuple[Any, ...]] = []
        geoms: list[tuple[int, int]] = []
        roots = [0]
        for group, scene in enumerate(scenes):
            first, bounds = len(rows), []
            for geom, row, box in self._solids_of(scene):
                geoms.append((group, geom))
                rows.append(row)
                bounds.append(box)
            nodes += _tree(np.array(bounds).reshape(-1, 2, 3), first, len(nodes))
            roots.append(len(nodes))
        self.geoms: NDArray[np.int64] = np.array(geoms, dtype=np.int64).reshape(-1, 2)
        """Scene, and number in its model, of each of S solids. Shape: (S, 2)."""
        self.arrays: Any = kernel.SolidArrays()
        """What kernels read, without places; see `at`."""
        self.arrays.solids = _structs(rows, kernel.Solid, device)
        self.arrays.nodes = _structs(nodes, kernel.Node, device)
        self.arrays.roots = wp.array(np.array(roots, dtype=np.int32), dtype=int, device=device)
        self._workers = WorkerPool(2**30)

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy the scenes; Warp's arrays and meshes can't be copied."""
        return type(self), (self._scenes, self.device)

    def __len__(self) -> int:
        """Return the number of solids."""
        return len(self.geoms)

    def name(self, solid: int) -> str:
        """Return the name of a solid's geom in the file, else of its body, else a number's."""
        scene, geom = self.geoms[solid].tolist()
        model = self._scenes[scene].model
        own, body = model.geom(geom).name, model.body(model.geom_bodyid[geom]).name
        has_own = own and not own.startswith(UNNAMED)
        return own if has_own or body == "world" or body.startswith(UNNAMED) else body

    def at(self, places: Tensor) -> Any:
        """Return `SolidArrays` for kernels, with groups at places, (N, G, 3), metres, float64.

        A group at `ABSENT` is not there. The arrays share the memory of contiguous places.
        """
        arrays: Any = kernel.SolidArrays()
        for name in ("solids", "nodes", "roots"):
            setattr(arrays, name, getattr(self.arrays, name))
        arrays.places = wp.from_torch(places.contiguous(), dtype=wp.vec3d)
        return arrays

    def places(self, scenes: Tensor | None = None) -> Tensor:
        """Return the places of groups where one scene, by number, (N,), is there. (N, G, 3)."""
        if scenes is None:
            scenes = torch.zeros(1, dtype=torch.int64)
        absent = torch.tensor(ABSENT, dtype=torch.float64)
        places = absent.repeat(len(scenes), self.count, 1)
        places[torch.arange(len(scenes)), scenes.cpu()] = 0.0
        return places.to(self.device)

    def distances(self, points: Tensor, scenes: Tensor | int = 0) -> Tensor:
        """Return the distances of points to the nearest surface; see `nearest`. Shape: (N,)."""
        return self.nearest(points, scenes).distance

    def nearest(
        self, points: Tensor, scenes: Tensor | int = 0, within: float = torch.inf
    ) -> Nearest:
        """Return what is nearest to points.

        Args:
            points: Metres, world frame. Shape: (N, 3).
            scenes: The scene of each point, (N,), or of all.
            within: Distance up to which solids are searched, metres.

        Raises:
            InputError: A scene's number or a shape is wrong.
        """
        return self.nearest_at(points, *self._where(points, scenes), within=within)

    def sweep(
        self, before: Tensor, now: Tensor, radius: float = 0.0, scenes: Tensor | int = 0
    ) -> Sweep:
        """Return where solids stop balls that go straight.

        A ball that touches or overlaps a solid may move along it and away from it; a ball whose
        centre is inside of a closed mesh is not stopped by it. Nothing stops a path with a NaN.

        Args:
            before: Where the balls start, metres, world frame. Shape: (N, 3).
            now: Where they go. Shape: (N, 3).
            radius: Of the balls, metres.
            scenes: The scene of each, (N,), or of all.

        Raises:
            InputError: A scene's number or a shape is wrong.
        """
        if before.shape != now.shape:
            raise InputError(f"paths from {before.shape} to {now.shape}; give as many ends")
        return self.sweep_at(before, now, radius, *self._where(before, scenes))

    def _where(self, points: Tensor, scenes: Tensor | int) -> tuple[Tensor, Tensor]:
        """Return places of all scenes, (G, G, 3), and which row each point reads, (N,)."""
        if points.ndim != 2 or points.shape[1] != 3:
            raise InputError(f"points have shape {tuple(points.shape)}; give (N, 3)")
        numbers = torch.as_tensor(scenes, device=points.device).expand(len(points))
        if len(numbers) and not 0 <= int(numbers.min()) <= int(numbers.max()) < self.count:
            raise InputError(f"scenes={scenes} is out of range; there are {self.count} scenes")
        return self.places(torch.arange(self.count)), numbers

    def nearest_at(
        self, points: Tensor, places: Tensor, rows: Tensor | None = None, within: float = torch.inf
    ) -> Nearest:
        """Return what is nearest, with groups at places.

        Args:
            points: See `nearest`.
            places: See `at`.
            rows: Row of places that each point reads, (N,); by default its own.
            within: See `nearest`.
        """
        count = len(points)
        distance = torch.empty(count, dtype=torch.float64, device=self.device)
        normal = torch.empty(count, 3, dtype=torch.float64, device=self.device)
        solid = torch.empty(count, dtype=torch.int32, device=self.device)
        outputs = [wp.from_torch(distance), _vectors(normal), wp.from_torch(solid)]
        given = [_vectors(points.double()), self._rows(rows, count), within]
        self._launch(kernel.nearest_all, places, given, outputs, count)
        return Nearest(distance, normal, solid)

    def sweep_at(
        self,
        before: Tensor,
        now: Tensor,
        radius: float,
        places: Tensor,
        rows: Tensor | None = None,
    ) -> Sweep:
        """Return where solids stop balls, with groups at places; see `sweep` and `nearest_at`."""
        count = len(before)
        fraction = torch.empty(count, dtype=torch.float64, device=self.device)
        solid = torch.empty(count, dtype=torch.int32, device=self.device)
        ends = [_vectors(of.double()) for of in (before, now)]
        given = [*ends, self._rows(rows, count), radius]
        outputs = [wp.from_torch(fraction), wp.from_torch(solid)]
        self._launch(kernel.sweep_all, places, given, outputs, count)
        return Sweep(fraction, solid)

    def _rows(self, rows: Tensor | None, count: int) -> Any:
        if rows is None:
            rows = torch.arange(count, device=self.device)
        return wp.from_torch(rows.int().contiguous())

    def _launch(
        self, of: Any, places: Tensor, given: Sequence[Any], outputs: Sequence[Any], count: int
    ) -> None:
        arrays = self.at(places)

        def work(member: int, first: int, last: int) -> None:
            inputs = [arrays, *given, first, *outputs]
            wp.launch(of, last - first, inputs=inputs, device=self.device)

        if self.device == "cpu" and count >= _LEAST_WORK:
            _load("cpu")
            self._workers.map_spans(0, count, work)
        else:
            with on_torch_stream(torch.device(self.device)):
                work(0, 0, count)

    def _solids_of(self, scene: SceneFile) -> Any:
        """Yield the number, the fields of `Solid` and the bounds of each solid of a scene."""
        model, data = scene.model, scene.data
        meshes = dict[tuple[bool, int], list[tuple[int, Any, NDArray[np.float64]]]]()
        for geom in np.flatnonzero(scene.solid).tolist():
            center = data.geom_xpos[geom].copy()
            turn, size = data.geom_xmat[geom].reshape(3, 3).copy(), model.geom_size[geom].copy()
            kind = _KINDS.get(int(model.geom_type[geom]))
            if kind is not None:
                half = _half_extents(kind, size)
                yield geom, (kind, 0, center, turn, size), _box(center, turn, -half, half)
                continue
            is_field = model.geom_type[geom] == _GEOM.mjGEOM_HFIELD
            key = is_field, int(model.geom_dataid[geom])
            if key not in meshes:
                meshes[key] = self._make_meshes(triangles_of(model, geom), is_field)
            for kind, mesh, (low, high) in meshes[key]:
                size = np.maximum(-low, high).clip(0.0)
                yield geom, (kind, mesh, center, turn, size), _box(center, turn, low, high)

    def _make_meshes(
        self, triangles: Triangles, is_closed: bool
    ) -> list[tuple[int, Any, NDArray[np.float64]]]:
        """Return kind, Warp's mesh and bounds of the closed parts, and of the others."""
        vertices, faces = triangles
        closed = np.full(len(faces), True) if is_closed else closed_parts(triangles)
        a, b, c = (vertices[faces[:, i]] for i in range(3))
        has_area = np.linalg.norm(np.cross(b - a, c - a), axis=1) > 0.0
        made = []
        for kind, some in (kernel.BODY, closed), (kernel.SURFACE, ~closed):
            own = faces[some & has_area]
            if len(own):
                points = wp.array(vertices.astype(np.float32), dtype=wp.vec3, device=self.device)
                indices = wp.array(own.reshape(-1).astype(np.int32), dtype=int, device=self.device)
                mesh = wp.Mesh(points, indices)
                self._meshes.append(mesh)
                corners = vertices[own].reshape(-1, 3)
                made.append((kind, mesh.id, np.stack([corners.min(0), corners.max(0)])))
        return made


@dataclasses.dataclass(frozen=True, eq=False)
class PlacedSolids:
    """The solids around the drones of N environments, which stay where they are."""

    solids: Solids
    places: Tensor  # (N, G, 3) float64
    """See `Solids.at`."""
    radius: float
    """Of the ball around a drone, metres."""

    def reached(self, before: Tensor, now: Tensor) -> Tensor:
        """Return where balls get to that go straight, the first solid at most. Shapes: (N, 3)."""
        fraction = self.solids.sweep_at(before, now, self.radius, self.places).fraction[:, None]
        return torch.where(fraction <= 1.0, before + fraction.clamp(max=1.0) * (now - before), now)

    def touched(self, before: Tensor | None, now: Tensor) -> tuple[Tensor, Tensor]:
        """Return which balls touch a solid, and how far it is from their centres.

        Args:
            before: Where they come from, (N, 3); None if solids have stopped them on their way.
            now: Where they are. Shape: (N, 3).

        Returns:
            Shapes: (N,), bool, and (N,), float64, metres.
        """
        distance = self.solids.nearest_at(now, self.places).distance
        is_touching = distance <= self.radius + float(kernel.TOUCHING)
        if before is not None:
            way = self.solids.sweep_at(before, now, self.radius, self.places)
            is_touching |= way.fraction <= 1.0
        return is_touching, distance


@functools.lru_cache(8)
def solids_of(scenes: tuple[SceneFile, ...], device: str) -> Solids:
    """Return the solids of scenes; the same object for the same scenes."""
    return Solids(scenes, device)


def triangles_of(model: Any, geom: int) -> Triangles:
    """Return the triangles of a geom that is a mesh or a height field of a compiled model.

    A height field has sides, and a bottom far below.
    """
    number = int(model.geom_dataid[geom])
    if model.geom_type[geom] == _GEOM.mjGEOM_HFIELD:
        rows, columns = int(model.hfield_nrow[number]), int(model.hfield_ncol[number])
        first = int(model.hfield_adr[number])
        heights = model.hfield_data[first : first + rows * columns].reshape(rows, columns)
        return _field_triangles(heights, model.hfield_size[number])
    start, count = int(model.mesh_vertadr[number]), int(model.mesh_vertnum[number])
    vertices = model.mesh_vert[start : start + count].astype(np.float64)
    start, count = int(model.mesh_faceadr[number]), int(model.mesh_facenum[number])
    return Triangles(vertices, model.mesh_face[start : start + count].astype(np.int32))


def _field_triangles(heights: NDArray[np.float64], size: NDArray[np.float64]) -> Triangles:
    """Return the triangles of heights from 0 to 1, (rows, columns), of a size as in MuJoCo."""
    rows, columns = heights.shape
    x, y = np.linspace(-size[0], size[0], columns), np.linspace(-size[1], size[1], rows)
    top = np.stack([*np.meshgrid(x, y), heights * size[2]], -1).reshape(-1, 3)
    grid = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = (grid[i : rows - 1 + i, j : columns - 1 + j] for i in (0, 1) for j in (0, 1))
    surface = [np.stack(of, -1).reshape(-1, 3) for of in ((a, b, d), (a, d, c))]
    rim = np.concatenate([grid[0, :-1], grid[:-1, -1], grid[-1, :0:-1], grid[:0:-1, 0]])
    bottom = top[rim] * (1.0, 1.0, 0.0) - (0.0, 0.0, max(size[3], _DEEP))
    count, here = len(rim), np.arange(len(rim))
    after, below = np.roll(here, -1), rows * columns
    sides = [
        np.stack([rim[here], below + here, rim[after]], -1),
        np.stack([rim[after], below + here, below + after], -1),
    ]
    middle = np.array([[0.0, 0.0, bottom[0, 2]]])
    floor = np.stack([below + after, below + here, np.full(count, below + count)], -1)
    vertices = np.concatenate([top, bottom, middle])
    return Triangles(vertices, np.concatenate([*surface, *sides, floor]).astype(np.int32))


def closed_parts(triangles: Triangles) -> NDArray[np.bool_]:
    """Return which triangles belong to a connected part that encloses a volume. Shape: (F,).

    Vertices at one place are one. In such a part, triangles pass each edge as often in one
    direction as in the other.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    vertices, faces = triangles
    _, place = np.unique(vertices.astype(np.float32), axis=0, return_inverse=True)
    corners = place.reshape(-1)[faces]
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], -1).reshape(-1, 2)
    count = int(place.max()) + 1
    ones = np.ones(len(edges))
    _, part = connected_components(coo_array((ones, edges.T), shape=(count, count)), directed=False)
    signs = np.sign(edges[:, 1] - edges[:, 0])
    _, edge = np.unique(edges.min(1) * count + edges.max(1), return_inverse=True)
    is_open = np.bincount(edge, weights=signs)[edge] != 0
    open_parts = np.bincount(part[edges[:, 0]], weights=is_open, minlength=part.max() + 1) > 0
    return ~open_parts[part[corners[:, 0]]]


def _half_extents(kind: int, size: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the half extents of a primitive in its own frame; a plane has none upwards."""
    x, y, z = size
    if kind == kernel.PLANE:
        return np.array([np.inf, np.inf, 0.0])
    if kind == kernel.BALL:
        return np.array([x, x, x])
    if kind == kernel.CAPSULE:
        return np.array([x, x, x + y])
    if kind == kernel.CYLINDER:
        return np.array([x, x, y])
    return np.array([x, y, z])


def _box(
    center: NDArray[np.float64],
    turn: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return low and high corner of the box around a turned box, (2, 3)."""
    if np.isinf(high).any():  # a plane, which is solid below
        up = turn[:, 2]
        ends = np.array([[-np.inf] * 3, [np.inf] * 3])
        for axis in range(3):
            if abs(up[axis]) > 1.0 - 1e-12:
                ends[int(up[axis] > 0), axis] = center[axis]
        return ends
    middle, reach = center + turn @ (low + high) / 2, np.abs(turn) @ (high - low) / 2
    slack = 1e-6 * (1.0 + np.abs(middle) + reach)
    return np.stack([middle - reach - slack, middle + reach + slack])


def _tree(bounds: NDArray[np.float64], solid: int, node: int) -> list[tuple[Any, ...]]:
    """Return the nodes of a group, whose first solid and node have these numbers.

    Solids without bounds come first, outside of the tree.
    """
    nodes: list[tuple[Any, ...]] = []

    def add(some: NDArray[np.int64]) -> None:
        low, high = bounds[some, 0].min(0), bounds[some, 1].max(0)
        place = len(nodes)
        nodes.append(())
        if len(some) > 1:
            axis = int(np.ptp(bounds[some].mean(1), axis=0).argmax())
            order = some[np.argsort(bounds[some, :, axis].sum(1), kind="stable")]
            add(order[: len(order) // 2])
            add(order[len(order) // 2 :])
        leaf = solid + int(some[0]) if len(some) == 1 else kernel.NO_SOLID
        nodes[place] = (low, high, node + len(nodes), leaf)

    is_bounded = np.isfinite(bounds).all((1, 2))
    for one in np.flatnonzero(~is_bounded):
        add(np.array([one]))
    if is_bounded.any():
        add(np.flatnonzero(is_bounded))
    return nodes


def _structs(rows: Sequence[tuple[Any, ...]], kind: Any, device: str) -> Any:
    """Return an array of Warp's structs from the values of their fields."""
    values: Any = np.zeros(len(rows), dtype=kind.numpy_dtype())
    for name, column in zip(values.dtype.names, zip(*rows, strict=True), strict=False):
        values[name] = np.stack(column)
    return wp.array(values, dtype=kind, device=device)


def _vectors(tensor: Tensor) -> Any:
    return wp.from_torch(tensor.contiguous(), dtype=wp.vec3d)


@functools.cache
def _load(device: str) -> None:
    """Compile the kernels, or load them, once."""
    wp.load_module(kernel, device=device)
