"""The server of a live exploration, for this machine alone."""

import logging
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nsmaps.errors import NsmapsError
from nsmaps.explore.live.scene import scene_of

if TYPE_CHECKING:
    from nsmaps.study.study import Study

_CLOSED = {"unused_session_lifetime_milliseconds": 2000, "check_unused_sessions_milliseconds": 1000}  #: of pages
_HOST = "127.0.0.1"  #: no other machine reaches the page, which computes and writes files


def server_of(study: "Study", folder: Path, port: int = 0) -> Any:
    """A Bokeh server that has been started, with the page of a study at its root; studies are saved into `folder`.

    Port 0 is any free one, which is `server.port`. `server.run_until_shutdown()` serves.

    Raises:
        NsmapsError: Bokeh is not installed, the port is in use, or the system has no two coordinates or no parameter.
    """
    try:
        from bokeh.application import Application
        from bokeh.application.handlers.function import FunctionHandler
        from bokeh.server.server import Server
    except ImportError as error:
        raise NsmapsError(
            "a live exploration is drawn by Bokeh, which is not installed; pip install 'nsmaps[explore]'"
        ) from error
    from nsmaps.explore.live.app import App

    if not 0 <= port < 65536:
        raise NsmapsError(f"the port is {port}; expected: a number from 1 to 65535, or 0 for any that is free")
    logging.getLogger("bokeh.server.views.ws").setLevel(logging.ERROR)  # which warns of pictures for a page that was closed
    scene = scene_of(study)
    application = Application(FunctionHandler(lambda doc: App(scene, folder).show(doc)))
    try:
        server = Server({"/": application}, port=port, address=_HOST, **_CLOSED)
    except OSError as error:
        raise NsmapsError(f"the port {port} is in use; expected: a free one, or 0 for any") from error
    server.start()
    return server


def serve(study: "Study", folder: Path, port: int = 0, browser: bool = True, said: Any = print) -> None:
    """Serve the page of a study until Ctrl-C, and open it in a browser; its address is printed first."""
    server = server_of(study, folder, port)
    address = f"http://localhost:{server.port}/"
    said(f"{address} (Ctrl-C ends it)")
    if browser:
        server.io_loop.add_callback(partial(server.show, "/"))
    server.run_until_shutdown()
