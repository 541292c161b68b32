"""`drone-rl bodies`: judge policies under several vehicle dynamics, also in the loop."""

import itertools
import textwrap
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pydantic
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from drone_rl.config import DynamicsSettings
from drone_rl.config.commands import BodiesSettings, JudgeSettings
from drone_rl.config.configuration import from_arguments
from drone_rl.policies.external_policy import as_policy
from drone_rl.policies.policy import BasePolicy
from drone_rl.trust.judge import Judgement, judge_one
from drone_rl.trust.results import Figures, Verdict
from drone_rl.utils.display import TableResult
from drone_rl.utils.errors import InputError
from drone_rl.utils.models import Seeded, Stored
from drone_rl.utils.palette import BAD, EMPTY, GOOD, ONE_SIDED, css, light
from drone_rl.utils.progress import Progress, as_progress, silent
from drone_rl.utils.provenance import Provenance, provenance
from drone_rl.utils.seeding import RootSeed, with_seed
from drone_rl.utils.text import interval, rate

LOOPED = "software in the loop"
"""Name of the column of these episodes, and their key in the file."""
GUSTS = 0.25
"""Standard deviation of the wind along each axis, as a fraction of its mean."""
_COLORS = {"good": GOOD, "poor": BAD, "one-sided": ONE_SIDED}


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
            cells = [_cell(by_body[body]) for body in self.bodies]
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
    **changes: Any,
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


def _cell(verdict: Verdict) -> str:
    """Return the kind and the success rate."""
    unsure = "" if verdict.certain else "?"
    return f"{verdict.kind.value}{unsure} {rate(verdict.greedy.success, label='')}"


def _looped(flights: Figures | LeftOut) -> str:
    """Return the successes with software in the loop, which are too few for a verdict."""
    if isinstance(flights, LeftOut):
        return "left out"
    success = flights.success
    return f"no verdict: {success.successes} of {success.trials} ({interval(success)})"


def chart(result: Bodies) -> Figure:
    """Draw a colored table: verdict, success rate with 95% interval, and largest failure."""
    head, *rows = result.rows()
    colors = [[EMPTY] * len(row[1:]) for row in rows]
    texts = [[textwrap.fill(text, 18) for text in row[1:]] for row in rows]
    unsure: list[tuple[int, int]] = []
    for y, name in enumerate(result.policies):
        for x, body in enumerate(result.bodies):
            verdict = result.policies[name][body]
            colors[y][x] = _COLORS.get(verdict.kind.family, EMPTY)
            if (row := verdict.failures.largest) is not None:
                texts[y][x] += "\n" + textwrap.fill(verdict.terms.failing(row.by, row.value), 18)
            unsure += [] if verdict.certain else [(y + 1, x)]  # below the head
    figure = Figure(figsize=(1.5 * len(head), 1.3 * len(rows) + 1.1), layout="constrained")
    axes = figure.subplots()
    axes.set_title("Verdict, success rate with 95% CI, and where most failures occur", fontsize=11)
    axes.axis("off")
    figure.supxlabel("hatched, ?: not certain", fontsize=9)
    table = axes.table(
        texts,
        cellColours=[[css(light(color)) for color in row] for row in colors],
        rowLabels=[row[0] for row in rows],
        colLabels=[textwrap.fill(body, 16) for body in head[1:]],
        cellLoc="center",
        bbox=Bbox.unit(),
    )
    table.auto_set_font_size(False)
    table.set_fontsize(8.5)
    for place in unsure:
        table[place].set(hatch="//")
    for cell in table.get_celld().values():
        cell.set(edgecolor="white", linewidth=2)
    return figure
