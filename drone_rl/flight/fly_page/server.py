"""The server of the page: Starlette at 127.0.0.1, one thread for the simulation.

Only a browser that knows the random token in the URL gets an answer, and only under this machine's
own name: other pages in the same browser can't fly the drone.
"""

import asyncio
import contextlib
import hmac
import json
import logging
import queue
import secrets
import socket
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol, Self, Unpack

from drone_rl.config.commands import FlySettings
from drone_rl.config.configuration import from_arguments
from drone_rl.config.options import FlyOptions
from drone_rl.flight.fly_page.flight import Flight
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
"""Seconds to wait for the server to start, and for its threads to end."""
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


class Guard:
    """An ASGI application that answers 403 unless host, origin and token are right."""

    def __init__(self, app: Any, token: str, port: int) -> None:
        """Take the application behind it."""
        self._app, self._start = app, f"/{token}/".encode()
        self._hosts = [f"{name}:{port}".encode() for name in (ADDRESS, "localhost")]

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Pass a request on, or refuse it."""
        if self._is_allowed(scope):
            await self._app(scope, receive, send)
        elif scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 1008})  # before accept: status 403
        elif scope["type"] == "http":
            plain = [(b"content-type", b"text/plain"), (b"cache-control", b"no-store")]
            await send({"type": "http.response.start", "status": 403, "headers": plain})
            text = b"403: open the URL that drone-rl fly printed\n"
            await send({"type": "http.response.body", "body": text})

    def _is_allowed(self, scope: Any) -> bool:
        if scope["type"] not in ("http", "websocket"):
            return False
        headers: dict[bytes, list[bytes]] = {}
        for name, value in scope["headers"]:
            headers.setdefault(name.lower(), []).append(value)
        path = scope["path"].encode()[: len(self._start)]
        has_token = hmac.compare_digest(path, self._start)
        host, origin = headers.get(b"host", []), headers.get(b"origin", [])
        is_here = len(host) == 1 and host[0] in self._hosts
        origins = [b"http://" + name for name in self._hosts]
        is_own = len(origin) == 1 and origin[0] in origins
        has_origin = is_own or (scope["type"] == "http" and not origin)
        return has_token and is_here and has_origin


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
                await socket.send_text(text)
            elif self._frame is not None and self._in_flight < _IN_FLIGHT:
                frame, self._frame = self._frame, None
                self._in_flight += 1
                await socket.send_bytes(frame)
            else:
                await self._changed.wait()


class Shown(Protocol):
    """What a page shows; see `Flight`."""

    def hello(self) -> dict[str, Any]:
        """Return what does not change."""
        ...

    def frame(self) -> bytes:
        """Return the present state and images; nothing if there are no new ones."""
        ...

    def handle(self, message: Any) -> None:
        """Do what a browser's message says."""
        ...

    def release(self) -> None:
        """Let go of all controls."""
        ...

    def advance(self, seconds: float) -> None:
        """Let time pass."""
        ...

    def close(self) -> None:
        """End it."""
        ...


class FlyPage:
    """A page in threads of this process; a context manager that closes it."""

    def __init__(
        self, make: Callable[[], Shown], *, port: int = 0, frames_per_second: int = 40
    ) -> None:
        """Start the server and a thread that lets what `make` returns pass; see `fly`."""
        uvicorn = extra("uvicorn", "fly", _ASKED_BY)
        extra("websockets", "fly", _ASKED_BY)
        self._asked_port, self._period = port, 1.0 / frames_per_second
        self._socket = _listen(port)
        self._token = secrets.token_urlsafe(24)
        port = self._socket.getsockname()[1]
        self.url = f"http://{ADDRESS}:{port}/{self._token}/"
        """Address of the page, with its token."""
        self._pages: set[_Page] = set()
        self._messages: queue.SimpleQueue[tuple[Any, _Page]] = queue.SimpleQueue()
        self._holder: _Page | None = None
        """The page whose keys or sticks were the last to change."""
        self._failure: Exception | None = None
        self._is_stopping = threading.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        try:
            self._flight = make()
        except BaseException:
            self._socket.close()
            raise
        self._hello = json.dumps(self._flight.hello())
        config = uvicorn.Config(
            Guard(self._make_app(), self._token, port),
            ws="websockets-sansio",
            ws_max_size=MAX_MESSAGE,
            ws_max_queue=16,
            ws_per_message_deflate=False,  # images are compressed already
            lifespan="off",
            log_config=None,
            log_level="warning",
            access_log=False,
            server_header=False,
            timeout_graceful_shutdown=1,
        )
        self._server = uvicorn.Server(config)
        self._threads = [
            threading.Thread(target=of, daemon=True) for of in (self._serve, self._simulate)
        ]
        for thread in self._threads:
            thread.start()
        self._wait_until_started()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def wait(self) -> None:
        """Wait until the server ends; raise the error that ended the simulation, if one did."""
        self._is_stopping.wait()  # Ctrl-C during `Thread.join` would mark the thread as ended
        if self._failure is not None:
            raise self._failure

    def close(self) -> None:
        """Write recorded steps and stop server and simulation."""
        self._is_stopping.set()
        self._server.should_exit = True
        for thread in self._threads:
            thread.join(_PATIENCE_S)

    def _wait_until_started(self) -> None:
        until = time.monotonic() + _PATIENCE_S
        while not self._server.started:
            if time.monotonic() > until or not self._threads[0].is_alive():
                self.close()
                raise InputError(f"port={self._asked_port}: the server did not start; try port=0")
            time.sleep(0.01)

    # The server's thread

    def _serve(self) -> None:
        try:
            self._server.run(sockets=[self._socket])
        finally:
            self._is_stopping.set()

    def _make_app(self) -> Any:
        applications = extra("starlette.applications", "fly", _ASKED_BY)
        routing = extra("starlette.routing", "fly", _ASKED_BY)
        files = [routing.Route(f"/{{token}}/{name}", self._file) for name in _FILES]
        return applications.Starlette(
            routes=[*files, routing.WebSocketRoute("/{token}/socket", self._talk)]
        )

    async def _file(self, request: Any) -> Any:
        responses = extra("starlette.responses", "fly", _ASKED_BY)
        name = request.url.path.rpartition("/")[2]
        path = Path(__file__).with_name(name or "index.html")
        return responses.Response(path.read_bytes(), media_type=_FILES[name], headers=_HEADERS)

    async def _talk(self, socket: Any) -> None:
        """Serve one page until it is closed."""
        page, self._loop = _Page(), asyncio.get_running_loop()
        self._pages.add(page)
        tasks: list[asyncio.Task[None]] = []
        try:
            await socket.accept()
            await socket.send_text(self._hello)
            tasks = [
                asyncio.create_task(of) for of in (page.send(socket), self._receive(socket, page))
            ]
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._pages.discard(page)
            self._messages.put((_CLOSED, page))
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _receive(self, socket: Any, page: _Page) -> None:
        while True:
            message = await socket.receive()
            if message["type"] == "websocket.disconnect":
                return
            try:
                content = json.loads(message.get("text") or "")
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
            self._run()
        except Exception as error:  # raised again by `wait`
            self._failure = error
            _log.error("the simulation failed: %s", error)
        finally:
            self._flight.close()
            self._server.should_exit = True

    def _run(self) -> None:
        period, before = self._period, time.monotonic()
        due = before
        while not self._is_stopping.is_set():
            now = time.monotonic()
            self._handle_messages()
            if self._pages:
                self._flight.advance(now - before)
                if frame := self._flight.frame():
                    _call_soon(self._loop, self._publish, frame)
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
                if message["type"] in ("hold", "sticks"):
                    self._holder = page
            except InputError as error:
                _call_soon(self._loop, page.tell, str(error))


def _call_soon(
    loop: asyncio.AbstractEventLoop | None, function: Callable[..., None], *values: Any
) -> None:
    """Call a function in a loop's thread; do nothing if there is no loop, or it is closed."""
    if loop is not None:
        with contextlib.suppress(RuntimeError):  # closed: the server ended first
            loop.call_soon_threadsafe(function, *values)


def _listen(port: int) -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((ADDRESS, port))
    except OSError as error:
        listener.close()
        raise InputError(
            f"port={port} can't be used ({error.strerror}); give another one, or 0 for a free one"
        ) from error
    return listener


def fly(
    policy: str | Path | Policy = "good",
    settings: FlySettings | None = None,
    *,
    outputs: str | Path = "outputs",
    **changes: Unpack[FlyOptions],
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
