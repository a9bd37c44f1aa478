"""Handlers for files beside a notebook that the server serves."""

from pathlib import Path
from typing import Any

from jupyter_core.utils import ensure_async
from jupyter_server.base.handlers import APIHandler
from tornado import web


class Beside(APIHandler):
    """A handler for a notebook given by its path in JupyterLab."""

    auth_resource = "contents"

    async def asked(self) -> dict[str, Any]:
        """Return the body of the request, after checking that the user may write here."""
        user = self.current_user
        if not await ensure_async(self.authorizer.is_authorized(self, user, "write", self.auth_resource)):
            raise web.HTTPError(403)
        body = self.get_json_body()
        if not isinstance(body, dict) or not isinstance(body.get("path"), str):
            raise web.HTTPError(400, "the path of a notebook is needed")
        return body

    def notebook(self, path: str) -> Path:
        """Return a notebook's path on the disk; raise 404 for a file that the server does not serve."""
        root = Path(self.contents_manager.root_dir).resolve()
        found = root / path.strip("/")
        if ".." in Path(path).parts or not found.parent.resolve().is_relative_to(root):
            raise web.HTTPError(404, f"there is no {path} here")
        return found
