"""JupyterHub's configuration for the classroom whose folder is in the environment; `hub` starts JupyterHub with it."""

import json
import os
import sys
from pathlib import Path

from traitlets.config import Config

from autograder.classroom import addresses, authenticators, box, class_page, hub, serve
from autograder.classroom.plan import Classroom, as_url
from autograder.classroom.servers import VARIABLE
from autograder.classroom.spawner import BoxSpawner
from autograder.gradebook import address
from course.environment import prepare

START, ANSWER = 900, 120  # s until a server's process is started, the queue included, and until it answers
LOOK = 5  # s between two looks at each server


def configure(c: Config, classroom: Classroom) -> None:
    """Configure JupyterHub for a classroom."""
    prepare()
    serve.close_gently()
    state = classroom.state
    c.JupyterHub.bind_url = f"{'https' if classroom.certificate else 'http'}://{classroom.ip}:{classroom.port}"
    if classroom.certificate:
        c.JupyterHub.ssl_cert, c.JupyterHub.ssl_key = classroom.certificate, classroom.key
    c.JupyterHub.hub_bind_url = c.JupyterHub.hub_connect_url = as_url(classroom.proxy_socket)
    c.JupyterHub.hub_socket_mode = 0o600
    c.Spawner.hub_connect_url = as_url(classroom.hub_socket)
    c.JupyterHub.db_url = address.url(state / "jupyterhub.sqlite")
    c.JupyterHub.cookie_secret_file = str(state / "cookie_secret")
    c.JupyterHub.cleanup_servers = False  # servers outlive the hub, and the next hub finds them
    c.JupyterHub.spawner_class = BoxSpawner
    c.ConfigurableHTTPProxy.api_url = as_url(classroom.run / "proxy.sock")
    c.ConfigurableHTTPProxy.pid_file = str(hub.proxy_pid(classroom))
    # A student controls everything at their address: nobody else may be logged in there.
    addresses.keep_apart(c, classroom)
    c.Spawner.disable_user_config = True
    c.Spawner.start_timeout, c.Spawner.http_timeout = START, ANSWER
    c.Spawner.poll_interval = LOOK

    c.JupyterHub.template_paths = [str(Path(__file__).with_name("templates"))]
    c.JupyterHub.default_url = class_page.start_page
    c.JupyterHub.services = [
        {
            "name": "calendar",  # releases exercises at their dates
            "command": [sys.executable, "-P", "-m", "autograder.classroom.calendar", str(classroom.folder)],
        }
    ]

    names = {member.name for member in classroom.members}
    c.Authenticator.allowed_users = names
    instructors = {member.name for member in classroom.instructors}
    c.Authenticator.admin_users = instructors
    c.Authenticator.allow_existing_users = False  # former members cannot log in
    c.Authenticator.delete_invalid_users = True  # and their old cookies and tokens stay invalid when they return
    c.Authenticator.post_auth_hook = lambda _, handler, known: known | {"admin": known["name"] in instructors}
    authenticators.Careful.classroom = classroom
    if classroom.passwords == "pam":
        c.PAMAuthenticator.executor_threads = authenticators.AT_ONCE  # PAM delays the answer to a wrong password by 2 s
        c.MembersPAM.prefix = classroom.prefix
        c.JupyterHub.authenticator_class = authenticators.MembersPAM
    else:
        known = json.loads((state / hub.SHARED).read_text())
        c.JupyterHub.authenticator_class = authenticators.SharedPassword
        c.SharedPasswordAuthenticator.user_password = known["students"]
        c.SharedPasswordAuthenticator.admin_password = known["instructors"]

    def where(spawner: BoxSpawner) -> None:
        member = classroom.find(spawner.user.name)
        own = member.name in instructors
        spawner.notebook_dir = box.home(member) if own else box.notebooks(member)
        spawner.default_url = f"/lab/tree/{'notebooks/' if own else ''}index.ipynb"

    c.Spawner.pre_spawn_hook = where


if VARIABLE in os.environ and "get_config" in globals():
    configure(get_config(), Classroom.load(Path(os.environ[VARIABLE])))  # type: ignore[name-defined]  # noqa: F821
