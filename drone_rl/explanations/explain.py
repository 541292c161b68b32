"""`drone-rl explain`: compute all sections, write them as files, and make one report."""

import dataclasses
import itertools
import logging
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from drone_rl.config.configuration import from_arguments
from drone_rl.envs import base_env
from drone_rl.explanations import (
    attribution,
    behavior,
    class_models,
    embedding,
    importance,
    response,
    scene_map,
    truth,
)
from drone_rl.explanations.context import Context, LeftOutError, find_lacking
from drone_rl.explanations.report import write_report
from drone_rl.explanations.results import Explanation
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.policies.external_network import Logits
from drone_rl.policies.external_policy import as_policy
from drone_rl.policies.policy import BasePolicy
from drone_rl.trust.coverage import find_domain
from drone_rl.trust.recorded import record_verdict
from drone_rl.trust.repetition import require_repeatable
from drone_rl.trust.verdict import FindClaim
from drone_rl.utils.display import Result, page
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import as_path, new_run_folder, to_file_name
from drone_rl.utils.models import Model, Seeded
from drone_rl.utils.progress import Progress, as_progress
from drone_rl.utils.provenance import provenance
from drone_rl.utils.schema import Whole
from drone_rl.utils.seeding import RootSeed, with_seed
from drone_rl.utils.text import listed
from drone_rl.utils.threads import pool_like_caller, torch_threads

_log = logging.getLogger(__name__)
Given = str | Path | BasePolicy | Logits  # a policy or something that `as_policy` converts to one
Section = Callable[[Context], Model | dict[str, Any] | None]
"""Returns the result of a section, None if there is nothing to show; runs at any time."""
SECTIONS: dict[str, Section] = {
    "attribution": attribution.section,
    "class_model": class_models.section,
    "dataset": behavior.dataset_section,
    "tsne": embedding.section,
    "verdict": behavior.verdict_section,
    "flaws": behavior.flaws_section,
    "importance": importance.section,
    "response": response.section,
    "asymmetry": response.asymmetry_section,
    "shifts": behavior.shifts_section,
    "truth": truth.section,
    "scene_map": scene_map.section,
}
"""Sections by the names of their results in `Explanation`; `drone_rl.explain` adds "places".
`report.page.PARTS` displays them."""
OF_EACH_IMAGE = frozenset({"attribution", "class_model", "tsne", "truth"})
"""Sections that are computed for each image among a policy's inputs, the others once."""
THREADED = frozenset({"attribution", "class_model", "flaws", "tsne"})
"""Sections that run in a second thread: they step no environment and use a copy of the network."""


@dataclasses.dataclass(frozen=True)
class Explanations(Result):
    """Explanations of one or several policies, and the report that shows them."""

    folder: Path
    """Holds a folder for each policy, and for each further image that it sees, and the report."""
    report: Path
    """One self-contained HTML file."""
    policies: dict[str, Explanation]
    """Results by the policies' names; those of further images, such as "NAME, depth", after."""
    seed: RootSeed
    """Root of all random streams."""

    def __str__(self) -> str:
        lines = []
        for name, explanation in self.policies.items():
            if verdict := explanation.verdict:
                findings = (finding.text for finding in explanation.findings)
                lines += [f"{name}: {verdict.line}", *findings]
        seed_line = Seeded(**self.seed.as_dict()).seed_line()
        return "\n".join([*lines, f"report: {self.report}", seed_line])

    def _repr_html_(self) -> str:
        return page(self.report.read_text(encoding="utf-8"))


def explain(
    policies: Given | Sequence[Given],
    settings: ExplainSettings | None = None,
    *,
    folder: str | Path | None = None,
    num_envs: int = 128,
    outputs: str | Path = "outputs",
    progress: Progress | None = None,
    more_sections: Mapping[str, Section] | None = None,
    find_claim: FindClaim | None = None,
    **changes: Any,
) -> Explanations:
    """Explain what policies respond to and whether they can be trusted.

    Args:
        policies: One or several: policies, what `load_policy` takes, or callables, see
            `policy_from`.
        settings: What to compute.
        folder: Folder of explanations and report; by default a new one under `outputs`.
        num_envs: Environments in a batch; bounds memory.
        outputs: Folder of all runs, see `load_policy` and `find_domain`.
        progress: Callback for progress; shows a bar by default.
        more_sections: Sections in addition to `SECTIONS`, by name.
        find_claim: Finds and checks certificates, see `judge`.
        changes: Settings to change, as in `explain("good", frames=100)`.

    Raises:
        InputError: A policy or a setting is unusable, or the folder can't be written.
    """
    settings, seed = with_seed(from_arguments(ExplainSettings, settings, changes, explain))
    Whole(1).read(num_envs, "num_envs")
    by_name = _named(policies, outputs)
    progress = as_progress(progress)
    folder = new_run_folder("explain", outputs) if folder is None else as_path(folder, "folder")
    sections = {**SECTIONS, **(more_sections or {})}
    of_image = {title: one for title, one in sections.items() if title in OF_EACH_IMAGE}
    done, steps = itertools.count(), len(by_name) * len(sections) + 1
    explained: dict[str, Explanation] = {}
    folders: dict[str, Path] = {}

    def explain_one(title: str, policy: BasePolicy) -> None:
        nonlocal steps
        require_repeatable(policy, seed=seed.value, renderer=settings.renderer)
        env = policy.make_env(num_envs, seed=seed.value, renderer=settings.renderer)
        with closing(env):
            claim = None if find_claim is None else find_claim(policy, seed=seed)
            measured = find_domain(policy, None, outputs)
            network, unlike = policy.make_network(), policy.unlike
            images = [*base_env(env).observer.images]
            steps += len(of_image) * len(images[1:])
            for image in images or [None]:
                added = f", {image}" if image in images[1:] else ""
                folders[title + added] = (
                    folder / f"{len(folders)}_{to_file_name(policy.name + added)}"
                )
                explained[title + added] = explain_policy(
                    Context(
                        env,
                        network,
                        settings,
                        claim,
                        measured,
                        unlike,
                        seed,
                        image,
                        policy.known_scenes,
                    ),
                    folders[title + added],
                    name=policy.name + added,
                    provenance={"policy": policy.source, "trained": policy.trained, **provenance()},
                    progress=lambda section: progress(
                        f"{policy.name}: {section}", next(done), steps
                    ),
                    sections=of_image if added else sections,
                )

    with torch_threads(1):  # same results for any number of cores; more would gain nothing
        for name, one in by_name.items():
            explain_one(name, one)
    for name, one in by_name.items():
        if verdict := explained[name].verdict:
            record_verdict(folders[name], one, verdict)
    progress("report", steps - 1, steps)
    report = write_report(list(folders.values()), folder)
    progress("explained", steps, steps)
    return Explanations(folder, report, explained, seed)


def _named(policies: Given | Sequence[Given], outputs: str | Path) -> dict[str, BasePolicy]:
    """Return the policies by name or, if some share a name, by file."""
    if isinstance(policies, str) or not isinstance(policies, Sequence):
        policies = [policies]
    loaded = [as_policy(policy, outputs) for policy in policies]
    by_name = {policy.name: policy for policy in loaded}
    if len(by_name) < len(loaded):
        by_name = {policy.source: policy for policy in loaded}
    if not loaded or len(by_name) < len(loaded):
        raise InputError(f"policy={[*by_name]} must name one or more policies, each once")
    return by_name


def explain_policy(
    context: Context,
    folder: Path,
    *,
    name: str,
    provenance: dict[str, Any],
    progress: Callable[[str], None] = lambda _: None,
    sections: Mapping[str, Section] | None = None,
) -> Explanation:
    """Compute all sections for one policy and write them to a folder.

    `provenance` is the origin of the policy as plain values. `sections` are `SECTIONS` by default;
    their order changes no result. `progress` is called with the title of each.

    Returns:
        The results, also in `explanation.json`; "left_out" gives the reason for each section, or
        part of one, that this policy or its task does not allow. It is logged before any section
        is computed.

    Raises:
        InputError: The folder can't be written.
    """
    sections = SECTIONS if sections is None else sections
    results: dict[str, Any] = {}
    left_out = find_lacking(sections, context)
    for why in dict.fromkeys(left_out.values()):
        missing = listed([part for part, reason in left_out.items() if reason == why])
        _log.warning("policy %s is explained without %s: %s", name, missing, why)
    sections = {title: one for title, one in sections.items() if title not in left_out}
    seconds: dict[str, float] = {}
    for title, (result, duration) in _run(sections, context, progress).items():
        if isinstance(result, LeftOutError):
            left_out[title] = str(result)
        else:
            results[title], seconds[title] = result, duration
    explanation = Explanation(
        name=name,
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        settings=context.settings.values(),
        **context.seed.as_dict(),
        seconds=seconds,
        actions=context.scenes.actions.shown,
        terms=context.scenes.task.vocabulary,
        provenance=provenance,
        left_out=left_out,
        **results,
    )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        context.dataset.save(folder / "dataset.npz", context.flights)
        explanation.save(folder)
    except OSError as error:
        raise InputError(
            f"explanation {folder} can't be written ({error.strerror}); choose another folder"
        ) from error
    return explanation


def _run(
    sections: Mapping[str, Section], context: Context, progress: Callable[[str], None]
) -> dict[str, tuple[Any, float]]:
    """Return results and seconds of all sections; those in `THREADED` run in a second thread."""
    twin, results = context.copied_for_thread(), dict[str, tuple[Any, float]]()
    with pool_like_caller(1) as pool:
        aside = {t: pool.submit(_compute, sections[t], twin) for t in sections if t in THREADED}
        for title in sorted(sections, key=THREADED.__contains__):
            progress(title.replace("_", " "))
            waiting = aside.get(title)
            results[title] = waiting.result() if waiting else _compute(sections[title], context)
    return {title: results[title] for title in sections}


def _compute(section: Section, context: Context) -> tuple[Any, float]:
    began = time.perf_counter()
    try:
        result = section(context)
    except LeftOutError as error:
        result = error
    return result, round(time.perf_counter() - began, 2)
