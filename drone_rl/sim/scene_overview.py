"""What a scene file holds, in lines and pictures, before anything is trained in it."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import mujoco as _mujoco
import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from torch import Tensor

from drone_rl.config import BaseTaskSettings, CameraSettings
from drone_rl.sim.entities import BOTTOM_CENTER, FRONT_CENTER, SceneEntity
from drone_rl.sim.rendering.scene import Scene
from drone_rl.sim.scenes import SceneFile, Site
from drone_rl.sim.scenes.solids import solids_of
from drone_rl.sim.tasks import Task, as_task
from drone_rl.sim.worlds import Worlds
from drone_rl.utils.errors import InputError
from drone_rl.utils.text import plural

mujoco: Any = _mujoco
"""MuJoCo's bindings, which are untyped."""
_FOV_ABOVE, _FOV = 50.0, 90.0
_MOST_NAMES = 12
_CELLS = 48
"""Points along the longest edge of the world at which free space is measured."""
_OVERSAMPLED = 2
_TOUCHING = 1e-3
"""Metres from a solid within which a light is inside of it."""
_START_COLOR, _GOAL_COLOR = (40, 160, 60), (220, 30, 130)


class _Shown(Task[Any]):
    """A scene without rules, around a drone of no size."""

    name, drone_size = "scene", 0.01

    def __init__(self, scene: SceneFile) -> None:
        self.scenes = (scene,)

    def make_props(self) -> Sequence[Any]:
        return [SceneEntity(self.scenes[0])]

    def sample(self, random_state: np.random.RandomState) -> Tensor:
        return torch.zeros(1, 3, dtype=torch.float64)

    def places(self, state: Any) -> Tensor:
        return state.sampled

    def step(self, state: Any, body: Any) -> tuple[Any, Tensor]:
        raise NotImplementedError


def describe(scene: SceneFile, task: Mapping[str, Any], drone_size: float = 0.3) -> str:
    """Return lines about size, objects, solids, sites, free space and what `reach` needs.

    Args:
        scene: The scene.
        task: Settings of a task that takes place in it: scene, and those of its mesh.
        drone_size: Diameter of the drone, metres.
    """
    model = scene.model
    low, high = scene.bounds
    wide, deep, tall = high - low
    height = flight_height(scene)
    free, area, volume, whole = _free_space(scene, drone_size, height)
    solid = sum(scene.solid)
    rows = [
        ("size", f"{wide:.2f} x {deep:.2f} x {tall:.2f} m, {_point(low)} to {_point(high)}"),
        ("drawn", _drawn(model)),
        ("objects", _names(_objects(model))),
        ("solid", f"{solid} of {plural(model.ngeom, 'geom')}"),
        *[("site", _describe_site(site)) for site in scene.sites],
        (
            "free",
            f"{free:.1f} of {area:.1f} m2 at z = {height:.2f} m, {volume:.0f} of {whole:.0f} m3, "
            f"for a drone of {drone_size:g} m",
        ),
        ("reach", _reach(task)),
        *[("warning", warning) for warning in (*scene.warnings, *_enclosed_lights(scene))],
    ]
    return "\n".join(f"{name:<9}{text}" for name, text in rows)


def flight_height(scene: SceneFile) -> float:
    """Return z of the first start or goal, else of half of the world's height, metres."""
    named = [*_sites(scene, "start"), *_sites(scene, "goal")]
    low, high = scene.bounds
    return named[0].position[2] if named else float(low[2] + high[2]) / 2


def render_above(scene: SceneFile, width: int = 900) -> Image.Image:
    """Return the scene from above, x to the right, with its sites, without what is above them."""
    low, high = scene.bounds
    shown = _without_roof(scene)
    middle, (wide, deep, _) = (low + high) / 2, 1.05 * (high - low)
    height = min(max(round(width * deep / wide), width // 4), 2 * width)
    slope = math.tan(math.radians(_FOV_ABOVE) / 2)
    away = max(wide / 2 / slope, deep / 2 / (slope * height / width))
    top = float(shown.bounds[1][2] + away)
    camera = (float(middle[0]), float(middle[1]), top)
    picture = _render(shown, BOTTOM_CENTER.name, camera, 90.0, _FOV_ABOVE, (width, height))
    draw = ImageDraw.Draw(picture)
    focal = width / 2 / slope
    for site in scene.sites:
        scale = focal / (top - site.position[2])

        def pixel(x: float, y: float, scale: float = scale) -> tuple[float, float]:
            return width / 2 + (x - camera[0]) * scale, height / 2 - (y - camera[1]) * scale

        at = pixel(*site.position[:2])
        color = _GOAL_COLOR if site.name.startswith("goal") else _START_COLOR
        if any(site.half_size[:2]):
            ends = [pixel(*corner) for corner in site.corners.tolist()]
            draw.line([*ends, *ends[:2]], fill=color, width=3, joint="curve")
        else:
            draw.circle(at, 5.0, outline=color, width=3)
        outline = {"stroke_width": 3, "stroke_fill": "white", "font": ImageFont.load_default(18)}
        draw.text((at[0] + 8, at[1] - 10), site.name, fill=color, **outline)
    return picture


def render_start(scene: SceneFile, size: tuple[int, int] = (900, 600)) -> Image.Image:
    """Return what a drone sees at the first start, else in the middle of the world."""
    low, high = scene.bounds
    place, heading = tuple(((low + high) / 2).tolist()), 0.0
    for site in _sites(scene, "start")[:1]:
        place, heading = site.position, site.heading
    return _render(scene, FRONT_CENTER.name, place, heading, _FOV, size)


def _render(
    scene: SceneFile,
    camera: str,
    place: Sequence[float],
    heading: float,
    fov: float,
    size: tuple[int, int],
) -> Image.Image:
    width, height = (_OVERSAMPLED * pixels for pixels in size)
    worlds = Worlds(1, _Shown(scene), CameraSettings(width=64, height=64))
    half = math.radians(heading) / 2
    worlds.state.body.position[:] = torch.tensor(place)
    worlds.state.body.attitude[:] = torch.tensor([math.cos(half), 0.0, 0.0, math.sin(half)])
    view = worlds.view(camera, width=width, height=height)
    view = dataclasses.replace(view, horizontal_fov=fov)
    image = Image.fromarray(worlds.render(worlds.state, view)[0].numpy())
    worlds.close()
    return image.resize(size, Image.Resampling.LANCZOS)


def _without_roof(scene: SceneFile) -> SceneFile:
    """Return the scene without geoms that are above its starts and goals, else above its middle."""
    low, high = scene.bounds
    places = [site.position for site in (*_sites(scene, "start"), *_sites(scene, "goal"))]
    places = places or [(*((low + high) / 2)[:2].tolist(), flight_height(scene))]
    hidden = set[str]()
    for geom, (least, most) in enumerate(scene.boxes):
        for place in places:
            is_over = (least[:2] <= place[:2]).all() and (place[:2] <= most[:2]).all()
            if is_over and least[2] > place[2]:
                hidden.add(scene.model.geom(geom).name)
    return scene.without(hidden) if hidden else scene


def _free_space(
    scene: SceneFile, drone_size: float, height: float
) -> tuple[float, float, float, float]:
    """Return free and whole area at a height, m2, and free and whole volume, m3."""
    low, high = scene.bounds
    counts = np.ceil(_CELLS * (high - low) / (high - low).max()).clip(2, _CELLS).astype(int)
    axes = [
        low[i] + (np.arange(counts[i]) + 0.5) * (high[i] - low[i]) / counts[i] for i in range(3)
    ]
    solids = solids_of((scene,), "cpu")

    def share(*along: NDArray[np.float64]) -> float:
        points = np.stack(np.meshgrid(*along, indexing="ij"), -1).reshape(-1, 3)
        distances = solids.distances(torch.from_numpy(points))
        return float((distances > drone_size / 2).double().mean())

    area, volume = float(np.prod((high - low)[:2])), float(np.prod(high - low))
    at_height = share(axes[0], axes[1], np.array([height]))
    return at_height * area, area, share(*axes) * volume, volume


def _reach(task: Mapping[str, Any]) -> str:
    """Return what the task `reach` lacks, or how it is trained."""
    try:
        made = as_task(BaseTaskSettings.read({"name": "reach", **task}, "task"))
        made.check_dynamics(made.make_dynamics())
    except InputError as error:
        return f"not yet: {error}"
    words = [f"task.{name}={value}" for name, value in task.items()]
    return f"ready: drone-rl train experiment=reach {' '.join(words)}"


def _drawn(model: Any) -> str:
    triangles = int(sum(model.mesh_facenum))
    meshes = f"{plural(model.nmesh, 'mesh', 'meshes')} of {plural(triangles, 'triangle')}"
    fields = plural(model.nhfield, "height field")
    textures, lights = plural(model.ntex, "texture"), plural(model.nlight, "light")
    geoms = f"{len(_shown(model))} of {plural(model.ngeom, 'geom')}"
    return f"{geoms}, {meshes}, {fields}, {textures}, {lights}"


def _enclosed_lights(scene: SceneFile) -> list[str]:
    """Return a line for each light whose light a solid around it shadows everywhere."""
    model, places = scene.model, scene.data.light_xpos
    has_place = model.light_type != mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    lights = np.flatnonzero(has_place & model.light_active & model.light_castshadow)
    solids, shown, lines = solids_of((scene,), "cpu"), _shown(model), []
    for light in lights.tolist():
        near = solids.nearest(torch.from_numpy(places[light][None]))
        distance, solid = float(near.distance), int(near.solid)
        if distance <= _TOUCHING and solids.geoms[solid, 1] in shown:
            lines.append(
                f"light {model.light(light).name or light} is inside of {solids.name(solid)}, "
                'whose shadow is everywhere; give the light castshadow="false", or move it'
            )
    return lines


def _shown(model: Any) -> list[int]:
    """Return the geoms that are drawn."""
    return Scene(model, (), (), (0.0, 0.0, 0.0)).shown(show_drone=True)


def _objects(model: Any) -> list[str]:
    """Return the names of bodies, and of geoms that are in no body."""
    bodies = [model.body(i).name for i in range(1, model.nbody)]
    loose = [model.geom(i).name for i in np.flatnonzero(model.geom_bodyid == 0)]
    return [name for name in (*bodies, *loose) if not name.startswith("unnamed_")]


def _names(names: Sequence[str]) -> str:
    rest = f" and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else ""
    return f"{len(names)}: {', '.join(names[:_MOST_NAMES])}{rest}" if names else "none has a name"


def _describe_site(site: Site) -> str:
    size = " x ".join(f"{2 * half:.2f}" for half in site.half_size)
    region = f", region of {size} m" if any(site.half_size) else ""
    turned = f", turned by {site.heading:.0f} degrees" if region and round(site.heading) else ""
    return f"{site.name or '(no name)'} at {_point(site.position)}{region}{turned}"


def _point(place: Sequence[float] | NDArray[np.float64]) -> str:
    return f"({', '.join(f'{value:.2f}' for value in place)})"


def _sites(scene: SceneFile, prefix: str) -> list[Site]:
    return [site for site in scene.sites if site.name.startswith(prefix)]
