"""Starts and goals at the sites of scene files, and the paths between them."""

import functools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple, NoReturn

import numpy as np
import torch
from numpy.typing import NDArray

from drone_rl.config.term_task import ANYWHERE, ObjectSettings, TermTaskSettings
from drone_rl.sim.scenes import SceneFile, Site
from drone_rl.sim.scenes.free_space import Distances, FreeSpace
from drone_rl.sim.scenes.meshes import ENDINGS
from drone_rl.sim.scenes.path_kernel import Grid, Route
from drone_rl.sim.scenes.solids import solids_of
from drone_rl.utils.errors import InputError

Point = NDArray[np.float64]
"""Metres, world frame. Shape: (3,)."""
_START = "start"
"""Sites that a scene may lack; episodes then start anywhere."""
_HALF_DIAGONAL = math.sqrt(0.5)
_ACROSS = 21
"""Points across the region of an object that is no goal."""


class Place(NamedTuple):
    """Where something can be in an episode. Metres, world frame."""

    points: NDArray[np.float64]
    """Centres of cells, or one point. Shape: (n, 3)."""
    spread: float = 0.0
    """Half of a cell's edge; 0 for a point."""
    site: Site | None = None
    """The box that it does not leave, if there is one."""

    def draw(self, random_state: np.random.RandomState) -> Point:
        """Sample a point."""
        point = self.points[random_state.randint(len(self.points))].copy()
        point[:2] += random_state.uniform(-self.spread, self.spread, 2)
        if self.site is None or not self.spread:
            return point
        half = np.array(self.site.half_size)
        inside = _seen_from(self.site, point).clip(-half, half)
        return np.append((self.site.position + inside @ self.site.axes)[:2], point[2])


class Goal(NamedTuple):
    """A goal's place, the route to it, and where episodes that lead there start."""

    place: Place
    route: int
    """Number of its route."""
    starts: dict[int, Place]
    """By number of the start, see `Routes.start_names`."""


class Routes:
    """Starts, goals and paths of a task in its scenes."""

    def __init__(self, settings: TermTaskSettings, scenes: Sequence[SceneFile]) -> None:
        """Find them.

        Raises:
            InputError: A scene lacks a site or solids, a start is too near to solids, or no path
                leads to a goal.
        """
        self._settings = settings
        self.radius = 0.5 * settings.drone_size
        self.routes: list[Route] = []
        """Where paths lead, by number."""
        self.clearances: list[Grid] = []
        """Distances to the nearest solid around the paths of each route, metres."""
        self.start_names: list[str] = []
        """Names of the starts of all scenes, by number."""
        self.most_metres = 0.0
        """Length of the longest path from a start to a goal."""
        self.is_level = True
        """Whether no path climbs."""
        self.goals: dict[tuple[int, str], list[Goal]] = {}
        """By scene and object."""
        self._others: dict[tuple[int, str], list[Place]] = {}
        """Places of objects that are no goals, by scene and object."""
        self.low, self.high = np.full(3, np.inf), np.full(3, -np.inf)
        """Least and largest coordinates of solids and sites in all scenes. Shapes: (3,)."""
        for number, scene in enumerate(scenes):
            self._find(number, scene)

    def place(
        self, scene: int, name: str, random_state: np.random.RandomState
    ) -> tuple[Point, Goal | None]:
        """Sample the centre of an object with a site, and return its goal if it is one."""
        if (others := self._others.get((scene, name))) is not None:
            return others[random_state.randint(len(others))].draw(random_state), None
        goals = self.goals[scene, name]
        goal = goals[random_state.randint(len(goals))]
        return goal.place.draw(random_state), goal

    def start(self, goal: Goal, random_state: np.random.RandomState) -> tuple[Point, float, int]:
        """Sample a start from where paths lead to a goal: its place, heading (degrees), number."""
        numbers = [*goal.starts]
        number = numbers[random_state.randint(len(numbers))]
        place = goal.starts[number]
        heading = random_state.uniform(*self._settings.start.range_of("heading"))
        at_site = 0.0 if place.site is None else place.site.heading
        return place.draw(random_state), at_site + heading, number

    def _find(self, number: int, scene: SceneFile) -> None:
        """Find what is in a scene."""
        s, where = self._settings, f"scene={scene.path}"
        if not any(scene.solid):
            raise InputError(
                f"{where}: nothing is solid; give geoms a contype or conaffinity other than 0"
            )
        low, high = scene.bounds
        places = [np.array(site.position) for site in scene.sites]
        low, high = np.min([low, *places], 0), np.max([high, *places], 0)
        self.low, self.high = np.minimum(self.low, low), np.maximum(self.high, high)
        solids = solids_of((scene,), "cpu")

        def distances(points: NDArray[np.float64]) -> NDArray[np.float64]:
            return solids.distances(torch.from_numpy(points)).numpy()

        first, found = len(self.start_names), self._starts(scene, where)
        self.start_names += [site.name if site else ANYWHERE for site in found]
        starts = dict(enumerate(found, first))
        sites = {
            name: self._sites(scene, of.site, f"task.objects.{name}", where)
            for name, of in s.objects.items()
            if of.site
        }
        goals = []
        for name, of in sites.items():
            if s.objects[name].role == "goal":
                goals += [(name, site) for site in of]
            else:
                self._others[number, name] = [_region(site) for site in of]
        levels = self._altitudes(found, goals)
        spaces = {level: FreeSpace(distances, low, high, self.radius, level) for level in {*levels}}
        for (name, site), level in zip(goals, levels, strict=True):
            self.is_level &= level is not None
            size = s.objects[name].half_size[0]
            goal = self._goal(spaces[level], distances, site, size, starts, where)
            self.goals.setdefault((number, name), []).append(goal)
        every = [goal for (scene, _), of in self.goals.items() if scene == number for goal in of]
        for start, site in starts.items():
            if not any(start in goal.starts for goal in every):
                around = self._start(spaces[levels[0]], distances, site, goals[0][1], None, where)
                ends = [site for _, site in goals]
                self._refuse(self.start_names[start], spaces[levels[0]], around, ends, where)

    def _refuse(
        self, start: str, space: FreeSpace, around: Place, goals: Sequence[Site], where: str
    ) -> NoReturn:
        """Raise an `InputError` about goals to which no path leads from the points of a start."""
        parts = np.unique(space.parts[space.numbers_of(around.points)])
        free = space.centers[np.isin(space.parts, parts[parts >= 0])]
        low, high = (free.min(0), free.max(0)) if len(free) else (self.low, self.high)
        remedy = "open a wider way, move a site, or give a smaller task.drone_size"
        for goal in goals:
            x, y, z = goal.position
            if not (low[:2] <= (x, y)).all() or not ((x, y) <= high[:2]).all():
                remedy = (
                    f"from there it gets to x = {low[0]:.1f} to {high[0]:.1f} m and y = "
                    f"{low[1]:.1f} to {high[1]:.1f} m, and {goal.name} is outside of this, at "
                    f"({x:g}, {y:g}, {z:g}); move it"
                )
        raise InputError(
            f"{where}: no path of a drone of {self._settings.drone_size:g} m leads from {start} to "
            f"{' or '.join(goal.name for goal in goals)}; {remedy}"
        )

    def _starts(self, scene: SceneFile, where: str) -> list[Site | None]:
        """Return the sites of starts; None stands for all free space."""
        prefix = self._settings.start.site
        if prefix == ANYWHERE or not prefix:
            return [None]
        if prefix == _START and not any(site.name.startswith(prefix) for site in scene.sites):
            return [None]
        return [*self._sites(scene, prefix, "task.start", where)]

    def _sites(self, scene: SceneFile, prefix: str, setting: str, where: str) -> list[Site]:
        found = [site for site in scene.sites if site.name.startswith(prefix)]
        ending = scene.path.suffix.lower()
        if not found and ending in ENDINGS:
            name = scene.path.name if ending == ".stl" else f"{scene.path.stem}.obj"
            size = " ".join([f"{self._settings.scene_scale:g}"] * 3)
            turn = ' euler="90 0 0"' if self._settings.scene_up == "y" else ""
            raise InputError(
                f"{where} is a mesh, which marks no sites; name it, as OBJ or STL, in an MJCF "
                f'file: <asset><mesh name="m" file="{name}" scale="{size}"/></asset><worldbody>'
                f'<geom type="mesh" mesh="m"{turn}/><site name="{prefix}" pos="4 2 1.2"/>'
                "</worldbody>"
            )
        if not found:
            names = ", ".join(site.name for site in scene.sites if site.name) or "none"
            raise InputError(
                f"{where} has no site whose name begins with {prefix} ({setting}.site; its sites: "
                f'{names}); add one, such as <site name="{prefix}" pos="4 2 1.2"/>'
            )
        return found

    def _altitudes(
        self, starts: Sequence[Site | None], goals: Sequence[tuple[str, Site]]
    ) -> list[float | None]:
        """Return the heights at which drones reach goals from all starts; None if they climb."""
        objects = self._settings.objects
        levels = [self._altitude(starts, site, objects[name]) for name, site in goals]
        count = sum(objects[name].count for name in {name for name, _ in goals})
        return levels if count == 1 or len({*levels}) == 1 else [None] * len(levels)

    def _altitude(
        self, starts: Sequence[Site | None], goal: Site, of: ObjectSettings
    ) -> float | None:
        heights = {round(self._height(start, goal), 6) for start in starts}
        low, high = self._settings.start.range_of("z")
        height = heights.pop()
        is_near = abs(height - goal.position[2]) < self.radius + of.half_size[2]
        return height if is_near and not heights and low == high else None

    def _height(self, start: Site | None, goal: Site) -> float:
        """Return the height of a start: that of the goal as far as its site allows."""
        if self._settings.start.z is not None:
            return self._settings.start.range_of("z")[0]
        if start is None:
            return goal.position[2]
        middle, half = start.position[2], start.half_size[2]
        return min(max(goal.position[2], middle - half), middle + half)

    def _goal(
        self,
        space: FreeSpace,
        distances: Distances,
        site: Site,
        size: float,
        starts: dict[int, Site | None],
        where: str,
    ) -> Goal:
        """Return a goal of a size, with its route and the starts that lead to it."""
        center = np.array(site.position)
        away = np.linalg.norm(space.centers - center, axis=1)
        is_point = not any(site.half_size[:2])
        if is_point:
            room = float(distances(center[None])[0]) - space.radius - space.margin
            is_source = space.is_free & (away <= room)
            if not is_source.any():
                is_source = space.is_free & (away < space.radius + size)
            place, ahead = Place(center[None]), away[is_source]
        else:
            inside = np.append(site.half_size[:2], np.inf)
            is_source = space.is_free & (np.abs(_seen_from(site, space.centers)) <= inside).all(1)
            parts = space.parts[is_source]
            is_source &= space.parts == (np.bincount(parts).argmax() if len(parts) else -2)
            points = space.centers[is_source]
            points[:, 2] = center[2]
            place, ahead = Place(points, 0.5 * space.cell, site), np.zeros(len(points))
        if not is_source.any():
            raise InputError(
                f"{where}: a drone of {self._settings.drone_size:g} m does not fit at {site.name}; "
                "move this site away from solids, or give a smaller task.drone_size"
            )
        lengths, is_reached = space.lengths_to(np.flatnonzero(is_source), ahead)
        half = (0.0, 0.0, 0.0) if is_point else (*site.half_size[:2], 0.0)
        self.routes.append(Route(lengths, site.position, half, math.radians(site.heading)))
        self.clearances.append(space.clearance)
        found = {
            number: self._start(space, distances, start, site, is_reached, where)
            for number, start in starts.items()
        }
        leading = {number: place for number, place in found.items() if len(place.points)}
        numbers = space.numbers_of(
            np.concatenate([np.empty((0, 3)), *(of.points for of in leading.values())])
        )
        most = float(lengths.values.ravel()[numbers].max(initial=0.0))
        self.most_metres = max(self.most_metres, most)
        return Goal(place, len(self.routes) - 1, leading)

    def _start(
        self,
        space: FreeSpace,
        distances: Distances,
        start: Site | None,
        goal: Site,
        is_reached: NDArray[np.bool_] | None,
        where: str,
    ) -> Place:
        """Return where a start has paths to a goal, without points if nowhere; None for all."""
        s, height = self._settings, self._height(start, goal)
        around = self.radius + s.start.apart
        fits = space.clearance.values.ravel() >= around + _HALF_DIAGONAL * space.cell
        is_inside, points = np.ones_like(fits), space.centers
        is_reached = np.ones_like(fits) if is_reached is None else is_reached
        if start is not None and any(start.half_size[:2]):
            half = np.append(start.half_size[:2], np.inf)
            is_inside = (np.abs(_seen_from(start, points)) <= half).all(1)
        if start is not None and not (any(start.half_size[:2]) and is_inside.any()):
            point = np.append(start.position[:2], height)
            room, needed = float(distances(point[None])[0]), self.radius
            is_near = np.linalg.norm(points - point, axis=1) <= 2 * space.cell
            has_path = bool((is_near & is_reached).any())
            place = Place(point[None][:has_path], site=start)
        else:
            low, high = -np.inf, np.inf
            if not space.is_level and (start is not None or s.start.z is not None):
                low, high = s.start.range_of("z") if s.start.z is not None else (height, height)
                off = points[:, 2] - points[:, 2].clip(low, high)
                is_inside &= np.abs(off) <= 0.5 * space.cell
            room = float(space.clearance.values.ravel()[is_inside].max(initial=0.0))
            needed = around + _HALF_DIAGONAL * space.cell
            kept = points[is_inside & fits & is_reached]
            kept[:, 2] = kept[:, 2].clip(low, high)
            place = Place(kept, 0.5 * space.cell, start)
        if room < needed:
            name = start.name if start else "free space"
            more = 1.05 * (needed - room)
            at = f"at most {room:.2f} m away from" if room > 0 else "inside of"
            less = f" give task={s.name} task.start.apart={s.start.apart - more:.2f}, or"
            raise InputError(
                f"{where}: a drone of {s.drone_size:g} m at {name}, {height:g} m high, is {at} "
                f"something solid and needs {needed:.2f} m;"
                f"{less if needed > self.radius and more <= s.start.apart else ''} move the site, "
                "or give a smaller task.drone_size"
            )
        return place


@functools.lru_cache(8)
def find_routes(settings: TermTaskSettings, scenes: tuple[SceneFile, ...]) -> Routes:
    """Return the routes of a task, the same ones for the same settings and scenes."""
    return Routes(settings, scenes)


def _seen_from(site: Site, points: NDArray[Any]) -> NDArray[Any]:
    """Return points in the frame of a site. Shape kept: (*, 3)."""
    return (points - np.array(site.position)) @ site.axes.T


def _region(site: Site) -> Place:
    """Return the points of a site, a lattice for a box."""
    across = [np.linspace(-half, half, _ACROSS if half else 1) for half in site.half_size[:2]]
    lattice = np.stack(np.meshgrid(*across, [0.0]), -1).reshape(-1, 3)
    spread = max(site.half_size[:2]) / (_ACROSS - 1)
    return Place(lattice @ site.axes + np.array(site.position), spread, site)
