"""Exclusive control of a rig, renewed by a separate process.

A caller that computes for minutes, or holds Python's interpreter, keeps its lease; one that ends, or is killed, does not:
the renewal ends with it, and the lease expires as it was agreed (docs/access.md).
"""

from __future__ import annotations

import contextlib
import json
import os
import select
import subprocess
import sys
from pathlib import Path
from typing import Any

from hapticd._connection import Endpoint
from hapticd.errors import HapticdError

#: For an interpreter to start on a machine that does much else.
START_LIMIT_S = 60.0


class Renewal:
    """The process that renews a lease. It starts before the lease does: a busy machine may take longer to start it than a
    lease lives.

    wait_until_ready(), then acquire the lease, then begin(); it renews until stop(), or until this process ends.
    """

    def __init__(self, endpoint: Endpoint, connect_s: float) -> None:
        """connect_s: how long it tries to connect before it is ready all the same."""
        self._process = subprocess.Popen(
            [sys.executable, "-m", "hapticd._lease_process"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            # An interrupt from the keyboard is for the program, which then returns the lease.
            start_new_session=True,
            env=_environment(),
        )
        certificates = str(endpoint.certificates) if endpoint.certificates else None
        self._send({"address": endpoint.address, "certificates": certificates, "connect_s": connect_s})

    @property
    def process_id(self) -> int:
        return self._process.pid

    def wait_until_ready(self) -> None:
        """Raises HapticdError if the process does not start."""
        assert self._process.stdout is not None
        said = select.poll()
        said.register(self._process.stdout, select.POLLIN)
        if said.poll(1000.0 * START_LIMIT_S) and self._process.stdout.readline():
            return
        raise HapticdError(
            "the process that renews the lease did not start",
            where=sys.executable,
            limit=f"within {START_LIMIT_S:.0f} s",
            remedy="look at what it wrote to the standard error",
        )

    def begin(self, token: str, ttl_s: float) -> None:
        # Not as an argument: those of a process can be read by every user of the machine.
        self._send({"token": token, "ttl_s": ttl_s})

    def stop(self) -> None:
        """May be called twice."""
        assert self._process.stdin is not None and self._process.stdout is not None
        if not self._process.stdin.closed:
            with contextlib.suppress(BrokenPipeError):  # it has ended: the lease was lost
                self._process.stdin.close()
        try:
            self._process.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process.stdout.close()

    def _send(self, order: dict[str, Any]) -> None:
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it has ended: wait_until_ready() says so, or the lease expires
            self._process.stdin.write(json.dumps(order).encode() + b"\n")
            self._process.stdin.flush()


def _environment() -> dict[str, str]:
    """Environment of this process, and where this package is."""
    environment = dict(os.environ)
    package = str(Path(__file__).resolve().parents[1])
    environment["PYTHONPATH"] = os.pathsep.join(filter(None, [package, environment.get("PYTHONPATH")]))
    return environment
