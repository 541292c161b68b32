"""Where metrics go besides metrics.csv."""

import dataclasses
import re
from typing import Any, ClassVar

from drone_rl.config.variant import Variant
from drone_rl.utils.errors import InputError

_NEEDS = re.compile(r"([a-z][\w.-]*) (?:could not be imported|is not installed|is required)")
"""What TorchRL's loggers say of a package that they miss."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Logger(Variant):
    """Which of TorchRL's loggers, and with which values."""

    def make(self, *args: Any, **kwargs: Any) -> Any:
        """Make the logger.

        Raises:
            InputError: It doesn't exist, or the package that it needs is not installed.
        """
        try:
            return super().make(*args, **kwargs)
        except ImportError as error:  # TorchRL raises it without the name of the package
            words = _NEEDS.match(str(error).lower())
            package = (error.name or (words and words[1]) or "").partition(".")[0]
            remedy = f"pip install {package}" if package else "pip install with what it needs"
            raise InputError(
                f"logger _target_={self.target} can't be made ({error}); install what it needs: "
                f"{remedy}, or choose another logger"
            ) from error


@dataclasses.dataclass(frozen=True, kw_only=True)
class Tensorboard(Logger):
    """TensorBoard event files."""

    target: ClassVar[str] = "torchrl.record.loggers.tensorboard.TensorboardLogger"
    exp_name: str = "tensorboard"
    """Folder of this logger under log_dir."""
    log_dir: str = "outputs"
    """Where the logs go."""
