"""Report user errors in one line, whichever library raised them."""

import logging
import os
import select
import sys
import threading
from collections.abc import Callable

from absl import logging as absl_logging
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from drone_rl.utils.errors import InputError
from drone_rl.utils.exit_codes import INTERRUPTED, USER_ERROR

MISTAKES = (InputError, HydraException, OmegaConfBaseException, OSError)
"""Errors of a user; any other is a bug and keeps its traceback."""


def guarded(command: Callable[[], int]) -> int:
    """Run a command; a user's error is one line with exit status 2, Ctrl-C is exit status 130."""
    os.environ["HYDRA_FULL_ERROR"] = "1"  # let Hydra's own errors through to be shortened here
    logging.raiseExceptions = False  # a log that can't be written is no reason for a traceback
    absl_logging.set_verbosity(absl_logging.WARNING)  # dm_control logs the OpenGL that it found
    logging.getLogger("OpenGL").setLevel(logging.WARNING)  # and PyOpenGL what it did not find
    lost = _errors_in_threads()
    try:
        status = command()
        if lost and not status:
            print(f"warning: {file_error(lost[0])}", file=sys.stderr)
        return status
    except KeyboardInterrupt:
        print("error: interrupted", file=sys.stderr)
        return INTERRUPTED
    except Exception as error:
        is_closed = isinstance(error, BrokenPipeError) and is_output_closed()
        if is_closed or not is_mistake(error):
            raise
        print(f"error: {one_line(error)}", file=sys.stderr)
        return USER_ERROR


def _errors_in_threads() -> list[OSError]:
    """Collect errors of the file system in threads, such as TensorBoard's, without tracebacks."""
    lost: list[OSError] = []
    show = threading.excepthook

    def note(args: threading.ExceptHookArgs) -> None:
        if isinstance(args.exc_value, OSError):
            lost.append(args.exc_value)
        else:
            show(args)

    threading.excepthook = note
    return lost


def is_mistake(error: Exception) -> bool:
    """Return whether the user made a mistake; logging wraps an OSError in a ValueError."""
    is_wrapped = isinstance(error, ValueError) and isinstance(error.__cause__, OSError)
    return isinstance(error, MISTAKES) or is_wrapped


def is_output_closed() -> bool:
    """Return whether standard output is a closed pipe, as after `| head`."""
    poll = select.poll()
    try:
        poll.register(sys.stdout.fileno(), select.POLLOUT)
    except (OSError, ValueError):  # not a file descriptor, as in tests
        return False
    return any(events & select.POLLERR for _, events in poll.poll(0))


def file_error(error: OSError) -> str:
    """Return an error of the file system as one line: path, reason and remedy."""
    reason = error.strerror or " ".join(str(error).split()) or type(error).__name__
    where = error.filename
    if where is None:
        where = "standard output or a file"
        if HydraConfig.initialized():
            runtime = HydraConfig.get().runtime
            is_known = not OmegaConf.is_missing(runtime, "output_dir")
            where += f" in {runtime.output_dir}" if is_known else ""
    where = os.fsdecode(where) if isinstance(where, bytes) else where
    text = (
        f"{where} can't be opened or written ({reason}); check the path, free some space, or "
        "choose another folder with hydra.run.dir=..."
    )
    return "".join(c if c.isprintable() else "?" for c in text)


def input_error(error: BaseException) -> InputError | None:
    """Return the first `InputError` of an error and its causes."""
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, InputError):
        cause = cause.__cause__ or cause.__context__
    return cause


def one_line(error: BaseException) -> str:
    """Return the most specific message of an error and its causes on one line."""
    if (ours := input_error(error)) is not None:
        return "".join(c if c.isprintable() else "?" for c in str(ours))
    for cause in (error, error.__cause__):
        if isinstance(cause, OSError) and not isinstance(cause, HydraException):
            return file_error(cause)  # Hydra's error of an unknown choice is an OSError, too
    return " ".join(str(error).split()) or type(error).__name__
