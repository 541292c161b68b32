"""The launchers and sweepers of `drone-rl`, which Hydra finds in the namespace `hydra_plugins`."""

from pathlib import Path
from typing import Any

from drone_rl.cli.hydra import launchers, sweepers
from drone_rl.sweeps.executors import LocalExecutor, RayExecutor, SlurmExecutor


class SequentialLauncher(launchers.InProcessLauncher):
    """`hydra/launcher=sequential`: one after the other in this process."""


class LocalLauncher(launchers.SweepLauncher):
    """`hydra/launcher=local`: in parallel on this machine, see `LocalExecutor`."""

    def __init__(self, num_jobs: int | None) -> None:
        executor = LocalExecutor(num_jobs)
        self.executor = lambda _: executor


class SlurmLauncher(launchers.SweepLauncher):
    """`hydra/launcher=slurm`: on a Slurm cluster by submitit, see `SlurmExecutor`."""

    def __init__(self, cluster: str, num_jobs: int, **resources: Any) -> None:
        self.executor = lambda folder: SlurmExecutor(
            Path(folder) / ".submitit", cluster=cluster, num_jobs=num_jobs, resources=resources
        )


class RayLauncher(launchers.SweepLauncher):
    """`hydra/launcher=ray`: on a Ray cluster, see `RayExecutor`."""

    def __init__(self, **settings: Any) -> None:
        self.executor = lambda _: RayExecutor(**settings)


class GridSweeper(sweepers.CombiningSweeper):
    """`hydra/sweeper=grid`: a run for each combination of values."""


class OptunaSweeper(sweepers.SearchSweeper):
    """`hydra/sweeper=optuna`: a search."""
