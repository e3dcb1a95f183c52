"""A TCP relay that can go dark: nothing passes and nothing closes, as with a cable that is pulled."""

from __future__ import annotations

import contextlib
import socket
import threading


class Relay:
    """Passes connections on to a daemon until go_dark()."""

    def __init__(self, target: str) -> None:
        host, _, port = target.rpartition(":")
        self._target = (host, int(port))
        self._dark = threading.Event()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._connections: list[socket.socket] = []
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        threading.Thread(target=self._accept, daemon=True).start()

    def go_dark(self) -> None:
        self._dark.set()

    def end(self) -> None:
        for one in (self._listener, *self._connections):
            with contextlib.suppress(OSError):
                one.shutdown(socket.SHUT_RDWR)
            one.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                client, _ = self._listener.accept()
                self._connections.append(client)
                if self._dark.is_set():
                    continue
                daemon = socket.create_connection(self._target)
                self._connections.append(daemon)
                for ends in ((client, daemon), (daemon, client)):
                    threading.Thread(target=self._pass, args=ends, daemon=True).start()

    def _pass(self, source: socket.socket, sink: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                if not self._dark.is_set():
                    sink.sendall(data)
            if not self._dark.is_set():
                sink.shutdown(socket.SHUT_WR)
