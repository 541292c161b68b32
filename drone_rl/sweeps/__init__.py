"""Many trainings as one piece of work: started side by side, gone on with, reported."""

from drone_rl.sweeps.executors import LocalExecutor
from drone_rl.sweeps.manifest import Sweep, open_sweep, read_sweep
from drone_rl.sweeps.runs import Run, read_result

__all__ = ["LocalExecutor", "Run", "Sweep", "open_sweep", "read_result", "read_sweep"]
