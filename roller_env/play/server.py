"""The game's page and its server: this machine serves it, a browser shows it.

There is no password. By default it listens on this machine's loopback address only, and then lets
in only pages that this machine served: a page from elsewhere, open in the same browser, cannot
reach the game.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import itertools
import json
import re
import signal
import socket
from collections import deque
from collections.abc import Awaitable, Callable, Iterator
from typing import Any, Final
from urllib.parse import urlsplit

import uvicorn
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

from roller_env.assets import asset_directory
from roller_env.platforms import ENDING_SIGNALS
from roller_env.play.room import Message, Room
from roller_env.play.wire import MAX_MESSAGE_BYTES, read_message

LOOPBACK: Final = "127.0.0.1"
DEFAULT_PORT: Final = 8080
MAX_PORT: Final = 65535
MAX_GUESTS: Final = 16
"""Browsers at once; each further one is turned away."""

MAX_WAITING: Final = 256
"""Messages that may wait for one browser: one that takes none for so long is sent away."""

_LOCAL_HOSTS: Final = ("localhost", "127.0.0.1", "[::1]")
_LOCAL_ORIGIN: Final = re.compile(r"http://(localhost|127\.0\.0\.1|\[::1\])(:\d+)?")
"""Of pages that this machine served: a tunnel's other end may have another port."""

_POLICY: Final = (
    "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; "
    "connect-src 'self' ws: wss:; worker-src 'self' blob:; frame-ancestors 'none'"
)
"""Content Security Policy: the page asks no other host for anything."""

_UNWANTED, _FULL, _SLOW = 1008, 1013, 1008
"""WebSocket close codes (RFC 6455): what was sent is not allowed; try again later."""


class PlayError(RuntimeError):
    """The game cannot be shown; the message says why and what helps."""


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens, so that nothing is loaded for a page that cannot be served.

    Args:
        host: address of the interface to listen on.
        port: 0 for the first free one from 8080.

    Raises:
        PlayError: there is no such port or address, it is taken, or it is not allowed.
    """
    if not 0 <= port <= MAX_PORT:
        raise PlayError(f"port: found {port}; must be a whole number from 0 to {MAX_PORT}")
    candidates = [port] if port else itertools.chain(range(DEFAULT_PORT, DEFAULT_PORT + 100), [0])
    for candidate in candidates:
        try:
            return _bound(host, candidate)
        except OSError as error:
            if port == 0 and error.errno == errno.EADDRINUSE:
                continue
            where, hint = f"host {host!r}", "--host says where to listen"
            if error.errno in (errno.EADDRINUSE, errno.EACCES):
                where, hint = f"port {port} of {host}", "--port 0 takes a free one"
            raise PlayError(f"{where}: {error.strerror}; {hint}") from None
    raise PlayError(f"host {host!r}: no port is free")


def _bound(host: str, port: int) -> socket.socket:
    found = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET)
    try:
        # So that a port is free that somebody has just left.
        found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        found.bind((host, port))
        found.listen(64)
    except OSError:
        found.close()
        raise
    return found


def warning_of(host: str) -> str | None:
    """Return what listening on ``host`` means, if it is more than this machine."""
    if host == LOOPBACK:
        return None
    return (
        f"warning: listening on {host}. There is no password and no encryption: everybody who can "
        "reach this address can watch, and play when nobody else does. "
        f"Without --host only this machine can ('ssh -L {DEFAULT_PORT}:localhost:{DEFAULT_PORT}' "
        "reaches it from another)."
    )


class Browser:
    """A browser, as a guest of the room: what it is sent waits here until it takes it."""

    def __init__(self, socket: WebSocket) -> None:
        self._socket = socket
        self._waiting: deque[str] = deque()
        self._frame: bytes | None = None
        self._something = asyncio.Event()
        self.is_slow = False

    def tell(self, told: Message) -> None:
        """Send a message, sooner or later."""
        if len(self._waiting) >= MAX_WAITING:
            self.is_slow = True
        else:
            self._waiting.append(json.dumps(told, separators=(",", ":"), allow_nan=False))
        self._something.set()

    def show(self, frame: bytes) -> None:
        """Send a frame, or leave it out if the next one comes first."""
        self._frame = frame
        self._something.set()

    async def send(self) -> None:
        """Send what there is, for as long as the browser takes it."""
        while not self.is_slow:
            await self._something.wait()
            self._something.clear()
            while self._waiting:
                await self._socket.send_text(self._waiting.popleft())
            frame, self._frame = self._frame, None
            if frame is not None:
                await self._socket.send_bytes(frame)
        await self._socket.close(_SLOW, "takes nothing of what it is sent")

    async def receive(self, room: Room) -> None:
        """Hear what the browser asks for, until it asks for something that it may not."""
        while True:
            received = await self._socket.receive()
            if received["type"] == "websocket.disconnect":
                return
            try:
                wish = read_message(received.get("text") or "")
            except ValueError:
                await self._socket.close(_UNWANTED, "no message of this game")
                return
            room.hear(self, wish)


def make_app(room: Room, host: str = LOOPBACK) -> Starlette:
    """Return the application that serves a room.

    Args:
        room: the game and who is there.
        host: address that is listened on: on the loopback's only pages of this machine are let in.
    """
    page = asset_directory("page")
    guests: set[Browser] = set()

    async def index(request: Request) -> Response:
        headers = {"Content-Security-Policy": _POLICY, "Cache-Control": "no-cache"}
        return FileResponse(page / "index.html", headers=headers)

    async def scene(request: Request) -> Response:
        known = room.scene
        if known is None or request.path_params["name"] != known.hash:
            return Response("there is no such scene", 404)
        headers = {"Content-Encoding": "gzip", "Cache-Control": "max-age=31536000, immutable"}
        return Response(known.content, media_type="application/json", headers=headers)

    async def game(socket: WebSocket) -> None:
        if not _is_welcome(socket, host):
            await socket.close(_UNWANTED)
            return
        await socket.accept()
        if len(guests) >= MAX_GUESTS:
            await socket.close(_FULL, f"there are {MAX_GUESTS} browsers already")
            return
        browser = Browser(socket)
        guests.add(browser)
        room.enter(browser)
        try:
            await _first_of(browser.send(), browser.receive(room))
        finally:
            guests.discard(browser)
            room.leave(browser)

    def files(kind: Any) -> StaticFiles:
        return StaticFiles(directory=asset_directory(kind))

    middleware = [Middleware(GZipMiddleware)]
    if host == LOOPBACK:
        middleware.append(Middleware(TrustedHostMiddleware, allowed_hosts=list(_LOCAL_HOSTS)))
    return Starlette(
        routes=[
            Route("/", index),
            Route("/scene/{name}.json", scene),
            WebSocketRoute("/ws", game),
            Mount("/pictures", files("pictures")),
            Mount("/sounds", files("sounds")),
            Mount("/", files("page")),
        ],
        middleware=middleware,
    )


def _is_welcome(socket: WebSocket, host: str) -> bool:
    """Say whether a browser's page is one that this machine served.

    What is no browser sends no origin, and could send any.
    """
    origin = socket.headers.get("origin")
    if origin is None:
        return True
    if host == LOOPBACK:
        return _LOCAL_ORIGIN.fullmatch(origin) is not None
    return urlsplit(origin).netloc == socket.headers.get("host")


async def _first_of(*doings: Awaitable[None]) -> None:
    """Do several things until one of them ends, and leave the others."""
    tasks = [asyncio.ensure_future(doing) for doing in doings]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            # That a browser is gone is how these end.
            with contextlib.suppress(WebSocketDisconnect, RuntimeError, OSError):
                task.result()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


class _Server(uvicorn.Server):
    """Uvicorn's server; what a signal does is decided here."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Capture none."""
        yield


def serve(
    room: Room,
    listening: socket.socket,
    host: str = LOOPBACK,
    also: Callable[[], Awaitable[None]] | None = None,
) -> None:
    """Serve the room's page until Ctrl+C is pressed, or the program is asked to end.

    A terminal that is closed and a request to terminate end it as Ctrl+C does: between two steps,
    so that what was played is whole.

    Args:
        room: the game and who is there.
        listening: of `listen`.
        host: that it listens on.
        also: something to do meanwhile.

    Raises:
        Exception: what the game, or ``also``, fails with.
    """
    asyncio.run(_serve(room, listening, host, also))


async def _serve(
    room: Room,
    listening: socket.socket,
    host: str,
    also: Callable[[], Awaitable[None]] | None,
) -> None:
    server = _Server(
        uvicorn.Config(
            make_app(room, host),
            log_level="warning",
            ws_max_size=MAX_MESSAGE_BYTES,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=1,
            lifespan="off",
        )
    )
    asked = asyncio.Event()
    with _signals(asked.set):
        port = listening.getsockname()[1]
        shown = "localhost" if host == LOOPBACK else host
        print(f"The game is at http://{shown}:{port}/ (Ctrl+C ends it)", flush=True)
        serving = asyncio.create_task(server.serve(sockets=[listening]))
        doings = [asyncio.create_task(room.run()), asyncio.create_task(asked.wait())]
        if also is not None:
            doings.append(asyncio.ensure_future(also()))
        try:
            done, _ = await asyncio.wait([serving, *doings], return_when=asyncio.FIRST_COMPLETED)
            for task in done:
                task.result()
        finally:
            room.close()
            server.should_exit = True
            for doing in doings:
                doing.cancel()
            await asyncio.gather(serving, *doings, return_exceptions=True)
    print("\nGood bye.", flush=True)


@contextlib.contextmanager
def _signals(remember: Callable[[], object]) -> Iterator[None]:
    """Let signals that end a program be told to ``remember``; the second of a kind interrupts."""
    numbers = (signal.SIGINT, *ENDING_SIGNALS)
    loop = asyncio.get_running_loop()

    def heard(number: int, _: object) -> None:
        signal.signal(number, signal.default_int_handler)
        loop.call_soon_threadsafe(remember)

    before = {number: signal.signal(number, heard) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
