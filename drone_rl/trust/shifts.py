"""`drone-rl shifts`: evaluate a policy under perturbations, and find its operating domain."""

import itertools
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import yaml
from matplotlib.figure import Figure

from drone_rl.config.commands import ShiftSettings
from drone_rl.config.configuration import from_arguments
from drone_rl.policies.baselines import check_baselines
from drone_rl.policies.external_network import Logits
from drone_rl.policies.external_policy import as_policy
from drone_rl.policies.policy import BasePolicy, Policy
from drone_rl.policies.zoo import fingerprint
from drone_rl.sim.tasks import as_task
from drone_rl.trust.axes import Axis, check_axes, find_axes
from drone_rl.trust.charts import chart, strips
from drone_rl.trust.domain import Prober, required_success, run_across
from drone_rl.trust.paired_evaluation import EvaluatedPolicy, PairedEvaluator
from drone_rl.trust.repetition import require_repeatable
from drone_rl.trust.shifts_results import Domain, NetworkIdentity, Range, Robustness, packed
from drone_rl.trust.suite import Suite, make_strip
from drone_rl.utils.display import TableResult
from drone_rl.utils.progress import Progress, as_progress
from drone_rl.utils.provenance import provenance
from drone_rl.utils.seeding import RootSeed, with_seed

CONFIRMING = 150
"""New episodes over each range that was found."""


class Shifts(TableResult, Robustness):
    """Success rates of a policy under perturbations, and its operating domain, with charts."""

    def save(self, folder: Path) -> None:
        """Write `shifts.json`, which verdicts, cards and reports quote, and the charts.

        `domain.yaml` has the ranges, if any, in the format of `drone-rl verdict
        require_domain=FILE`; `shifts.png` has curves, `strips.png` camera images.
        """
        self.replace(**provenance()).write_json(folder / "shifts.json")
        if self.domain is not None:
            (folder / "domain.yaml").write_text(yaml.safe_dump(self.requirements()))
        self.figure().savefig(folder / "shifts.png", dpi=110)
        strips(self).save(folder / "strips.png")

    def rows(self) -> list[list[str]]:
        """Return the success rates as a table: a header, then a row for each axis."""
        return self.table()

    def figure(self) -> Figure:
        """Return the curves."""
        return chart(self)

    def notes(self) -> tuple[str, str]:
        """Return the operating domain, what differs from the training, and the seed."""
        return self.sentence, self.seed_line()


def shifts(
    policy: str | Path | BasePolicy | Logits,
    settings: ShiftSettings | None = None,
    *,
    task: Mapping[str, Any] | None = None,
    dynamics: Mapping[str, Any] | None = None,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    **changes: Any,
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
    progress("repeated episodes")
    require_repeatable(loaded, seed=seed.value, device=settings.device, renderer=settings.renderer)
    subject = EvaluatedPolicy.of(loaded, device=settings.device, renderer=settings.renderer)
    if settings.domain:
        check_baselines(as_task(subject.task), subject.network.actions)
    axes = find_axes(settings.axes, subject)
    total = len(axes) * (len(settings.strengths) + settings.domain) + 1
    done = itertools.count()

    def report(text: str) -> None:
        progress(text, next(done), total)

    with closing(PairedEvaluator(subject, settings.episodes, seed.value)) as evaluator:
        suite = Suite(evaluator, settings.modes, settings.possible_share)
        measured = suite.run(axes, settings.strengths, report)
    domain = _domain(subject, axes, settings, seed, report) if settings.domain else None
    with closing(PairedEvaluator(subject, 1, seed.value)) as filmed:
        pictures = {axis.name: make_strip(filmed, axis) for axis in axes}
    progress("flown", total, total)
    network = None  # of a third-party policy
    if isinstance(loaded, Policy):
        described = loaded.description.model_dump(mode="json")
        weights = fingerprint(loaded.state.weights)
        network = NetworkIdentity(weights=weights, description=described)
    return Shifts(
        policy=loaded.name,
        network=network,
        settings=settings,
        **seed.as_dict(),
        terms=as_task(subject.task).vocabulary,
        **measured,
        domain=domain,
        seconds=time.perf_counter() - begin,
        unlike=loaded.unlike,
        image_size=(subject.camera.height, subject.camera.width),
        pictures={
            name: tuple(None if frame is None else packed(frame) for frame in strip)
            for name, strip in pictures.items()
        },
    )


def _domain(
    subject: EvaluatedPolicy,
    axes: Sequence[Axis],
    settings: ShiftSettings,
    seed: RootSeed,
    report: Callable[[str], None],
) -> Domain:
    """Search the operating domain."""
    episodes, ranges = settings.domain_episodes, dict[str, Range]()
    with closing(PairedEvaluator(subject, episodes, seed.value)) as evaluator:
        oracle = evaluator.run_oracle()
        prober = Prober(evaluator, oracle, settings.good_share, settings.possible_share)
        required = required_success(oracle, settings.good_share)
        for axis in axes:
            report(f"range of {axis.name}")
            ranges[axis.name] = prober.search(
                axis,
                lambda spans: run_across(subject, spans, CONFIRMING, seed.value, required),
            )
    return Domain(plain=prober.plain, ranges=ranges, is_absolute=oracle is None)
