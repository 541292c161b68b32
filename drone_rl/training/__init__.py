"""The loop that turns batches of episodes into a better policy, and what it leaves behind."""

from drone_rl.training.callbacks import (
    Callback,
    CheckpointCallback,
    CsvCallback,
    LoggerCallback,
    ProgressCallback,
)
from drone_rl.training.checkpoint import (
    load_checkpoint,
    load_policy,
    save_checkpoint,
)
from drone_rl.training.trainer import NotANumberError, Trainer

__all__ = [
    "Callback",
    "CheckpointCallback",
    "CsvCallback",
    "LoggerCallback",
    "NotANumberError",
    "ProgressCallback",
    "Trainer",
    "load_checkpoint",
    "load_policy",
    "save_checkpoint",
]
