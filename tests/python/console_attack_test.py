"""What is kept out of the console: other sites, other names, floods; and that the rig does not notice."""

from __future__ import annotations

import base64
import contextlib
import http.client
import json
import os
import resource
import signal
import socket
import ssl
import struct
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from random import Random
from typing import Any

import pytest

import hapticd
from console_page import HEADERS, Visitor, configuration
from daemon import BINARIES
from hapticd.v1 import rig_pb2

STOP = "/rpc/hapticd.v1.SafetyService/Stop"


@pytest.fixture
def daemon(start_daemon: Any, tmp_path: Path) -> Any:
    more = f'[access]\naudit_file = "{tmp_path / "audit.jsonl"}"\n'
    return start_daemon("--scene", "tap_1d", "--model-store", ":memory:", *configuration(tmp_path, more))


@pytest.fixture
def console(daemon: Any, start_console: Any) -> Any:
    return start_console()


def audited(folder: Path, method: str, count: int = 1) -> list[Any]:
    """Lines of the audit log, once there are so many; of stops, those by the service."""
    until = time.monotonic() + 20
    while True:
        lines = [json.loads(line) for line in (folder / "audit.jsonl").read_text().splitlines()]
        found = [line for line in lines if line["method"] == method and not line.get("arguments", "").startswith("by the ")]
        if len(found) >= count or time.monotonic() > until:
            return found
        time.sleep(0.02)


def is_latched(daemon: Any) -> bool:
    """Whether the guard is, and clears it."""
    with hapticd.connect(daemon.address) as rig:
        latched = rig.get_rig_state(without_histograms=True).guard_fault == rig_pb2.GUARD_FAULT_STOPPED
        if latched:
            rig.clear()
        return bool(latched)


class Socket:
    """A WebSocket, as far as a test needs it."""

    def __init__(self, port: int, cookie: str = "", origin: str = "", secure: ssl.SSLContext | None = None) -> None:
        self.wire = socket.create_connection(("127.0.0.1", port), timeout=30)
        if secure:
            self.wire = secure.wrap_socket(self.wire, server_hostname="127.0.0.1")
        own = f"{'https' if secure else 'http'}://127.0.0.1:{port}" if origin == "" else origin
        key = base64.b64encode(os.urandom(16)).decode()
        self.wire.sendall(
            f"GET /live HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            f"Sec-WebSocket-Key: {key}\r\nOrigin: {own}\r\nCookie: {cookie}\r\n\r\n".encode())  # fmt: skip
        self.rest = b""
        while b"\r\n\r\n" not in self.rest:
            piece = self.wire.recv(4096)
            if not piece:
                break
            self.rest += piece
        head, _, self.rest = self.rest.partition(b"\r\n\r\n")
        self.status = int(head.split(b" ")[1])

    def send(self, payload: bytes, opcode: int = 1) -> None:
        length = len(payload)
        head = bytes([0x80 | opcode]) + (bytes([0x80 | length]) if length < 126 else bytes([0xFE]) + struct.pack(">H", length) if length < 65536
                                         else bytes([0xFF]) + struct.pack(">Q", length))  # fmt: skip
        mask = os.urandom(4)
        body = payload if length > 100000 else bytes(b ^ mask[i % 4] for i, b in enumerate(payload))
        self.wire.sendall(head + mask + body)

    def _take(self, count: int) -> bytes:
        while len(self.rest) < count:
            piece = self.wire.recv(65536)
            if not piece:
                raise EOFError
            self.rest += piece
        taken, self.rest = self.rest[:count], self.rest[count:]
        return taken

    def receive(self) -> tuple[int, bytes]:
        head = self._take(2)
        length = head[1] & 127
        if length == 126:
            length = struct.unpack(">H", self._take(2))[0]
        elif length == 127:
            length = struct.unpack(">Q", self._take(8))[0]
        return head[0] & 15, self._take(length)

    def next_json(self) -> Any:
        while True:
            opcode, payload = self.receive()
            if opcode == 1 and b'"beat"' not in payload:
                return json.loads(payload)

    def is_closed(self) -> bool:
        try:
            while self.receive()[0] != 8:
                pass
            return True
        except (EOFError, ConnectionError):
            return True


def ticks(daemon: Any) -> int:
    with hapticd.connect(daemon.address) as rig:
        return int(rig.get_rig_state(without_histograms=True).tick)


def test_a_browser_is_who_asked_for_the_key(daemon: Any, console: Any, tmp_path: Path) -> None:
    stranger = Visitor(daemon, console, sign_in=False)
    assert stranger.ask("GET", "/").status == 401
    assert stranger.ask("GET", "/api.js").status == 401
    assert stranger.rpc("RigService/GetRigState")[0] == 401
    assert stranger.rpc("SafetyService/Stop")[0] == 401
    assert stranger.ask("GET", "/open?key=00000000000000000000000000000000").status == 401
    with hapticd.connect(daemon.address) as rig:
        key = rig.open_console().url.split("key=")[1]
        me = rig.get_access().identity
    answer = stranger.ask("GET", f"/open?key={key}")
    cookie = answer.headers["Set-Cookie"]
    assert "HttpOnly" in cookie and "SameSite=Strict" in cookie
    assert stranger.ask("GET", f"/open?key={key}").status == 401
    visitor = Visitor(daemon, console)
    page = visitor.ask("GET", "/")
    assert page.status == 200
    assert page.headers["Content-Security-Policy"].startswith("default-src 'self'")
    assert page.headers.get("Access-Control-Allow-Origin") is None
    assert visitor.rpc("AccessService/GetAccess")[1]["identity"] == me
    assert visitor.rpc("SafetyService/Stop")[0] == 200
    stop = audited(tmp_path, "SafetyService/Stop")[0]
    assert stop["identity"] == me and stop["peer"].startswith("console 127.0.0.1:")
    status, refused = visitor.rpc("RenderingService/SetTarget", {"stiffness_n_per_mm": 1e9})
    assert status == 400 and refused["code"] == "OUT_OF_RANGE" and "1000 N/mm" in refused["detail"]["limit"]


def test_other_sites_are_kept_out(daemon: Any, console: Any) -> None:
    visitor = Visitor(daemon, console)
    own = f"127.0.0.1:{visitor.port}"
    # The name of another site that was made to point here.
    for host in ("evil.example", f"evil.example:{visitor.port}", f"127.0.0.1.evil.example:{visitor.port}"):
        assert visitor.ask("GET", "/", headers={"Host": host}).status == 421
        assert visitor.ask("POST", STOP, "{}", {**HEADERS, "Host": host, "Origin": f"http://{host}"}).status == 421
    for origin in ("http://evil.example", "null", f"https://{own}", f"http://{own}.evil.example"):
        assert visitor.ask("POST", STOP, "{}", {**HEADERS, "Origin": origin}).status == 403
        assert Socket(visitor.port, visitor.cookie, origin).status == 403
    # What a form or an image can send.
    for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x"):
        assert visitor.ask("POST", STOP, "{}", {"Content-Type": kind, "X-Hapticd": "1"}).status == 415
    assert visitor.ask("POST", STOP, "{}", {"Content-Type": "application/json"}).status == 403
    assert visitor.ask("GET", STOP).status == 404
    assert visitor.ask("OPTIONS", STOP, headers={"Origin": "http://evil.example"}).status == 403
    for site in ("cross-site", "same-site", "none"):
        assert visitor.ask("POST", STOP, "{}", {**HEADERS, "Sec-Fetch-Site": site}).status == 403
    # None of them stopped anything.
    assert visitor.rpc("RigService/GetRigState")[1]["guard_fault"] == "GUARD_FAULT_NONE"
    assert visitor.ask("POST", STOP, "{}", {**HEADERS, "Origin": f"http://{own}", "Sec-Fetch-Site": "same-origin"}).status == 200


def test_what_is_too_large_is_refused(daemon: Any, console: Any) -> None:
    visitor = Visitor(daemon, console)
    assert visitor.ask("POST", "/rpc/hapticd.v1.RigService/GetRigState", '{"x":"' + "x" * 300_000 + '"}', HEADERS).status == 413
    assert visitor.ask("GET", "/", headers={"X-Long": "x" * 20_000}).status == 431
    live = Socket(visitor.port, visitor.cookie)
    assert live.status == 101
    live.send(b"x" * 200_000)
    assert live.is_closed()
    for nonsense in (b"no json", b"[]", b"{}", b'{"open":-1}', b'{"open":"x","method":"a"}', b'{"telemetry":1,"columns":3}', b'{"telemetry":1,"columns":[3]}',
                     b'{"open":1e300}', b"[" * 60_000):  # fmt: skip
        live = Socket(visitor.port, visitor.cookie)
        live.send(nonsense)
        assert live.is_closed(), nonsense
    flood = Socket(visitor.port, visitor.cookie)
    try:
        for _ in range(6000):
            flood.send(b'{"close":1}')
    except ConnectionError:
        pass
    assert flood.is_closed()
    assert visitor.rpc("RigService/GetRigState")[0] == 200


def test_streams_come_as_they_are_granted(daemon: Any, console: Any) -> None:
    visitor = Visitor(daemon, console)
    live = Socket(visitor.port, visitor.cookie)
    live.send(b'{"open":7,"method":"hapticd.v1.LeaseService/WatchLease","request":{},"credits":1}')
    first = live.next_json()
    assert first["id"] == 7 and first["message"]["change"] == "LEASE_CHANGE_NONE"
    status, grant = visitor.rpc("LeaseService/AcquireLease", {"purpose": "test", "ttl_s": 30})
    assert status == 200
    live.send(b'{"open":8,"method":"hapticd.v1.RigService/GetRigState"}')
    refused = live.next_json()
    assert refused["id"] == 8 and refused["end"]["code"] == "UNIMPLEMENTED"  # and no second message of 7
    live.send(b'{"credit":7,"n":1}')
    assert live.next_json()["message"]["lease"]["purpose"] == "test"
    # A lease counts for calls that show it.
    assert visitor.rpc("SceneService/UnloadScene")[0] == 409
    assert visitor.rpc("SceneService/UnloadScene", headers={**HEADERS, "X-Hapticd-Lease": grant["token"]})[0] == 200
    live.send(b'{"close":7}')
    assert live.next_json()["end"]["code"] == "CANCELLED"


def test_a_page_that_does_not_read_gets_pairs_and_is_told(start_daemon: Any, start_console: Any, tmp_path: Path) -> None:
    daemon = start_daemon("--scene", "tap_1d", "--model-store", ":memory:", *configuration(tmp_path, "[rig.sim]\nspeed = 4\n"))
    visitor = Visitor(daemon, start_console())
    live = Socket(visitor.port, visitor.cookie)
    live.send(b'{"telemetry":1,"columns":["tick"],"max_rows":64,"credits":1}')
    start = live.next_json()
    assert start["columns"] == [{"name": "tick", "unit": "1"}] and start["rate_hz"] == 1000

    def rows() -> Any:
        while True:
            opcode, payload = live.receive()
            if opcode == 2:
                return struct.unpack(f"<{len(payload) // 8}d", payload)

    first = rows()
    assert first[0] == 1 and first[2] == 1
    before = ticks(daemon)
    while ticks(daemon) < before + 2000:
        time.sleep(0.02)
    live.send(b'{"credit":1,"n":1}')
    late = rows()
    assert late[1] <= 64 and late[2] > 1 and late[4] >= 1900
    assert late[5] == first[-1] + 1 and late[3] == 0  # from where it was, all of it
    while ticks(daemon) < before + 9000:
        time.sleep(0.02)
    live.send(b'{"credit":1,"n":1}')
    later = rows()
    assert later[3] > 1000 and later[5] == late[-1] + 1 + later[3]  # longer than is kept: so many are lost, and said so
    live.send(b'{"telemetry":2,"columns":["no_such"]}')
    assert "no such column" in live.next_json()["end"]["message"]


def test_pages_that_do_not_read_take_little_memory(start_daemon: Any, start_console: Any, tmp_path: Path) -> None:
    daemon = start_daemon("--scene", "tap_1d", "--model-store", ":memory:", *configuration(tmp_path, "[rig.sim]\nspeed = 4\n"))
    console = start_console()

    def resident_mb() -> float:
        status = Path(f"/proc/{console.process.pid}/status").read_text()
        return int(status.split("VmRSS:")[1].split()[0]) / 1000

    visitor = Visitor(daemon, console)
    assert visitor.rpc("SafetyService/Stop")[0] == 200
    before_mb = resident_mb()
    pages = [Socket(visitor.port, visitor.cookie) for _ in range(60)]
    for page in pages:
        for tap in (1, 2):
            page.send(json.dumps({"telemetry": tap, "columns": ["tick"] * 250, "max_rows": 8192, "credits": 0}).encode())
    for tap in (1, 2, 1):
        began = ticks(daemon)
        while ticks(daemon) < began + 4000:  # as many rows as the console keeps
            time.sleep(0.1)
        for page in pages:
            page.send(json.dumps({"credit": tap, "n": 1}).encode())
        assert visitor.rpc("SafetyService/Stop")[0] == 200
    time.sleep(1.0)
    assert resident_mb() - before_mb < 100.0


def test_a_log_that_is_not_read_stops_no_page(start_daemon: Any, start_console: Any, tmp_path: Path) -> None:
    # Its reader takes nothing, and it is full.
    reader, errors = os.pipe()
    os.set_blocking(errors, False)
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(errors, b"x" * 4096)
    os.set_blocking(errors, True)
    options = ("--scene", "tap_1d", "--model-store", ":memory:", *configuration(tmp_path))
    daemon = start_daemon(*options)
    console = start_console(errors=errors)
    visitor = Visitor(daemon, console)
    daemon.end()
    while visitor.rpc("RigService/GetRigState")[0] != 503 or Socket(visitor.port, visitor.cookie).status != 503:
        time.sleep(0.1)  # until the console has seen it, and says so
    daemon = start_daemon(*options)
    while Socket(visitor.port, visitor.cookie).status != 101:
        time.sleep(0.1)
    assert visitor.rpc("SafetyService/Stop")[0] == 200
    console.process.send_signal(signal.SIGTERM)
    assert console.process.wait(timeout=30) == 0
    os.close(reader)
    os.close(errors)


def test_a_thousand_sockets_keep_no_stop_from_its_way(daemon: Any, console: Any) -> None:
    resource.setrlimit(resource.RLIMIT_NOFILE, (resource.getrlimit(resource.RLIMIT_NOFILE)[1],) * 2)
    visitor = Visitor(daemon, console)
    strangers = []
    for number in range(1000):
        one = socket.create_connection(("127.0.0.1", visitor.port), timeout=30)
        if number % 2:
            one.sendall(b"GET / HTTP/1.1\r\nHost: 127.0")  # and never the rest
        strangers.append(one)
    before = ticks(daemon)
    assert visitor.rpc("SafetyService/Stop")[0] == 200
    assert ticks(daemon) > before
    # No more pages that are signed in are kept than are allowed.
    pages = [Socket(visitor.port, visitor.cookie) for _ in range(70)]
    assert [one.status for one in pages[:64]] == [101] * 64 and {one.status for one in pages[64:]} == {503}
    assert visitor.rpc("SafetyService/Stop")[0] == 200
    with hapticd.connect(daemon.address) as rig:
        assert rig.get_rig_state(without_histograms=True).loop.running
    for one in strangers:
        one.close()


def lab_of(folder: Path, *clients: str) -> Path:
    """Certificates of a rig and of clients, each "ROLE/NAME"."""
    made = folder / "made"
    script = Path(__file__).resolve().parents[2] / "deploy/make_certificates.sh"
    named = [word for client in clients for word in ("--client", client)]
    subprocess.run(["bash", script, "--lab", "test", "--out", made, "--server", "rig,127.0.0.1", *named], check=True, capture_output=True)
    return made


def test_who_takes_all_places_for_pages_gives_them_to_others(start_daemon: Any, start_console: Any, tmp_path: Path) -> None:
    made = lab_of(tmp_path, "operator/anna", "operator/otto")
    start_daemon("--model-store", ":memory:", *configuration(tmp_path))
    port = start_console("--max_sockets", "8", "--listen_tls", "127.0.0.1:0", "--certificates", str(made / "servers/rig")).port

    def page(name: str) -> Socket:
        files = made / "clients" / name
        context = ssl.create_default_context(cafile=str(files / "authority.crt"))
        context.load_cert_chain(files / "client.crt", files / "client.key")
        return Socket(port, secure=context)

    hers = [page("anna") for _ in range(12)]
    assert [one.status for one in hers] == [101] * 8 + [503] * 4
    his = [page("otto") for _ in range(6)]
    assert [one.status for one in his] == [101] * 4 + [503] * 2
    assert all(one.is_closed() for one in hers[:4]), "the oldest"
    for one in hers[4:8] + his[:4]:
        assert b"beat" in one.receive()[1]
    assert page("anna").status == 503


def test_browsers_that_ask_at_once_are_all_answered(daemon: Any, console: Any) -> None:
    def ask(visitor: Visitor) -> set[int]:
        return {visitor.rpc(method)[0] for _ in range(30) for method in ("RigService/GetRigState", "SceneService/ListScenes")}

    with ThreadPoolExecutor() as crowd:
        assert set().union(*crowd.map(ask, [Visitor(daemon, console) for _ in range(6)])) == {200}


def test_too_many_requests_wait_but_a_stop_does_not(daemon: Any, start_console: Any) -> None:
    visitor = Visitor(daemon, start_console("--max_requests_per_s", "10"))
    assert 429 in [visitor.rpc("RigService/GetRigInfo")[0] for _ in range(60)]
    assert visitor.rpc("SafetyService/Stop")[0] == 200


def test_beyond_this_machine_a_certificate_says_who_it_is(start_daemon: Any, start_console: Any, tmp_path: Path) -> None:
    made = lab_of(tmp_path, "operator/anna", "observer/otto", "operator/lost")
    serial = subprocess.run(["openssl", "x509", "-serial", "-noout", "-in", made / "clients/lost/client.crt"], check=True, capture_output=True, text=True)
    denied = f'[access.denied]\n"serial:{serial.stdout.strip().removeprefix("serial=")}" = "a lost laptop"\n'
    daemon = start_daemon("--scene", "tap_1d", "--model-store", ":memory:", *configuration(tmp_path, denied))
    port = start_console("--listen_tls", "127.0.0.1:0", "--certificates", str(made / "servers/rig")).port

    def secured(person: str) -> ssl.SSLContext:
        context = ssl.create_default_context(cafile=str(made / "clients" / (person or "anna") / "authority.crt"))
        if person:
            context.load_cert_chain(made / "clients" / person / "client.crt", made / "clients" / person / "client.key")
        return context

    def ask(person: str, method: str, request: str = "{}", headers: dict[str, str] = {}) -> tuple[int, Any]:  # noqa: B006
        connection = http.client.HTTPSConnection("127.0.0.1", port, timeout=30, context=secured(person))
        connection.request("POST", f"/rpc/hapticd.v1.{method}", request, {**HEADERS, **headers})
        answer = connection.getresponse()
        return answer.status, json.loads(answer.read() or b"{}")

    assert ask("anna", "AccessService/GetAccess")[1]["identity"] == "spiffe://test/hapticd/operator/anna"
    assert ask("otto", "SafetyService/Stop")[0] == 200
    status, refused = ask("otto", "SafetyService/Clear")
    assert status == 403 and "operator" in refused["message"]
    # As over gRPC, a remote client commands under a lease.
    status, refused = ask("anna", "SafetyService/Clear")
    assert status == 409 and refused["detail"]["reason"] == "ERROR_REASON_LEASE_REQUIRED"
    grant = ask("anna", "LeaseService/AcquireLease", '{"ttl_s":30}')[1]
    assert ask("anna", "SafetyService/Clear", headers={"X-Hapticd-Lease": grant["token"]})[0] == 200
    assert ask("anna", "SafetyService/Stop", headers={"Origin": "http://127.0.0.1:" + str(port)})[0] == 403
    with pytest.raises((ssl.SSLError, ConnectionError, http.client.HTTPException)):
        ask("", "AccessService/GetAccess")
    # Tests the same on the socket: what may be seen, what only an operator may begin, and nothing without a
    # certificate.
    watches = Socket(port, secure=secured("otto"))
    assert watches.status == 101
    watches.send(b'{"open":1,"method":"hapticd.v1.EventService/WatchEvents","request":{},"credits":9}')
    assert "hapticd" in watches.next_json()["message"]["events"][0]["event"]["text"]
    watches.send(b'{"open":2,"method":"hapticd.v1.TurntableService/Home","request":{},"credits":9}')
    refused = next(one for one in iter(watches.next_json, None) if one["id"] == 2)
    assert refused["end"]["code"] == "PERMISSION_DENIED" and "operator" in refused["end"]["message"]
    assert Socket(port, secure=secured("otto"), origin="https://elsewhere.example").status == 403
    with pytest.raises((ssl.SSLError, ConnectionError, IndexError)):
        Socket(port, secure=secured(""))
    # A key exchange of which the console has most of the work.
    costly = secured("otto")
    costly.set_ecdh_curve("secp521r1")
    with pytest.raises((ssl.SSLError, ConnectionError)):
        Socket(port, secure=costly)
    # A client that asks on the rig itself is told where it is.
    with hapticd.connect(daemon.address) as rig:
        assert rig.open_console().url == f"https://127.0.0.1:{port}/"
    status, refused = ask("lost", "RigService/GetRigState")
    assert status == 401 and "deny list" in refused["message"] and "a lost laptop" in refused["message"]
    with pytest.raises(RuntimeError, match="refusing to show the console beyond this machine without certificates"):
        start_console("--listen_tls", "127.0.0.1:0")
    with pytest.raises(RuntimeError, match="refusing to listen beyond this machine"):
        start_console("--listen", "0.0.0.0:0")


def test_no_request_ends_the_console_or_the_daemon(daemon: Any, console: Any) -> None:
    visitor = Visitor(daemon, console)
    # A text of a lease that gRPC would not send.
    for token in ("\xfc", "x" * 40, "a b"):
        assert visitor.rpc("RigService/GetRigState", headers={**HEADERS, "X-Hapticd-Lease": token})[0] == 200
    connection = http.client.HTTPConnection("127.0.0.1", visitor.port, timeout=30)
    connection.request("GET", "/", headers={"X-Hapticd-Lease": "0\x7f"})  # no header of HTTP either
    assert connection.getresponse().status == 400
    live = Socket(visitor.port, visitor.cookie)
    live.send('{"open":1,"method":"hapticd.v1.LeaseService/WatchLease","lease":"é\\u0000"}'.encode())
    assert live.next_json()["id"] == 1
    # Brackets within brackets.
    for nested in ("[" * 32_700 + "]" * 32_700, "[" * 60_000, '{"a":' * 10_000 + "1" + "}" * 10_000):
        live = Socket(visitor.port, visitor.cookie)
        live.send(f'{{"open":1,"method":"x","request":{nested}}}'.encode()[:65_000])
        assert live.is_closed()
        status, refused = visitor_raw(visitor, nested)
        assert status == 400 and "nests too deep" in refused["message"]
    # Bytes that are not text of JSON, or of none at all.
    for body in (b"\xff\xfe", b'{"x":"\xff"}', b'{"x":' + b"9" * 10_000 + b"}", b"\0" * 100):
        assert visitor_raw(visitor, body)[0] == 400
    assert console.process.poll() is None
    assert visitor.rpc("RigService/GetRigState")[0] == 200


#: Requests of pages, to be spoiled.
PAGE_FRAMES = (
    '{"open":1,"method":"hapticd.v1.LeaseService/WatchLease","request":{},"credits":1}',
    '{"open":2,"method":"hapticd.v1.EventService/WatchEvents","request":{"from_number":"0","kinds":["RECORDING_EVENT_KIND_STOP"]},"credits":9}',
    '{"telemetry":3,"columns":["contact_in_contact","guard_authority"],"max_rows":64,"credits":3}',
    '{"credit":1,"n":3}', '{"credit":3,"n":2}', '{"close":1}', '{"close":3}',
)  # fmt: skip
PAGE_CALLS = (
    ("RigService/GetRigState", '{"without_histograms":true}'),
    ("SceneService/LoadScene", '{"name":"tap_1d","object_model":"sponge_1d"}'),
    ("RenderingService/SetTarget", '{"stiffness_n_per_mm":0.4,"ramp_s":0.5}'),
    ("SimulationService/SetHandProgram", '{"program":{"kind":"HAND_PROGRAM_KIND_PRESS","force_n":1.5}}'),
    ("ModelService/GetModel", '{"model":"ab"}'), ("RecordingService/Annotate", '{"text":"a note \\u00b5"}'),
)  # fmt: skip


def spoiled(random: Random, text: str) -> bytes:
    """Bytes like those of a text, with a few of them exchanged, left out, repeated or made up."""
    bytes_ = bytearray(text.encode())
    for _ in range(random.randrange(1, 6)):
        at = random.randrange(len(bytes_) + 1)
        match random.randrange(6):
            case 0:
                bytes_[at : at + 1] = bytes([random.randrange(256)])
            case 1:
                del bytes_[at : at + random.randrange(1, 20)]
            case 2:
                bytes_[at:at] = bytes_[random.randrange(len(bytes_) + 1) :][: random.randrange(1, 40)]
            case 3:
                bytes_[at:at] = random.choice([b"[" * 40, b"{", b"}", b'"', b"\\u0000", b"\\ud800", b"1e999", b"-0", b"null", b"\xc0\x80", b"9" * 400])
            case 4:
                bytes_[at:at] = b"\0" * random.randrange(1, 4)
            case _:
                bytes_ = bytes_[:at] or bytearray(b" ")
    return bytes(bytes_)


def test_ten_thousand_spoiled_inputs_end_nothing(daemon: Any, start_console: Any) -> None:
    console = start_console("--max_requests_per_s", "10000")
    seed = int(os.environ.get("HAPTICD_SEED", "1"))
    random = Random(seed)
    count = int(os.environ.get("HAPTICD_INPUTS", "10000"))
    visitor = Visitor(daemon, console)
    connection = http.client.HTTPConnection("127.0.0.1", visitor.port, timeout=30)
    live: Socket | None = None
    for number in range(count):
        if number % 2:
            try:
                live = live or Socket(visitor.port, visitor.cookie)
                live.send(spoiled(random, random.choice(PAGE_FRAMES)), random.choice([1, 1, 1, 1, 1, 1, 2, 8, 9, 10]))
                if number % 50 == 1:  # what came is read, so that its end is seen
                    live.wire.settimeout(0.01)
                    with contextlib.suppress(TimeoutError):
                        while True:
                            live.receive()
            except (EOFError, OSError, IndexError):
                live = None
            continue
        method, request = random.choice(PAGE_CALLS)
        path = f"/rpc/hapticd.v1.{method}" if random.randrange(10) else f"/rpc/{spoiled(random, method).hex()}"
        try:
            connection.request("POST", path, spoiled(random, request), {**HEADERS, "Cookie": visitor.cookie})
            answer = connection.getresponse()
            json.loads(answer.read() or b"{}")
            assert answer.status != 500, (seed, number, path)
        except (ConnectionError, http.client.HTTPException):
            connection.close()
        assert number % 500 or console.process.poll() is None, (seed, number)
    assert console.process.poll() is None and daemon.process.poll() is None, seed
    assert visitor.rpc("SafetyService/Stop")[0] == 200
    assert is_latched(daemon)


def visitor_raw(visitor: Visitor, body: str | bytes, path: str = "/rpc/hapticd.v1.RigService/GetRigState") -> tuple[int, Any]:
    connection = http.client.HTTPConnection("127.0.0.1", visitor.port, timeout=30)
    connection.request("POST", path, body, {**HEADERS, "Cookie": visitor.cookie})
    answer = connection.getresponse()
    return answer.status, json.loads(answer.read())


def test_any_body_stops(daemon: Any, console: Any, tmp_path: Path) -> None:
    visitor = Visitor(daemon, console)
    for body in (b"", b"{}", b'{"reason":"\xff"}', b"no json", b"[" * 3000, b'{"unknown":1}', b"\0\0", b'{"reason":"' + b"x" * 5000 + b'"}',
                 b'{"reason":"' + b"x" * 3_000_000 + b'"}'):  # fmt: skip
        status, stopped = visitor_raw(visitor, body, STOP)
        assert status == 200 and stopped["guard_state"] == "GUARD_STATE_LATCHED", body[:20]
        assert is_latched(daemon)
    assert visitor.rpc("SafetyService/Stop", {"reason": "the finger hurts"})[0] == 200
    assert is_latched(daemon)
    shown = [line["arguments"] for line in audited(tmp_path, "SafetyService/Stop", 10)]
    assert "could not be read" in shown[2] and "not waited for" in shown[8] and "the finger hurts" in shown[-1]
    # A body that never comes, in one piece or in chunks; the answer does not wait for it.
    for head in ("Content-Length: 4000", "Content-Length: 9999999999999", "Transfer-Encoding: chunked"):
        with socket.create_connection(("127.0.0.1", visitor.port), timeout=30) as wire:
            wire.sendall(f"POST {STOP} HTTP/1.1\r\nHost: 127.0.0.1:{visitor.port}\r\nCookie: {visitor.cookie}\r\nX-Hapticd: 1\r\n"
                         f"Content-Type: application/json\r\n{head}\r\n\r\n".encode())  # fmt: skip
            assert b"GUARD_STATE_LATCHED" in whole_answer(wire)
        assert is_latched(daemon)


def whole_answer(wire: socket.socket) -> bytes:
    """Reads until the other end has sent all."""
    answer = b""
    while piece := wire.recv(65536):
        answer += piece
    return answer


def test_the_answer_to_a_head_request_has_no_body(daemon: Any, console: Any) -> None:
    visitor = Visitor(daemon, console)
    for path in ("/", "/nothing", "/api.js", "/open?key=x"):
        connection = http.client.HTTPConnection("127.0.0.1", visitor.port, timeout=30)
        for _ in range(2):  # the second would begin within a body
            connection.request("HEAD", path, headers={"Cookie": visitor.cookie})
            answer = connection.getresponse()
            assert answer.status in (200, 401, 404) and answer.read() == b""
        connection.request("GET", "/console.css", headers={"Cookie": visitor.cookie})
        assert connection.getresponse().read().startswith(b"/*")


def test_a_console_that_crashes_or_stands_still_moves_nothing(daemon: Any, console: Any, start_console: Any) -> None:
    Visitor(daemon, console)
    with hapticd.connect(daemon.address) as rig:
        rig.set_hand_program({"kind": "press", "force_n": 3.0, "repetitions": -1})

        def advances(count: int) -> Any:
            first = rig.get_rig_state(without_histograms=True).tick
            while (state := rig.get_rig_state(without_histograms=True)).tick < first + count:
                time.sleep(0.01)
            return state

        console.process.send_signal(signal.SIGSTOP)
        state = advances(500)
        assert state.loop.running and state.guard_state == rig_pb2.GUARD_STATE_RENDERING
        console.process.send_signal(signal.SIGCONT)
        console.end(signal.SIGKILL)
        state = advances(500)
        assert state.loop.running and state.guard_state == rig_pb2.GUARD_STATE_RENDERING
        # One that is started again serves at once.
        assert Visitor(daemon, start_console()).rpc("SafetyService/Stop")[0] == 200


def test_who_is_behind_a_browser_is_the_daemons_to_judge(start_daemon: Any, start_console: Any, tmp_path: Path) -> None:
    me = subprocess.run(["id", "-un"], check=True, capture_output=True, text=True).stdout.strip()
    more = f'[access]\naudit_file = "{tmp_path / "audit.jsonl"}"\n[access.users]\n{me} = "observer"\n'
    daemon = start_daemon("--scene", "tap_1d", "--model-store", ":memory:", *configuration(tmp_path, more))
    visitor = Visitor(daemon, start_console())
    with hapticd.connect(daemon.address) as rig:
        if rig.get_access().identity == "local":
            pytest.skip("this kernel does not show who connects")
    status, refused = visitor.rpc("SceneService/UnloadScene")
    assert status == 403 and refused["code"] == "PERMISSION_DENIED"
    line = audited(tmp_path, "SceneService/UnloadScene")[0]
    assert line["identity"] == f"user:{me}" and line["peer"].startswith("console 127.0.0.1:") and line["outcome"] == "PERMISSION_DENIED"
    assert visitor.rpc("SafetyService/Stop")[0] == 200


def test_only_a_console_calls_on_behalf_of_others(daemon: Any, console: Any, tmp_path: Path) -> None:
    import grpc
    from hapticd.v1 import access_pb2 as access
    from hapticd.v1 import safety_pb2 as safety
    from hapticd.v1 import scene_pb2 as scene

    def call(channel: Any, method: str, request: Any, response: Any, **metadata: Any) -> Any:
        stub = channel.unary_unary(f"/hapticd.v1.{method}", type(request).SerializeToString, response.FromString)
        return stub(request, **metadata)

    forged = (("hapticd-on-behalf-of", "spiffe://lab/hapticd/maintainer/otto"),)
    with grpc.insecure_channel(daemon.address) as channel:
        for method, request, response, metadata in (
            ("SceneService/UnloadScene", scene.UnloadSceneRequest(), scene.UnloadSceneResponse, forged),
            ("AccessService/RedeemConsoleKey", access.RedeemConsoleKeyRequest(key="0" * 32), access.RedeemConsoleKeyResponse, forged),
            ("AccessService/ReportConsole", access.ReportConsoleRequest(url="http://evil.example"), access.ReportConsoleResponse, ()),
        ):
            with pytest.raises(grpc.RpcError) as refused:
                call(channel, method, request, response, metadata=metadata)
            assert refused.value.code() == grpc.StatusCode.PERMISSION_DENIED
        # A stop stops, and is the client's own.
        stopped = call(channel, "SafetyService/Stop", safety.StopRequest(), safety.StopResponse, metadata=forged)
        assert stopped.latched_after_tick > 0
    assert "otto" not in audited(tmp_path, "SafetyService/Stop")[0]["identity"]
    with hapticd.connect(daemon.address) as rig:
        assert rig.open_console().url.startswith(f"http://127.0.0.1:{console.port}/open?key=")


@pytest.mark.skipif(os.geteuid() != 0, reason="needs to be several users")
def test_over_the_unix_socket_the_user_decides_who_is_a_console(start_daemon: Any, start_console: Any, tmp_path: Path) -> None:
    daemon = start_daemon("--model-store", ":memory:", *configuration(tmp_path, '[console]\nuser = "daemon"\n'))
    (tmp_path / "d.sock").chmod(0o666)
    forge = (
        "import grpc, sys; from hapticd.v1 import access_pb2 as a\n"
        f"channel = grpc.insecure_channel('unix:{tmp_path}/d.sock')\n"
        "def call(name, request, response, metadata=()):\n"
        "    return channel.unary_unary('/hapticd.v1.AccessService/' + name, type(request).SerializeToString, response.FromString)(request, metadata=metadata)\n"
        "try: print(call('GetAccess', a.GetAccessRequest(), a.Access, (('hapticd-on-behalf-of', 'user:anna'),)).identity)\n"
        "except grpc.RpcError as error: print(error.code())\n"
        "try: call('ReportConsole', a.ReportConsoleRequest(url='http://x'), a.ReportConsoleResponse); print('a console')\n"
        "except grpc.RpcError as error: print(error.code())\n"
    )

    def as_user(name: str) -> list[str]:
        words: list[str] = []
        for _ in range(5):  # other runs of pytest close its folders again
            for folder in (tmp_path, *list(tmp_path.parents)[:3]):
                folder.chmod(0o755)
            ran = subprocess.run(["setpriv", f"--reuid={name}", "--regid=nogroup", "--clear-groups", "/usr/bin/python3", "-c", forge],
                                 check=True, capture_output=True, text=True)  # fmt: skip
            words = ran.stdout.split()
            if "StatusCode.UNAVAILABLE" not in words:
                break
        return words

    assert as_user("daemon") == ["user:anna", "a", "console"]
    first, second = as_user("nobody")
    assert first.startswith("user:") and second == "StatusCode.PERMISSION_DENIED"
    # Signed in by one user, used by the program of another.
    visitor = Visitor(daemon, start_console())
    steal = (f"import http.client; c = http.client.HTTPConnection('127.0.0.1', {visitor.port}); "
             f"c.request('GET', '/', headers={{'Cookie': '{visitor.cookie}'}}); print(c.getresponse().status)")  # fmt: skip
    for name, status in (("root", "200"), ("nobody", "401")):
        ran = subprocess.run(["setpriv", f"--reuid={name}", "--clear-groups", "/usr/bin/python3", "-c", steal], check=True, capture_output=True, text=True)
        assert ran.stdout.strip() == status, name


def test_a_cookie_is_of_one_console(daemon: Any, start_console: Any, tmp_path: Path) -> None:
    # A console of the same secret: a browser shows its cookies to every port of the host.
    visitor = Visitor(daemon, start_console("--state", str(tmp_path)))
    other = start_console("--state", str(tmp_path))
    name, value = visitor.cookie.split("=")
    assert visitor.ask("GET", "/").status == 200
    visitor.cookie = f"{name.replace(str(visitor.port), str(other.port))}={value}"
    visitor.port = other.port
    assert visitor.ask("GET", "/").status == 401


def test_a_secret_that_others_may_read_is_replaced(daemon: Any, start_console: Any, tmp_path: Path) -> None:
    first = start_console("--state", str(tmp_path))
    visitor = Visitor(daemon, first)
    key = tmp_path / "console.key"
    assert key.stat().st_mode & 0o777 == 0o600
    secret = key.read_bytes()
    first.end()
    key.chmod(0o644)
    second = start_console("--state", str(tmp_path), port=first.port)
    assert "could be read by others" in second.log.read_text()
    assert key.read_bytes() != secret and key.stat().st_mode & 0o777 == 0o600
    assert visitor.ask("GET", "/").status == 401


@pytest.mark.skipif(not (BINARIES / "hapticctl").exists(), reason="it starts hapticctl, which was not built")
def test_a_personal_console_is_its_users_and_ends_with_the_page(start_daemon: Any, tmp_path: Path) -> None:
    daemon = start_daemon("--scene", "tap_1d", "--model-store", ":memory:")  # loopback only, and no console of the rig
    with pytest.raises(hapticd.HapticdError, match="no console runs"), hapticd.connect(daemon.address) as rig:
        rig.open_console()
    ctl = [str(BINARIES / "hapticctl"), "--server", daemon.address]
    url = subprocess.run([*ctl, "console", "--print"], check=True, capture_output=True, text=True).stdout.strip()
    port, query = url.split("127.0.0.1:")[1].split("/", 1)
    visitor = Visitor(daemon, type("At", (), {"port": int(port)}), sign_in=False)
    assert visitor.rpc("RigService/GetRigState")[0] == 401
    visitor.cookie = visitor.ask("GET", "/" + query).headers["Set-Cookie"].split(";")[0]
    assert visitor.ask("GET", "/" + query).status == 401
    with hapticd.connect(daemon.address) as rig:
        assert visitor.rpc("AccessService/GetAccess")[1]["identity"] == rig.get_access().identity
    live = Socket(visitor.port, visitor.cookie)
    assert live.status == 101
    live.wire.close()
    until = time.monotonic() + 60.0
    while time.monotonic() < until:
        try:
            socket.create_connection(("127.0.0.1", visitor.port), timeout=30).close()
        except ConnectionRefusedError:
            return
        time.sleep(0.2)
    raise AssertionError("the console does not end")


def test_a_console_elsewhere_shows_a_certificate_of_its_role(start_daemon: Any, start_console: Any, tmp_path: Path) -> None:
    made = lab_of(tmp_path, "console/page", "maintainer/otto")
    config = tmp_path / "tls.toml"
    config.write_text(f'[network]\ncertificates = "{made / "servers/rig"}"\nlisten_tls = "127.0.0.1:0"\n')
    daemon = start_daemon("--scene", "tap_1d", "--model-store", ":memory:", "--config", str(config))
    port = daemon.await_log(r"with certificates, on 127.0.0.1:(\d+)\s")
    console = start_console("--certificates", str(made / "clients/page"), server=f"tls:127.0.0.1:{port}")
    visitor = Visitor(daemon, console)
    with hapticd.connect(daemon.address) as rig:
        assert visitor.rpc("AccessService/GetAccess")[1]["identity"] == rig.get_access().identity
    assert visitor.rpc("SafetyService/Stop")[0] == 200
    # Another role cannot call on behalf of a client.
    refused = start_console("--certificates", str(made / "clients/otto"), server=f"tls:127.0.0.1:{port}")
    while "refuses this console" not in refused.log.read_text():
        time.sleep(0.05)
