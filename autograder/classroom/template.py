"""The process that students' servers are forked from: Python with JupyterLab's server and its extensions loaded.

Loading them takes some seconds of processor time and most of a server's memory, which forks share.  The process knows
nothing of the class: its environment has only the library paths, and a request tells it no more about a member than
that member's own server may know (`forkserver`).
"""

import os
import sys

from autograder.sandbox.forkserver import SUPPORTED, Forkserver, Template

# Some modules read the home folder, the user's name or the hub's address from the environment when they are loaded.
# They find this placeholder, by which a test notices each such module.
NOBODY = "nobody-at-all"
# The modules of a running server, from its sys.modules.  Each server itself loads what is missing here.
LOADED = """
    jupyterhub.singleuser.extension jupyter_server.serverapp jupyterlab.labapp jupyter_lsp jupyter_server_terminals
    nbgrader.apps nbgrader.server_extensions.assignment_list notebook.app notebook_shim.nbserver
    IPython IPython.core.interactiveshell argcomplete filelock httpcore jinja2.ext jupyter_core.migrate
    jupyter_lsp.virtual_documents_shadow jupyter_server.services.api.handlers jupyter_server.services.config.handlers
    jupyter_server.services.contents.handlers jupyter_server.services.kernels.handlers
    jupyter_server.services.kernelspecs.handlers jupyter_server.kernelspecs.handlers
    jupyter_server.nbconvert.handlers jupyter_server.services.nbconvert.handlers
    jupyter_server.services.security.handlers jupyter_server.services.sessions.handlers
    jupyter_server.services.shutdown jupyter_server.services.events.handlers jupyter_server.view.handlers
    tornado.platform.asyncio typer traitlets.config.argcomplete_config
"""
# Those of them that read something from the environment that differs between students.
IMPORTED_AGAIN = "jupyterhub.services.auth jupyterhub.singleuser jupyterlab.labapp"
# The environment variables for libraries, set by `ros_wheels_bootstrapper` in the wheels of ROS 2; it starts each
# Python a second time where they are not set.
LIBRARIES = ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE")
OPTIONS = ("-P", "-s")  # the server imports nothing from the home folder


def start() -> Forkserver:
    """Start the process; raises OSError if that is impossible."""
    if not SUPPORTED:
        raise OSError("none is forked with this Python")
    own = {
        "HOME": f"/{NOBODY}",
        "JUPYTERHUB_API_URL": f"http://{NOBODY}/hub/api",
        "JUPYTERHUB_SERVICE_PREFIX": f"/{NOBODY}/",
        "LANG": "C.UTF-8",
        "PATH": f"{sys.prefix}/bin:/usr/local/bin:/usr/bin:/bin",
        "USER": NOBODY,
    }
    return Forkserver(Template(own | libraries(), LOADED, IMPORTED_AGAIN, OPTIONS))


def libraries() -> dict[str, str]:
    """Return this process's values of LIBRARIES."""
    return {name: os.environ[name] for name in LIBRARIES if LIBRARIES[-1] in os.environ and name in os.environ}
