"""A stop by two paths at once, of which one does not pass gRPC."""

from __future__ import annotations

import queue
import socket
import ssl
import threading
import time
from dataclasses import dataclass
from typing import Any, Callable, ContextManager, Optional

import grpc

from hapticd._connection import Endpoint, _split
from hapticd.errors import Refused, TimedOut, Unreachable, from_rpc
from hapticd.v1 import rig_pb2, safety_pb2

# The whole protocol: proto/README.md.
_REQUEST = b"HAPTICD STOP 1\n"
_ANSWER_SIZE = 33
_METHOD = "/hapticd.v1.SafetyService/Stop"
#: For the second answer, after the first.
_GRACE_S = 0.2


@dataclass(frozen=True)
class StopOutcome:
    """first: "stop_port" or "service", whichever answered first, and after how many seconds. answer: of the service if
    it came as well. problem: of the other path, if it did not answer."""

    first: str
    after_s: float
    answer: safety_pb2.StopResponse
    both_answered: bool
    problem: str = ""


def stop_by_port(endpoint: Endpoint, timeout_s: float) -> int:
    """Stops by the daemon's path for stops alone: the next port, or the datagram socket next to the unix socket. Returns
    the last completed tick when the stop was handed to the loop. Raises Unreachable, TimedOut, Refused."""
    if endpoint.address.startswith("unix:"):
        where = endpoint.address[len("unix:") :] + ".stop"
        return _tick_of(_ask(where, lambda: _by_datagram(where, timeout_s)), where)
    host, port = _split(endpoint.address)
    host = host.strip("[]")
    where = f"{host}:{int(port) + 1}"
    return _tick_of(_ask(where, lambda: _by_connection(endpoint, host, int(port) + 1, timeout_s)), where)


def _ask(where: str, send: Callable[[], bytes]) -> bytes:
    try:
        return send()
    except TimeoutError:
        raise TimedOut("the daemon's stop port does not answer in time", where=where, remedy="use the emergency stop") from None
    except OSError as error:
        raise Unreachable("no daemon takes stops there", where=where, value=str(error), remedy="use the emergency stop") from None


def _by_datagram(path: str, timeout_s: float) -> bytes:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as own:
        own.settimeout(timeout_s)
        own.bind("")  # a name that the kernel chooses, so that an answer can come
        own.connect(path)
        own.send(_REQUEST)
        return own.recv(64)


def _by_connection(endpoint: Endpoint, host: str, port: int, timeout_s: float) -> bytes:
    with socket.create_connection((host, port), timeout_s) as plain:
        plain.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if endpoint.certificates is None:
            return _exchange(plain)
        context = ssl.create_default_context(cafile=str(endpoint.certificates / "authority.crt"))
        context.load_cert_chain(str(endpoint.certificates / "client.crt"), str(endpoint.certificates / "client.key"))
        with context.wrap_socket(plain, server_hostname=host) as encrypted:
            return _exchange(encrypted)


def _exchange(connection: socket.socket) -> bytes:
    connection.sendall(_REQUEST)
    answer = b""
    while len(answer) < _ANSWER_SIZE and (more := connection.recv(_ANSWER_SIZE - len(answer))):
        answer += more
    return answer


def _tick_of(answer: bytes, where: str) -> int:
    if answer.startswith(b"HAPTICD REFUSED"):
        raise Refused("the daemon refuses a stop of this client", where=where, remedy="ask a maintainer of the rig")
    if len(answer) != _ANSWER_SIZE or not answer.startswith(b"HAPTICD STOPPED "):
        raise Unreachable("what answers there is no stop port", where=where)
    return int(answer[16:32], 16)


def _by_call(channel: grpc.Channel, address: str, reason: str, timeout_s: float) -> safety_pb2.StopResponse:
    call = channel.unary_unary(
        _METHOD,
        request_serializer=safety_pb2.StopRequest.SerializeToString,
        response_deserializer=safety_pb2.StopResponse.FromString,
    )
    try:
        answer: safety_pb2.StopResponse = call(safety_pb2.StopRequest(reason=reason[:256]), timeout=timeout_s)
        return answer
    except grpc.RpcError as error:
        raise from_rpc(error, address) from None


def _start(run: Callable[[str, Callable[[], Any]], None], name: str, path: Callable[[], Any]) -> bool:
    try:
        threading.Thread(target=run, args=(name, path), daemon=True).start()
    except RuntimeError:  # this user may start no further thread
        return False
    return True


def stop_by_both(endpoint: Endpoint, channel: Callable[[], ContextManager[grpc.Channel]], reason: str, timeout_s: float) -> StopOutcome:
    """channel: called once the stop port was asked: if no further thread can start, gRPC waits for ever, and is left alone."""
    began = time.monotonic()
    ended: queue.Queue[tuple[str, float, Any]] = queue.Queue()

    def by_port() -> safety_pb2.StopResponse:
        tick = stop_by_port(endpoint, timeout_s)
        return safety_pb2.StopResponse(
            guard_state=rig_pb2.GUARD_STATE_LATCHED, guard_fault=rig_pb2.GUARD_FAULT_STOPPED, latched_after_tick=tick
        )

    def run(name: str, path: Callable[[], safety_pb2.StopResponse]) -> None:
        result: Any
        try:
            result = path()
        except Exception as error:  # it is reported
            result = error
        ended.put((name, time.monotonic() - began, result))

    def by_call() -> safety_pb2.StopResponse:
        with channel() as opened:
            return _by_call(opened, endpoint.address, reason, timeout_s)

    def no_thread() -> Any:
        raise Unreachable("this user may start no further thread", where=endpoint.address, remedy="raise the limit: ulimit -u")

    if not _start(run, "stop_port", by_port):
        run("stop_port", by_port)
    if not _start(run, "service", by_call):
        run("service", no_thread)
    results = [ended.get()]
    try:
        is_answered = not isinstance(results[0][2], Exception)
        results.append(ended.get(timeout=_GRACE_S if is_answered else None))
    except queue.Empty:
        pass  # the other one is late
    answers = [one for one in results if not isinstance(one[2], Exception)]
    if not answers:
        failures = {name: result for name, _, result in results}
        raise failures["service"] if isinstance(failures["service"], Refused) else failures["stop_port"]
    first, after_s, answer = answers[0]
    by_service = [result for name, _, result in answers if name == "service"]
    problems = [str(result) for _, _, result in results if isinstance(result, Exception)]
    return StopOutcome(first, after_s, by_service[0] if by_service else answer, len(answers) == 2, "".join(problems))


def stop_at(endpoint: Endpoint, reason: str, timeout_s: float) -> StopOutcome:
    """Stops without a channel that exists."""
    return stop_by_both(endpoint, endpoint.open, reason, timeout_s)


def stop(
    reason: str = "", *, address: Optional[str] = None, certificates: Optional[str] = None, timeout_s: float = 5.0
) -> StopOutcome:
    """Zero force, by both paths at once, without a connection that exists. address, certificates: as of connect().

    Raises HapticdError if neither answers in time: use the emergency stop.
    """
    return stop_at(Endpoint.of(address, certificates), reason, timeout_s)


__all__ = ["StopOutcome", "stop", "stop_at", "stop_by_both", "stop_by_port"]
