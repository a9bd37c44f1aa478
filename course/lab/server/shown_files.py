"""Files that a browser shows as a page of its own run no script, and load nothing from elsewhere.

They may have been handed in.  jupyter_server itself lets their scripts run, in an origin of their own, where they can
send the page's address elsewhere, with the token in it that the server asks for.  JupyterLab's viewer of HTML, which
does not show them so, still runs the scripts of a page if one chooses "Trust HTML" there.
"""

from typing import Any

from jupyter_server.base.handlers import AuthenticatedFileHandler, JupyterHandler
from jupyter_server.files.handlers import FilesHandler
from jupyter_server.nbconvert.handlers import NbconvertFileHandler, NbconvertPostHandler

OWN = "'self' data:"  # the server's own files, and what the page holds itself
POLICY = (
    f"default-src 'none'; img-src {OWN}; media-src {OWN}; font-src {OWN}; style-src {OWN} 'unsafe-inline'; "
    "base-uri 'none'; form-action 'none'; sandbox"
)
HEADER = "Content-Security-Policy"


def confine(handler: Any, path: str) -> None:
    """Set the policy of a handler of files that knows its file, except for PDF.

    Browsers show PDF in a viewer of their own, or, with a policy, not at all.
    """
    handler.set_header(
        HEADER, _usual_policy(handler) if handler.get_content_type() == "application/pdf" else _policy(handler)
    )


def guard() -> None:
    """Have the server's handlers of files, and of notebooks as pages, set the policy."""
    for kind in (AuthenticatedFileHandler, FilesHandler, NbconvertFileHandler, NbconvertPostHandler):
        kind.content_security_policy = property(_policy)  # type: ignore[assignment, method-assign]
    AuthenticatedFileHandler.set_extra_headers = confine  # type: ignore[method-assign, assignment]


def _usual_policy(handler: JupyterHandler) -> str:
    """Return the policy of every page of the server."""
    return str(JupyterHandler.content_security_policy.__get__(handler))


def _policy(handler: JupyterHandler) -> str:
    return f"{_usual_policy(handler)}; {POLICY}"
