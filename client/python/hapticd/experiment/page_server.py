"""The pages of an experiment: served on this machine only, to those who know their address."""

from __future__ import annotations

import http.server
import json
import math
import secrets
import threading
from http import HTTPStatus
from pathlib import Path
from typing import Any, Callable, Optional
from urllib.parse import parse_qs, urlsplit

from hapticd.errors import BadArgument
from hapticd.experiment.page_person import PagePerson

PAGES = Path(__file__).resolve().parent / "page"
TYPES = {".html": "text/html; charset=utf-8", ".css": "text/css; charset=utf-8", ".js": "text/javascript; charset=utf-8"}
MAX_BODY = 1024
#: How often a page hears that nothing has changed, s: so it knows that the program is there.
HEARTBEAT_S = 1.0


class _Server(http.server.ThreadingHTTPServer):
    daemon_threads = True
    person: PagePerson
    keys: dict[str, str]  # of a page's address: its role
    closing: threading.Event

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A page that is closed breaks its connection: no news."""


class _Handler(http.server.BaseHTTPRequestHandler):
    server: _Server
    protocol_version = "HTTP/1.1"
    timeout = 10.0

    def log_message(self, format: str, *arguments: Any) -> None:
        pass

    def _role(self) -> Optional[str]:
        """Session of the key in the address; None and an answer if it has none, or if another site's name leads here."""
        host = self.headers.get("Host", "")
        if host.rpartition(":")[0] not in ("127.0.0.1", "localhost"):
            self._refuse(HTTPStatus.FORBIDDEN, "this page is for this machine")
            return None
        key = parse_qs(urlsplit(self.path).query).get("key", [""])[0]
        for known, role in self.server.keys.items():
            if secrets.compare_digest(known.encode(), key.encode()):
                return role
        self._refuse(HTTPStatus.FORBIDDEN, "the address is not complete: open the one that the program printed")
        return None

    def _answer(self, status: HTTPStatus, kind: str, body: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("Content-Security-Policy", "default-src 'self'; frame-ancestors 'none'")
        self.end_headers()
        self.wfile.write(body)

    def _refuse(self, status: HTTPStatus, why: str) -> None:
        self.close_connection = True
        self._answer(status, "text/plain; charset=utf-8", why.encode())

    def do_GET(self) -> None:
        path = urlsplit(self.path).path
        # Files that both pages share tell nothing.
        if path in ("/page.css", "/participant.js", "/experimenter.js"):
            return self._file(PAGES / path[1:])
        if path == "/favicon.ico":  # browsers ask for one by themselves
            return self._answer(HTTPStatus.NO_CONTENT, "image/x-icon", b"")
        role = self._role()
        if role is None:
            return
        if path == f"/{role}":
            return self._file(PAGES / f"{role}.html")
        if path == "/events":
            return self._events(role)
        self._refuse(HTTPStatus.NOT_FOUND, "there is no such page")

    def _file(self, path: Path) -> None:
        self._answer(HTTPStatus.OK, TYPES[path.suffix], path.read_bytes())

    def _events(self, role: str) -> None:
        self.close_connection = True
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/event-stream")
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        version = -1
        while not self.server.closing.is_set():
            if role == "participant":
                self.server.person.seen()
            version, shown = self.server.person.view(role, version, HEARTBEAT_S)
            self.wfile.write(b"data: " + json.dumps(shown, allow_nan=False).encode() + b"\n\n")
            self.wfile.flush()

    def do_POST(self) -> None:
        role = self._role()
        if role is None:
            return
        # Other sites cannot send this header without being asked.
        if self.headers.get("X-Hapticd") != "1":
            return self._refuse(HTTPStatus.FORBIDDEN, "this call is for the page's own script")
        try:
            length = int(self.headers.get("Content-Length", ""))
            if not 0 <= length <= MAX_BODY:
                raise ValueError
            said = json.loads(self.rfile.read(length))
            self._do(role, said)
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
            return self._refuse(HTTPStatus.BAD_REQUEST, "this is no message of the page")
        self._answer(HTTPStatus.OK, TYPES[".js"], b"{}")

    def _do(self, role: str, said: Any) -> None:
        person = self.server.person
        if said["do"] == "abort":
            person.abort(role)
        elif role == "experimenter" and said["do"] == "clear":
            person.clear()
        elif role == "participant" and said["do"] == "key":
            name, after_ms = str(said["key"])[:16], said.get("after_ms")
            if after_ms is not None and not math.isfinite(float(after_ms)):
                raise ValueError
            person.key(name, None if after_ms is None else float(after_ms))
        elif role == "participant" and said["do"] == "noise":
            gain = float(said["gain"])
            if said["state"] not in ("running", "suspended", "closed") or not 0.0 <= gain <= 1.0:
                raise ValueError
            person.noise(said["state"], gain)
        else:
            raise ValueError


class PageServer:
    """Use as a context manager. port 0: a free one."""

    def __init__(
        self, port: int, on_stop: Callable[[str], Any], person: Optional[PagePerson] = None, on_clear: Callable[[], Any] = lambda: None
    ) -> None:
        self.participant = person or PagePerson(on_stop, on_clear=on_clear)
        try:
            self._server = _Server(("127.0.0.1", port), _Handler)
        except (OSError, OverflowError) as error:
            raise BadArgument(f"the pages cannot be served there: {error}", where="--port", value=str(port), limit="a free port, or 0") from error
        self._server.person = self.participant
        self._server.closing = threading.Event()
        keys = {role: secrets.token_urlsafe(16) for role in ("participant", "experimenter")}
        self._server.keys = {key: role for role, key in keys.items()}
        base = f"http://127.0.0.1:{self._server.server_address[1]}"
        self.participant_url = f"{base}/participant?key={keys['participant']}"
        self.experimenter_url = f"{base}/experimenter?key={keys['experimenter']}"
        self._thread = threading.Thread(target=self._server.serve_forever, name="pages", daemon=True)

    def __enter__(self) -> PageServer:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.closing.set()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()
