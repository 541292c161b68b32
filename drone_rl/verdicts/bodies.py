"""The same policies in other bodies and other air, as an object that shows itself."""

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drone_rl.config import DynamicsSettings
from drone_rl.config.bodies import BodiesSettings
from drone_rl.config.judging import JudgeSettings
from drone_rl.flight.in_the_loop.drone import FlightControllerError
from drone_rl.policies.base_policy import Pilot
from drone_rl.policies.external_policy import as_pilot
from drone_rl.robustness.sitl_text import LOOPED, reasons
from drone_rl.utils.display import aligned, paragraph, picture, table
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import Bar, Progress, silent
from drone_rl.utils.provenance import provenance
from drone_rl.utils.seed_text import BODIES, seed_line
from drone_rl.utils.seeding import RootSeed, with_seed
from drone_rl.utils.sentences import say
from drone_rl.verdicts.bodies_chart import chart
from drone_rl.verdicts.bodies_text import rows
from drone_rl.verdicts.judge import judge

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
