"""A guard for the parts of a page, such as its pictures: they are files, and any other address is refused.

A notebook that was handed in may have pictures, sounds and styles at any address of the server of whoever opens it.
Without this, an address that does more than show something would do so as soon as the notebook is looked at.
"""

from jupyter_server.base.handlers import JupyterHandler
from tornado import web

PARTS = {"audio", "embed", "font", "image", "object", "style", "track", "video"}  # of "Sec-Fetch-Dest", by browsers


def guard() -> None:
    """Have all handlers of this server refuse it."""
    begin = JupyterHandler.prepare

    async def prepare(handler: JupyterHandler, **options: bool) -> None:
        wanted = handler.request.headers.get("Sec-Fetch-Dest")
        if wanted in PARTS and not isinstance(handler, web.StaticFileHandler):
            raise web.HTTPError(403, f"{handler.request.path} is not a file, so no part of a page is loaded from it")
        await begin(handler, **options)

    JupyterHandler.prepare = prepare  # type: ignore[method-assign, assignment]
