"""Maps of scenes: the floor plan with the paths of episodes, and the success rate by start."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from drone_rl.config.commands import HeldOutSettings
from drone_rl.envs import base_env
from drone_rl.envs.rollout import Agent, as_agent, steps
from drone_rl.policies.actor import Exploring
from drone_rl.policies.policy import BasePolicy
from drone_rl.sim.scenes import SceneFile, Site
from drone_rl.sim.scenes.solids import solids_of
from drone_rl.sim.tasks import Task
from drone_rl.sim.tasks.geometry_kernel import GOAL
from drone_rl.trust.plots.saving import save_drawn
from drone_rl.utils.intervals import Share, rate_of
from drone_rl.utils.palette import BAD, EMPTY, FAINT, GOOD, INK, NEXT_CUBE, css

EPISODES = 100
_PIXELS = 400
"""Of the floor plan, along its longer side."""
_MARGIN = 0.3
"""Metres around the scene."""
_LOWER = 0.5
"""Height of the lower section of the plan, as a fraction of the way from the ground to flights."""
_COLORS = {"success": css(GOOD), "contact": css(BAD), "other": css(INK)}
_MARKS = {"success": "", "contact": "X", "other": "s"}
"""Where episodes end."""


@dataclasses.dataclass(frozen=True)
class Path3D:
    """The path of a drone in one episode."""

    points: NDArray[np.float64]
    """Positions from start to end, metres, world frame. Shape: (T + 1, 3)."""
    goals: NDArray[np.float64]
    """Centres of the goals at the start. Shape: (G, 3)."""
    scene: int
    start: str
    """Name of the start."""
    end: str
    """How the episode ended: a name of `Task.ends`."""

    @property
    def outcome(self) -> str:
        """One of "success", "contact" and "other"."""
        return {"SUCCESS": "success", "CONTACT": "contact"}.get(self.end, "other")


@torch.no_grad()
def fly_paths(env: Any, actor: Any, episodes: int = EPISODES) -> list[Path3D]:
    """Run episodes with the most probable actions; return their paths.

    Args:
        env: Environments of a task in scenes.
        actor: An actor of TorchRL, or an agent.
        episodes: Number of episodes.
    """
    base, found = base_env(env), list[Path3D]()
    task: Any = base.worlds.task
    agent: Agent = Exploring(as_agent(actor), greedy=True)
    while len(found) < episodes:
        state: Any = base.start()
        goals = state.places[:, task.roles == GOAL].cpu().numpy()
        scenes = task.scene_of(state).tolist()
        starts = _starts(task, state)
        points = [[one] for one in state.drone.cpu().numpy()]
        ends = [0] * len(state)
        for step in steps(agent, base.observer, state):
            places, reasons = step.after.drone.cpu().numpy(), step.after.end_reason.tolist()
            for row, place, reason in zip(step.rows.tolist(), places, reasons, strict=True):
                points[row].append(place)
                ends[row] = reason
        found += [
            Path3D(np.array(points[i]), goals[i], scenes[i], starts[i], task.ends(ends[i]).name)
            for i in range(len(ends))
        ]
    return found[:episodes]


def _starts(task: Any, state: Any) -> list[str]:
    if task.routes is None:
        return ["the start"] * len(state)
    return [task.routes.start_names[i] for i in task.starts_of(state).tolist()]


def by_start(paths: list[Path3D]) -> dict[str, Share]:
    """Return the success rate by start, with its interval."""
    names = sorted({path.start for path in paths})
    ended = {name: [p.outcome == "success" for p in paths if p.start == name] for name in names}
    return {name: rate_of(of) for name, of in ended.items()}


def draw_map(scene: SceneFile, paths: list[Path3D]) -> Figure:
    """Draw the floor plan of a scene at the height of flight, paths, contacts and success rates.

    Args:
        scene: The scene.
        paths: Those of episodes in this scene.
    """
    figure = Figure(figsize=(9.0, 6.0), layout="constrained")
    rates = by_start(paths)
    plan, bars = figure.subplots(1, 2, width_ratios=[3.4, 1])
    heights = _heights(scene, np.array([path.points[0] for path in paths]))
    _draw_plan(plan, scene, heights)
    _draw_starts(plan, [site for site in scene.sites if site.name in rates])
    for path in sorted(paths, key=lambda path: path.outcome != "success"):
        _draw_path(plan, path)
    goals = np.unique(np.concatenate([path.goals for path in paths]).round(3), axis=0)
    plan.plot(*goals[:, :2].T, "*", color=css(NEXT_CUBE), mec="white", ms=16, ls="", zorder=5)
    counts = {name: sum(p.outcome == name for p in paths) for name in _COLORS}
    figure.suptitle(
        f"{scene.name}: {counts['success']} of {len(paths)} episodes reach the goal", fontsize=12
    )
    _add_legend(figure, counts, heights)
    _draw_rates(bars, rates)
    return figure


def _heights(scene: SceneFile, starts: NDArray[np.float64]) -> tuple[float, float]:
    """Return a height between ground and flights, whose starts are (N, 3), then that of flights."""
    above = np.array([0.0, 0.0, max(float((starts[:, 2] - scene.bounds[0][2]).max()), 0.0)])
    before, now = torch.from_numpy(starts), torch.from_numpy(starts - above)
    to_ground = solids_of((scene,), "cpu").sweep(before, now).fraction.clamp(max=1.0) * above[2]
    height = float(np.median(starts[:, 2]))
    return height - (1.0 - _LOWER) * float(np.median(to_ground.numpy())), height


def _draw_plan(axis: Axes, scene: SceneFile, heights: tuple[float, float]) -> None:
    """Fill what is solid at each of two heights, the lower one in a lighter color."""
    low, high = scene.bounds
    low, high = low[:2] - _MARGIN, high[:2] + _MARGIN
    size = float((high - low).max()) / _PIXELS
    x, y = (np.arange(a, b, size) for a, b in zip(low, high, strict=True))
    solids = solids_of((scene,), "cpu")
    for z, color in zip(heights, (css(EMPTY), css(INK)), strict=True):
        points = np.stack([*np.meshgrid(x, y), np.full((len(y), len(x)), z)], -1).reshape(-1, 3)
        away = solids.distances(torch.from_numpy(points)).numpy().reshape(len(y), len(x))
        if (away < 0.5 * size).any():
            axis.contourf(x, y, away, [-np.inf, 0.5 * size], colors=[color], zorder=0)
    axis.set_aspect("equal")
    axis.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]), xlabel="x (m)", ylabel="y (m)")
    axis.spines[["top", "right"]].set_visible(False)


def _draw_starts(axis: Axes, sites: Sequence[Site]) -> None:
    """Outline the regions of starts, with the names that the success rates have."""
    for site in sites:
        corners = site.corners
        axis.fill(*corners.T, fill=False, ec=css(FAINT), ls="--", lw=1, zorder=4)
        white = [withStroke(linewidth=3, foreground="white")]
        low = corners[corners.sum(1).argmin()]
        axis.text(
            low[0],
            low[1],
            site.name,
            color=css(FAINT),
            size=9,
            va="top",
            path_effects=white,
            zorder=6,
        )


def _draw_path(axis: Axes, path: Path3D) -> None:
    color, mark, x, y = _COLORS[path.outcome], _MARKS[path.outcome], *path.points[:, :2].T
    fails = path.outcome != "success"
    style, alpha, z = ("--" if path.outcome == "other" else "-"), (1.0 if fails else 0.5), 2 + fails
    axis.plot(x, y, style, color=color, lw=1.6 if fails else 1.0, alpha=alpha, zorder=z)
    axis.plot(x[0], y[0], "o", color=color, ms=3.5, zorder=z)
    axis.plot(x[-1], y[-1], marker=mark, color=color, mec="white", mew=0.5, ms=9, zorder=5)


def _add_legend(figure: Figure, counts: dict[str, int], heights: tuple[float, float]) -> None:
    lines = {
        "success": ("reaches the goal", "-"),
        "contact": ("touches something (X)", "-"),
        "other": ("neither: out of time or bounds", "--"),
    }
    handles: list[Any] = [
        Line2D([], [], color=_COLORS[name], ls=style, marker=_MARKS[name], label=f"{text}: {count}")
        for name, (text, style) in lines.items()
        if (count := counts[name])
    ]
    handles += [
        Line2D([], [], color=css(INK), marker="o", ls="", ms=3.5, label="start of an episode"),
        Line2D([], [], color=css(NEXT_CUBE), marker="*", ls="", ms=12, label="goal"),
        Patch(color=css(INK), label=f"solid at {heights[1]:.1f} m, the height of flight"),
        Patch(color=css(EMPTY), label=f"solid at {heights[0]:.1f} m, flown over"),
    ]
    figure.legend(handles=handles, loc="outside lower left", ncols=2, frameon=False)


def _draw_rates(axis: Axes, rates: dict[str, Share]) -> None:
    for row, share in enumerate(rates.values()):
        rate = share.share or 0.0
        spread = [[rate - share.lower95], [share.upper95 - rate]]
        axis.barh(row, rate, color=css(GOOD), alpha=0.6)
        axis.errorbar(rate, row, xerr=spread, color=css(INK), capsize=3, lw=1)
    texts = [f"{name}\n{s.successes} of {s.trials}" for name, s in rates.items()]
    axis.set_yticks(range(len(rates)), texts, fontsize=9)
    axis.set(xlim=(0, 1.02), xticks=[0, 0.5, 1], xticklabels=["0%", "50%", "100%"])
    axis.set_ylim(len(rates) - 0.4, -0.6)
    axis.set_title("success by start,\n95% interval", fontsize=11)
    axis.set_box_aspect(min(0.45 * len(rates) + 0.3, 2.0))
    axis.spines[["top", "right"]].set_visible(False)


def save_maps(policy: BasePolicy, folder: Path, settings: HeldOutSettings, seed: int) -> list[Path]:
    """Draw a map of each scene of a policy's task; return the files, none without scenes.

    Args:
        policy: The policy.
        folder: Where files map_SCENE.png are written.
        settings: Device and renderer.
        seed: Root of the held-out episodes' random streams.
    """
    where: dict[str, Any] = {"device": settings.device, "renderer": settings.renderer}
    with policy.flying(EPISODES, seed=seed, **where) as (env, actor):
        task: Task[Any] = base_env(env).worlds.task
        scenes = getattr(task, "surroundings", ())
        paths = fly_paths(env, actor) if scenes else []
    files = []
    for number, scene in enumerate(scenes):
        own = [path for path in paths if path.scene == number]
        if own:
            files.append(folder / f"map_{scene.name}")
            save_drawn(draw_map(scene, own), files[-1])
    return [path.with_name(path.name + ".png") for path in files]
