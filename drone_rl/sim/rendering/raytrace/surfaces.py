"""Materials of a scene's geoms, and how textures lie on them, for `surfaces_kernel`."""

from typing import Any

import mujoco as _mujoco
import numpy as np
import warp as wp
from numpy.typing import NDArray

from drone_rl.sim.rendering.raytrace import surfaces_kernel as kernel
from drone_rl.sim.rendering.scene import Scene

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""
_PLANE, _HFIELD, _SPHERE, _CAPSULE, _CYLINDER, _MESH = (
    int(getattr(mujoco.mjtGeom, f"mjGEOM_{name}"))
    for name in ("PLANE", "HFIELD", "SPHERE", "CAPSULE", "CYLINDER", "MESH")
)
_MOST_LINES = 200
"""MuJoCo's `mjMAXPLANEGRID`: grid lines of a plane."""


def make_surfaces(scene: Scene) -> kernel.Surfaces:
    """Return what the geoms of a scene look like."""
    model = scene.model
    count = model.ngeom
    material = model.geom_matid
    sizes = np.array([_visual_size(model, i) for i in range(count)]).reshape(-1, 3)
    shine = np.tile([0.0, 0.5, 64.0], (count, 1))
    texture, mapping = np.full(count, -1), np.zeros(count, int)
    scale, shift = np.ones((count, 3)), np.zeros((count, 2))
    role = mujoco.mjtTextureRole.mjTEXROLE_RGB
    for i in np.flatnonzero(material >= 0).tolist():
        of = material[i]
        shine[i] = model.mat_emission[of], model.mat_specular[of], 128 * model.mat_shininess[of]
        texture[i] = model.mat_texid[of, role]
        if texture[i] >= 0:
            mapping[i], scale[i], shift[i] = _map_texture(model, i, sizes[i])
    cells = [_cells(model, i) for i in range(count)]
    made: Any = kernel.Surfaces()
    values = {
        "color": (scene.colors[None], wp.vec4),
        "shine": (shine, wp.vec3),
        "texture": (texture[None], int),
        "mapping": (mapping[None], int),
        "scale": (scale[None], wp.vec3),
        "shift": (shift, wp.vec2),
        "cells": ([cell[:4] for cell in cells], wp.vec4),
        "counts": ([cell[4:] for cell in cells], wp.vec2i),
    }
    for name, (value, dtype) in values.items():
        setattr(made, name, wp.array(np.asarray(value), dtype=dtype, device="cpu"))
    quality = model.vis.quality
    made.divisions, made.slices = int(quality.numquads), int(quality.numslices)
    made.stacks = int(quality.numstacks)
    return made


def _visual_size(model: Any, geom: int) -> NDArray:
    """Return the size by which MuJoCo's OpenGL scales a geom, metres. Shape: (3,)."""
    size = model.geom_size[geom]
    if model.geom_type[geom] == _SPHERE:
        return size[[0, 0, 0]]
    return size[[0, 0, 1]] if model.geom_type[geom] in (_CAPSULE, _CYLINDER) else size


def _map_texture(model: Any, geom: int, size: NDArray) -> tuple[int, NDArray, NDArray]:
    """Return the mapping, scale and shift of a geom's texture, as MuJoCo's OpenGL sets them."""
    kind, material = model.geom_type[geom], model.geom_matid[geom]
    texture = model.mat_texid[material, mujoco.mjtTextureRole.mjTEXROLE_RGB]
    is_uniform, repeat = bool(model.mat_texuniform[material]), model.mat_texrepeat[material]
    is_real = kind in (_PLANE, _MESH, _HFIELD)
    stretch = np.where(size > 0, size, 1.0)
    if model.tex_type[texture] != mujoco.mjtTexture.mjTEXTURE_2D:
        unit = np.ones(3) if is_real else 1.0 / stretch
        return kernel.CUBE, unit * size if is_uniform else unit, np.zeros(2)
    mesh = model.geom_dataid[geom] if kind == _MESH else -1
    has_coordinates = mesh >= 0 and model.mesh_texcoordadr[mesh] >= 0
    if has_coordinates or kind not in (_MESH, _HFIELD):
        scale = np.where(repeat > 0, repeat, 1.0) * (stretch[:2] if is_uniform else 1.0)
        is_infinite = kind == _PLANE and (size[:2] <= 0).any()
        return kernel.WRAPPED, np.array([*scale, 1.0]), np.full(2, -0.5 if is_infinite else 0.0)
    scale = repeat / stretch[:2] * (stretch[:2] if is_uniform else 1.0)
    return kernel.PROJECTED, np.array([*0.5 * scale, 1.0]), np.zeros(2)


def _cells(model: Any, geom: int) -> list[float]:
    """Return first grid line and distance along x and y, and the numbers of cells, of a plane."""
    cells, counts = [], []
    if model.geom_type[geom] != _PLANE:
        return [0.0, 1.0, 0.0, 1.0, 0, 0]
    for half, repeat in zip(model.geom_size[geom, :2], _repeats(model, geom), strict=True):
        if half > 0:
            spacing = max(model.geom_size[geom, 2], half / (_MOST_LINES - 2))
            count = int(half / spacing) // 2 * 2
            cells += [-count * spacing, 2 * spacing]
            counts.append(count)
        else:
            far = 2.1 * model.vis.map.zfar * model.stat.extent
            step = 2 / repeat if repeat > 0 else far / (_MOST_LINES - 2)
            cells += [2 * step, (far + 2 * step) / _MOST_LINES]
            counts.append(-1)
    return [*cells, *counts]


def _repeats(model: Any, geom: int) -> NDArray:
    material = model.geom_matid[geom]
    return model.mat_texrepeat[material] if material >= 0 else np.zeros(2)
