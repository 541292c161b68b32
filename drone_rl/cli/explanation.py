"""`drone-rl explain`, `report`, `class-models` and `reproduce`: their settings."""

import logging
from pathlib import Path
from typing import Annotated, Any

import drone_rl
from drone_rl.cli.settings import (
    CommandSettings,
    PolicyCommandSettings,
    RolloutCommandSettings,
    finish,
)
from drone_rl.config.values import NumEnvs
from drone_rl.explanations.chapter_figures import FigureSettings
from drone_rl.explanations.settings import ClassModelsSettings, ExplainSettings
from drone_rl.trust.rule import VerdictKind
from drone_rl.utils.progress import log
from drone_rl.utils.schema import Listed, OneOf

_log = logging.getLogger(__name__)


class ExplainCommand(RolloutCommandSettings, ExplainSettings):
    """Analyse what a policy responds to and test the analyses.

    The analyses are t-SNE, class models and saliency maps. Writes report.html.
    """

    policy: Annotated[Any, Listed("policy")] = ("latest",)
    """Policy, or a list of policies that one report compares, as in policy=[good,poor]: files,
    folders of runs, latest, or names of shipped policies."""
    num_envs: NumEnvs = 128
    """Environments in a batch; bounds memory."""
    require: Annotated[str, OneOf(tuple(VerdictKind))] | None = None
    """Kind of verdict to require, such as good; other kinds and uncertain verdicts end with exit
    status 10 to 13 or 18. null accepts all kinds."""

    def run(self, folder: Path) -> tuple[int, str]:
        """Explain policies in a report; return the exit status and the report's path."""
        loaded = [drone_rl.load_policy(p, outputs=self.paths.outputs) for p in self.policy]
        result = drone_rl.explain(
            [p.in_task(**self.task).in_dynamics(**self.dynamics) for p in loaded],
            self.as_base(ExplainSettings),
            folder=folder,
            num_envs=self.num_envs,
            outputs=self.paths.outputs,
            progress=log,
        )
        print(result)
        verdicts = [one.verdict for one in result.policies.values() if one.verdict]
        unmet = [v for v in verdicts if not (v.certain and v.kind == self.require)]
        statuses = [verdict.exit_code or VerdictKind.NONE.exit_code for verdict in unmet]
        return max(statuses if self.require else (), default=0), str(result.report)


class ReportCommand(CommandSettings):
    """Write report.html from saved explanations, without running a policy."""

    explanations: Annotated[Any, Listed("folder")] = ("latest",)
    """Folder with an explanation.json, or a list of folders that one report compares; latest for
    those of the newest explanation."""

    def run(self, folder: Path) -> tuple[int, str]:
        """Write a report from explanations; return the exit status and the report's path."""
        from drone_rl.explanations.report.page import find_explanations, write_report

        made = write_report(find_explanations(self.explanations, self.paths.outputs), folder)
        _log.info("report: %s", made)
        return 0, str(made)


class ClassModelsCommand(PolicyCommandSettings, ClassModelsSettings):
    """Optimize an observation for each action of a policy (section 5.2, Eq. 18)."""

    def run(self, folder: Path) -> tuple[int, str]:
        """Optimize observations for each action; return the exit status and the image's path."""
        settings = self.as_base(ClassModelsSettings)
        result = drone_rl.class_models(self.policy, settings, **self.shared(), progress=log)
        finish(result, folder, "class_models.png, class_models.json and class_models.npz")
        return 0, str(folder / "class_models.png")


class ReproduceCommand(CommandSettings, FigureSettings):
    """Make a figure of the chapter again, as PNG."""

    def run(self, folder: Path) -> tuple[int, str]:
        """Make a figure of the chapter again; return the exit status and the image's path."""
        settings = self.as_base(FigureSettings)
        result = drone_rl.reproduce(self.figure, settings, outputs=self.paths.outputs)
        finish(result, folder, f"figure_{self.figure}.png and figure_{self.figure}.json")
        return 0, str(folder / f"figure_{self.figure}.png")
