"""Where the game is shown: a browser page that this machine serves, or a window.

MuJoCo Studio's web server has no password. As it comes it listens on all interfaces and takes
WebSockets from pages of any origin; here it listens on this machine's loopback address only, and
then takes them only from pages that this machine served, so that a page from elsewhere, open in
the same browser, cannot reach the game either.

Of the browsers that watch, Studio lets each take the controls from the one that has them ("Steal
control" in its bar). Here that is not heard: they can ask, and are next when the player gives the
controls up or is gone.

Panels are sent as changes, of which a page can leave none out, 60 times a second, and it takes a
bounded number of them for each picture that it draws. A page that draws slowly, as where software
draws beside other work, falls ever further behind: after 15 s in which it drew nothing, its panels
came right with the 44th picture. Here the page says when the next ones are due: it tells its keys
once for every picture. (Read and tried with MuJoCo 4.0.0.)
"""

from __future__ import annotations

import errno
import functools
import re
import signal
import socket
import sys
import threading
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Final

from mujoco.studio import launch_thread, messages, plugin, viewer_handle, viewer_protocol

from roller_env.platforms import ENDING_SIGNALS

LOOPBACK: Final = "127.0.0.1"
DEFAULT_PORT: Final = 8080
TITLE: Final = "Roller"

LOCAL_ORIGINS: Final = (
    re.compile(r"http://(localhost|127\.0\.0\.1|\[::1\])(:\d+)?"),
    # What is no browser sends no origin, and could send any.
    None,
)
"""Origins of pages that this machine served: a tunnel's other end may have another port."""

MAX_PORT: Final = 65535

NATIVE_PYTHON: Final = (3, 12)
"""Studio's window imports `collections.abc.Buffer`, which Python has since 3.12."""

NATIVE_GRAPHICS: Final = "opengl_headless"
"""The window shows pictures drawn off screen: to draw into the window itself ("opengl") fails in
MuJoCo 4.0.0, in an empty scene too, with "Target not found"."""

NATIVE_NOTE: Final = (
    "note: MuJoCo 4.0.0's window shows the level but, where it was tried, neither panels nor sky; "
    "Enter starts the game. The page (--viewer web) shows all of it."
)

STALE_PAGE_S: Final = 0.1
"""How often a page that draws nothing is sent what is new: so seldom that it can catch up, and more
often than the game lets go of keys of which it hears nothing."""

Plugins = Sequence[plugin.Plugin]


class PlayError(RuntimeError):
    """The game cannot be shown; the message says why and what helps."""


def check_address(host: str, port: int) -> None:
    """Refuse, before anything is loaded, an address on which no page could be served.

    Args:
        host: address of the interface to listen on.
        port: 0 for the first free one from 8080.

    Raises:
        PlayError: there is no such port or address, it is taken, or it is not allowed.
    """
    if not 0 <= port <= MAX_PORT:
        raise PlayError(f"port: found {port}; must be a whole number from 0 to {MAX_PORT}")
    try:
        with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as probe:
            # As Studio's server does, so that a port is free that somebody has just left.
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
    except OSError as error:
        where, hint = f"host {host!r}", "--host says where to listen"
        if error.errno in (errno.EADDRINUSE, errno.EACCES):
            where, hint = f"port {port} of {host}", "--port 0 takes a free one"
        raise PlayError(f"{where}: {error.strerror}; {hint}") from None


def open_page(
    plugins: Plugins, *, port: int = 0, host: str = LOOPBACK
) -> viewer_handle.ViewerHandle:
    """Serve the game's page from a thread and return Studio's handle of it.

    Args:
        plugins: the game's, of `roller_env.play.app`.
        port: to listen on; 0 takes the first free one from 8080.
        host: address of the interface to listen on. Others than the loopback let everybody who
            can reach it watch, play, and see the log.
    """
    # Imported here: a window needs none of it.
    from mujoco.studio import web_viewer
    from mujoco.studio.web import web_server

    origins = LOCAL_ORIGINS if host == LOOPBACK else None

    class PageViewer(web_viewer.WebViewer):
        """Studio's web viewer, bound to one address."""

        @property
        def _host(self) -> str:
            return host

        @_host.setter
        def _host(self, _: str) -> None:
            """Studio wants all interfaces, without asking: no."""

        def _start_server(self) -> None:
            self._page_drew = threading.Event()
            taking = web_server._SessionMessage.FORCE_CONTROL
            # Imported there from websockets, and called by that name.
            web_server.serve = _serving(  # type: ignore[attr-defined]
                taking, self._page_drew.set, origins
            )
            super()._start_server()

        def prepare_next_frame(self) -> bool:
            """Wait for the page, but not for long."""
            self._page_drew.wait(STALE_PAGE_S)
            self._page_drew.clear()
            return bool(super().prepare_next_frame())

    def view(config: Any, endpoint: Any, viewers: Any) -> None:
        viewer_protocol.run_viewer_loop(PageViewer(config, endpoint, plugins=viewers))

    return _launch(view, plugins, viewer_protocol.ViewerConfig(title=TITLE, http_port=port))


def open_window(plugins: Plugins) -> viewer_handle.ViewerHandle:
    """Open a window with the game and return Studio's handle of it.

    Raises:
        PlayError: this Python is too old for Studio's window, or there is no window system.
    """
    if sys.version_info < NATIVE_PYTHON:
        found = ".".join(map(str, sys.version_info[:3]))
        raise PlayError(
            f"a window needs Python 3.12 or newer (MuJoCo Studio's does), and this is {found}; "
            "the browser page works here: --viewer web"
        )
    try:
        from mujoco.studio import native_viewer
    except ImportError as error:
        raise PlayError(f"MuJoCo Studio's window does not load here: {error}") from error

    class WindowViewer(native_viewer.NativeViewer):
        """Studio's window, which survives a change of the level.

        To destroy a scene that has been drawn crashes in MuJoCo 4.0.0: scenes of levels that were
        left are kept until the window is closed.
        """

        def __init__(self, *arguments: Any, **options: Any) -> None:
            self._left: list[Any] = []
            super().__init__(*arguments, **options)

        def _sync_renderer(self, model: Any) -> None:
            if id(model) != self._renderer_model_id:
                self._left.append((self._model_scene, self._renderer._scenes.pop("scn", None)))
            super()._sync_renderer(model)

        def close(self) -> None:
            self._left.clear()
            super().close()

    def view(config: Any, endpoint: Any, viewers: Any) -> None:
        viewer_protocol.run_viewer_loop(WindowViewer(config, endpoint, plugins=viewers))

    return _launch(view, plugins, viewer_protocol.ViewerConfig(title=TITLE, gfx=NATIVE_GRAPHICS))


def run(handle: viewer_handle.ViewerHandle, ended: Callable[[], bool] = lambda: False) -> None:
    """Let the game run until its window is closed, Ctrl+C is pressed, or ``ended`` says so.

    A terminal that is closed and a request to terminate end it as Ctrl+C does: between two steps.

    Raises:
        RuntimeError: the page cannot be served, such as on a port that is taken.
    """
    with handle, _signals_between_steps() as asked_to_end:
        handle.dispatch(messages.LoadModelEvent(path=""))
        try:
            while not asked_to_end.is_set() and not ended() and handle.is_running():
                handle.sync()
        except KeyboardInterrupt:
            asked_to_end.set()
        if asked_to_end.is_set():
            print("\nGood bye.", flush=True)


@contextmanager
def _signals_between_steps() -> Iterator[threading.Event]:
    """Let signals that end a program be kept in mind instead of interrupting what is being done.

    An exception in the middle of a step would leave a ball that has moved in a game that has not,
    and a replay of it that is of no game. The second signal of a kind interrupts.
    """
    asked = threading.Event()

    def remember(number: int, _: object) -> None:
        signal.signal(number, signal.default_int_handler)
        asked.set()

    numbers = (signal.SIGINT, *ENDING_SIGNALS)
    before = {number: signal.signal(number, remember) for number in numbers}
    try:
        yield asked
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def warning_of(host: str) -> str | None:
    """Return what listening on ``host`` means, if it is more than this machine."""
    if host == LOOPBACK:
        return None
    return (
        f"warning: listening on {host}. There is no password and no encryption: everybody who can "
        "reach this address can watch, take the controls, and read the names of files in the log. "
        f"Without --host only this machine can ('ssh -L {DEFAULT_PORT}:localhost:{DEFAULT_PORT}' "
        "reaches it from another)."
    )


def _launch(
    view: Callable[[Any, Any, Any], None], plugins: Plugins, config: viewer_protocol.ViewerConfig
) -> viewer_handle.ViewerHandle:
    viewers, simulations = plugin.split_plugins(plugins)
    return launch_thread.launch_thread(
        lambda endpoint: view(config, endpoint, viewers), sim_plugins=simulations
    )


def _serving(taking: str, page_drew: Callable[[], None], origins: Sequence[Any] | None) -> Any:
    """Return what serves WebSockets in the place of `websockets`' own ``serve``.

    Args:
        taking: the message by which a browser takes the controls from another one.
        page_drew: called when the player's page has drawn a picture.
        origins: of the pages that are let in; None for any.
    """
    from websockets.asyncio.server import ServerConnection, serve
    from websockets.typing import Data

    class Seat(ServerConnection):
        """The connection of a browser that does not take the controls from another one."""

        async def __aiter__(self) -> AsyncIterator[Data]:
            async for message in super().__aiter__():
                if message != taking:
                    yield message
                if isinstance(message, bytes) and self.is_of_panels:
                    page_drew()

        @property
        def is_of_panels(self) -> bool:
            """Whether it is the player's, which tells keys and is sent panels."""
            return self.request is not None and self.request.path.startswith("/ui")

    return functools.partial(serve, origins=origins, create_connection=Seat)
