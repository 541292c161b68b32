"""Where metrics go besides metrics.csv."""

import dataclasses
from typing import ClassVar

from drone_rl.settings.variant import Variant


@dataclasses.dataclass(frozen=True, kw_only=True)
class Logger(Variant):
    """Which of TorchRL's loggers, and with which values."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Tensorboard(Logger):
    """TensorBoard event files."""

    target: ClassVar[str] = "torchrl.record.loggers.tensorboard.TensorboardLogger"
    exp_name: str = "tensorboard"
    """Folder of this logger under log_dir."""
    log_dir: str = "outputs"
    """Where the logs go."""
