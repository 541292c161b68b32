"""`drone-rl explain`."""

import logging
from pathlib import Path
from typing import Annotated, Any

import drone_rl
from drone_rl.cli.settings import CommandSettings
from drone_rl.config.configuration import DynamicsChanges, TaskChanges, no_changes
from drone_rl.evaluation.rule import Kind
from drone_rl.explanations.settings import ExplainSettings
from drone_rl.utils.progress import log
from drone_rl.utils.schema import Listed, OneOf, Whole

_log = logging.getLogger(__name__)


class Command(CommandSettings, ExplainSettings):
    """Settings of `drone-rl explain`."""

    policy: Annotated[Any, Listed("policy")] = ("latest",)
    """Policy, or a list of policies that one report compares, as in policy=[good,poor]: files,
    folders of runs, latest, or names of shipped policies."""
    num_envs: Annotated[int, Whole(1, unit="environments")] = 128
    """Environments in a batch; bounds memory."""
    require: Annotated[str, OneOf(tuple(Kind))] | None = None
    """Kind of verdict to require, such as good; other kinds end with exit status 10 to 13 or 18.
    none accepts all kinds."""
    task: TaskChanges = no_changes()
    """Changes of the policy's task settings (see conf/task), as in task.num_cubes=5."""
    dynamics: DynamicsChanges = no_changes()
    """Changes of the vehicle dynamics (see conf/dynamics), as in dynamics=quadrotor."""


def run(settings: Command, folder: Path) -> tuple[int, str]:
    """Explain policies in a report; return the exit status and the report's path."""
    loaded = [drone_rl.load_policy(p, outputs=settings.paths.outputs) for p in settings.policy]
    done = drone_rl.explain(
        [p.in_task(**settings.task).in_dynamics(**settings.dynamics) for p in loaded],
        settings.narrowed(ExplainSettings),
        folder=folder,
        num_envs=settings.num_envs,
        outputs=settings.paths.outputs,
        progress=log,
    )
    print(done)
    _log.info("report: %s", done.report)
    verdicts = [numbers["verdict"] for numbers in done.numbers.values()]
    refused = [] if settings.require is None else _refused(verdicts, settings.require)
    return max(refused, default=0), str(done.report)


def _refused(verdicts: list[dict[str, Any]], required: str) -> list[int]:
    """Return the exit statuses of verdicts of another kind, or that are not certain."""
    other = [v for v in verdicts if not (v["certain"] and v["kind"] == required)]
    return [verdict["exit_code"] or Kind.NONE.exit_code for verdict in other]
