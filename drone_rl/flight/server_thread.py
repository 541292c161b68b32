"""Servers of this process: the thread that runs one, and the error of one that can't listen."""

import asyncio
import contextlib
import logging
import threading
from collections.abc import Callable, Coroutine, Iterator
from typing import Any, Self

from drone_rl.utils.errors import InputError, shown

_log = logging.getLogger(__name__)


@contextlib.contextmanager
def listening(host: str, port: int) -> Iterator[None]:
    """Raise an `InputError` where a server can't listen at a port of a host."""
    try:
        yield
    except (OSError, OverflowError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(
            f"port={port} of address={shown(host)} can't be opened ({reason}); give another one, "
            "such as port=0, or stop the server that has it"
        ) from error


class ServerThread:
    """Runs a server in an event loop of its own until `close`; a context manager that closes it."""

    loop: asyncio.AbstractEventLoop
    """The event loop of its thread."""

    def __init__(self, serve: Callable[[Callable[[], None]], Coroutine[Any, Any, None]]) -> None:
        """Start `serve(ready)`; return once that calls `ready`, or raise the error that ended it.

        The coroutine is cancelled by `close`.
        """
        self._error: Exception | None = None
        # Ctrl-C during `Thread.join` would mark the thread as ended, hence the events
        self._ready, self._ended = threading.Event(), threading.Event()
        threading.Thread(target=self._main, args=(serve,), daemon=True).start()
        self._ready.wait()
        if self._error is not None:
            raise self._error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def wait(self) -> None:
        """Wait until the server ends; raise the error that ended it, if one did."""
        self._ended.wait()
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """Stop the server."""
        if not self._ended.is_set():
            self.call_soon(self._task.cancel)
            self._ended.wait()

    def call_soon(self, function: Callable[..., object], *values: Any) -> None:
        """Call a function in the server's thread; do nothing if that has ended."""
        with contextlib.suppress(RuntimeError):
            self.loop.call_soon_threadsafe(function, *values)

    def _main(self, serve: Callable[[Callable[[], None]], Coroutine[Any, Any, None]]) -> None:
        try:
            with contextlib.suppress(asyncio.CancelledError):
                asyncio.run(self._run(serve))
        except Exception as error:  # raised again in the thread that started this one
            self._error = error
            if self._ready.is_set():
                _log.error("the server failed: %s", error)
        finally:
            self._ended.set()
            self._ready.set()

    async def _run(self, serve: Callable[[Callable[[], None]], Coroutine[Any, Any, None]]) -> None:
        self.loop, task = asyncio.get_running_loop(), asyncio.current_task()
        assert task is not None
        self._task = task
        await serve(self._ready.set)
