"""`drone-rl shifts`: evaluate a policy under perturbations, and find its operating domain."""

import dataclasses
import itertools
import json
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Unpack

import yaml
from matplotlib.figure import Figure
from numpy.typing import NDArray

from drone_rl.config import MINIMAL, BaseTaskSettings
from drone_rl.config.commands import ShiftSettings
from drone_rl.config.configuration import from_arguments
from drone_rl.config.options import ShiftOptions
from drone_rl.envs import base_env, worlds_of
from drone_rl.policies.baselines import check_baselines
from drone_rl.policies.external_network import Logits
from drone_rl.policies.external_policy import as_policy
from drone_rl.policies.policy import BasePolicy, Policy
from drone_rl.policies.zoo import fingerprint
from drone_rl.sim.tasks import as_task
from drone_rl.trust.agents import OracleAgent
from drone_rl.trust.axes import AXES, Axis, check_axes, find_axes
from drone_rl.trust.charts import chart, strips
from drone_rl.trust.domain import Prober
from drone_rl.trust.paired_evaluation import EvaluatedPolicy, PairedEvaluator
from drone_rl.trust.perturbations import Condition, PerturbationMode
from drone_rl.trust.rounding_sensitivity import require_function
from drone_rl.trust.shifts_file import FORMAT, FORMAT_VERSION
from drone_rl.trust.shifts_text import SHIFTS, is_tested, rows
from drone_rl.trust.suite import Suite, make_strip, packed
from drone_rl.trust.verdict_text import unlike as say_unlike
from drone_rl.utils.display import TableResult
from drone_rl.utils.errors import InputError
from drone_rl.utils.progress import Progress, as_progress
from drone_rl.utils.provenance import provenance
from drone_rl.utils.seeding import RootSeed, with_seed
from drone_rl.utils.text import say, seed_line


@dataclasses.dataclass(frozen=True)
class Shifts(TableResult):
    """Success rates of a policy under perturbations, and its operating domain."""

    policy: BasePolicy
    settings: ShiftSettings
    numbers: dict[str, Any]
    """The results as plain values, as in `shifts.json`."""
    pictures: Mapping[str, Sequence[NDArray | None]]
    """Camera images of each axis: without perturbation, then at each of the five strengths; None if
    the task does not allow the strength. Shapes: (H, W, 3), uint8."""

    @property
    def area(self) -> float:
        """Mean over axes of the area under the curve of success rate against strength."""
        areas = [along["areas"]["constant"] for along in self.numbers["axes"].values()]
        defined = [area for area in areas if area is not None]
        return sum(defined) / max(len(defined), 1)

    @property
    def sentence(self) -> str:
        """The operating domain as text."""
        return say(SHIFTS, self.numbers)

    def save(self, folder: Path) -> None:
        """Write `shifts.json`, which verdicts, cards and reports quote, and the charts.

        `domain.yaml` has the ranges, if any, in the format of `drone-rl verdict
        require_domain=FILE`; `shifts.png` has curves, `strips.png` camera images.
        """
        images = {
            name: [None if one is None else packed(one) for one in strip]
            for name, strip in self.pictures.items()
        }
        written = {**self.numbers, "pictures": images, **provenance()}
        (folder / "shifts.json").write_text(json.dumps(written, indent=2))
        if self.numbers["domain"] is not None:
            (folder / "domain.yaml").write_text(yaml.safe_dump(ranges_of(self.numbers)))
        self.figure().savefig(folder / "shifts.png", dpi=110)
        strips(self.numbers, self.pictures).save(folder / "strips.png")

    def rows(self) -> list[list[str]]:
        """Return the success rates as a table: a header, then a row for each axis."""
        return rows(self.numbers)

    def figure(self) -> Figure:
        """Return the curves."""
        return chart(self.numbers)

    def notes(self) -> tuple[str, str]:
        """Return the operating domain, what differs from the training, and the seed."""
        unlike = self.policy.unlike
        other = f" {say_unlike({'unlike': unlike})}" if unlike else ""
        return f"{self.sentence}{other}", seed_line(self.numbers)


def shifts(
    policy: str | Path | BasePolicy | Logits,
    settings: ShiftSettings | None = None,
    *,
    task: Mapping[str, Any] | None = None,
    dynamics: Mapping[str, Any] | None = None,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    **changes: Unpack[ShiftOptions],
) -> Shifts:
    """Evaluate a policy under perturbations, one axis at a time and all combined.

    Args:
        policy: The policy, what `load_policy` takes, or a callable, see `policy_from`.
        settings: Axes, strengths, number of episodes and so on.
        task: Changed settings of the policy's task.
        dynamics: Changed settings of its vehicle dynamics.
        outputs: See `load_policy`.
        progress: Called with the name of each step; a progress bar by default.
        changes: Changed settings, as in `shifts("good", axes=["light"])`.

    Raises:
        InputError: The policy or a setting is unusable, or there is no such axis or strength.
    """
    settings, seed = with_seed(from_arguments(ShiftSettings, settings, changes, shifts))
    progress = as_progress(progress)
    check_axes(settings.axes or ())
    loaded = as_policy(policy, outputs, task=task, dynamics=dynamics)
    begin = time.perf_counter()
    require_function(loaded, seed=seed.value, device=settings.device, renderer=settings.renderer)
    subject = make_evaluated_policy(loaded, settings)
    if settings.domain:
        if (judged := as_task(subject.task)).oracle is None:
            raise InputError(f"task={judged.name} has no oracle to compare with; give domain=false")
        check_baselines(judged, subject.network.actions)
    axes = find_axes(settings.axes, subject)
    total = len(axes) * (len(settings.strengths) + settings.domain) + 1
    done = itertools.count()

    def report(text: str) -> None:
        progress(text, next(done), total)

    with closing(PairedEvaluator(subject, settings.episodes, seed.value)) as evaluator:
        suite = Suite(
            evaluator, [PerturbationMode(mode) for mode in settings.modes], settings.possible_share
        )
        measured = suite.run(axes, settings.strengths, report)
    domain = _domain(subject, axes, settings, seed, report) if settings.domain else None
    with closing(PairedEvaluator(subject, 1, seed.value)) as filmed:
        pictures = {axis.name: make_strip(filmed, axis) for axis in axes}
    progress("flown", total, total)
    identity = None  # of a third-party policy
    if isinstance(loaded, Policy):
        described = loaded.description.as_dict()
        identity = {"weights": fingerprint(loaded.state["policy"]), "description": described}
    numbers = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "policy": loaded.name,
        "network": identity,
        "settings": settings.values(),
        **seed.as_dict(),
        "terms": as_task(subject.task).vocabulary.as_dict(),
        **measured,
        "domain": domain,
        "seconds": time.perf_counter() - begin,
    }
    return Shifts(loaded, settings, numbers, pictures)


def ranges_of(numbers: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Convert the operating domain of `shifts.json` to the format of `require_domain`."""
    return {
        name: {end: range_[end] for end in ("low", "high") if range_[end] is not None}
        | {"unit": AXES[name].unit}
        for name, range_ in numbers["domain"]["ranges"].items()
        if range_["positions"] is not None and is_tested(numbers, name)
    }


def _domain(
    subject: EvaluatedPolicy,
    axes: Sequence[Axis],
    settings: ShiftSettings,
    seed: RootSeed,
    report: Callable[[str], None],
) -> dict[str, Any]:
    """Return the operating domain: "plain", without perturbation, and "ranges" by axis."""
    ranges: dict[str, Any] = {}
    with closing(PairedEvaluator(subject, settings.domain_episodes, seed.value)) as evaluator:
        oracle = evaluator.run(Condition(), agent=OracleAgent(only_visible=False)).episodes
        prober = Prober(evaluator, oracle, settings.good_share, settings.possible_share)
        for axis in axes:
            report(f"range of {axis.name}")
            ranges[axis.name] = prober.search(axis)
    return {"plain": prober.plain, "ranges": ranges}


def make_evaluated_policy(policy: BasePolicy, settings: ShiftSettings) -> EvaluatedPolicy:
    """Return the policy with its task, camera and transforms.

    Raises:
        InputError: The task has no settings to perturb, or its settings make another task.
    """
    task: Any = policy.task
    if not isinstance(task, BaseTaskSettings):
        settings_of_task = getattr(task, "settings", None)
        is_rebuilt = isinstance(settings_of_task, BaseTaskSettings)
        is_rebuilt = is_rebuilt and type(as_task(settings_of_task)) is type(task)
        task = settings_of_task if is_rebuilt else None
    if task is None:
        raise InputError(
            f"the task of policy={policy.name} has no settings to perturb; give another policy"
        )
    env: Any = policy.make_env(1, device=settings.device, renderer=settings.renderer)
    try:
        camera, transforms = worlds_of(env).camera, base_env(env).observer.transforms
    finally:
        env.close()
    network = policy.make_network(settings.device).eval()
    described = getattr(policy, "description", None)  # only policies from files have one
    look = MINIMAL if described is None else described.appearance
    where, moved = (settings.device, settings.renderer), (policy.dynamics, policy.actions)
    return EvaluatedPolicy(network, task, camera, transforms, look, *where, *moved)
