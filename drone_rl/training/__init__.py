"""The loop that turns batches of episodes into a better policy, and what it leaves behind."""

from drone_rl.training.callbacks import (
    Callback,
    CheckpointCallback,
    CsvCallback,
    LoggerCallback,
    ProgressCallback,
)
from drone_rl.training.checkpoint import load_checkpoint, save_checkpoint
from drone_rl.training.trainer import NotANumberError, Trainer
from drone_rl.training.weights import check_weights

__all__ = [
    "Callback",
    "CheckpointCallback",
    "CsvCallback",
    "LoggerCallback",
    "NotANumberError",
    "ProgressCallback",
    "Trainer",
    "check_weights",
    "load_checkpoint",
    "save_checkpoint",
]
