"""A sweep's runs, their files, and its manifest `sweep.json`, with which the command resumes it."""

import dataclasses
import hashlib
import json
import re
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Literal

from pydantic import Field

from drone_rl.config.configuration import check_same_config
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import last_of, read_json, refuse_links
from drone_rl.utils.limits import SWEEP_BYTES
from drone_rl.utils.overrides import COMMAND, check_harmless
from drone_rl.utils.provenance import Provenance, provenance
from drone_rl.utils.schema import as_mapping, shown

MAY_CHANGE = ("resume", "logger", "paths", "trainer.checkpoint_interval_s", "renderer")
"""Settings that may differ when a sweep is resumed."""
_LEVELS = 100
"""Levels of folders that are searched for links; runs may be in folders of folders."""
THREADS = {"OMP_NUM_THREADS": "1", "OMP_WAIT_POLICY": "PASSIVE"}
"""Environment variables of every run, so that parallel runs don't compete for the cores.

Training sets torch's threads itself, so that its result does not depend on this.
"""


@dataclasses.dataclass(frozen=True)
class Run:
    """One training run."""

    number: int
    """Index in the sweep, from 0."""
    overrides: tuple[str, ...]
    """Settings as command-line overrides."""
    folder: Path
    """Output folder."""

    @property
    def checkpoint(self) -> Path:
        """Path of the newest checkpoint."""
        return last_of(self.folder)

    @property
    def failure(self) -> Path:
        """Path of the failure's reason."""
        return self.folder / "failure.json"

    def arguments(self) -> list[str]:
        """Return the arguments of `drone-rl` that begin or resume this run."""
        folder = quoted(str(self.folder))
        single = ["hydra.mode=RUN", f"hydra.run.dir={folder}"]
        resume = [f"resume={folder}"] if self.checkpoint.is_file() else []
        return ["train", *self.overrides, *single, *resume]

    def repeat_command(self) -> str:
        """Return the shell command that repeats this training run."""
        settings = [o for o in self.overrides if not o.startswith("trial=")]
        alone = ["hydra.mode=RUN"] if is_sweep(settings) else []  # a file of conf/sweep is chosen
        return shlex.join(["drone-rl", "train", *settings, *alone])


def read_failure(run: Run) -> str | None:
    """Return the error of a failed run, or None."""
    try:
        error = as_mapping(read_json(run.failure), "failure")["error"]
    except (InputError, KeyError):
        return None
    return "".join(c if c.isprintable() else " " for c in str(error)[:1000])


def quoted(value: str) -> str:
    """Quote a value for Hydra's command line."""
    escaped = value.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{escaped}'"


def path_argument(path: Path) -> str:
    """Return a path for Hydra's command line, with quotes if it needs them."""
    text = str(path)
    return text if re.fullmatch(r"[\w./+-]+", text) else quoted(text)


class Sweep(Provenance, extra="forbid"):
    """A sweep: the content of `sweep.json`."""

    format: Literal["drone_rl sweep, version 2"] = "drone_rl sweep, version 2"
    command: Annotated[str, COMMAND]
    """The command that began the sweep."""
    settings: dict[str, Any]
    """The common settings of all runs, with interpolations unresolved."""
    runs: tuple[Run, ...]
    """The runs in the order of their numbers; in the file, folders are relative."""
    folder: Annotated[Path, Field(exclude=True)] = Path()
    """Folder of the sweep."""

    def name_of(self, run: Run) -> str:
        """Return the path of a run's folder inside the sweep's folder."""
        return run.folder.relative_to(self.folder).as_posix()

    def save(self) -> None:
        """Write `sweep.json`."""
        runs = tuple(dataclasses.replace(r, folder=Path(self.name_of(r))) for r in self.runs)
        self.replace(runs=runs, **provenance()).write_json(self.folder / "sweep.json")


def read_sweep(folder: Path) -> Sweep:
    """Read `sweep.json`.

    Raises:
        InputError: The folder holds no sweep, or the file is damaged.
    """
    path = folder / "sweep.json"
    if not path.is_file():
        raise InputError(
            f"{folder} is not the folder of a sweep (it has no sweep.json); "
            "give one that drone-rl train -m made, outputs/train/multiruns/..."
        )
    try:
        refuse_links(folder, _LEVELS)
        sweep = Sweep.read_json(path, SWEEP_BYTES)
        for override in (override for run in sweep.runs for override in run.overrides):
            check_harmless(override, "a run")
        runs = (dataclasses.replace(r, folder=inside(folder, str(r.folder))) for r in sweep.runs)
        return sweep.replace(folder=folder, runs=tuple(runs))
    except InputError as error:
        raise InputError(
            f"{path} is damaged, or of an older version of drone_rl ({error}); move the folder "
            "away and sweep again"
        ) from None


def inside(folder: Path, name: str, where: str = "a run's folder ") -> Path:
    """Return a run's folder by its path inside the sweep's folder; `where` names its origin.

    Raises:
        InputError: It is not inside.
    """
    path = PurePosixPath(name)
    if path.is_absolute() or not path.parts or ".." in path.parts:
        raise InputError(
            f"{where}{shown(name)} is not inside the sweep's folder; give a relative path, such as "
            "run${hydra.job.num}"
        )
    return folder / path


def check_folders(runs: Sequence[Run]) -> None:
    """Raise an `InputError` for two runs in the same folder."""
    owners: dict[Path, Run] = {}
    for run in runs:
        other = owners.setdefault(run.folder, run)
        if other is not run:
            raise InputError(
                f"runs {other.number} and {run.number} have the same folder {run.folder}, so that "
                "one result would count twice; add ${hydra.job.num} to hydra.sweep.subdir"
            )


def open_sweep(
    folder: Path, command: Sequence[str], settings: Mapping[str, Any], runs: Sequence[Run]
) -> Sweep:
    """Begin a sweep in a new folder, created if missing, or resume it in its folder.

    The settings are common to all runs. Known runs must be unchanged; new ones, such as those of
    more seeds, are added. A folder with another sweep is an `InputError`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    refuse_links(folder, _LEVELS)
    if not (folder / "sweep.json").exists():
        if other := next(folder.glob("**/run.yaml"), None):
            raise InputError(
                f"hydra.sweep.dir={folder} holds other runs ({other.parent.name}); "
                "choose another folder"
            )
        text, plain = shlex.join(command), json.loads(json.dumps(settings))
        sweep = Sweep(folder=folder, command=text, settings=plain, runs=tuple(runs))
    else:
        sweep = read_sweep(folder)
        begun = {run.number: run.overrides for run in sweep.runs}
        if any(begun.get(run.number, run.overrides) != run.overrides for run in runs):
            raise InputError(
                f"hydra.sweep.dir={folder} holds another sweep, begun by: {sweep.command}; "
                "choose another folder, or give that command to resume it"
            )
        check_same_config(sweep.settings, json.loads(json.dumps(settings)), MAY_CHANGE)
        new = tuple(run for run in runs if run.number not in begun)
        sweep = sweep.replace(runs=sweep.runs + new)
        check_folders(sweep.runs)
    sweep.save()
    return sweep


_NOT_IDENTIFYING = re.compile(r"\+?hydra(?!\.sweeper\.metric)|paths\.|-")
"""Beginning of overrides that do not identify a sweep."""


def is_sweep(overrides: Sequence[str]) -> bool:
    """Return whether a command line starts several runs."""
    flags = {"-m", "--multirun", "hydra.mode=MULTIRUN"}
    alone = "hydra.mode=RUN" in overrides
    return not alone and any(o in flags or o.startswith("sweep=") for o in overrides)


def sweep_name(overrides: Sequence[str]) -> str:
    """Return a folder name for the overrides in any order, without those of Hydra and of paths.

    It contains the file in conf/sweep, or else the swept settings, and a hash of the overrides.
    """
    what = sorted(o for o in overrides if not _NOT_IDENTIFYING.match(o))
    files = [o.partition("=")[2] for o in what if o.startswith("sweep=")]
    keys = [o.partition("=")[0] for o in what if "," in o or "range(" in o]
    label = re.sub(r"[^\w.-]+", "-", "+".join(files or keys))[:60]
    digest = hashlib.sha256("\n".join(what).encode()).hexdigest()[:8]
    return f"{label}-{digest}" if label else digest
