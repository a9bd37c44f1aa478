"""The session's service calls: waiting for the server and the answer, and explaining why no answer comes."""

import contextlib
import itertools
import math
import threading
import time
from collections.abc import Callable, Collection, Mapping
from typing import Any, cast

from rclpy.action import ActionClient
from rclpy.client import Client
from rclpy.node import Node
from rclpy.task import Future

from course.errors import CallTimeout, LiveError, NodeFailed
from course.explaining.failure_report import Frame, of_thread
from course.explaining.hangs import NOT_SPUN
from course.explaining.lines_that_wait import crowded, remark
from course.explaining.source import ONE_AT_A_TIME, answering, blocked, second_check, swapped_callbacks, wrong_result
from course.foundation.waiting import Lasting, wait_until
from course.ros.names import OF_EVERY_NODE, SEND, base, is_of_every_node, split, type_name
from course.ros.rclpy_internals import NodeNameNonExistentError, RCLError, action_name, client_of, is_served
from course.session.guards import in_main_thread, say
from course.session.interface_usage import is_of
from course.session.live_node import LiveNode
from course.session.long_callbacks import LongCallbacks
from course.session.matching import listing, served_services, unfit_service, unfit_topics, unserved
from course.session.node_process import NodeProcess
from course.session.offered import client_for_service, may_serve, never_made, none_will_offer
from course.session.outsiders import Outsiders
from course.session.patience import Patience
from course.session.presence import Presence
from course.session.watch import Handle, Watch

INVALID = "Callback returned an invalid type"  # rclpy's reason when a parameter callback returned no result
LOOK = 0.05  # s between two checks whether the node that should answer has died
DROPPED = 1.0  # s at rest, after which a server with an old definition has dropped the request
OLD = "still uses the old definition"
GONE = 0.7  # s without a server, after which a request that was sent is given up: the next server does not receive it
ENDING = 3.0  # s more that the program which served it may take to end, and its end tells why
TELLING = 2.0  # s more, after which the reader learns why there is no server, if the wait is to last much longer
PATIENT = 5.0  # s that are much longer
SOON = 20  # the look at which a program that has no server yet is asked where it is: after about 1 s
GRACE = 1.0  # s that discovering a server may take before a dead node is reported instead


class Calls:
    """The clients of `node`, which is spun elsewhere, and the nodes in `handles` that serve them."""

    def __init__(self, node: Node, handles: Mapping[str, Handle], watch: Watch, outsiders: Outsiders):
        self.node, self._handles, self.watch, self._outsiders = node, handles, watch, outsiders
        self._clients: dict[tuple[str, type], Client] = {}
        self._outdated: dict[NodeProcess, str] = {}  # programs started before this package was built again
        self._owing: set[NodeProcess] = set()  # programs that have not answered, and may still work for an earlier call
        self._servers: dict[str, int] = {}  # the number of servers of each service when the reader was last told

    def forget(self, services: Collection[str]) -> None:
        """Destroy the clients of these services: matched with an ended server, they might not find the next one."""
        self._destroy([key for key, client in self._clients.items() if client.service_name in services])

    def forget_types(self, package: str) -> None:
        """Destroy the clients whose type is of `package`."""
        self._destroy([key for key in self._clients if is_of(key[1], package)])

    def package_replaced(self, package: str) -> None:
        """Note the programs that still run with the old interfaces of `package`."""
        for handle in list(self._handles.values()):
            if isinstance(handle, NodeProcess) and handle.alive and f"{package}." in handle.source:
                self._outdated[handle] = package

    def _tell_of_outdated(self, service: str) -> None:
        """Tell the reader if the server of `service` was started before its text or an interface was changed."""
        for handle in list(self._handles.values()):
            if handle.alive and handle.edited and service in handle.services:
                what = handle.name if isinstance(handle, NodeProcess) else f"the class of {handle.name}"
                again = f"ros.restart('{handle.name}')" if isinstance(handle, NodeProcess) else "ros.start(...)"
                self.watch.notice(f"{service} still runs the old version of {what}: start it again, with {again}.")
        if outdated := self._old_definition(service):
            self.watch.notice(outdated)

    def _old_definition(self, service: str) -> str:
        """Return a sentence on a server of `service` that still has the interface of an earlier build; '' without."""
        for handle, package in self._outdated.items():
            if handle.alive and service in handle.services:
                return (
                    f"{handle.name} was started before {package} was built again, and {OLD}: "
                    f"its requests and responses may be misread. Run its cell, or ros.restart('{handle.name}')."
                )
        return ""

    def _destroy(self, keys: list[tuple[str, type]]) -> None:
        for key in keys:
            self._servers.pop(self._clients[key].service_name, None)
            self.node.destroy_client(self._clients.pop(key))

    def wait_for_service(self, service: str, srv_type: type[Any], timeout: float) -> None:
        """Wait until a server for `service` is there; raises CallTimeout after `timeout` s."""
        self._ready(self._client(service, srv_type), timeout)

    def call(self, service: str, srv_type: type[Any], request: object, timeout: float) -> Any:
        """Send `request` and return the response; raises CallTimeout if none comes within `timeout` s."""
        client = self._client(service, srv_type)
        service = client.service_name
        self._tell_of_outdated(service)
        deadline = time.monotonic() + timeout
        self._ready(client, timeout)
        # Before the request is sent: its callback may have raised when the next line runs.
        raised = {each: each.raised for each in list(self._handles.values()) if isinstance(each, LiveNode)}
        future = client.call_async(request)
        try:
            response = self._answer(client, future, raised, deadline, timeout)
        except LiveError as error:
            future.set_exception(error)  # for watchers: no answer will be accepted any more
            future.exception()
            raise
        if INVALID in str(response):
            self._tell_of_no_result(service)
        return response

    def _tell_of_no_result(self, service: str) -> None:
        """Tell the reader about a parameter callback with a wrong return value, for which rclpy names no node."""
        for handle in list(self._handles.values()):
            if service in handle.services and (swapped := swapped_callbacks(handle.source)):
                acts, first, checks, second = swapped
                lines = f" (lines {first} and {second})" if isinstance(handle, NodeProcess) else ""
                self.watch.notice(
                    f"{handle.name}: the callbacks are registered the wrong way round{lines}. The on-set callback is "
                    f"'{acts}', which returns nothing, and the post-set callback is '{checks}', which returns a "
                    f"SetParametersResult. Write `add_on_set_parameters_callback(self.{checks})` and "
                    f"`add_post_set_parameters_callback(self.{acts})`."
                )
            elif service in handle.services and (twice := second_check(handle.source)):
                acts, line, checks = twice
                self.watch.notice(
                    f"{handle.name}: '{acts}' is registered as an on-set callback"
                    f"{f' in line {line}' if isinstance(handle, NodeProcess) else ''}, and returns nothing. '{checks}' "
                    "checks what is set; what acts on it belongs into a post-set callback: write "
                    f"`add_post_set_parameters_callback(self.{acts})`."
                )
            elif service in handle.services and (wrong := wrong_result(handle.source)):
                name, line, text = wrong
                at = f" in line {line}" if isinstance(handle, NodeProcess) else ""
                returned = f"`{text}`" if text else "nothing"
                self.watch.notice(
                    f"{handle.name}: the callback '{name}' returns {returned}{at}. It must "
                    "return `SetParametersResult(successful=...)`, on every path through it."
                )

    def _answer(
        self, client: Client, future: Future, raised: Mapping[LiveNode, int], deadline: float, timeout: float
    ) -> Any:
        service, servers = client.service_name, self._programs(client.service_name)
        asked = self._that_serve(service)
        hanging = self.hanging(service, deadline - time.monotonic())
        # What cannot be read is dropped; one that awaits may be at rest, too, and answer later.
        old = bool(self._old_definition(service)) and not any("await" in each.source for each in servers)
        dropped = Lasting(lambda: old and all(each.asleep for each in servers), DROPPED)

        def raising() -> list[tuple[LiveNode, int]]:
            """The servers that have raised since then: asking the graph for them only now keeps a usual call fast."""
            grown = [(node, since) for node, since in raised.items() if node.raised > since]
            return [(node, since) for node, since in grown if service in node.services]

        def look() -> None:
            self._look_at(service)
            if any(node.has_raised_in(service, since) for node, since in raising()):  # the same as before
                self._look_at(service, again=True)
            at = hanging()
            if at or (dropped() and all(each.is_at_rest() for each in servers)):
                client.remove_pending_request(future)
                raise self._unanswered(service, f"will not answer within {timeout:g} s", at)

        if self._done(future, deadline, look, service):
            self._owing -= {*servers}
            return future.result()
        client.remove_pending_request(future)
        if asked and not any(each in asked for each in list(self._handles.values())):
            raise CallTimeout(f"{service} did not answer: its server was stopped meanwhile. Call again once it runs.")
        serving = self._that_serve(service)
        dead = bool(serving) and not any(each.alive for each in serving)
        self._look_at(service, again=dead or bool(raising()))
        raise self._unanswered(service, f"did not answer within {timeout:g} s", self._doing(service))

    def _unanswered(self, service: str, what: str, at: str) -> CallTimeout:
        """Return the error that says why a request is given up; `at` are lines that say where the server is."""
        self._owing |= {*self._programs(service)}
        old = self._old_definition(service)
        if old:
            self.watch.forget(OLD)
        why = (
            self._killed(service)
            or old
            or self._unspun(service)
            or self._blocked(service)
            or ("its server is busy." if at else "is its server busy or blocked?")
        )
        unfit = "".join(f"\n{each}" for each in unfit_topics(self.node, self._handles))
        lost = "".join(f"\n{lost}" for each in self._programs(service) if (lost := of_thread(each.path, each.output)))
        return CallTimeout(f"{service} {what}: {why}{at}{lost}{unfit}")

    def _killed(self, service: str) -> str:
        """Return why nobody answers `service`, if the graph has only servers of programs that no longer run; or ''."""
        if not self._outsiders.are_gone(service):
            return ""
        return "the program that served it no longer runs. It was killed, so ROS 2 still lists it: start it again."

    def _unspun(self, service: str) -> str:
        """Return that nothing spins the node that serves `service`, if its program is in a loop before that; or ''."""
        servers = self._programs(service)
        if len(servers) != 1 or not servers[0].unspun():
            return ""
        self.watch.forget(NOT_SPUN)  # the start has reported the same
        return NOT_SPUN

    def _that_serve(self, service: str) -> list[Handle]:
        """Return what the session has started that serves `service`, or did before it ended, and was not stopped."""
        return [each for each in list(self._handles.values()) if service in each.services]

    def _programs(self, name: str) -> list[NodeProcess]:
        """Return the running programs that serve the service or action `name`."""
        return [each for each in self._running() if each.services & {name, f"{name}{SEND}"}]

    def serving(self, name: str) -> bool:
        """Return True while a program runs that has served the service or action `name`, and was not stopped."""
        return any(not each.stopped for each in self._programs(name))

    def is_at_rest(self, names: Collection[str]) -> bool:
        """Return True if all programs sleep, and no answer or result of these services and actions is under way.

        Then each is served by nobody, or by a program of the session that has nothing left to do.
        """
        if not all(each.asleep for each in list(self._handles.values()) if isinstance(each, NodeProcess)):
            return False
        for name in names:
            servers = self._programs(name)
            count = self.node.count_services(name) + self.node.count_services(f"{name}{SEND}")
            if len(servers) != count or not all(server.is_at_rest() for server in servers):
                return False
        return True

    def hanging(self, name: str, limit: float, beside: float = -math.inf) -> Callable[[], str]:
        """Return a function for a wait for the service or action `name`, to be called again and again.

        It returns '', or lines that say where the only server is, once a callback there will not return within `limit`
        s of its call, which begins after this one.  Only an endless loop counts if the program may work for somebody
        else: for an earlier call, or a goal that was sent at the time `beside` (s, monotonic).
        """
        servers = self._programs(name)
        if len(servers) != 1:
            return str
        server = servers[0]
        asked = name if name in server.services else f"{name}{SEND}"
        asked_before = server in self._owing or time.time() - server.started > time.monotonic() - beside
        limit = math.inf if asked_before else limit

        def find() -> tuple[Frame, ...]:
            return server.unspun() or server.hang(answering(server.source, name), limit) or server.deadlocked()

        patience = Patience(find)

        def look() -> str:
            frames = patience.exhausted()
            if not frames or self.node.count_services(asked) != 1:
                return ""
            why = crowded(server.source, server.in_calls())
            return "\n".join(["", f"{server.name} is here:", *map(str, frames), *why])

        return look

    def _doing(self, service: str) -> str:
        """Return where what serves `service` (or any program, for '') is now; '' if it only waits."""
        for handle in list(self._handles.values()):
            if (
                (service or isinstance(handle, NodeProcess))
                and service in ("", *handle.services)
                and (frames := handle.doing())
            ):
                why: list[str] = []
                if isinstance(handle, NodeProcess):
                    why = remark(frames, handle.source) or crowded(handle.source, handle.in_calls())
                return "\n".join(["", f"{handle.name} is here:", *map(str, frames), *why])
        return ""

    def doing(self, name: str, *, groups: bool = True) -> str:
        """Return where what serves the service or action `name` is now, at two looks; '' if it only waits.

        Also why its callback group lets no other call of the service begin, or its own never end, unless not `groups`.
        """
        for service in (name, f"{name}{SEND}"):
            if self._doing(service) and (at := self._doing(service)):
                return at.strip()
        nodes = [each for each in list(self._handles.values()) if isinstance(each, LiveNode) and name in each.services]
        for node in nodes if groups else ():
            if node.keeps_callers_waiting(name):
                why = self._blocked(name)
                return f"{node.name}: {why}" if why else ONE_AT_A_TIME.format(name)
        return ""

    def _blocked(self, service: str) -> str:
        """Return why a node's callback may not answer at `service`, from its text."""
        for handle in list(self._handles.values()):
            if service not in handle.services:
                continue
            text, name = (handle.source, "") if isinstance(handle, NodeProcess) else handle.callback_of(service)
            threads, group = (
                (1, None) if isinstance(handle, NodeProcess) else (handle.threads, handle.one_group(service))
            )
            served = self.node.count_services
            if why := blocked(text, service, name, threads=threads, is_served=served, one_group=group):
                self.watch.forget("inside a callback")  # the guards have reported the same
                return why
        return ""

    def wait(self, future: Future, timeout: float) -> Any:
        """Wait for a future in the main thread and return its result; raises CallTimeout after `timeout` s.

        Raises CallTimeout before that once there is no server that could answer, and NodeFailed when one of the
        session's nodes dies, or raises an exception, meanwhile.
        """
        client = client_of(self.node, future)
        name = "" if client is None else _name(client)
        gone = Lasting(
            lambda: client is not None and not is_served(client), GONE, unless=lambda: self.serving(name), more=ENDING
        )
        hanging = self.hanging(name, math.inf) if client is not None else str

        def look() -> None:
            self.watch.look()
            if gone() and (why := self._unserved(future)):
                self.watch.look()  # that its program has died is the better reason
                raise CallTimeout(f"nothing will arrive{why}")
            if at := hanging():
                raise CallTimeout(f"nothing will arrive within {timeout:g} s.{at}")

        if self._done(future, time.monotonic() + timeout, look):
            result = future.result()
            if getattr(result, "accepted", True) is False:  # a goal: why its server has rejected it is known before
                self.watch.look()
            return result
        raise CallTimeout(f"nothing arrived within {timeout:g} s{self._unserved(future) or self._doing('')}")

    def _unserved(self, future: Future) -> str:
        """Return why nobody has received what a future of a client of this node waits for; '' if a server is there."""
        client = client_of(self.node, future)
        if client is None or is_served(client):
            return ""
        if isinstance(client, ActionClient):
            return f". {unserved(self.node, client)}"
        return f". No node serves {client.service_name}. {self.apart(client)}"

    def _done(self, future: Future, deadline: float, look: Callable[[], None], service: str = "") -> bool:
        """Return True if the future is done before `deadline`; `look` may raise meanwhile.

        In vain, the reader is told of callbacks that have not returned for long, except in the server of `service`.
        """
        done, long = threading.Event(), LongCallbacks(self._handles)
        future.add_done_callback(lambda _: done.set())
        while not future.done() and not done.wait(max(0.0, min(LOOK, deadline - time.monotonic()))):
            long.look()
            if time.monotonic() >= deadline:
                for text in long.told(service):
                    self.watch.notice(text)
                return False
            look()
        return True

    def _look_at(self, service: str, *, again: bool = False) -> None:
        """Raise NodeFailed if a node that serves `service`, or should serve it, has an unreported failure."""
        if report := self.watch.reason(service, lambda handle: may_serve(handle.source, service), again=again):
            raise NodeFailed(f"{service} does not answer.\n{report}")

    def _client(self, service: str, srv_type: type[Any]) -> Client:
        key = (service, srv_type)
        if key not in self._clients:
            try:
                self._clients[key] = self.node.create_client(srv_type, service)
            except RCLError:  # a node of this kernel uses the name with another type
                types = dict(self.node.get_service_names_and_types()).get(service, [])
                if (kind := type_name(srv_type)) in types or not types:
                    raise
                raise LiveError(f"{service} has the type {types[0]}, but you use {kind}.") from None
        return self._clients[key]

    def _ready(self, client: Client, timeout: float) -> None:
        if not wait_until(client.service_is_ready, min(timeout, GRACE), alert=False):
            self._look_at(client.service_name, again=True)  # there is no server, and a node has died
            if timeout > GRACE and (why := self._unfit(client)):
                raise CallTimeout(f"no server for {client.service_name}. {why}")
        left = timeout - GRACE
        if left > PATIENT and not wait_until(client.service_is_ready, TELLING):
            if in_main_thread():  # another thread's message would stand below a cell that waits for nothing
                say(f"Still waiting for {client.service_name}. {self.apart(client)}")
            left -= TELLING
        stuck, unfit = self._stuck("create_service", client.service_name), self._later_unfit(client)
        if (
            not wait_until(client.service_is_ready, left, unless=lambda: stuck() or unfit())
            and not client.service_is_ready()
        ):
            if why := unfit():
                raise CallTimeout(f"no server for {client.service_name}. {why}")
            if at := stuck():
                raise CallTimeout(f"no server for {client.service_name} yet.{at}")
            raise CallTimeout(f"no server for {client.service_name} within {timeout:g} s. {self.apart(client)}")
        self._note_server_of(client.service_name)
        self._tell_who_answers(client.service_name)

    def _note_server_of(self, service: str) -> None:
        """Ask the graph which program serves `service`, unless one is known to: it lists services one by one."""
        if self._programs(service):
            return
        for each in self._running():
            each.services |= {*itertools.chain.from_iterable(map(Presence(self.node).services, each.nodes))}

    def _running(self) -> list[NodeProcess]:
        """Return the session's programs that run."""
        return [each for each in list(self._handles.values()) if isinstance(each, NodeProcess) and each.alive]

    def _may_offer(self, maker: str, name: str) -> list[NodeProcess]:
        """Return the running programs that may still make `name` by `maker`, by their text."""
        return [each for each in self._running() if not none_will_offer({each.name: each}, maker, name)]

    def _stuck(self, maker: str, name: str) -> Callable[[], str]:
        """Return a function for a wait for a server, to be called again and again.

        It returns '', or lines that say where the only program that may still make `name` is, in an endless loop.
        """
        programs = self._may_offer(maker, name)
        if len(programs) != 1:
            return str
        patience = Patience(lambda: programs[0].beginning(endless=True), SOON)
        found: list[str] = []

        def look() -> str:
            if not found and (frames := patience.exhausted()):
                found.append(
                    "\n".join(["", f"{programs[0].name} is here, in a loop that does not end:", *map(str, frames)])
                )
            return "".join(found)

        return look

    def beginning(self, maker: str, name: str) -> str:
        """Return lines that say where the programs are that may still make `name` by `maker`; '' without such."""
        found = []
        for each in self._may_offer(maker, name):
            first, second = each.beginning(), each.beginning()
            if first and second and first[-1].function == second[-1].function:
                found += ["", f"{each.name} is here:", *map(str, second)]
        return "\n".join(found)

    def _tell_who_answers(self, service: str) -> None:
        """Tell the reader, once, about several servers of `service`, or one that the session did not start.

        Only of a service that a cell calls: what a panel of the lab reads is not the cell's doing.
        """
        if not in_main_thread():
            return
        count = self.node.count_services(service)
        if self._servers.get(service) == count:
            return
        self._servers[service] = count
        outside = self._outsiders.serving(service)
        own = [name for name, handle in list(self._handles.items()) if handle.alive and service in handle.services]
        if outside and count > len(outside):
            self.watch.notice(
                f"{service} is served by a node of this session and by {outside[0]}, which this session has not "
                f"started: either may answer. To end the other: {outside[0].ending}."
            )
        elif outside:
            self.watch.notice(
                f"{service} is answered by {outside[0]}, which this session has not started. To end it: "
                f"{outside[0].ending}."
            )
        elif count > 1 and len(own) > 1:
            self.watch.notice(
                f"{service} is served by {' and by '.join(own)}: any of them may answer. Stop all but one, as "
                f"with ros.stop('{own[0]}')."
            )

    def _misfit(self, client: Client) -> str:
        """Return why the servers of a client's service, which are there, do not fit the client; '' if none are."""
        name, kind = client.service_name, type_name(cast(type, client.srv_type))
        types = {each for known, kinds in self._servers_here() if known == name for each in kinds}
        if types and kind not in types:
            return f"It is served with the type {min(types)}, but you use {kind}."
        return unfit_service(self.node, name, self._handles)

    def _unfit(self, client: Client) -> str:
        """Return why no server that is here, or is coming, will ever answer this client; '' while one may."""
        return self._misfit(client) or self._never(client)

    def _later_unfit(self, client: Client) -> Callable[[], str]:
        """Return a function for a wait for a server, to be called again and again, which looks each `GRACE` s.

        It returns '', or why no server will answer: on a busy machine the graph is learnt late.
        """
        looked, found = time.monotonic(), ""

        def look() -> str:
            nonlocal looked, found
            if not found and time.monotonic() - looked >= GRACE:
                looked, found = time.monotonic(), self._unfit(client)
            return found

        return look

    def _never(self, client: Client) -> str:
        """Return why a client finds no server, if the text of no running program can create one; '' otherwise."""
        if type_name(cast(type, client.srv_type)).startswith(OF_EVERY_NODE):
            return ""
        never = none_will_offer(self._handles, "create_service", client.service_name)
        return self.apart(client) if never or self._makes_none(client.service_name) else ""

    def _without_service(self, name: str) -> list[NodeProcess]:
        """Return the running programs that may make the service `name` by their text, and have none of their own.

        The services that every node has are there: the graph has learnt of the node's.
        """
        return [each for each in self._may_offer("create_service", name) if self._serves_nothing(each)]

    def _serves_nothing(self, handle: Handle) -> bool:
        """Return True if nodes that have just been started have no services but those that every node has."""
        own: set[str] = set()
        for node in handle.nodes:
            with contextlib.suppress(NodeNameNonExistentError):
                own |= {known for known, _ in self.node.get_service_names_and_types_by_node(*split(node))}
        return bool(own) and all(map(is_of_every_node, own))

    def _makes_none(self, name: str) -> bool:
        """Return True if all programs that may make the service `name` wait to be asked, and have made none."""
        idle = self._without_service(name)
        return bool(idle) and idle == self._may_offer("create_service", name) and all(map(NodeProcess.is_at_rest, idle))

    def _servers_here(self) -> list[tuple[str, list[str]]]:
        """Return the names and types of the services that nodes serve, without what only clients ask for."""
        found = []
        for name, space in self.node.get_node_names_and_namespaces():
            with contextlib.suppress(NodeNameNonExistentError):  # it has just ended
                found += self.node.get_service_names_and_types_by_node(name, space)
        return found

    def apart(self, client: Client) -> str:
        """Return why a client finds no server, and which services exist instead."""
        kind = type_name(cast(type, client.srv_type))
        if kind.startswith(OF_EVERY_NODE):  # its node is missing
            node, _, _ = client.service_name.rpartition("/")
            nodes = sorted({*Presence(self.node).names()})
            listed = listing([name for name in nodes if not base(name).startswith("_")], node)
            return (
                f"No node is called {node}. Nodes here: {listed}."
                if listed
                else "No nodes are running: start one first."
            )
        served = served_services(self.node)
        others = [each for each in served.get(client.service_name, []) if each != kind]
        if others:
            return f"It is served with the type {others[0]}, but you use {kind}."
        if unfit := self._misfit(client):
            return unfit
        listed = listing(served, client.service_name)
        at = self.beginning("create_service", client.service_name)
        if served and not self._without_service(client.service_name):
            programs = (each for each in list(self._handles.values()) if isinstance(each, NodeProcess) and each.alive)
            made = (never_made(each.name, each.source, client.service_name) for each in programs)
            return f"Served here: {listed}.{at or next(filter(None, made), '')}"
        alive = {name: handle for name, handle in list(self._handles.items()) if handle.alive}
        running = [name for name, handle in alive.items() if self._serves_nothing(handle)] or list(alive)
        if running:
            texts = [text for each in running if (text := str(getattr(alive[each], "source", "")))]
            why = next(filter(None, (client_for_service(text, client.service_name) for text in texts)), "")
            why = why if len(running) == 1 and why else "Is `create_service(...)` reached?"
            return f"{' and '.join(running)}: running, but without any service. {why}{at}"
        return "There are no services here: has the node been started?"


def _name(client: Client | ActionClient) -> str:
    return action_name(client) if isinstance(client, ActionClient) else client.service_name
