"""The process that students' servers are forked from: a Python that has loaded JupyterLab's server and its extensions.

A server takes some seconds of a processor to load them, and most of its memory; forks have that memory in common.  The
process knows nothing of the class: its environment is clean but for where libraries are, and it is told of a member
only what that member's own server may know (`forkserver`).
"""

import os
import sys

from autograder.sandbox.forkserver import SUPPORTED, Forkserver, Template

# Of what is loaded, some takes a home folder, a user's name or the hub's address from the environment at once.  It
# finds these there, which belong to nobody, and by which a test finds who has taken them.
NOBODY = "nobody-at-all"
# What a server loads, as sys.modules of a running one has it.  What is missing is loaded by each server.
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
# Of these, what takes something from the environment that differs from student to student.
FORGOTTEN = "jupyterhub.services.auth jupyterhub.singleuser jupyterlab.labapp"
# Of the environment of the process, what says where libraries are: set once by the wheels of ROS 2, see their
# `ros_wheels_bootstrapper`, which has each Python started a second time where it is not set.
LIBRARIES = ("LD_LIBRARY_PATH", "_ROS_WHEELS_BOOTSTRAP_COMPLETE")
OPTIONS = ("-P", "-s")  # nothing in the home folder is a module of the server


def start() -> Forkserver:
    """Start the process; raises OSError."""
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
    return Forkserver(Template(own | libraries(), LOADED, FORGOTTEN, OPTIONS))


def libraries() -> dict[str, str]:
    """The variables that say where libraries are, as this process has them."""
    return {name: os.environ[name] for name in LIBRARIES if LIBRARIES[-1] in os.environ and name in os.environ}
