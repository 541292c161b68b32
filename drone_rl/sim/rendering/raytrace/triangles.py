"""Build the hierarchies of triangles of a scene's meshes and height fields."""

import dataclasses
from typing import Any

import mujoco as _mujoco
import numpy as np
import warp as wp
from numpy.typing import NDArray

from drone_rl.sim.rendering.raytrace.triangles_kernel import WIDTH, Triangles

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""
_CREASE = 0.8
"""Cosine of the angle beyond which OpenGL shows a mesh without texture coordinates flat."""

_WIDER = 1 + 1e-5
"""Factor of the half extents of boxes, against rounding."""


@dataclasses.dataclass(frozen=True)
class Mesh:
    """Triangles in a frame of their own. Metres."""

    corners: NDArray[np.float32]  # (num_triangles, 3, 3)
    normals: NDArray[np.float32]
    """Unit normals of the corners for shading, (num_triangles, 3, 3)."""
    texcoords: NDArray[np.float32] | None = None  # (num_triangles, 3, 2)


def read_mesh(model: Any, number: int) -> Mesh:
    """Return a mesh of a model with the normals that MuJoCo's OpenGL takes."""
    start, count = model.mesh_faceadr[number], model.mesh_facenum[number]
    part = slice(start, start + count)
    vertices = model.mesh_vert[model.mesh_vertadr[number] :]
    corners = vertices[model.mesh_face[part]]
    stored = model.mesh_normal[model.mesh_normaladr[number] :]
    normals = stored[model.mesh_facenormal[part]]
    if model.mesh_texcoordadr[number] >= 0:
        places = model.mesh_texcoord[model.mesh_texcoordadr[number] :]
        return Mesh(corners, normals, places[model.mesh_facetexcoord[part]])
    flat = np.broadcast_to(_flat_normals(corners), normals.shape)
    is_sharp = (normals * flat).sum(-1, keepdims=True) < _CREASE
    return Mesh(corners, np.where(is_sharp, flat, normals))


def read_height_field(model: Any, number: int) -> Mesh:
    """Return a height field of a model with its sides and base, flat as MuJoCo's OpenGL has it."""
    rows, columns = int(model.hfield_nrow[number]), int(model.hfield_ncol[number])
    wide, deep, high, base = model.hfield_size[number]
    start = model.hfield_adr[number]
    heights = model.hfield_data[start : start + rows * columns].reshape(rows, columns)
    x = np.broadcast_to(np.linspace(-wide, wide, columns), heights.shape)
    y = np.broadcast_to(np.linspace(-deep, deep, rows)[:, None], heights.shape)
    top = np.stack([x, y, heights * high], -1)
    low = np.stack([x, y, np.full(heights.shape, -base)], -1)
    a, b, c, d = top[:-1, :-1], top[:-1, 1:], top[1:, 1:], top[1:, :-1]
    triangles = [np.stack([d, a, c], 2), np.stack([a, b, c], 2)]
    edges = [
        (top[::-1, 0], low[::-1, 0]),
        (top[:, -1], low[:, -1]),
        (top[0], low[0]),
        (top[-1, ::-1], low[-1, ::-1]),
    ]
    for above, below in edges:
        triangles.append(np.stack([below[:-1], below[1:], above[1:]], 1))
        triangles.append(np.stack([below[:-1], above[1:], above[:-1]], 1))
    triangles.append(np.stack([low[0, 0], low[-1, 0], low[-1, -1]]))
    triangles.append(np.stack([low[0, 0], low[-1, -1], low[0, -1]]))
    corners = np.concatenate([t.reshape(-1, 3, 3) for t in triangles]).astype(np.float32)
    return Mesh(corners, np.broadcast_to(_flat_normals(corners), corners.shape))


def _flat_normals(corners: NDArray[np.float32]) -> NDArray[np.float32]:
    """Unit normals. Shapes: (count, 3, 3) to (count, 1, 3)."""
    a, b, c = corners.astype(float).swapaxes(0, 1)
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=-1, keepdims=True)
    return (normals / np.where(lengths == 0, 1, lengths)).astype(np.float32)[:, None]


def make_triangles(meshes: list[Mesh]) -> Triangles:
    """Return the hierarchies of meshes for the kernels, on the CPU."""
    trees = [_build(mesh) for mesh in meshes]
    depths = np.array([tree["depth"] for tree in trees], int)
    leaves = 1 << depths
    values: dict[str, tuple[Any, Any]] = {
        "depth": (depths, int),
        "node": (np.cumsum([0, *(2 * leaves - 1)])[:-1], int),
        "leaf": (np.cumsum([0, *leaves])[:-1], int),
    }
    kinds: dict[str, Any] = {
        "boxes": float,
        "normals": wp.vec3,
        "texcoords": wp.vec2,
        "corners": float,
    }
    for name, kind in kinds.items():
        if trees:
            values[name] = np.concatenate([tree[name] for tree in trees]), kind
    made: Any = Triangles()
    for name, (value, kind) in values.items():
        setattr(made, name, wp.array(value, dtype=kind, device="cpu"))
    return made


def _build(mesh: Mesh) -> dict[str, Any]:
    """Split triangles in halves, along the longest axis, down to leaves of at most `WIDTH`."""
    count = len(mesh.corners)
    depth = max(0, int(np.ceil(np.log2(max(count, 1) / WIDTH))))
    low, high = mesh.corners.min(1), mesh.corners.max(1)
    middles = (low + high) / 2
    order = np.arange(count)
    for level in range(depth):
        starts = _starts(count, level)
        segment = np.repeat(np.arange(1 << level), np.diff(starts))
        placed = middles[order]
        least = np.minimum.reduceat(placed, starts[:-1])
        spread = np.maximum.reduceat(placed, starts[:-1]) - least
        rows, axis = np.arange(1 << level), spread.argmax(1)
        scale = np.maximum(spread[rows, axis], 1e-30).astype(float)
        along = placed[np.arange(count), axis[segment]] - least[rows, axis][segment]
        order = order[np.argsort(2.0 * segment + along / scale[segment])]
    leaves = 1 << depth
    starts = _starts(count, depth)
    slots = starts[:-1, None] + np.arange(WIDTH)
    is_used = slots < starts[1:, None]
    of_slot = np.where(is_used, order[np.where(is_used, slots, 0)], -1)
    corners = _fill(mesh.corners, of_slot)  # (leaves, WIDTH, 3, 3)
    levels_low = [np.where(is_used[..., None], low[of_slot], np.inf).min(1)]
    levels_high = [np.where(is_used[..., None], high[of_slot], -np.inf).max(1)]
    while len(levels_low[0]) > 1:
        levels_low.insert(0, levels_low[0].reshape(-1, 2, 3).min(1))
        levels_high.insert(0, levels_high[0].reshape(-1, 2, 3).max(1))
    low, high = np.concatenate(levels_low), np.concatenate(levels_high)
    texcoords = np.zeros((count, 3, 2)) if mesh.texcoords is None else mesh.texcoords
    return {
        "depth": depth,
        "boxes": np.concatenate([(low + high) / 2, (high - low) / 2 * _WIDER], 1).ravel(),
        "corners": corners.transpose(0, 2, 3, 1).reshape(leaves * 9 * WIDTH),
        "normals": _fill(mesh.normals, of_slot).reshape(-1, 3),
        "texcoords": _fill(texcoords, of_slot).reshape(-1, 2),
    }


def _starts(count: int, level: int) -> NDArray:
    """Where each segment of a level starts, and the end. Shape: (2 to the level + 1,)."""
    return np.arange((1 << level) + 1) * count >> level


def _fill(values: NDArray, of_slot: NDArray) -> NDArray[np.float32]:
    """Values of the triangles in slots, zero in empty ones."""
    is_used = (of_slot >= 0).reshape(*of_slot.shape, 1, 1)
    return np.where(is_used, values[of_slot], 0).astype(np.float32)
