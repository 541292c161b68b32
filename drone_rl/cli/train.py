"""`drone-rl train`: one run, or the sweep of many, which needs none of the heavy libraries."""

from pathlib import Path

from hydra.core.hydra_config import HydraConfig
from omegaconf import DictConfig

from drone_rl.cli.launchers import LocalLauncher, RayLauncher, SlurmLauncher, register_plugins
from drone_rl.cli.optuna_sweeper import OptunaSweeper
from drone_rl.sweeps.naming import is_sweep, sweep_name
from drone_rl.sweeps.runs import quoted
from drone_rl.utils.errors import InputError
from drone_rl.utils.files import folder_lock, refuse_links
from drone_rl.utils.overrides import taken_over


def register() -> None:
    """Tells Hydra of the launchers and the sweeper."""
    register_plugins(LocalLauncher, SlurmLauncher, RayLauncher, OptunaSweeper)


def prepare(overrides: list[str]) -> list[str]:
    """Makes `resume=FOLDER` mean: the settings of that run, and its folder; names a sweep's."""
    if is_sweep(overrides):
        if any(o.startswith("hydra.sweep.dir=") for o in overrides):
            return overrides
        parent = "${paths.outputs}/${hydra.job.config_name}/multiruns"
        return [*overrides, f"hydra.sweep.dir={parent}/{sweep_name(overrides)}"]
    folders = [o.split("=", 1)[1] for o in overrides if o.startswith("resume=")]
    if not folders or folders[-1] in ("", "null"):
        return overrides
    if any(o.startswith("hydra.run.dir=") for o in overrides):
        return overrides  # a sweep gives all settings itself
    folder = Path(folders[-1])
    if not (folder / "checkpoints" / "last.pt").is_file():
        raise InputError(f"resume={folder} has no checkpoints/last.pt; give the folder of a run")
    refuse_links(folder)
    kept = taken_over(folder, overrides)
    return [*kept, *overrides, "hydra.mode=RUN", f"hydra.run.dir={quoted(str(folder))}"]


def run(config: DictConfig) -> tuple[int, float]:
    """Trains one policy. Returns the exit status and the running mean of cubes."""
    from drone_rl.cli.training import train  # slow to import; a sweep leaves it to its runs

    folder = Path(HydraConfig.get().runtime.output_dir)
    with folder_lock(folder):
        return train(config, folder)
