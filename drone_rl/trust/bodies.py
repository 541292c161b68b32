"""`drone-rl bodies`: judge policies under several vehicle dynamics, also in the loop."""

import itertools
import textwrap
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Unpack

import pydantic
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from drone_rl.config import DynamicsSettings
from drone_rl.config.commands import BodiesSettings, JudgeSettings
from drone_rl.config.configuration import from_arguments
from drone_rl.config.options import BodiesOptions
from drone_rl.policies.external_policy import as_policy
from drone_rl.policies.policy import BasePolicy
from drone_rl.trust.judge import Judgement, judge_one
from drone_rl.trust.results import Figures, Verdict
from drone_rl.utils.display import TableResult
from drone_rl.utils.errors import InputError
from drone_rl.utils.models import Seeded, Stored
from drone_rl.utils.palette import BAD, EMPTY, FAINT, GOOD, INK, ONE_SIDED, css, light
from drone_rl.utils.progress import Progress, as_progress, silent
from drone_rl.utils.provenance import Provenance, provenance
from drone_rl.utils.seeding import RootSeed, with_seed
from drone_rl.utils.text import interval, percent, rate

LOOPED = "software in the loop"
"""Name of the column of these episodes, and their key in the file."""
GUSTS = 0.25
"""Standard deviation of the wind along each axis, as a fraction of its mean."""
_COLORS = {
    "good": css(light(GOOD)),
    "good, but trivial": css(light(GOOD, 0.15)),
    "poor": css(light(BAD)),
    "one-sided": css(light(ONE_SIDED)),
    "none": css(light(EMPTY)),
}
_INK, _FAINT = css(INK), css(FAINT)
_WIDTH, _HEIGHT = 1.35, 1.1
"""Inches of a cell."""


class LeftOut(Stored):
    """The reason why there are no episodes with software in the loop."""

    left_out: str


class Bodies(TableResult, Seeded, Provenance):
    """Verdicts by policy and dynamics."""

    model_config = pydantic.ConfigDict(validate_by_name=True, serialize_by_alias=True)

    bodies: tuple[str, ...]
    """Names of the dynamics."""
    policies: dict[str, dict[str, Verdict]]
    """By policy and dynamics."""
    in_the_loop: dict[str, Figures | LeftOut] = pydantic.Field({}, alias=LOOPED)
    """Of episodes with software in the loop, by policy."""

    def save(self, folder: Path) -> None:
        """Write `bodies.json`, `bodies.png` and `bodies.svg`."""
        self.replace(**provenance()).write_json(folder / "bodies.json")
        figure = self.figure()
        for kind in ("png", "svg"):
            figure.savefig(folder / f"bodies.{kind}", dpi=130)

    def rows(self) -> list[list[str]]:
        """Return the verdicts as a table: a header, then a row for each policy."""
        column = [LOOPED] if self.in_the_loop else []
        table = [["", *self.bodies, *column]]
        for name, by_body in self.policies.items():
            cells = [" ".join(_cell(by_body[body])) for body in self.bodies]
            flights = [_looped(self.in_the_loop[name])] if self.in_the_loop else []
            table.append([name, *cells, *flights])
        return table

    def figure(self) -> Figure:
        """Return the table with colors."""
        return chart(self)

    def notes(self) -> list[str]:
        """Return the reasons for missing episodes, and the seed."""
        looped = self.in_the_loop.items()
        missing = [f"{n}, {LOOPED}: {of.left_out}" for n, of in looped if isinstance(of, LeftOut)]
        return [*filter(None, [*missing, self.seed_warning()]), self.seed_line()]


def bodies(
    policies: str | Path | BasePolicy | list[Any] | tuple[Any, ...] | None = None,
    settings: BodiesSettings | None = None,
    *,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    judge: Callable[..., Judgement] = judge_one,
    in_the_loop: Callable[[BasePolicy, int, RootSeed], Figures] | None = None,
    **changes: Unpack[BodiesOptions],
) -> Bodies:
    """Judge policies in computer-vision mode, in flight, in wind, and with worse drones.

    Args:
        policies: One or several of what `judge` takes, except baselines; those of the settings by
            default.
        settings: Policies, dynamics, number of episodes and so on.
        outputs: See `load_policy`.
        progress: Called with what is running; a progress bar by default.
        judge: Judges one policy, by default without certificates; `drone_rl.bodies` passes
            `drone_rl.judge`.
        in_the_loop: Runs so many episodes with software in the loop, for `loop_flights`, or raises
            an `InputError`; `drone_rl.bodies` passes
            `drone_rl.flight.sitl_evaluation.figures_in_the_loop`.
        changes: Settings to change, as in `bodies("good", episodes=100)`.

    Raises:
        InputError: A policy or a setting is unusable.
    """
    settings, seed = with_seed(from_arguments(BodiesSettings, settings, changes, bodies))
    progress = as_progress(progress)
    loaded = _load(settings.policies if policies is None else policies, outputs)
    if settings.loop_flights and in_the_loop is None:
        raise InputError(f"loop_flights={settings.loop_flights} needs in_the_loop=")
    shared = settings.as_base(JudgeSettings)
    for policy, body in itertools.product(loaded, settings.bodies):  # before any episode
        policy.in_dynamics(**changes_of(body, policy.dynamics))
    by_policy: dict[str, dict[str, Verdict]] = {}
    steps = len(loaded) * (len(settings.bodies) + bool(settings.loop_flights))
    for policy in loaded:
        verdicts = by_policy.setdefault(policy.name, {})
        for body in settings.bodies:
            count = sum(map(len, by_policy.values()))
            progress(f"{policy.name}: {body}", count, steps)
            how = {"dynamics": changes_of(body, policy.dynamics), "outputs": outputs}
            verdicts[body] = judge(policy, shared, **how, progress=silent, drawn_seed=seed)
    looped: dict[str, Figures | LeftOut] = {}
    if in_the_loop is not None and settings.loop_flights:
        for policy in loaded:
            progress(f"{policy.name}: {LOOPED}", steps - len(loaded) + len(looped), steps)
            still = policy.in_dynamics(**changes_of("simple flight", policy.dynamics))
            try:
                looped[policy.name] = in_the_loop(still, settings.loop_flights, seed)
            except InputError as error:
                looped[policy.name] = LeftOut(left_out=str(error))
    progress("flown", steps, steps)
    names = tuple(settings.bodies)
    return Bodies(bodies=names, **seed.as_dict(), policies=by_policy, in_the_loop=looped)


def _load(policies: Any, outputs: str | Path) -> list[BasePolicy]:
    listed = policies if isinstance(policies, list | tuple) else [policies]
    loaded = [as_policy(one, outputs) for one in listed]
    if not loaded:
        raise InputError("policies=[] is empty; give at least one policy")
    names = [policy.name for policy in loaded]
    if twice := next((name for name in names if names.count(name) > 1), None):
        raise InputError(f"two policies are called {twice}; give each once, or rename a file")
    return loaded


def changes_of(body: str, dynamics: DynamicsSettings) -> Mapping[str, Any]:
    """Return the settings in which named dynamics differ from a policy's own.

    Wind, if any, blows from the right, with gusts of a quarter of its speed along each axis.
    """
    still = {"wind": [0.0, 0.0, 0.0], "gusts": 0.0}
    if body == "computer vision":
        return {"mode": "computer_vision", **still}
    flying = {"mode": "simple_flight", "camera_mount": "gimbal", **still}
    if body.startswith("wind"):
        speed = float(body.split()[1])
        return {**flying, "wind": [0.0, speed, 0.0], "gusts": GUSTS * speed}
    if body == "motors twice as slow":
        return {**flying, "rotor_time_constant": 2.0 * dynamics.rotor_time_constant}
    return {**flying, "camera_mount": "body"} if body == "camera on the body" else flying


def _cell(verdict: Verdict) -> tuple[str, str]:
    """Return the kind and the success rate."""
    success = rate(verdict.greedy.success, label="")
    return f"{verdict.kind.value}{'' if verdict.certain else '?'}", success


def _looped(flights: Figures | LeftOut) -> str:
    """Return the successes with software in the loop, which are too few for a verdict."""
    if isinstance(flights, LeftOut):
        return "left out"
    success = flights.success
    return f"no verdict: {success.successes} of {success.trials} ({interval(success)})"


def chart(result: Bodies) -> Figure:
    """Draw a colored table: verdict, success rate with 95% interval, and largest failure."""
    policies, looped = result.policies, result.in_the_loop
    bodies = [*result.bodies, *([LOOPED] if looped else [])]
    size = (_WIDTH * (len(bodies) + 1), _HEIGHT * len(policies) + 0.9)
    figure = Figure(figsize=size, layout="constrained")
    axes = figure.subplots()
    axes.set(xlim=(-1, len(bodies)), ylim=(len(policies), -0.55))
    axes.axis("off")
    heading = "Verdict, success rate with 95% CI, and where most failures occur"
    axes.set_title(heading, loc="left", fontsize=11, color=_INK)
    note = "hatched, ?: not certain"
    figure.supxlabel(note, fontsize=9, color=_FAINT)
    for x, body in enumerate(bodies):
        text = textwrap.fill(body, 16)
        axes.text(x + 0.5, -0.25, text, ha="center", va="center", fontsize=10, color=_INK)
    for y, (name, verdicts) in enumerate(policies.items()):
        axes.text(-0.05, y + 0.5, name, ha="right", va="center", fontsize=11, color=_INK)
        cells = [_verdict_cell(verdicts[body]) for body in result.bodies]
        if looped:
            text = textwrap.fill(_looped(looped[name]), 17)
            cells.append((_COLORS["none"], "..", [(0.5, text, 8.5, _INK)]))
        for x, (color, hatch, lines) in enumerate(cells):
            axes.add_patch(Rectangle((x, y), 1, 1, fc=color, ec="white", lw=2, hatch=hatch))
            for height, text, points, ink in lines:
                axes.text(
                    x + 0.5, y + height, text, ha="center", va="center", fontsize=points, color=ink
                )
    return figure


def _verdict_cell(verdict: Verdict) -> tuple[str, str | None, list[tuple[float, str, float, str]]]:
    """Color, hatch, and lines of a cell: height, text, points and color of each."""
    kind, success, row = verdict.kind.value, verdict.greedy.success, verdict.failures.largest
    failure = "" if row is None else verdict.terms.failing(row.by, row.value)
    color = _COLORS.get(kind) or _COLORS.get(kind.split()[0], _COLORS["none"])
    lines = [
        (0.17, f"{kind}{'' if verdict.certain else ' ?'}", 9.0, _INK),
        (0.38, percent(success.share or 0.0), 11.0, _INK),
        (0.57, interval(success), 8.5, _INK),
        (0.81, textwrap.fill(failure, 21), 7.0, _FAINT),
    ]
    return color, None if verdict.certain else "//", lines
