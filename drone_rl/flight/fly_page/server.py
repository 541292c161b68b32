"""The server of the page: websockets at 127.0.0.1, one thread for the simulation.

Only a browser that knows the random token in the URL gets an answer, and only under this machine's
own name: other pages in the same browser can't fly the drone.
"""

import asyncio
import hmac
import http
import json
import logging
import queue
import secrets
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from drone_rl.config.configuration import from_arguments
from drone_rl.flight.fly_page.flight import Flight
from drone_rl.flight.server_thread import ServerThread, listening
from drone_rl.flight.settings import FlySettings
from drone_rl.policies.policy import Policy, load_policy
from drone_rl.utils.errors import InputError, extra
from drone_rl.utils.files import as_path

_log = logging.getLogger(__name__)

ADDRESS = "127.0.0.1"
MAX_MESSAGE = 4096
"""Bytes of one message of a browser."""
_ASKED_BY = "drone-rl fly"
_IN_FLIGHT = 3
"""Frames that a page may have received but not displayed yet."""
_CLOSED = object()
"""The message that a page was closed."""
_PATIENCE_S = 30.0
"""Seconds to wait for the simulation to end."""
_FILES = {"": "text/html", "fly.js": "text/javascript", "fly.css": "text/css"}
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "connect-src 'self'; img-src 'self' data:; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}


class _Page:
    """One open page: it gets the newest frame when it has displayed the earlier ones."""

    def __init__(self) -> None:
        self._frame: bytes | None = None
        self._problem: str | None = None
        self._in_flight = 0
        self._changed = asyncio.Event()

    def offer(self, frame: bytes) -> None:
        """Replace the frame that waits."""
        self._frame = frame
        self._changed.set()

    def tell(self, problem: str) -> None:
        """Replace the error message that waits."""
        self._problem = problem
        self._changed.set()

    def acknowledge(self) -> None:
        """Note that the page has displayed a frame."""
        self._in_flight = max(0, self._in_flight - 1)
        self._changed.set()

    async def send(self, socket: Any) -> None:
        """Send frames and error messages for ever."""
        while True:
            self._changed.clear()
            if self._problem is not None:
                text, self._problem = json.dumps({"error": self._problem}), None
                await socket.send(text)
            elif self._frame is not None and self._in_flight < _IN_FLIGHT:
                frame, self._frame = self._frame, None
                self._in_flight += 1
                await socket.send(frame)
            else:
                await self._changed.wait()


class FlyPage(ServerThread):
    """A page in threads of this process; a context manager that closes it."""

    def __init__(
        self, make: Callable[[], Flight], *, port: int = 0, frames_per_second: int = 40
    ) -> None:
        """Start the server and a thread that lets what `make` returns pass; see `fly`."""
        self._websockets = extra("websockets.asyncio.server", "fly", _ASKED_BY)
        self._port, self._period = port, 1.0 / frames_per_second
        self._start = f"/{secrets.token_urlsafe(24)}/"
        self._pages: set[_Page] = set()
        self._messages: queue.SimpleQueue[tuple[Any, _Page]] = queue.SimpleQueue()
        self._holder: _Page | None = None
        """The page whose keys were the last to change."""
        self._flight = make()
        self._hello = json.dumps(self._flight.hello())
        self._is_stopping = threading.Event()
        self._simulation = threading.Thread(target=self._simulate, daemon=True)
        try:
            super().__init__(self._serve)
        except BaseException:
            self._flight.close()
            raise
        self._simulation.start()

    @property
    def url(self) -> str:
        """Address of the page, with its token."""
        return f"http://{ADDRESS}:{self._port}{self._start}"

    def close(self) -> None:
        """Write recorded steps and stop server and simulation."""
        self._is_stopping.set()
        self._simulation.join(_PATIENCE_S)

    # The server's thread

    async def _serve(self, ready: Callable[[], None]) -> None:
        logger = logging.getLogger("drone_rl.websockets")
        logger.setLevel(logging.CRITICAL)  # browsers open connections that they do not use
        with listening(ADDRESS, self._port):
            server = await self._websockets.serve(
                self._talk,
                ADDRESS,
                self._port,
                process_request=self._answer,
                compression=None,  # images are compressed already
                max_size=MAX_MESSAGE,
                close_timeout=1.0,
                server_header=None,
                logger=logger,
            )
        async with server:
            self._port = server.sockets[0].getsockname()[1]
            ready()
            await server.wait_closed()

    def _answer(self, connection: Any, request: Any) -> Any:
        """Return a file, or a refusal; None lets the socket open."""
        if not self._is_allowed(request):
            text = "403: open the URL that drone-rl fly printed\n"
            return connection.respond(http.HTTPStatus.FORBIDDEN, text)
        name = request.path.removeprefix(self._start)
        if name == "socket":
            return None
        if name not in _FILES:
            return connection.respond(http.HTTPStatus.NOT_FOUND, "404: no such file\n")
        path = Path(__file__).with_name(name or "index.html")
        response = connection.respond(http.HTTPStatus.OK, path.read_text("utf-8"))
        del response.headers["Content-Type"]
        response.headers.update({**_HEADERS, "Content-Type": f"{_FILES[name]}; charset=utf-8"})
        return response

    def _is_allowed(self, request: Any) -> bool:
        """Return whether host, origin and token are right."""
        start, origins = self._start.encode(), request.headers.get_all("Origin")
        has_token = hmac.compare_digest(request.path.encode()[: len(start)], start)
        hosts = [f"{name}:{self._port}" for name in (ADDRESS, "localhost")]
        is_here = request.headers.get_all("Host") in ([host] for host in hosts)
        is_own = origins in ([f"http://{host}"] for host in hosts)
        return (
            has_token and is_here and (is_own or (not origins and "Upgrade" not in request.headers))
        )

    async def _talk(self, socket: Any) -> None:
        """Serve one page until it is closed."""
        exceptions = extra("websockets.exceptions", "fly", _ASKED_BY)
        page = _Page()
        self._pages.add(page)
        sending = None
        try:
            await socket.send(self._hello)
            sending = asyncio.create_task(page.send(socket))
            async for text in socket:
                self._receive(text, page)
        except exceptions.ConnectionClosed:
            pass
        finally:
            self._pages.discard(page)
            self._messages.put((_CLOSED, page))
            if sending is not None:
                sending.cancel()
                await asyncio.gather(sending, return_exceptions=True)

    def _receive(self, text: str | bytes, page: _Page) -> None:
        try:
            content = json.loads(text if isinstance(text, str) else "")
        except (ValueError, RecursionError):
            content = None
        if isinstance(content, dict) and content.get("type") == "ack":
            page.acknowledge()
        else:
            self._messages.put((content, page))

    def _publish(self, frame: bytes) -> None:
        """Offer a frame to all pages."""
        for page in self._pages:
            page.offer(frame)

    # The simulation's thread

    def _simulate(self) -> None:
        try:
            self._make_frames()
        except Exception as error:  # raised again by `wait`
            self._error = error
            _log.error("the simulation failed: %s", error)
        finally:
            self._flight.close()
            super().close()

    def _make_frames(self) -> None:
        period, before = self._period, time.monotonic()
        due = before
        while not (self._is_stopping.is_set() or self._ended.is_set()):
            now = time.monotonic()
            self._handle_messages()
            if self._pages:
                self._flight.advance(now - before)
                self.call_soon(self._publish, self._flight.frame())
            before, due = now, max(due + period, time.monotonic() - period)
            self._is_stopping.wait(max(0.0, due - time.monotonic()))

    def _handle_messages(self) -> None:
        for _ in range(self._messages.qsize()):
            message, page = self._messages.get()
            if message is _CLOSED:
                if page is self._holder:
                    self._flight.release()
                continue
            try:
                self._flight.handle(message)
                if message["type"] == "hold":
                    self._holder = page
            except InputError as error:
                self.call_soon(page.tell, str(error))


def fly(
    policy: str | Path | Policy = "good",
    settings: FlySettings | None = None,
    *,
    outputs: str | Path = "outputs",
    **changes: Any,
) -> FlyPage:
    """Start a page to fly from, in threads of this process.

    >>> with drone_rl.fly("good") as page:
    ...     print(page.url)
    ...     page.wait()

    Args:
        policy: A policy, a file, the folder of a run, or the name of a shipped policy.
        settings: Settings of the page.
        outputs: Folder of the runs, and of the recorded flights by default.
        changes: Settings to change, such as port=8000.

    Raises:
        InputError: A setting is wrong, the port is in use, or the extra `fly` is not installed.
    """
    settings = from_arguments(FlySettings, settings, changes, fly)
    flown_policy = policy if isinstance(policy, Policy) else load_policy(policy, outputs=outputs)
    folder = settings.demonstrations or as_path(outputs, "outputs") / "demonstrations"
    return FlyPage(
        lambda: Flight(flown_policy, settings, Path(folder)),
        port=settings.port,
        frames_per_second=settings.frames_per_second,
    )
