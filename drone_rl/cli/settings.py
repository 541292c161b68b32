"""Base classes of the commands and their settings."""

import inspect
import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Self

import pydantic

import drone_rl
from drone_rl.config.commands import PathsSettings
from drone_rl.config.configuration import DynamicsChanges, TaskChanges
from drone_rl.utils.files import trained_policies
from drone_rl.utils.settings import Settings

_log = logging.getLogger(__name__)
_NO_FOLDER = (
    *("hydra.run.dir=.", "hydra.output_subdir=null", "hydra.job_logging.root.handlers=[console]"),
    "++hydra.job_logging.handlers.file.delay=true",
)
"""Keep Hydra from creating a folder, settings and a log."""


class CommandSettings(Settings):
    """Settings of a command, such as `drone-rl train`."""

    paths: PathsSettings = PathsSettings()
    """Folders."""

    unnamed: ClassVar[str] = ""
    """Setting whose value may be typed without its name, as in `drone-rl scene FILE`."""
    has_folder: ClassVar[bool] = True
    """Whether the command writes files into a folder, with its settings and a log."""

    @classmethod
    def prepare(cls, overrides: Sequence[str]) -> list[str]:
        """Return the command line that Hydra composes."""
        words = with_name(overrides, cls.unnamed) if cls.unnamed else [*overrides]
        return words if cls.has_folder else [*words, *_NO_FOLDER]

    @classmethod
    def description(cls) -> str:
        """Return what `--help` says about the command."""
        return inspect.getdoc(cls) or ""

    def run(self, folder: Path) -> tuple[int, object]:
        """Run the command; return the exit status and the value that a sweep maximises."""
        raise NotImplementedError

    def ends_alone(self) -> bool:
        """Return whether the command ends without the user, and so reports that it still runs."""
        return True

    def used_policy(self, folder: Path) -> str:
        """Return the value of `policy=` that selects the policy which this command used."""
        del folder
        which = getattr(self, "policy", None) or "latest"
        which = which if isinstance(which, str) else which[0]
        trained = trained_policies(self.paths.outputs) if which == "latest" else []
        return str(trained[0].parents[1]) if trained else which

    def with_policy_of_now(self, folder: Path) -> Self:
        """Replace policy=latest by the run that it selects now: another may be the newest soon."""
        which, used = getattr(self, "policy", None), self.used_policy(folder)
        if which not in ("latest", ("latest",)) or used == "latest":
            return self
        _log.info("policy=latest is %s", used)
        return self.replace(policy=used if which == "latest" else (used,))


def with_name(overrides: Sequence[str], setting: str) -> list[str]:
    """Return a command line on which values without a name are that of `setting`."""
    from drone_rl.sweeps.manifest import quoted

    words = [o for o in overrides if "=" in o.split("/")[0] or o.startswith("-")]
    values = [quoted(o) for o in overrides if o not in words]
    value = values[0] if len(values) == 1 else f"[{','.join(values)}]"
    return [*words, f"{setting}={value}"] if values else words


class PolicyCommandSettings(CommandSettings):
    """Settings of a command on one policy and its task."""

    policy: str = "latest"
    """Policy: a .pt or .safetensors file, folder of a run, latest, or name of a shipped policy."""
    task: TaskChanges = pydantic.Field(default_factory=dict)
    """Changes of the policy's task settings (see conf/task), as in task.num_cubes=5."""

    def shared(self) -> dict[str, Any]:
        """Return the arguments that the functions of all such commands have."""
        return {"task": self.task, "outputs": self.paths.outputs}


class RolloutCommandSettings(PolicyCommandSettings):
    """Settings of a command that rolls out one policy."""

    dynamics: DynamicsChanges = pydantic.Field(default_factory=dict)
    """Changes of the vehicle dynamics (see conf/dynamics), as in dynamics=quadrotor."""

    def load_policy(self) -> Any:
        """Return the policy with the changes of its task and dynamics."""
        policy = drone_rl.load_policy(self.policy, outputs=self.paths.outputs)
        policy = policy.in_task(**self.task)
        return policy.in_dynamics(**self.dynamics) if self.dynamics else policy


def finish(result: Any, path: Path, files: str = "") -> None:
    """Save a result by its method `save`, print it, and log where it is.

    `files` are the names of the written files if the path is their folder.
    """
    result.save(path)
    print(result)
    _log.info("written: %s", f"{files} in {path}" if files else path)
