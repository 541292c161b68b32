"""Bodies of a scene file that something else places: each is taken out, as a scene of its own."""

import dataclasses
import functools
import math
from typing import Any, NamedTuple

import mujoco as _mujoco
import numpy as np

from drone_rl.sim.scenes.compiling import UNNAMED
from drone_rl.sim.scenes.elements import Element, parse, write
from drone_rl.sim.scenes.scene_file import SceneFile
from drone_rl.utils.errors import InputError, did_you_mean

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""
_UNLIT = {"ambient": "0 0 0", "active": "0"}


class Body(NamedTuple):
    """A body with all that is fixed to it. Metres."""

    scene: SceneFile
    """The body alone, around the middle of the box around it."""
    center: tuple[float, float, float]
    """The middle where the file has the body, world frame."""
    size: tuple[float, float, float]
    """Edges of the box, parallel to the world's axes."""


@functools.lru_cache(32)
def take_bodies(
    scene: SceneFile, bodies: tuple[tuple[str, float], ...]
) -> tuple[SceneFile, tuple[Body, ...]]:
    """Return a scene without some bodies, and these; the same objects for the same arguments.

    Args:
        scene: A scene.
        bodies: Name of each, and degrees by which it is turned to the left. A body inside of
            another one of them is taken out of that one.

    Raises:
        InputError: There is no such body, or it has no geoms or a plane.
    """
    model, names = scene.model, [name for name, _ in bodies]
    owners = [0] * model.nbody
    for body in range(1, model.nbody):
        is_taken = model.body(body).name in names
        owners[body] = body if is_taken else owners[int(model.body_parentid[body])]
    owner = np.array(owners)[model.geom_bodyid]
    root = parse(scene.mjcf.encode(), scene.path)
    elements = {element.get("name"): element for element in root.every("body")}
    for element in (root, *root.every()):
        element.children = [
            of for of in element.children if of.tag != "body" or of.get("name") not in names
        ]
    taken = tuple(_take(scene, root, elements, owner, *body) for body in bodies)
    return _part(scene, root, owner == 0), taken


def _take(
    scene: SceneFile,
    root: Element,
    elements: dict[str, Element],
    owner: Any,
    name: str,
    degrees: float,
) -> Body:
    """Return a body of the scene whose elements are `root` and, by name, `elements`."""
    if name not in elements:
        known = [of for of in elements if of and not of.startswith(UNNAMED)]
        raise InputError(
            f"{scene.path.name} has no body {name!r}; its bodies: {', '.join(known) or 'none'}"
            f"{did_you_mean(name, known)}"
        )
    model, data = scene.model, scene.data
    number = model.body(name).id
    own = owner == number
    if not own.any() or (model.geom_type[own] == mujoco.mjtGeom.mjGEOM_PLANE).any():
        raise InputError(
            f"{scene.path.name}: body {name!r} has {'a plane' if own.any() else 'no geoms'}, so "
            "that it can't be placed; name another body, or give it boxes"
        )
    half, quat = math.radians(degrees) / 2, np.empty(4)
    turn = np.array([math.cos(half), 0.0, 0.0, math.sin(half)])
    mujoco.mju_mulQuat(quat, turn, data.xquat[number])

    def at(place: Any) -> SceneFile:
        pose = {"pos": _text(place), "quat": _text(quat)}
        element = dataclasses.replace(
            elements[name], attributes={**elements[name].attributes, **pose}
        )
        world = Element("worldbody", {}, scene.path, 0, [element])
        visual = Element("visual", {}, scene.path, 0, [Element("headlight", _UNLIT, scene.path, 0)])
        kept = [of for of in root.children if of.tag not in ("worldbody", "visual", "statistic")]
        whole = dataclasses.replace(root, children=[*kept, visual, world])
        return _part(scene, _without_unused_assets(whole), own)

    low, high = at((0.0, 0.0, 0.0)).bounds
    middle = (low + high) / 2
    return Body(
        at(-middle),
        tuple((data.xpos[number] + middle).tolist()),
        tuple((high - low).tolist()),
    )


def _part(scene: SceneFile, root: Element, geoms: Any) -> SceneFile:
    """Return the scene that is left with some elements; `geoms` says which of its geoms are."""
    solid = tuple(np.array(scene.solid)[geoms].tolist())
    used = {value for element in root.every() for value in element.attributes.values()}
    files = {name: content for name, content in scene.assets.items() if name in used}
    return dataclasses.replace(scene, mjcf=write(root)[0], assets=files, solid=solid, warnings=())


def _without_unused_assets(root: Element) -> Element:
    """Return a model without assets that no other element names."""
    for _ in range(2):  # materials first, then the textures that they name
        named = {
            value
            for element in root.every()
            for key, value in element.attributes.items()
            if key in ("mesh", "hfield", "material", "texture")
        }
        children = [
            dataclasses.replace(
                of, children=[asset for asset in of.children if asset.get("name") in named]
            )
            if of.tag == "asset"
            else of
            for of in root.children
        ]
        root = dataclasses.replace(root, children=children)
    return root


def _text(numbers: Any) -> str:
    return " ".join(f"{number:.17g}" for number in numbers)
