"""A user's mistake as one line, whoever noticed it."""

import os
import sys
from collections.abc import Callable

from hydra.errors import HydraException
from omegaconf.errors import OmegaConfBaseException

from drone_rl.hydra_app.choices import without_schemas
from drone_rl.utils.errors import InputError
from drone_rl.utils.quiet import ignore_noise

MISTAKES = (InputError, HydraException, OmegaConfBaseException, OSError)
"""What a user can be blamed for; all else is a bug of ours and keeps its traceback."""


def guarded(command: Callable[[], int]) -> int:
    """Runs a command; a mistake becomes one line and an exit status of 2, Ctrl-C one of 130."""
    os.environ["HYDRA_FULL_ERROR"] = "1"  # let Hydra's own errors through to be shortened here
    ignore_noise()
    try:
        return command()
    except KeyboardInterrupt:
        print("error: interrupted", file=sys.stderr)
        return 130
    except MISTAKES as error:
        print(f"error: {one_line(error)}", file=sys.stderr)
        return 2


def one_line(error: BaseException) -> str:
    """The most telling message of an error and its causes, on one line."""
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, InputError):
            return "".join(c if c.isprintable() else "?" for c in str(cause))
        cause = cause.__cause__ or cause.__context__
    text = without_schemas(" ".join(str(error).split())) or type(error).__name__
    if isinstance(error.__cause__, OmegaConfBaseException):
        text += f": {str(error.__cause__).splitlines()[0]}"
    if "is not in struct" in text or "Could not override" in text:
        text += "; see drone-rl COMMAND --help for the names that exist"
    if "does not support sweep type" in text:
        text += "; to search an interval, add hydra/sweeper=optuna"
    return text
