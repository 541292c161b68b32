"""Compile a scene's MJCF, and write it again as what does not move."""

import re
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import mujoco as _mujoco
import numpy as np
from numpy.typing import NDArray

from drone_rl.sim.scenes.elements import Element, parse, write
from drone_rl.sim.scenes.reader import Reading
from drone_rl.utils.errors import InputError

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""
UNNAMED = "unnamed_"
"""First part of the names of elements that have none in the file."""
_SECTIONS = {"statistic", "visual", "default", "asset", "worldbody"}


def compile_scene(root: Element, reading: Reading) -> tuple[Any, str, tuple[bool, ...]]:
    """Return the compiled model, its MJCF, and whether each of its geoms can be touched.

    Raises:
        InputError: MuJoCo refuses the scene.
    """
    text, of_line = write(root)
    try:
        spec = mujoco.MjSpec.from_string(text, include=reading.models, assets=reading.files)
        can_touch = [bool(geom.contype or geom.conaffinity) for geom in spec.geoms]
        for geom in spec.geoms:  # MuJoCo would make convex hulls of meshes, for its own contacts
            geom.contype = geom.conaffinity = 0
        with warnings.catch_warnings(record=True, action="always") as caught:
            model = spec.compile()
        lines = [str(one.message).splitlines()[0][:200] for one in caught]
        reading.notes["remarks"] += [_with_names(line, reading) for line in lines]
        solid = {geom.id: is_solid for geom, is_solid in zip(spec.geoms, can_touch, strict=True)}
        return model, spec.to_xml(), tuple(solid[i] for i in range(model.ngeom))
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        raise InputError(_reason(_with_names(str(error), reading), of_line)) from error


def _with_names(message: str, reading: Reading) -> str:
    """Return MuJoCo's message with the names of the user's files instead of ours."""
    for (_, path), (name, _) in reading.names.items():
        message = message.replace(f"'{name}'", f"'{path.name}'")
    return message


def _reason(message: str, of_line: list[Element]) -> str:
    """Return MuJoCo's message about a line of our text with the line of the user's file."""
    lines = [line for line in message.splitlines() if line.strip()] or ["MuJoCo can't compile it"]
    what = re.sub(r"^(XML )?Error: (Error: )?", "", lines[0])[:200]
    place = re.search(r"line (\d+)\s*$", message.rstrip())
    number = int(place[1]) if place else 0
    where = f"{of_line[number - 1]}: " if 0 < number <= len(of_line) else ""
    return f"{where}{what}; correct it"


def freeze(text: str, file: Path, model: Any, data: Any) -> Element:
    """Return a model's MJCF with everything where `data` has it, without joints and frames."""
    root = parse(text.encode(), file)
    kept = [section for section in root.children if section.tag in _SECTIONS]
    root.children = [Element("compiler", {"angle": "radian"}, file, 0), *kept]
    bodies = iter(range(1, model.nbody))
    owners = {tag: getattr(model, f"{tag}_bodyid") for tag in _PLACED}

    def place(element: Element, body: int) -> None:
        """Place what a body has, then the bodies in it, which are numbered in this order."""
        children = [child for child in _without_frames(element) if child.tag in (*_PLACED, "body")]
        for tag in _PLACED:
            own = [child for child in children if child.tag == tag]
            for child, number in zip(own, np.flatnonzero(owners[tag] == body), strict=True):
                _PLACED[tag](child, model, data, int(number))
                _name(child, int(number))
        element.children = children
        for child in children:
            if child.tag == "body":
                number = next(bodies)
                _place_body(child, model, data, number)
                _name(child, number)
                place(child, number)

    for section in kept:
        if section.tag == "worldbody":
            place(section, 0)
    return root


def _without_frames(element: Element) -> Iterator[Element]:
    for child in element.children:
        if child.tag == "frame":
            yield from _without_frames(child)
        else:
            yield child


def _place_body(element: Element, model: Any, data: Any, number: int) -> None:
    parent = model.body_parentid[number]
    turn = data.xmat[parent].reshape(3, 3)
    back, quat = np.empty(4), np.empty(4)
    mujoco.mju_negQuat(back, data.xquat[parent])
    mujoco.mju_mulQuat(quat, back, data.xquat[number])
    _set(element, pos=turn.T @ (data.xpos[number] - data.xpos[parent]), quat=quat)
    for name in ("mocap", "gravcomp", "sleep"):
        element.attributes.pop(name, None)


def pose_in_file(
    model: Any, geom: int, place: NDArray[np.float64], attitude: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the pose that a file gives a geom, which MuJoCo moves to a mesh's centre of mass.

    Args:
        model: The compiled model.
        geom: Number of the geom.
        place: Of the geom in the model, in any frame. Shape: (3,).
        attitude: Quaternion, in the same frame. Shape: (4,).
    """
    if model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_MESH:
        return place, attitude
    mesh = model.geom_dataid[geom]
    back, moved, offset = np.empty(4), np.empty(4), np.empty(3)
    mujoco.mju_negQuat(back, model.mesh_quat[mesh])
    mujoco.mju_mulQuat(moved, attitude, back)
    mujoco.mju_rotVecQuat(offset, model.mesh_pos[mesh], moved)
    return place - offset, moved


def _place_geom(element: Element, model: Any, data: Any, number: int) -> None:
    pos, quat = pose_in_file(model, number, model.geom_pos[number], model.geom_quat[number])
    is_mesh = model.geom_type[number] == mujoco.mjtGeom.mjGEOM_MESH
    if not is_mesh and element.attributes.pop("mesh", None):  # fitted to it
        element.attributes.pop("fitscale", None)
        _set(element, size=model.geom_size[number])
    _set(element, pos=pos, quat=quat)
    if model.geom_group[number] in (1, 2):  # visible, and apart from the drone's body
        element.attributes["group"] = "0"


def _place_site(element: Element, model: Any, data: Any, number: int) -> None:
    _set(element, pos=model.site_pos[number], quat=model.site_quat[number])


def _place_light(element: Element, model: Any, data: Any, number: int) -> None:
    body = model.light_bodyid[number]
    turn = data.xmat[body].reshape(3, 3)
    for name in ("mode", "target"):
        element.attributes.pop(name, None)
    pos = turn.T @ (data.light_xpos[number] - data.xpos[body])
    _set(element, pos=pos, dir=turn.T @ data.light_xdir[number])


def _name(element: Element, number: int) -> None:
    """Name an element as dm_control would, which takes a time of the square of their number."""
    element.attributes.setdefault("name", f"{UNNAMED}{element.tag}_{number}")


def _set(element: Element, **values: NDArray[np.float64]) -> None:
    for name, numbers in values.items():
        element.attributes[name] = " ".join(f"{number:.9g}" for number in numbers)


_PLACED: dict[str, Callable[[Element, Any, Any, int], None]] = {
    "geom": _place_geom,
    "site": _place_site,
    "light": _place_light,
}
