"""From a command line to a command's settings, and from those to runs."""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

import hydra
from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig, OmegaConf

from drone_rl.hydra_app.help import show_help
from drone_rl.hydra_app.messages import one_line
from drone_rl.hydra_app.schemas import register_schemas
from drone_rl.settings.configuration import from_config
from drone_rl.utils.errors import InputError
from drone_rl.utils.settings import Settings


class Command(Protocol):
    """A module of `drone_rl.cli`."""

    __name__: str
    Command: type[Settings]
    """What it can be told."""

    def run(self, settings: Any, folder: Path) -> tuple[int, object]:
        """Does it. Returns the exit status and what a sweep makes best."""
        ...


def conf_dir() -> Path:
    """The configuration: of the checkout, or the copy inside an installed wheel."""
    package = Path(__file__).resolve().parents[1]
    beside = package.parent / "conf"
    return beside if (beside / "train.yaml").is_file() else package / "conf"


def run_command(name: str, command: Command, overrides: Sequence[str]) -> int:
    """Composes the settings of one command and runs it.

    Args:
        name: Of its file in conf/.
        command: Its module.
        overrides: As on the command line.

    Returns:
        Exit status.
    """
    overrides = getattr(command, "prepare", list)(overrides)
    register_schemas(**{name: command.Command})
    getattr(command, "register", lambda: None)()
    if {"--help", "-h"} & set(overrides):
        show_help(name, conf_dir(), overrides)
        return 0
    statuses: list[int] = []
    job = _job(command, statuses)
    wrapped = hydra.main(version_base="1.3", config_path=str(conf_dir()), config_name=name)(job)
    argv = sys.argv
    sys.argv = [f"drone-rl {name.replace('_', '-')}", *overrides]
    try:
        wrapped()
    finally:
        sys.argv = argv
    return max(statuses, default=0)


def read_settings(cls: type[Settings], config: DictConfig) -> Any:
    """Composed settings, every reference resolved, as those of a command."""
    return from_config(cls, OmegaConf.to_container(config, resolve=True))


def _job(command: Command, statuses: list[int]) -> Callable[[DictConfig], object]:
    """What Hydra calls for each run."""

    def job(config: DictConfig) -> object:
        try:
            settings = read_settings(command.Command, config)
            status, value = command.run(settings, Path(HydraConfig.get().runtime.output_dir))
        except InputError as error:  # one bad run of a sweep leaves the others alone
            print(f"error: {one_line(error)}", file=sys.stderr)
            status, value = 2, None
        statuses.append(status)
        if status > 128:  # a signal ends a whole sweep, not one run of it
            sys.exit(status)
        return value

    job.__module__ = command.__name__
    vars(job)["statuses"] = statuses  # where a launcher notes how jobs ended that ran elsewhere
    return job
