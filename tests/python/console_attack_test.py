"""Who is kept out of the console: other sites, other names, floods; and that the rig does not notice."""

from __future__ import annotations

import base64
import http.client
import json
import os
import re
import resource
import socket
import ssl
import struct
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest

import hapticd
from console_page import HEADERS, Visitor, configuration

STOP = "/rpc/hapticd.v1.SafetyService/Stop"


@pytest.fixture
def daemon(start_daemon: Any, tmp_path: Path) -> Any:
    return start_daemon("--scene", "tap_1d", "--model-store", ":memory:", "--config",
                        str(configuration(tmp_path, more=f'[access]\naudit_file = "{tmp_path / "audit.jsonl"}"\n')))  # fmt: skip


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


def test_a_browser_is_who_asked_for_the_key(daemon: Any, tmp_path: Path) -> None:
    stranger = Visitor(daemon, sign_in=False)
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
    visitor = Visitor(daemon)
    page = visitor.ask("GET", "/")
    assert page.status == 200
    assert page.headers["Content-Security-Policy"].startswith("default-src 'self'")
    assert page.headers.get("Access-Control-Allow-Origin") is None
    assert visitor.rpc("AccessService/GetAccess")[1]["identity"] == me
    assert visitor.rpc("SafetyService/Stop")[0] == 200
    lines = [json.loads(line) for line in (tmp_path / "audit.jsonl").read_text().splitlines()]
    stop = [line for line in lines if line["method"] == "SafetyService/Stop"][0]
    assert stop["identity"] == me and stop["peer"].startswith("console 127.0.0.1:")
    # A pass is of this process: what a client sends as one is no identity.
    status, refused = visitor.rpc("RenderingService/SetTarget", {"stiffness_n_per_mm": 1e9})
    assert status == 400 and refused["code"] == "OUT_OF_RANGE" and "1000 N/mm" in refused["detail"]["limit"]


def test_other_sites_are_kept_out(daemon: Any) -> None:
    visitor = Visitor(daemon)
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


def test_what_is_too_large_is_refused(daemon: Any) -> None:
    visitor = Visitor(daemon)
    assert visitor.ask("POST", STOP, '{"reason":"' + "x" * 300_000 + '"}', HEADERS).status == 413
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


def test_streams_come_as_they_are_granted(daemon: Any) -> None:
    visitor = Visitor(daemon)
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


def test_a_page_that_does_not_read_gets_pairs_and_is_told(start_daemon: Any, tmp_path: Path) -> None:
    daemon = start_daemon("--scene", "tap_1d", "--model-store", ":memory:", "--config",
                          str(configuration(tmp_path, more="[rig.sim]\nspeed = 4\n")))  # fmt: skip
    visitor = Visitor(daemon)
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


def test_a_thousand_sockets_keep_no_stop_from_its_way(daemon: Any) -> None:
    resource.setrlimit(resource.RLIMIT_NOFILE, (resource.getrlimit(resource.RLIMIT_NOFILE)[1],) * 2)
    visitor = Visitor(daemon)
    strangers = []
    for number in range(1000):
        one = socket.create_connection(("127.0.0.1", visitor.port), timeout=30)
        if number % 2:
            one.sendall(b"GET / HTTP/1.1\r\nHost: 127.0")  # and never the rest
        strangers.append(one)
    before = ticks(daemon)
    assert visitor.rpc("SafetyService/Stop")[0] == 200
    assert ticks(daemon) > before
    # Of pages that are signed in, no more than are allowed.
    pages = [Socket(visitor.port, visitor.cookie) for _ in range(70)]
    assert [one.status for one in pages[:64]] == [101] * 64 and {one.status for one in pages[64:]} == {503}
    assert visitor.rpc("SafetyService/Stop")[0] == 200
    with hapticd.connect(daemon.address) as rig:
        assert rig.get_rig_state(without_histograms=True).loop.running
    for one in strangers:
        one.close()


def test_too_many_requests_wait_but_a_stop_does_not(start_daemon: Any, tmp_path: Path) -> None:
    path = configuration(tmp_path)
    path.write_text(path.read_text().replace("[console]", "[console]\nmax_requests_per_s = 10.0"))
    visitor = Visitor(start_daemon("--model-store", ":memory:", "--config", str(path)))
    assert 429 in [visitor.rpc("RigService/GetRigInfo")[0] for _ in range(60)]
    assert visitor.rpc("SafetyService/Stop")[0] == 200


def test_beyond_this_machine_a_certificate_says_who_it_is(start_daemon: Any, tmp_path: Path) -> None:
    root = Path(__file__).resolve().parents[2]
    made = tmp_path / "made"
    subprocess.run(["bash", root / "deploy/make_certificates.sh", "--lab", "test", "--out", made, "--server", "rig,127.0.0.1",
                    "--client", "operator/anna", "--client", "observer/otto"], check=True, capture_output=True)  # fmt: skip
    config = tmp_path / "hapticd.toml"
    config.write_text(f'[network]\ncertificates = "{made / "servers/rig"}"\n[console]\nlisten_tls = "127.0.0.1:0"\n')
    daemon = start_daemon("--scene", "tap_1d", "--model-store", ":memory:", "--config", str(config))
    found = re.search(r"the console is shown on https://127.0.0.1:(\d+)", daemon.log.read_text())
    assert found
    port = int(found.group(1))

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
    # The same on the socket: what may be seen, what only an operator may begin, and no one without a certificate.
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
    # Whoever asks on the rig itself is told where it is.
    with hapticd.connect(daemon.address) as rig:
        assert rig.open_console().url == f"https://127.0.0.1:{port}/"
    config.write_text('[console]\nlisten_tls = "127.0.0.1:0"\n')
    with pytest.raises(RuntimeError, match="refusing to show the console beyond this machine without certificates"):
        start_daemon("--model-store", ":memory:", "--config", str(config))
    config.write_text('[console]\nlisten = "0.0.0.0:0"\n')
    with pytest.raises(RuntimeError, match="refusing to listen beyond this machine"):
        start_daemon("--model-store", ":memory:", "--config", str(config))
