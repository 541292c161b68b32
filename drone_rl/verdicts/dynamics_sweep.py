"""The same policies in other bodies and other air, as an object that shows itself."""

import dataclasses
import json
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from drone_rl.config import DynamicsSettings
from drone_rl.config.commands import BodiesSettings, JudgeSettings
from drone_rl.flight.in_the_loop.drone import FlightControllerError
from drone_rl.policies.base_policy import Pilot
from drone_rl.policies.external_policy import as_pilot
from drone_rl.sim.vocabulary import terms_of
from drone_rl.utils.display import aligned, paragraph, picture, table
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import Bar, Progress, silent
from drone_rl.utils.provenance import provenance
from drone_rl.utils.seeding import RootSeed, with_seed
from drone_rl.utils.text import BODIES, Evidence, percent, say, seed_line
from drone_rl.verdicts.judge import judge

LOOPED = "software in the loop"
"""Their column, and their key in the evidence."""


def with_loops(table: list[list[str]], numbers: Evidence) -> list[list[str]]:
    """A table with their column, if there are any.

    Args:
        table: Names, then a row for each policy.
        numbers: The evidence.
    """
    if LOOPED not in numbers:
        return table
    cells = [LOOPED, *(looped(numbers[LOOPED][name]) for name in numbers["policies"])]
    return [[*row, text] for row, text in zip(table, cells, strict=True)]


def looped(flights: Evidence) -> str:
    """What became of a policy's flights: no verdict, for which they are too few."""
    if "left_out" in flights:
        return "left out"
    success = flights["success"]
    ends = " to ".join(f"{100 * success[bound]:.0f}" for bound in ("lower95", "upper95"))
    return f"no verdict: {success['successes']} of {success['trials']} ({ends})"


def reasons(numbers: Evidence) -> list[str]:
    """Why flights were left out, a line each."""
    flown = numbers.get(LOOPED, {}).items()
    return [f"{name}, {LOOPED}: {f['left_out']}" for name, f in flown if "left_out" in f]


def rows(numbers: Evidence) -> list[list[str]]:
    """Names of bodies, then a row for each policy."""
    bodies = [str(body) for body in numbers["bodies"]]
    cells = [
        [name, *(cell(flown[body]) for body in bodies)]
        for name, flown in numbers["policies"].items()
    ]
    return with_loops([["", *bodies], *cells], numbers)


def cell(verdict: Evidence) -> str:
    """A verdict in a few words: its kind and the share of successful episodes."""
    success = verdict["greedy"]["success"]
    unsure = "" if verdict["certain"] else "?"
    ends = f"{_points(success['lower95'])} to {_points(success['upper95'])}"
    return f"{verdict['kind']}{unsure} {percent(success['share'])} ({ends})"


def failure(verdict: Evidence) -> str:
    """Where most of its failures are; nothing if there is none."""
    row: dict[str, Any] | None = verdict["failures"]["largest"]
    return "" if row is None else terms_of(verdict).failing(row["by"], row["value"])


def _points(share: float) -> str:
    return f"{100 * share:.0f}"


_COLORS = {"good": "#b9e0b0", "poor": "#f2b5ad", "one-sided": "#f7d7a0", "none": "#e3e6ea"} | {
    "good, but trivial": "#dfe7bd"
}
_INK, _FAINT = "#1e2024", "#5b616b"
_WIDTH, _HEIGHT = 1.75, 0.95
"""Inches of a cell."""


def chart(numbers: Mapping[str, Any]) -> Figure:
    """A row a policy, a column a body: verdict, share with 95% interval, what fails most.

    Args:
        numbers: As in `bodies.json`.
    """
    policies = numbers["policies"]
    looped = numbers.get(LOOPED, {})
    bodies = [*numbers["bodies"], *([LOOPED] if looped else [])]
    size = (_WIDTH * (len(bodies) + 1), _HEIGHT * len(policies) + 0.6)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots()
    axes.set(xlim=(-1, len(bodies)), ylim=(len(policies), -0.55))
    axes.axis("off")
    for x, body in enumerate(bodies):
        axes.text(x + 0.5, -0.25, body, ha="center", va="center", fontsize=10, color=_INK)
    for y, (name, flown) in enumerate(policies.items()):
        axes.text(-0.05, y + 0.5, name, ha="right", va="center", fontsize=11, color=_INK)
        for x, body in enumerate(numbers["bodies"]):
            _cell(axes, x, y, flown[body])
        if looped:
            _looped_cell(axes, len(bodies) - 1, y, looped[name])
    return figure


def _looped_cell(axes: Axes, x: int, y: int, flights: Mapping[str, Any]) -> None:
    box = {"facecolor": _COLORS["none"], "edgecolor": "white", "linewidth": 2, "hatch": ".."}
    axes.add_patch(Rectangle((x, y), 1, 1, **box))
    text, ink = textwrap.fill(looped(flights), 22), _INK
    axes.text(x + 0.5, y + 0.5, text, ha="center", va="center", fontsize=8.0, color=ink)


def _cell(axes: Axes, x: int, y: int, verdict: Mapping[str, Any]) -> None:
    kind = verdict["kind"]
    color = _COLORS.get(kind) or _COLORS.get(kind.split()[0], _COLORS["none"])
    box = {"facecolor": color, "edgecolor": "white", "linewidth": 2}
    axes.add_patch(Rectangle((x, y), 1, 1, **box))
    success, unsure = verdict["greedy"]["success"], "" if verdict["certain"] else " ?"
    share = f"{100 * success['share']:.1f}%"
    ends = f"{100 * success['lower95']:.0f} to {100 * success['upper95']:.0f}"
    lines = (
        (0.2, f"{verdict['kind']}{unsure}", 9.0, _INK),
        (0.45, f"{share}  ({ends})", 9.5, _INK),
        (0.77, textwrap.fill(failure(verdict), 26), 7.0, _FAINT),
    )
    for height, text, points, ink in lines:
        axes.text(x + 0.5, y + height, text, ha="center", va="center", fontsize=points, color=ink)


GUSTS = 0.25
"""Standard deviation of the wind along each axis, as a share of its mean."""


@dataclasses.dataclass(frozen=True)
class Bodies:
    """What becomes of verdicts when policies get a body."""

    settings: BodiesSettings
    numbers: dict[str, Any] = dataclasses.field(repr=False)
    """As in `bodies.json`: by policy and body the verdict's evidence, and by policy what became of
    flights with software in the loop, if there were any."""

    def save(self, folder: Path) -> None:
        """Writes `bodies.json`, `bodies.png` and `bodies.svg`."""
        (folder / "bodies.json").write_text(json.dumps({**self.numbers, **provenance()}, indent=2))
        figure = chart(self.numbers)
        for kind in ("png", "svg"):
            figure.savefig(folder / f"bodies.{kind}", dpi=130)

    def __str__(self) -> str:
        """The table: a policy a row, a body a column; and why flights were left out, if any."""
        return "\n".join([aligned(rows(self.numbers)), *self._notes()])

    def _repr_html_(self) -> str:
        head, *lines = rows(self.numbers)
        notes = "".join(map(paragraph, self._notes()))
        return table(head, lines) + notes + picture(chart(self.numbers))

    def _notes(self) -> list[str]:
        """Why flights were left out, if any were, and the seed."""
        notes = [*reasons(self.numbers), say(BODIES, self.numbers), seed_line(self.numbers)]
        return [*filter(None, notes)]


def bodies(
    policies: str | Path | Pilot | list[Any] | tuple[Any, ...] | None = None,
    settings: BodiesSettings | None = None,
    *,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    **changes: Any,
) -> Bodies:
    """Judges policies in computer-vision mode, in flight, in wind, and with worse drones.

    Args:
        policies: One or several of what `judge` takes; those of the settings by default.
        settings: Which, and how.
        outputs: See `load_policy`.
        progress: Told of what is being flown; a bar by default.
        changes: Settings to change, as in `bodies("good", episodes=100)`.

    Raises:
        InputError: A policy or a setting is unusable.
    """
    settings, seed = with_seed((settings or BodiesSettings()).replace(**changes))
    progress = progress or Bar()
    given = list(settings.policies) if policies is None else policies
    whom = given if isinstance(given, list | tuple) else [given]
    pilots = [as_pilot(one, outputs) for one in whom]
    _check_names([pilot.name for pilot in pilots])
    asked = settings.narrowed(JudgeSettings)
    found: dict[str, dict[str, Any]] = {}
    steps = len(pilots) * (len(settings.bodies) + bool(settings.loop_flights))
    for pilot in pilots:
        flown = found.setdefault(pilot.name, {})
        for body in settings.bodies:
            count = sum(map(len, found.values()))
            progress(f"{pilot.name}: {body}", count, steps)
            changed = changes_of(body, pilot.dynamics)
            done = judge(
                pilot,
                asked,
                dynamics=changed,
                outputs=outputs,
                progress=silent,
                drawn_seed=seed,
            )
            flown[body] = done.verdict.as_dict()
    numbers: dict[str, Any] = {
        "bodies": list(settings.bodies),
        **seed.as_dict(),
        "policies": found,
    }
    if settings.loop_flights:
        looped = numbers[LOOPED] = {}
        for pilot in pilots:
            progress(f"{pilot.name}: {LOOPED}", steps - len(pilots) + len(looped), steps)
            looped[pilot.name] = _looped(pilot, settings, seed)
    progress("flown", steps, steps)
    return Bodies(settings, numbers)


def _looped(pilot: Pilot, settings: BodiesSettings, seed: RootSeed) -> dict[str, Any]:
    """A policy's flights through a firmware, in still air; or why there are none."""
    from drone_rl.robustness.sitl import fly_in_the_loop

    still = pilot.in_dynamics(**changes_of("simple flight", pilot.dynamics))
    count = settings.loop_flights
    try:
        return fly_in_the_loop(still, count, drawn_seed=seed, progress=silent).as_dict()
    except (InputError, FlightControllerError) as error:
        return {"left_out": str(error)}


def _check_names(names: list[str]) -> None:
    """Refuses what no table can show.

    Raises:
        InputError: There is none, or two have the same.
    """
    if not names:
        raise InputError("policies=[] names nobody; give a policy or more")
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two policies are called {name}; give each once, or rename a file")


def changes_of(body: str, own: DynamicsSettings) -> Mapping[str, Any]:
    """What a body of that name changes of the dynamics that a policy was made for.

    Wind blows from the right, with gusts of a quarter of its speed along each axis; else the air is
    still. A policy's own drone keeps its own parameters.
    """
    still = {"wind": [0.0, 0.0, 0.0], "gusts": 0.0}
    if body == "computer vision":
        return {"mode": "computer_vision", **still}
    flying = {"mode": "simple_flight", "camera_mount": "gimbal", **still}
    if body.startswith("wind"):
        speed = float(body.split()[1])
        return {**flying, "wind": [0.0, speed, 0.0], "gusts": GUSTS * speed}
    if body == "motors twice as slow":
        return {**flying, "rotor_time_constant": 2.0 * own.rotor_time_constant}
    return {**flying, "camera_mount": "body"} if body == "camera on the body" else flying
